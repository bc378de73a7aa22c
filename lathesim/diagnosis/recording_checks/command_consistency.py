"""A recording that contradicts itself: a command that does not follow from what its controller was given, a reading in another unit.

Between a command and what its controller was given lies no physics that could be left out, only the controller's law. Where the command
would follow with another sample period, it is the time column that is wrong.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Mapping

import numpy as np
from scipy.optimize import minimize_scalar

from lathesim.analysis.display_unit import shown_with_unit
from lathesim.component import Input
from lathesim.diagnosis.location import passed_through
from lathesim.diagnosis.method.method import MOST_SHIFTED, STANDARD, Method
from lathesim.diagnosis.recording_checks.controllers import share_with, unexplained_share
from lathesim.engine.assembly import FloatArray, Place
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.signal import SETTLING, read_ahead, root_mean_square

_STEP = 1e-6
"""By how much a zero is moved for its slope [SI]; commands answer in proportion."""


def contradicted(
    experiment: Experiment,
    values: Mapping[str, float],
    of_another_law: Mapping[str, bool] | None = None,
    added: Collection[str] = (),
    method: Method = STANDARD,
) -> str:
    """Return a sentence where a recorded command does not follow from what its controller was given, with the machine at ``values``.

    The text is empty where it does, where nothing was replayed, and for commands ``of_another_law``: what the lesson's controller leaves of
    them answers to the reference, and so is the controller's doing. One that mostly does not follow is believed to be of another law only
    where that is a simple one (true). To a command in ``added`` something may be added on its way; of it only a shift and another zero
    are told.
    """
    if not experiment.machine.replay:
        return ""
    laws = of_another_law or {}
    for row, share in unexplained_share(experiment, values):
        if share > method.little:
            name = experiment.machine.compare[row]
            if told := _late_channel(experiment, values, row, share, method=method) or _other_zero(
                experiment, values, row, share, method=method
            ):
                return told
            if (
                name in added
                or (name in laws and (share < method.larger_part or laws[name]))
                or _reads_through_a_converter(experiment, row)
            ):
                continue
            return (
                f"{share:.0%} of {name} does not follow from what its controller was given: a channel is shifted, swapped or in another "
                "unit, the sample period is another, or the controller is not that of the lesson."
            )
    return ""


def _reads_through_a_converter(experiment: Experiment, row: int) -> bool:
    """Return whether what a command (row) follows from was read by a converter: what that made of it, with its noise, was not recorded."""
    ports = experiment.machine.assembly.ports
    return any("bits" in ports(name) for name in passed_through(experiment.sensed.plan, experiment.sensed.channels[row]))


def _late_channel(experiment: Experiment, values: Mapping[str, float], row: int, share: float, method: Method = STANDARD) -> str:
    """Return a sentence where a command follows from what its controller was given once one channel is shifted; empty where none does."""
    name = experiment.machine.compare[row]
    controller = Place.of(name).part
    period = experiment.machine.assembly.sample_period
    assembly = experiment.machine.assembly
    fed = {assembly.sources.get(f"{controller}.{port}", "") for port in assembly.by_name[controller].component.declared(Input)}
    for channel in (other for other in experiment.machine.compare if other in fed):

        def left(samples: float, channel: str = channel) -> float:
            return share_with(experiment, channel, read_ahead(experiment.record[channel], samples), row, values, MOST_SHIFTED)

        found = minimize_scalar(left, bounds=(-MOST_SHIFTED, MOST_SHIFTED), method="bounded", options={"xatol": 0.01, "maxiter": 25})
        if found.fun < method.little * share:
            how = "later" if found.x < 0.0 else "earlier"
            late = f"{abs(found.x) * period * 1e3:.3g} ms ({abs(found.x):.2g} samples)"
            return (
                f"With {channel} {late} {how} {name} follows from what its controller was given, as recorded {share:.0%} of it does not: "
                "the channels were not recorded at the same times (ChannelTimeShift)."
            )
    return ""


def _other_zero(experiment: Experiment, values: Mapping[str, float], row: int, share: float, method: Method = STANDARD) -> str:
    """Return a sentence where a command follows from what its controller was given once its reference is read from another zero; empty
    where it does not. The first guess is how far apart the two are in the middle; what is left of the command then tells how far that is
    off."""
    name = experiment.machine.compare[row]
    controller, ports = Place.of(name).part, experiment.machine.assembly.ports(name)
    target = f"{controller}.{ports['drive']}"
    measured = experiment.machine.assembly.sources.get(f"{controller}.{ports['measured']}", "")
    if target not in experiment.machine.drive or measured not in experiment.machine.compare:
        return ""
    zero = float(np.nanmedian(experiment.record[measured] - experiment.record[target]))

    def residual(more: float) -> FloatArray:
        moved = experiment.sensed_with(target, experiment.record[target] + zero + more)
        return np.asarray(np.nan_to_num(moved.one(values)[row]))

    size, step = float(np.std(np.nan_to_num(experiment.sensed.recorded[row]))), _STEP
    begin = int(SETTLING * experiment.sensed.samples)
    first = residual(0.0)[begin:]
    slope = (residual(step)[begin:] - first) / step
    more = -float(slope @ first) / max(float(slope @ slope), 1e-300)
    if root_mean_square(residual(more)[begin:]) > method.little * share * size:
        return ""
    shown = shown_with_unit(zero + more, experiment.record.channels[target].unit, 3)
    return (
        f"With {shown} added to {target} {name} follows from what its controller was given, as recorded {share:.0%} of it does not: "
        f"it was recorded from another zero than {measured}."
    )


def exchanged_with(experiment: Experiment, values: Mapping[str, float], method: Method = STANDARD) -> str:
    """Return a sentence where another channel is the command that a controller makes of what it was given, and its own is not: two columns
    are exchanged, though their units differ. The text is empty where none is."""
    if not experiment.machine.replay:
        return ""
    begin = int(SETTLING * experiment.sensed.samples)
    simulated = np.nan_to_num(experiment.sensed.recorded - experiment.sensed.one(values))[:, begin:]
    recorded = np.nan_to_num(experiment.sensed.recorded)[:, begin:]
    for row, share in unexplained_share(experiment, values):
        name = experiment.machine.compare[row]
        for other, column in enumerate(recorded):
            size = float(np.std(column))
            if other != row and share > method.little and size > 0.0 and root_mean_square(column - simulated[row]) < method.little * size:
                exchanged = experiment.machine.compare[other]
                return (
                    f"{exchanged} is what the lesson's controller makes of what it was given, and {share:.0%} of {name} "
                    "is not: the two look swapped. Exchange their columns in the lesson."
                )
    return ""


def swapped(experiment: Experiment, values: Mapping[str, float], method: Method = STANDARD) -> str:
    """Return a sentence where two channels of one unit are what the machine with ``values`` makes of each other; empty where none are."""
    recorded = np.nan_to_num(experiment.sensed.recorded)
    simulated = recorded - np.nan_to_num(experiment.sensed.one(values))
    units = [experiment.record.channels[name].unit for name in experiment.machine.compare]
    power = np.maximum(np.sum(recorded**2, axis=1), 1e-60)
    off = np.sum((recorded[:, None] - simulated[None]) ** 2, axis=2) / power[:, None]
    for first, second in itertools.combinations(range(len(units)), 2):
        as_mapped, exchanged = off[first, first] + off[second, second], off[first, second] + off[second, first]
        if units[first] == units[second] and as_mapped > method.little and exchanged < method.little * as_mapped:
            names = f"{experiment.machine.compare[first]} and {experiment.machine.compare[second]}"
            return (
                f"{names} look swapped: as mapped the machine misses {np.sqrt(0.5 * as_mapped):.0%} of them, exchanged "
                f"{np.sqrt(0.5 * exchanged):.0%}. Exchange their columns in the lesson."
            )
    return ""
