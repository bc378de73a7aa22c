"""Columns of another place of the machine: the other side of a transmission, or another axis.

What a controller makes of a reading is arithmetic. Where its command follows from a column times a factor, the controller was given that,
and the column was recorded before a gear or a screw, or in another unit. A factor on the command itself is as well another gain of the
controller: of the two the machine behind it tells. Beside no controller the machine tells: a column that is what it makes times one of its
own transmissions was recorded on the other side of that.
Left out: a transmission that the lesson does not know and no command shows; it stays a factor on the reading.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping

import numpy as np

from lathesim.component import Output, State
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.recording_checks.controllers import unexplained_share
from lathesim.diagnosis.recording_checks.wrong_readings import is_within
from lathesim.engine.assembly import FloatArray, Part, Place
from lathesim.identification.replay.experiment import Experiment, build_experiments
from lathesim.identification.replay.measured_motion import line_of, measured_output
from lathesim.identification.roles import closes_a_loop
from lathesim.identification.signal import SETTLING, root_mean_square
from lathesim.recordings.recorded_channel import known_factor

_SPEEDS = ("m/s", "rad/s")
_ANGLES = {1.0: "radians", 0.5 / math.pi: "turns", 180.0 / math.pi: "degrees"}
"""What makes a unit of radians -> its name."""


def of_another_place(experiment: Experiment, values: Mapping[str, float], method: Method = STANDARD) -> str:
    """Return a sentence where a column is of another axis or of the other side of a transmission; empty where none is."""
    if not experiment.machine.replay:
        return ""
    begin = int(SETTLING * experiment.sensed.samples)
    recorded = np.nan_to_num(experiment.sensed.recorded)
    made = (recorded - np.nan_to_num(experiment.sensed.one(values)))[:, begin:]
    return (
        _follows_another_reference(experiment, method)
        or _made_by_another(experiment, recorded[:, begin:], made, method)
        or _times_a_factor(experiment, values, recorded[:, begin:], made, method)
    )


def _follows_another_reference(experiment: Experiment, method: Method) -> str:
    """Return the sentence for a reading that goes where the reference of another controller than its own asks."""
    assembly = experiment.machine.assembly
    loops = [part for part in assembly.parts if closes_a_loop(part)]
    asked = {f"{part.name}.{part.component.ports['drive']}": part for part in loops}
    asked = {name: part for name, part in asked.items() if name in experiment.machine.drive}
    for own, part in asked.items():
        reading = assembly.sources.get(f"{part.name}.{part.component.ports['measured']}", "")
        if reading not in experiment.machine.compare:
            continue
        column, unit = np.nan_to_num(experiment.record[reading]), experiment.record.unit(reading)
        apart = {name: _apart(column, experiment.record[name]) for name in asked if experiment.record.unit(name) == unit}
        nearest = min(apart, key=lambda name: apart[name], default=own)
        away = apart.get(own, 0.0) > method.larger_part
        if nearest != own and away and apart[nearest] < method.little:
            return f"{reading} goes where {nearest} asks, and not where {own} does: the column is of another axis."
    return ""


def _apart(column: FloatArray, other: FloatArray) -> float:
    """Return how far a column is from another one, zeros aside, as a share of that one."""
    size = float(np.std(np.nan_to_num(other)))
    return float(np.std(column - np.nan_to_num(other))) / size if size > 0.0 else math.inf


def _made_by_another(experiment: Experiment, recorded: FloatArray, made: FloatArray, method: Method) -> str:
    """Return the sentence for a column that is what the machine makes in another channel of its unit, and nothing like its own."""
    # a second sensor of one motion is held against the first, and shows what that recorded
    again = {sight.row for sight in experiment.sensed.redundant_sensors}
    for row, other in itertools.permutations([row for row in range(len(recorded)) if row not in again], 2):
        name, shown = (experiment.machine.compare[place] for place in (row, other))
        if experiment.record.unit(name) != experiment.record.unit(shown):
            continue
        own, there, back = _apart(recorded[row], made[row]), _apart(recorded[row], made[other]), _apart(recorded[other], made[row])
        if there < method.little and min(own, back) > method.larger_part:
            return f"{name} is what the machine makes of {shown}, and nothing like its own: the column is of another axis."
    return ""


def _times_a_factor(experiment: Experiment, values: Mapping[str, float], recorded: FloatArray, made: FloatArray, method: Method) -> str:
    """Return the sentence for a column that is what the machine makes times a factor which no sensor has."""
    for row, name in enumerate(experiment.machine.compare):
        one, other = (column - np.mean(column) for column in (recorded[row], made[row]))
        factor = float(one @ other) / max(float(other @ other), 1e-300)
        beside = root_mean_square(one - factor * other)
        if is_within(abs(factor), method.alike) or not beside < method.larger_part * root_mean_square(one):
            continue
        given = _given_to_controller(experiment, values, name, 1.0 / factor, method)
        factor = factor if given is None else 1.0 / given
        why = _transmission(experiment, name, factor, method) or ("" if given is None else _mistaken(factor))
        if why:
            of_what = "the machine makes" if given is None else "its controller was given"
            return f"{name} is {factor:.4g} times what {of_what}, {why}. Write scale: {1.0 / factor:.6g} for its column."
    return ""


def _mistaken(factor: float) -> str:
    """Return in words what a factor on a column may be."""
    unit = known_factor(factor)
    return f"which is the factor of a mistaken unit: {unit}" if unit else "so it is in another unit, or of the other side of a transmission"


def _given_to_controller(experiment: Experiment, values: Mapping[str, float], name: str, factor: float, method: Method) -> float | None:
    """Return the factor on a column with which a command follows from it, near a first guess; none where no command does.

    A command is linear in what its controller was given, so two replays tell the factor: r(g) = r(g0) + (g - g0) r'.
    """

    def commands(of: float) -> tuple[Experiment, dict[int, float]]:
        column = experiment.record.channels[name]
        record = experiment.record.with_channel(name, column.unit, of * column.values)
        scaled = build_experiments(experiment.machine, [(experiment.name, record)], ())[0]
        return scaled, dict(unexplained_share(scaled, values))

    as_recorded = dict(unexplained_share(experiment, values))
    first, shares = commands(factor)
    begin = int(SETTLING * first.sensed.samples)
    for row, share in as_recorded.items():
        if not shares[row] < method.larger_part * share:
            continue
        step = factor * 1e-3
        second, _ = commands(factor + step)
        left, moved = (np.nan_to_num(one.sensed.one(values)[row])[begin:] for one in (first, second))
        slope = (moved - left) / step
        found = factor - float(slope @ left) / max(float(slope @ slope), 1e-300)
        scaled, left_of = commands(found)
        own = experiment.machine.compare[row] == name
        if left_of[row] < method.little * share and not (own and _is_a_gain(experiment, scaled, name, values, method)):
            return found
    return None


def _is_a_gain(experiment: Experiment, scaled: Experiment, name: str, values: Mapping[str, float], method: Method) -> bool:
    """Return whether a factor on a command, the column ``name`` itself, is rather another gain of its controller: the machine behind it
    follows hardly better from the ``scaled`` command than from the recorded one."""
    others = [row for row, other in enumerate(experiment.machine.compare) if other != name]
    before, after = (np.nan_to_num(one.sensed.one(values)[others]) for one in (experiment, scaled))
    ratios = [root_mean_square(one) / max(root_mean_square(other), 1e-300) for one, other in zip(after, before, strict=True)]
    return math.prod(ratios) > 1.0 / method.alike


def _transmission(experiment: Experiment, name: str, factor: float, method: Method) -> str:
    """Return which transmission of the machine a factor is that of; empty where of none."""
    assembly = experiment.machine.assembly
    host, item = Place.of(measured_output(assembly, name))
    ports = assembly.ports(host)
    if item not in (ports.get("displacement"), ports.get("flow")):
        return ""
    for output, ratio in _turning_within(assembly.by_name[host]):
        for angle, unit in _ANGLES.items():
            if abs(abs(factor) * ratio / angle - 1.0) < method.little:
                return f"as the motion of {host}.{output} in {unit} is: it was recorded on the other side of the transmission"
    return ""


def _turning_within(part: Part) -> Iterator[tuple[str, float]]:
    """Return the other speeds of a part, with how far it moves for each unit of them."""
    component, flow = part.component, part.component.ports.get("flow", "")
    for output, declared in component.declared(Output).items():
        if output == flow or declared.unit not in _SPEEDS:
            continue
        lines = ((line_of(part, flow, state), line_of(part, output, state)) for state in component.declared(State))
        found = [moved[1] / turned[1] for moved, turned in lines if moved is not None and turned is not None]
        yield from ((output, ratio) for ratio in found[:1] if not math.isclose(ratio, 1.0))
