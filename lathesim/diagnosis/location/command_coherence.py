"""What is left and yet answers to what the machine was asked to do: no load and no noise does that.

    R(f) = H(f) U(f),    H = S_ru / S_uu (1 - 1/(K g)) / (1 - 1/K),    g = |S_ru|^2 / (S_rr S_uu)

r is what the lesson's own simulation leaves of a channel, u a recorded input that drives it, and S are the means over K overlapping blocks
of a recording. The law H, learned on one recording and drawn towards nothing by as much as chance makes of the coherence g, foretells a
share of what is left on the other. A resonance, a filter, a spring that nobody modelled do so at frequencies at which a motion has next to
no power, where a missing force is not looked for. Sources: Ljung, System Identification, 2nd ed. 1999, section 16.6 (residuals against
inputs); Bendat, Piersol, Random Data, 4th ed. 2010, section 6.2 (coherence, blocks).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from lathesim.diagnosis.method import STANDARD, Method
from lathesim.engine.assembly import FloatArray
from lathesim.identification.machine.roles import decides
from lathesim.identification.replay.closed_loop import own_run
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.signal.rounding import LARGER_PART


@dataclass(frozen=True)
class CommandCoherence:
    """A channel of which a ``share`` of what is left answers to a driven input, and how much that is in floors."""

    channel: str
    driven: str
    share: float
    over_floor: float

    def __str__(self) -> str:
        return f"{self.share:.0%} of what is left of {self.channel} answers to {self.driven}, as a spring, a resonance or a filter does"


def command_coherence(
    experiments: tuple[Experiment, Experiment], values: tuple[Mapping[str, float], Mapping[str, float]], method: Method = STANDARD
) -> CommandCoherence | None:
    """Return the channel of which most that is left in the lesson's own simulation with some ``values`` answers to a recorded input,
    learned on the first experiment and scored on the second; none where none does, no controller holds the simulation, or samples do not
    count."""
    learned_on, scored_on = experiments
    if not learned_on.feeds_back or any(
        experiment.weights is not None and np.any(experiment.weights < LARGER_PART) for experiment in experiments
    ):
        return None
    length = _block(experiments, method)
    if not length:
        return None
    left = [_left(experiment, one, length) for experiment, one in zip(experiments, values, strict=True)]
    parts = {part.name: part.component for part in learned_on.machine.assembly.parts}
    found = []
    for row, channel in enumerate(learned_on.machine.compare):
        over = float(np.std(left[1][row])) / scored_on.floors[channel]
        if over < method.shared.plainly_off or decides(parts[channel.partition(".")[0]]):
            continue
        for driven in learned_on.machine.drive:
            asked = [_jerked(experiment.record[driven]) for experiment in experiments]
            share = foretold(asked[0], left[0][row], asked[1], left[1][row], length)
            found.append(CommandCoherence(channel, driven, share, over))
    best = max(found, key=lambda item: item.share, default=None)
    return best if best is not None and best.share > method.shared.dependence else None


def _block(experiments: tuple[Experiment, Experiment], method: Method) -> int:
    """Return the samples of a block; 0 where a recording has room for fewer than four."""
    shortest = min(len(experiment.record) for experiment in experiments)
    limits = method.location
    length = max(limits.shortest_answer, shortest // limits.answers)
    return length if shortest >= limits.least_answers * length else 0


def coherent_share(
    experiments: tuple[Experiment, Experiment], values: tuple[Mapping[str, float], Mapping[str, float]], method: Method = STANDARD
) -> dict[str, float]:
    """Return the largest share of what is left of each channel that answers to a driven input, learned on the first experiment and scored
    on the second; nothing where no controller holds the simulation."""
    learned_on = experiments[0]
    length = _block(experiments, method)
    if not (learned_on.feeds_back and length):
        return {}
    left = [_left(experiment, one, length) for experiment, one in zip(experiments, values, strict=True)]
    asked = {driven: [_jerked(experiment.record[driven]) for experiment in experiments] for driven in learned_on.machine.drive}
    return {
        channel: max((foretold(both[0], left[0][row], both[1], left[1][row], length) for both in asked.values()), default=0.0)
        for row, channel in enumerate(learned_on.machine.compare)
    }


def foretold(asked: FloatArray, answered: FloatArray, asked_there: FloatArray, answered_there: FloatArray, length: int) -> float:
    """Return the share of ``answered_there`` (samples,) that the law between ``asked`` and ``answered`` foretells, in blocks of some
    ``length``; nothing where it foretells worse than zero."""
    u, r, u_there, r_there = (_blocks(values, length) for values in (asked, answered, asked_there, answered_there))
    input_power, output_power = np.sum(np.abs(u) ** 2, axis=0), np.sum(np.abs(r) ** 2, axis=0)
    cross = np.sum(r * np.conj(u), axis=0)
    coherence = np.abs(cross) ** 2 / np.maximum(input_power * output_power, 1e-300)
    null_maximum = 1.0 / len(u)
    believed = np.clip((coherence - null_maximum) / ((1.0 - null_maximum) * np.maximum(coherence, null_maximum)), 0.0, 1.0)
    law = believed * cross / np.maximum(input_power, 1e-300)
    power = float(np.sum(np.abs(r_there) ** 2))
    return max(0.0, 1.0 - float(np.sum(np.abs(r_there - law * u_there) ** 2)) / power) if power > 0.0 else 0.0


def _left(experiment: Experiment, values: Mapping[str, float], length: int) -> FloatArray:
    """Return what the lesson's own simulation leaves (channels, samples), less what wanders from block to block."""
    residual = np.nan_to_num(experiment.own.recorded - experiment.sensed.from_zero_of(own_run(experiment, values)))
    around = length // 2 | 1
    padded = np.pad(residual, ((0, 0), (around // 2, around // 2)), mode="edge")
    sums = np.cumsum(np.pad(padded, ((0, 0), (1, 0))), axis=1)
    return np.asarray(residual - (sums[:, around:] - sums[:, :-around]) / around)


def _jerked(driven: FloatArray) -> FloatArray:
    """Return the second differences of an input (samples,): a way would leak from its slow motion into every frequency."""
    values = np.nan_to_num(driven)
    return np.asarray(np.diff(values, 2, prepend=[values[0], values[0]]))


def _blocks(values: FloatArray, length: int) -> FloatArray:
    """Return the transforms of half-overlapping blocks (blocks, frequencies)."""
    starts = range(0, len(values) - length + 1, length // 2)
    return np.asarray(np.fft.rfft(np.array([values[start : start + length] for start in starts]) * np.hanning(length), axis=1))
