"""What effects do in the lesson's own simulation, in which nothing recorded holds anything: how far they move it, how far it stays off."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.fit import Fitted
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.replay.open_loop import is_a_process
from lathesim.identification.signal.rounding import LARGER_PART

SETTLING = 0.02
"""Share of a recording at its beginning that is left out of residuals: controllers start with memories that nobody recorded."""
_IMPULSES = 2e-3
"""Share of the samples that may be far off without an effect making a simulation worse."""


def in_own_simulation(experiment: Experiment, before: Fitted, after: Fitted, candidate: Candidate) -> tuple[float, float]:
    """Return what an effect does in the lesson's own simulation: how far it moves it, and how much worse it makes it (root mean squares).

    The first is the move of the channel moved most over what the model leaves unexplained there. Where a controller answers to a force
    that nobody modelled, its command goes with that force, and in a replay almost anything between command and motion seems to explain
    some of it. A third of the move is enough where nothing feeds back, as that cannot happen then, and where the move explains what was
    recorded: the error without the effect is larger by most of the move's own power. Without feedback the second says nothing, as such a
    simulation drifts. Of an effect at a process, which no controller answers to, the replay tells as well, and what the loops of the axes
    make by chance of the steps of their converters is not in it.
    """
    simulated = experiment.sensed if _is_at_a_process(experiment, candidate) else experiment.own
    neutral = {**after.by_name, **dict(zip(candidate.parameters, candidate.neutral.tolist(), strict=True))}
    names = simulated.settable(neutral)
    start = dict(zip(names, (simulated.given(name) for name in names), strict=True))
    rows = [[{**start, **values}[name] for name in names] for values in (after.by_name, neutral, before.by_name)]
    runs = simulated.outputs(names, np.array(rows))
    first, second, earlier = runs if simulated is experiment.sensed else map(experiment.sensed.as_seen, runs)
    begin = int(SETTLING * simulated.samples)
    left, left_without, moved = (
        np.sqrt(np.mean(np.nan_to_num(signal, nan=np.inf)[:, begin:] ** 2, axis=1))
        for signal in (_known(experiment, first), _known(experiment, second), first - second)
    )
    with np.errstate(invalid="ignore"):  # a run that is lost moves no further than it is off
        moves = np.nan_to_num(moved / np.maximum(left, experiment.sensed.seen_floors))
    most = int(np.argmax(moves))
    explains = left_without[most] ** 2 - left[most] ** 2 > LARGER_PART * moved[most] ** 2
    size = float(moves[most]) * (3.0 if explains or not experiment.feeds_back else 1.0)
    worse, worse_before = (_usual_error(_known(experiment, signal)[:, begin:]) for signal in (first, earlier))
    closed_loop_degradation = float(np.max(np.nan_to_num(worse / np.maximum(worse_before, experiment.sensed.seen_floors), nan=np.inf)))
    return size, closed_loop_degradation if experiment.feeds_back else 0.0


def _is_at_a_process(experiment: Experiment, candidate: Candidate) -> bool:
    host = candidate.at.partition(".")[0]
    return any(part.name == host and is_a_process(part.component) for part in experiment.machine.assembly.parts)


def agreed_in_closed_loop(*recordings: tuple[Experiment, Fitted, Fitted]) -> float:
    """Return the share of the error of the lesson's own simulation, weighed by the floors, that the second fit explains of the first one's
    on every recording; 0 where it is not most of it, or no controller answers to the recorded channels."""
    shares = []
    for experiment, before, after in recordings:
        error, left = (own_error(experiment, fitted.by_name) for fitted in (before, after))
        shares.append(1.0 - left / max(error, 1e-300) if experiment.feeds_back else 0.0)
    return min(shares) if min(shares) > LARGER_PART else 0.0


def own_run(experiment: Experiment, values: Mapping[str, float]) -> FloatArray:
    """Return the channels (channels, samples) of the lesson's own simulation with some values."""
    names = experiment.own.settable(values)
    (run,) = experiment.own.outputs(names, np.array([[values[name] for name in names]]))
    return np.asarray(run)


def own_error(experiment: Experiment, values: Mapping[str, float]) -> float:
    """Return the squared error of the lesson's own simulation with some values, in squared floors, summed over channels and samples."""
    error = _known(experiment, experiment.sensed.as_seen(own_run(experiment, values)))[:, int(SETTLING * experiment.own.samples) :]
    return float(np.sum((np.nan_to_num(error, nan=np.inf) / experiment.sensed.seen_floors[:, None]) ** 2))


def _usual_error(error: FloatArray) -> FloatArray:
    """Return the root mean square of each channel's error (channels, samples) without its few largest: how a controller answers to a
    jump, at which sample and with what impulse, says nothing of the machine."""
    power = np.sort(np.nan_to_num(error, nan=np.inf) ** 2, axis=1)
    return np.asarray(np.sqrt(np.mean(power[:, : power.shape[1] - int(_IMPULSES * power.shape[1])], axis=1)))


def _known(experiment: Experiment, simulated: FloatArray) -> FloatArray:
    """Return recorded less simulated, zero where nothing was recorded."""
    return np.where(np.isfinite(experiment.sensed.seen), experiment.sensed.seen - simulated, 0.0)
