"""Whether a reading is in another unit than the lesson says, from another zero, in coarser counts, or was cut off where it was read.

A drive at its limit shows as a current that stands, and so does a logger whose range is too small. The drive's machine goes where that
current takes it; that of the logger goes on as if there were none: everything else that was recorded follows without a limit.

A replay cannot show counts, as rounding is noise to it. The values tell them at once: all of them are whole multiples of one spacing.
A second sensor of one motion has its zero nowhere near that of the first one on most machines, which is no error of either.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence

import numpy as np

from lathesim.analysis.display_unit import shown_with_unit
from lathesim.diagnosis.location import FORCES, missing_share
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.engine.assembly import Place
from lathesim.identification.estimation.estimates import Estimate
from lathesim.identification.records import Candidate, Fitted
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.signal import FEWEST_LEVELS, OFF_GRID, SETTLING, grid_spacing, root_mean_square
from lathesim.recordings.recorded_channel import known_factor


def in_another_unit(experiment: Experiment, values: Mapping[str, float], method: Method = STANDARD) -> str:
    """Return a sentence where one force is what the machine with ``values`` makes times the factor of a mistaken unit, and hardly anything
    else, and all others are nearly what it makes; empty where none is. Another effect may do the same: of a force that is a share of
    another one, a part of that other one. Where all are off the machine is another one; of motions the mapping asks."""
    begin = int(SETTLING * experiment.sensed.samples)
    recorded = np.nan_to_num(experiment.sensed.recorded)[:, begin:]
    simulated = recorded - np.nan_to_num(experiment.sensed.one(values))[:, begin:]
    factors = [float(one @ other) / max(float(other @ other), 1e-300) for one, other in zip(recorded, simulated, strict=True)]
    off = [row for row, factor in enumerate(factors) if not is_within(factor, method.alike)]
    if len(off) != 1 or len(factors) == 1 or experiment.record.unit(experiment.machine.compare[off[0]]) not in FORCES:
        return ""
    (row,) = off
    factor, name = factors[row], experiment.machine.compare[row]
    beside = root_mean_square(recorded[row] - factor * simulated[row])
    unit = "" if is_within(abs(factor), method.recordings.unit_high) else known_factor(factor, method.little)
    if not unit or not beside < method.little * root_mean_square(recorded[row]):
        return ""
    return f"{name} is {factor:.4g} times what the machine makes, which is the factor of a mistaken unit: {unit}."


def wrong_unit(candidates: Iterable[Candidate], values: Mapping[str, float], method: Method = STANDARD) -> str:
    """Return a sentence where one of some effects would be a factor on a reading that a mistaken unit leaves; empty where none is.

    No amplifier is off by 2 pi: the column is. It is asked of effects that took most of the error away: a wrong unit does.
    """
    for candidate in candidates:
        for name, neutral in zip(candidate.parameters, candidate.neutral, strict=True):
            factor = values.get(name, 1.0)
            if neutral == 1.0 and abs(factor + 1.0) < method.little:
                return f"{candidate.at} reads {factor:.4g} times what the machine does: its sign is turned round."
            if neutral == 1.0 and (unit := known_factor(factor)):
                return f"{candidate.at} reads {factor:.4g} times what the machine does, which is the factor of a mistaken unit: {unit}."
    return ""


def is_within(factor: float, most: float) -> bool:
    """Return whether a factor is between the inverse of another one and that one itself."""
    return 1.0 / most < factor < most


_READ = ("A", "N", "N*m")


def clipped_reading(experiment: Experiment, fitted: Fitted, method: Method = STANDARD) -> str:
    """Return a sentence where a reading stands at a level beyond which the simulation goes on, and all else follows without; else empty."""
    for row, name in enumerate(experiment.machine.compare):
        unit = experiment.sensed.plan.unit(experiment.sensed.channels[row])
        recorded = experiment.sensed.recorded[row]
        if unit not in _READ or not np.isfinite(recorded).all():
            continue
        simulated = experiment.sensed.seen[row] - fitted.residual[row]
        ends = ((recorded.max(), 1.0), (recorded.min(), -1.0))
        levels = [level for level, side in ends if _goes_beyond(recorded, simulated, level, side, method=method)]
        others = [other for other in range(len(experiment.machine.compare)) if other != row]
        if levels and others and all(missing_share(experiment, fitted, other)[0] < method.within_laws for other in others):
            stand = int(np.count_nonzero(np.isin(recorded, levels)))
            where = " and ".join(shown_with_unit(float(level), unit) for level in levels)
            return (
                f"{name} is clipped at {where}: {stand} of {len(recorded)} samples stand there, and everything else went on as if it went "
                "further. Widen the range of the instrument and record again."
            )
    return ""


def _goes_beyond(recorded: np.ndarray, simulated: np.ndarray, level: float, side: float, method: Method = STANDARD) -> bool:
    """Return whether a reading with noise stands at its largest or smallest value for long, while the simulation is beyond it."""
    flat = recorded == level
    ends = (recorded == recorded.max()) | (recorded == recorded.min())
    inside = ~(ends | np.roll(ends, 1))
    # fewer samples do not tell what nearly all of them do
    if min(np.count_nonzero(flat), np.count_nonzero(inside)) * method.little < 1.0:
        return False
    if float(np.mean(np.diff(recorded, prepend=recorded[0])[inside] == 0.0)) > method.larger_part:
        return False
    usual = float(np.quantile(np.abs(recorded - simulated)[inside], method.nearly_all))
    beyond = side * (simulated - recorded)[flat]
    return float(np.mean(beyond > 0.0)) > method.nearly_all and float(np.median(beyond)) > method.errors * usual


def sensor_zeros(experiment: Experiment, method: Method = STANDARD) -> list[str]:
    """Return a sentence for each second sensor whose zero differs from that of the first one or of the prescribed position."""
    told = []
    sensed = experiment.sensed
    for row in sorted(sensed.led):
        apart = sensed.recorded[row] - sensed.channel([], [], sensed.plan.channels.index(sensed.channels[row]))
        apart = apart[np.isfinite(apart)] if np.isfinite(apart).any() else np.zeros(1)
        middle, spread = float(np.mean(apart)), float(np.std(apart))
        if abs(middle) > method.errors * max(spread, float(sensed.seen_floors[row])):
            shown = shown_with_unit(abs(middle), sensed.plan.unit(sensed.channels[row]), 3)
            told.append(
                f"{experiment.machine.compare[row]} has its zero {shown} beside that of the reference; taken for no error of either."
            )
    for row, (first, apart) in experiment.sensed.zeros().items():
        shown_there = experiment.sensed.seen[row][np.isfinite(experiment.sensed.seen[row])]
        spread = float(np.std(shown_there)) if len(shown_there) else 0.0
        if abs(apart) > method.errors * max(spread, float(experiment.sensed.seen_floors[row])):
            name, other = experiment.machine.compare[row], experiment.machine.compare[first]
            shown = shown_with_unit(abs(apart), experiment.sensed.plan.unit(experiment.sensed.channels[row]), 3)
            told.append(f"{name} has its zero {shown} beside that of {other}; taken for no error of either.")
    return told


def coarse_counts(
    experiments: Sequence[Experiment], known: Collection[Candidate] = (), method: Method = STANDARD
) -> list[tuple[Candidate, Estimate]]:
    """Return each effect whose size is the spacing of what a sensor reads, with that spacing, where all recordings show one that is coarser
    than the lesson's sensor has; ``known`` ones are not given again. A sensor that the lesson takes for exact tells nothing: every
    recording keeps only so many digits."""
    seen = [_on_grids(experiment, method=method) for experiment in experiments]
    found = []
    for candidate in experiments[0].candidates:
        spacings = np.array([grids.get(candidate.part, 0.0) for grids in seen])
        middle, spread = float(np.mean(spacings)), float(np.ptp(spacings))
        if spread < OFF_GRID * middle and all(candidate.part != other.part for other in known):
            found.append((candidate, Estimate(middle, spread + OFF_GRID * middle / FEWEST_LEVELS)))
    return found


def _on_grids(experiment: Experiment, method: Method = STANDARD) -> dict[str, float]:
    found: dict[str, float] = {}
    period = experiment.machine.assembly.sample_period
    for candidate in (candidate for candidate in experiment.candidates if candidate.effect.identification.spacing):
        ports = experiment.machine.assembly.ports(candidate.at)
        # the rate of an encoder is one count a sample, or several
        for role, counts in (("reading", 1.0), ("rate", period)):
            channel = f"{candidate.at}.{ports.get(role, '')}"
            if channel in experiment.machine.compare and (known := _declared(experiment, channel, counts)) > 0.0:
                spacing = counts * grid_spacing(experiment.record[channel])
                if spacing > method.alike * known:
                    found.setdefault(candidate.part, spacing)
    return found


def _declared(experiment: Experiment, channel: str, counts: float) -> float:
    """Return the counts [SI] in which the lesson says that a sensor reads, 0 where it does not; ``counts`` are one unit of the channel."""
    name = experiment.machine.assembly.ports(channel).get("resolution", "")
    return max(
        experiment.own.given(f"{Place.of(channel).part}.{name}") if name else 0.0, counts * experiment.machine.resolution.get(channel, 0.0)
    )
