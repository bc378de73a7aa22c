"""Inputs that nobody recorded: a command that does not follow from its controller, because something is added to it on its way.

    s_k = u_k - u_lesson,k

u is the recorded command, u_lesson what the lesson's controller makes of the recorded reference and measurements: between the two lies no
physics. A fault of the recording leaves s as well. The signal counts as added where it has a simple shape, or where a diagnosis with s as
one more known input finds the rest of the machine in agreement. What goes with the reference, or with the place and the speed that the
controller measures, is another law of the controller or another column. Source: Ljung, System Identification, 2nd ed. 1999, section 13.1.

The shape of a signal is said in words: pulses, steps or a sine, or none of them.

    piecewise constant   s_k = c_j            between two jumps
    sine                 s_k = a sin(2 pi f t_k) + b cos(2 pi f t_k) + c

The kind that explains more of the power is taken, where it explains nearly all. Source: Bendat, Piersol, Random Data, 4th ed. 2010,
section 11.5 (least squares at the largest line of a periodogram).
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.fft import rfft, rfftfreq
from scipy.optimize import minimize_scalar

from lathesim.analysis.display_unit import shown_with_unit
from lathesim.component import Input, Output, Parameter
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.recording_checks.controllers import controller_commands, regressed_share, unexplained_share
from lathesim.effects.effect import Effect
from lathesim.engine.assembly import FloatArray, Place
from lathesim.identification.replay.experiment import Experiment, RecordedMachine
from lathesim.identification.signal import SETTLING
from lathesim.lessons.insertion import insert_effect
from lathesim.record import Record


class AddedSignal(Effect):
    """A known signal added to a command:  u_out = u_in + share s."""

    family, site = "constants", "reading"
    neutral = {"share": 0.0}
    fingerprint = "A command differs from what its controller makes of its inputs, and the drive follows it."
    experiment = "Record what is added to the command, or switch it off."
    source = "Equation of a summing point: Ljung, System Identification, 2nd ed. 1999, section 13.1 (extra inputs in closed loop)."

    incoming = Input("{signal}", doc="command of the controller")
    added = Input("{signal}", default=0.0, doc="signal that is added")
    outgoing = Output("{signal}", doc="sum of both")
    share = Parameter("1", 1.0, doc="how much of it is added")

    @staticmethod
    def output(incoming: float, added: float, share: float) -> float:
        """The sum of both."""
        return incoming + share * added


def _adding(channel: str) -> str:
    """Return the name of the part that adds a signal behind an output (``part.output``)."""
    return f"added_{channel.replace('.', '_')}"


def shape_of(values: FloatArray, period: float, unit: str, method: Method = STANDARD) -> SignalShape:
    """Return the shape of a signal (samples,); of a command, which is arithmetic, next to nothing may stay unexplained."""
    largest = float(np.max(np.abs(values), initial=0.0))
    on = np.abs(values) > method.little * largest
    if largest == 0.0 or not on.any():
        return SignalShape("", (), 0.0)
    first, last = int(np.argmax(on)), len(on) - int(np.argmax(on[::-1]))
    whole = ((first * period, last * period),)
    steps, sine = _steps(values, period, unit, method), _sine(values[first:last], period, unit, method)
    best = max((steps, SignalShape(sine.words, whole, sine.share, repeats=True)), key=lambda shape: shape.share)
    return best if best.share > 1.0 - method.little**2 else SignalShape("", whole, 0.0)


def _steps(values: FloatArray, period: float, unit: str, method: Method) -> SignalShape:
    """Return the shape of a signal as levels between jumps; a share of 0 where there are nearly as many jumps as samples."""
    edges = np.flatnonzero(np.abs(np.diff(values)) > method.recordings.signal_jump * float(np.ptp(values))) + 1
    bounds = [0, *edges.tolist(), len(values)]
    if not len(edges) or len(bounds) > len(values) / method.recordings.signal_samples:
        return SignalShape("", (), 0.0)
    pairs = list(itertools.pairwise(bounds))
    levels = np.array([float(np.median(values[begin:end])) for begin, end in pairs])
    left = np.concatenate([values[begin:end] - level for (begin, end), level in zip(pairs, levels, strict=True)])
    on = np.abs(levels) > method.little * float(np.max(np.abs(levels)))
    if not on.any():
        return SignalShape("", (), 0.0)
    stretches = tuple((begin * period, end * period) for (begin, end), is_on in zip(pairs, on, strict=True) if is_on)
    return SignalShape(_levels_in_words(pairs, levels, on, period, unit, method), stretches, _explained(values, left))


def _levels_in_words(
    pairs: list[tuple[int, int]], levels: FloatArray, on: npt.NDArray[np.bool_], period: float, unit: str, method: Method
) -> str:
    sizes, lengths = levels[on], np.array([end - begin for begin, end in pairs])[on] * period
    size = _span(np.unique(np.round(sizes, 12)), unit, method)
    returns = bool(np.all(on[:-1] ^ on[1:])) and not on[-1]
    if returns:
        many = "a pulse" if len(sizes) == 1 else f"{len(sizes)} pulses"
        return f"{many} of {size}, {_span(lengths, 's', method)} long"
    return f"a step of {size}" if len(sizes) == 1 else f"{len(sizes)} steps of {size}"


def _span(values: FloatArray, unit: str, method: Method) -> str:
    low, high = float(np.min(values)), float(np.max(values))
    if high - low <= method.little * max(abs(low), abs(high)):
        return shown_with_unit(float(np.median(values)), unit, 3)
    return f"{shown_with_unit(low, unit, 3)} to {shown_with_unit(high, unit, 3)}"


def _sine(values: FloatArray, period: float, unit: str, method: Method) -> SignalShape:
    """Return a signal as one sine about a constant."""
    if len(values) < 2 * method.recordings.signal_samples:
        return SignalShape("", (), 0.0)
    time = np.asarray(np.arange(len(values)) * period, dtype=np.float64)
    resolution = 1.0 / (len(values) * period)
    power = np.abs(rfft(values - values.mean(), n=4 * len(values))) ** 2
    lines = rfftfreq(4 * len(values), period)
    start = float(lines[int(np.argmax(power))])
    found = minimize_scalar(
        lambda f: float(np.sum(_beside_sine(values, time, f)[0] ** 2)),
        bounds=(max(start - resolution, 0.25 * resolution), start + resolution), method="bounded", options={"xatol": 1e-6 * resolution},
    )  # fmt: skip
    left, amplitude = _beside_sine(values, time, float(found.x))
    if found.x * period * method.recordings.signal_samples > 1.0 or found.x < resolution:
        return SignalShape("", (), 0.0)
    return SignalShape(f"a sine of {shown_with_unit(amplitude, unit, 3)} at {found.x:.4g} Hz", (), _explained(values - values.mean(), left))


def _beside_sine(values: FloatArray, time: FloatArray, frequency: float) -> tuple[FloatArray, float]:
    """Return what the best sine of a frequency leaves (samples,), and its amplitude."""
    angle = 2.0 * np.pi * frequency * time
    columns = np.column_stack([np.sin(angle), np.cos(angle), np.ones_like(angle)])
    found = np.linalg.lstsq(columns, values, rcond=None)[0]
    return values - columns @ found, float(np.hypot(found[0], found[1]))


def _explained(values: FloatArray, left: FloatArray) -> float:
    return 1.0 - float(np.sum(left**2)) / max(float(np.sum(values**2)), 1e-300)


def unrecorded_inputs(
    experiments: Sequence[Experiment], values: Mapping[str, float], laws: Collection[str], method: Method = STANDARD
) -> list[UnrecordedInput]:
    """Return the signals that may be added to commands, one for each recording in which one is; none for commands with another law
    (``laws``), or where the signal goes with what the controller was given."""
    found: list[UnrecordedInput] = []
    for experiment in experiments if experiments[0].machine.replay and experiments[0].machine.decisions == 1 else ():
        for row, share in unexplained_share(experiment, values):
            command = experiment.machine.compare[row]
            if share > method.recordings.command_floor and command not in laws:
                signal = np.nan_to_num(experiment.sensed.one(values)[row])
                if not _goes_with_inputs(experiment, command, signal, method):
                    found.append(_described(experiment, command, signal, share, method))
    # one of simple shape, or one that a contradiction shows and that is smaller than what a wrong column leaves
    certain = {one.command for one in found if one.shape.share > 0.0 or method.little < one.unexplained < method.larger_part}
    return [one for one in found if one.command in certain]


def with_inputs(machine: RecordedMachine, added: Sequence[UnrecordedInput]) -> RecordedMachine:
    """Return the machine with the added signals as driven inputs behind their commands: its recordings need these channels, too."""
    for command in dict.fromkeys(one.command for one in added):
        name = _adding(command)
        assembly = insert_effect(machine.assembly, AddedSignal, command, name=name, sources={"added": 0.0})
        machine = replace(machine, assembly=assembly, drive=(*machine.drive, f"{name}.added"))
    return machine


def with_signals(experiment: Experiment, values: Mapping[str, float], added: Sequence[UnrecordedInput]) -> Record:
    """Return the record of an experiment with the added signals of its commands."""
    record, left = experiment.record, experiment.sensed.one(values)
    for row, name in controller_commands(experiment):
        if any(one.command == name for one in added):
            record = record.with_channel(f"{_adding(name)}.added", record.unit(name), np.nan_to_num(left[row]))
    return record


def _described(experiment: Experiment, command: str, signal: FloatArray, share: float, method: Method) -> UnrecordedInput:
    shape, unit = _shape(experiment, command, signal, method), experiment.record.unit(command)
    targets = tuple(wire.target for wire in experiment.machine.assembly.wires if wire.source == command)
    time = np.asarray(np.arange(len(signal)) * experiment.sensed.period, dtype=np.float64)
    return UnrecordedInput(
        command, targets, experiment.name, unit, time, signal, np.nan_to_num(experiment.record[command]), share, shape
    )  # fmt: skip


def _shape(experiment: Experiment, command: str, signal: FloatArray, method: Method) -> SignalShape:
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
    controller = Place.of(command).part
    wires = experiment.machine.assembly.sources
    targets = [target for target in dict.fromkeys((*experiment.machine.drive, *wires)) if Place.of(target).part == controller]
    names = [name for target in targets for name in (target, wires.get(target, "")) if name in experiment.record]
    given = [np.nan_to_num(experiment.record[name]) for name in dict.fromkeys(names)]
    motions = [np.column_stack([place, np.gradient(place), np.cumsum(place - place.mean())]) for place in given]
    groups = motions if shape.share > 0.0 else [np.column_stack(motions)] if motions else []
    return any(_told_by(columns, signal) > method.larger_part for columns in groups)


def _told_by(columns: FloatArray, signal: FloatArray) -> float:
    """Return the share of a signal (samples,) that columns (samples, columns) tell, learned on the first half, scored on the second."""
    begin = int(SETTLING * len(signal))
    columns, signal = columns[begin:] - columns[begin:].mean(axis=0), signal[begin:] - signal[begin:].mean()
    learned = np.arange(len(signal)) < len(signal) // 2
    return regressed_share(columns[learned], signal[learned], columns[~learned], signal[~learned])


@dataclass(frozen=True)
class SignalShape:
    """The shape of a signal: its ``kind`` in words with sizes, the stretches in which it is there [s], and the ``share`` of its power that
    the kind explains (0 for one of no simple shape)."""

    words: str
    windows: tuple[tuple[float, float], ...]
    share: float
    repeats: bool = False
    """Whether it is a sine, as a motion may be."""


@dataclass(frozen=True)
class UnrecordedInput:
    """A signal ``values`` (samples,) [``unit``] over ``time`` [s] in one ``recording``, added to ``command`` on its way to ``targets``
    (``part.input``); ``total`` is the recorded command. ``unexplained`` is its share of the command."""

    command: str
    targets: tuple[str, ...]
    recording: str
    unit: str
    time: FloatArray
    values: FloatArray
    total: FloatArray
    unexplained: float
    shape: SignalShape

    @property
    def wire(self) -> str:
        """The place at which it acts: the first input that the command feeds."""
        return self.targets[0] if self.targets else self.command

    @property
    def words(self) -> str:
        """What it is, when and how large."""
        size = shown_with_unit(float(np.sqrt(np.mean(self.values**2))), self.unit, 3)
        when = f", between {self.shape.windows[0][0]:.4g} and {self.shape.windows[-1][1]:.4g} s" if self.shape.windows else ""
        return f"{self.shape.words or 'a signal of no simple shape'}{when} ({size} rms in {self.recording})"

    def __str__(self) -> str:
        """The signal in a sentence, without its end."""
        return f"A signal that nobody recorded is added to {self.command} on its way to {self.wire}: {self.words}"
