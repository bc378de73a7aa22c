"""Whether a recording was sampled at another period than it says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.recording_checks.controllers import shown_commands, unexplained_share
from lathesim.engine.assembly import Assembly
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.roles import closes_a_loop, decides
from lathesim.identification.signal import SETTLING, root_mean_square
from lathesim.record import Record


def of_another_period(experiment: Experiment, values: Mapping[str, float], method: Method = STANDARD) -> str:
    """Return a sentence where a recorded command follows from what its controller was given with another sample period only; empty where it
    does so as recorded, with no other, or nothing was replayed."""
    period = 1e3 * experiment.machine.assembly.sample_period
    if experiment.machine.replay and experiment.machine.clock != 1.0 and (told := _beside_the_lesson(experiment, values, method)):
        return told
    for row, share in unexplained_share(experiment, values) if experiment.machine.replay else ():
        name = experiment.machine.compare[row]
        # clocks of other devices, and seconds for milliseconds
        for factor in (0.5, 2.0, 0.8, 1.25, 0.1, 10.0, 1e-3, 1e3) if share > method.little else ():
            if dict(unexplained_share(_at_period(experiment, factor), values))[row] < method.little:
                return (
                    f"With a sample period of {factor * period:.4g} ms {name} follows from what its controller was given, with "
                    f"{period:.4g} ms {share:.0%} of it does not: the time column, or its unit, is off by a factor of {1.0 / factor:.4g}."
                )
    return ""


def _beside_the_lesson(experiment: Experiment, values: Mapping[str, float], method: Method) -> str:
    """Return a sentence where the time column and the lesson's period differ by more than two clocks do, unless a command speaks for the
    time column: it follows from what its controller was given with that only."""
    # of an open loop the converter that holds its voltage keeps the time, and no command tells which clock is right
    period, clock = 1e3 * experiment.machine.assembly.sample_period, experiment.machine.clock
    decides_every, how = period / experiment.machine.decisions, "fast" if clock > 1.0 else "slow"
    times = f"every {decides_every / clock:.4g} ms, and by the recording's clock every {decides_every:.4g} ms: that runs"
    for controller, row in shown_commands(experiment):
        as_recorded, as_told = (_beyond_floor(experiment, factor, values, row) for factor in (1.0, 1.0 / clock))
        name = experiment.machine.compare[row]
        if as_recorded > method.recordings.command_floor and as_told < method.little * as_recorded:
            return (
                f"{controller} decides {times} {abs(clock - 1.0):.2%} {how}. With the lesson's period {name} follows from what its "
                f"controller was given, with the recorded one {as_recorded:.1%} of it does not."
            )
        if as_told > method.recordings.command_floor and as_recorded < method.little * as_told:
            return ""
    parts = experiment.machine.assembly.parts
    open_loop = not any(closes_a_loop(part) for part in parts)
    shown = [controller for controller, _ in shown_commands(experiment)]
    shown += [part.name for part in parts if open_loop and decides(part.component)]
    if not shown:
        return ""
    return (
        f"{shown[0]} decides {times} {abs(clock - 1.0):.2%} {how}. No command tells which of the two is right. "
        "Write the true sample_period in the lesson, or mend the time column."
    )


def _beyond_floor(experiment: Experiment, factor: float, values: Mapping[str, float], row: int) -> float:
    """Return the share of a channel that a replay with every period ``factor`` times as long does not explain, noise aside."""
    residual = (_at_period(experiment, factor) if factor != 1.0 else experiment).sensed.one(values)[row]
    left = root_mean_square(residual[int(SETTLING * experiment.sensed.samples) :])
    size = float(np.std(np.nan_to_num(experiment.sensed.recorded[row])))
    return float(np.sqrt(max(left**2 - experiment.floors[experiment.machine.compare[row]] ** 2, 0.0))) / size if size > 0.0 else 0.0


def _at_period(experiment: Experiment, factor: float) -> Experiment:
    """Return the same recording with every period ``factor`` times as long; controllers that decide more often do so at their own rate."""
    decisions = max(1, round(factor * experiment.machine.decisions)) if experiment.machine.decisions > 1 else 1
    return replace(
        experiment,
        machine=replace(experiment.machine, assembly=_slower(experiment.machine.assembly, factor), decisions=decisions),
        with_candidates=_slower(experiment.with_candidates, factor),
        record=Record(factor * experiment.record.time, experiment.record.channels, dict(experiment.record.meta)),
    )


def _slower(assembly: Assembly, factor: float) -> Assembly:
    return replace(assembly, sample_period=factor * assembly.sample_period, step=factor * assembly.step)
