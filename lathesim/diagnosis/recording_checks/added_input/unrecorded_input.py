"""Inputs that nobody recorded: a command that does not follow from its controller, because something is added to it on its way.

    s_k = u_k - u_lesson,k

u is the recorded command, u_lesson what the lesson's controller makes of the recorded reference and measurements: between the two lies no
physics. A fault of the recording leaves s as well. The signal counts as added where it has a simple shape, or where a diagnosis with s as
one more known input finds the rest of the machine in agreement. What goes with the reference, or with the place and the speed that the
controller measures, is another law of the controller or another column. Source: Ljung, System Identification, 2nd ed. 1999, section 13.1.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.recording_checks.added_input.known_input import AddedInput, with_added_input, with_signal
from lathesim.diagnosis.recording_checks.added_input.signal_shape import shape_of
from lathesim.diagnosis.recording_checks.controller_law import regressed_share
from lathesim.diagnosis.recording_checks.unexplained_command import controller_commands, unexplained_share
from lathesim.diagnosis.records.added_signal import Shape, UnrecordedInput
from lathesim.engine.assembly import FloatArray
from lathesim.identification.replay.closed_loop import SETTLING
from lathesim.identification.replay.experiment import Experiment, Machine
from lathesim.record import Record


def unrecorded_inputs(
    experiments: Sequence[Experiment], values: Mapping[str, float], laws: Collection[str], method: Method = STANDARD
) -> list[UnrecordedInput]:
    """Return the signals that may be added to commands, one for each recording in which one is; none for commands with another law
    (``laws``), or where the signal goes with what the controller was given."""
    found: list[UnrecordedInput] = []
    for experiment in experiments if experiments[0].machine.replay and experiments[0].machine.decisions == 1 else ():
        for row, share in unexplained_share(experiment, values):
            command = experiment.machine.compare[row]
            if share > method.recording_checks.clock_unexplained and command not in laws:
                signal = np.nan_to_num(experiment.sensed.one(values)[row])
                if not _goes_with_inputs(experiment, command, signal, method):
                    found.append(_described(experiment, command, signal, share, method))
    certain = {one.command for one in found if _may_be_added(one, method)}
    return [one for one in found if one.command in certain]


def _may_be_added(one: UnrecordedInput, method: Method) -> bool:
    """Return whether a signal may be added: one of simple shape, or one that a contradiction shows and that is smaller than what a wrong
    column leaves."""
    limits = method.recording_checks
    return one.shape.share > 0.0 or limits.unexplained_command < one.unexplained < method.shared.larger_part


def with_inputs(machine: Machine, added: Sequence[UnrecordedInput]) -> Machine:
    """Return the machine with the added signals as driven inputs."""
    for command in dict.fromkeys(one.command for one in added):
        machine = with_added_input(machine, AddedInput(command))
    return machine


def with_signals(experiment: Experiment, values: Mapping[str, float], added: Sequence[UnrecordedInput]) -> Record:
    """Return the record of an experiment with the added signals of its commands."""
    record, left = experiment.record, experiment.sensed.one(values)
    for row, name in controller_commands(experiment):
        if any(one.command == name for one in added):
            record = with_signal(record, AddedInput(name), np.nan_to_num(left[row]))
    return record


def _described(experiment: Experiment, command: str, signal: FloatArray, share: float, method: Method) -> UnrecordedInput:
    shape, unit = _shape(experiment, command, signal, method), experiment.record.unit(command)
    targets = tuple(wire.target for wire in experiment.machine.assembly.wires if wire.source == command)
    time = np.asarray(np.arange(len(signal)) * experiment.sensed.period, dtype=np.float64)
    return UnrecordedInput(
        command, targets, experiment.name, unit, time, signal, np.nan_to_num(experiment.record[command]), share, shape
    )  # fmt: skip


def _shape(experiment: Experiment, command: str, signal: FloatArray, method: Method) -> Shape:
    begin = int(SETTLING * len(signal))
    settled = np.concatenate([np.zeros(begin), signal[begin:]])
    return shape_of(settled, experiment.sensed.period, experiment.record.unit(command), method)


def _goes_with_inputs(experiment: Experiment, command: str, signal: FloatArray, method: Method) -> bool:
    """Return whether most of a signal goes with place, speed and sum of what its controller was given, as another column's would.

    Pulses and steps do not, whatever the loop makes of them. A sine may be the motion's own. Any other signal is asked against all that
    the controller was given at once, as a reference of another axis leaves the difference of two motions.
    """
    if (shape := _shape(experiment, command, signal, method)).share > 0.0 and not shape.repeats:
        return False
    controller = command.partition(".")[0]
    wires = {wire.target: wire.source for wire in experiment.machine.assembly.wires}
    targets = [target for target in dict.fromkeys((*experiment.machine.drive, *wires)) if target.partition(".")[0] == controller]
    names = [name for target in targets for name in (target, wires.get(target, "")) if name in experiment.record]
    given = [np.nan_to_num(experiment.record[name]) for name in dict.fromkeys(names)]
    motions = [np.column_stack([place, np.gradient(place), np.cumsum(place - place.mean())]) for place in given]
    groups = motions if shape.share > 0.0 else [np.column_stack(motions)] if motions else []
    return any(_told_by(columns, signal) > method.shared.larger_part for columns in groups)


def _told_by(columns: FloatArray, signal: FloatArray) -> float:
    """Return the share of a signal (samples,) that columns (samples, columns) tell, learned on the first half, scored on the second."""
    begin = int(SETTLING * len(signal))
    columns, signal = columns[begin:] - columns[begin:].mean(axis=0), signal[begin:] - signal[begin:].mean()
    learned = np.arange(len(signal)) < len(signal) // 2
    return regressed_share(columns[learned], signal[learned], columns[~learned], signal[~learned])
