"""Alarms, which stop a run as a control would, and the controllers that close a loop around an axis.

Alarms: a run stops once an axis exceeds its travel or its limit of following error, as a control would stop it.

LinuxCNC has FERROR, MIN_LIMIT and MAX_LIMIT for this (Integrator Manual, INI configuration), Fanuc the parameters 1320, 1321 and 1828. Left
out: a limit that grows with the speed, as in LinuxCNC, and a smaller limit for an axis at rest.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from lathesim.analysis.display_unit import shown_with_unit
from lathesim.analysis.failed_run import UNSTABLE
from lathesim.component import Component, Input, Output, Parameter
from lathesim.engine.assembly import FloatArray, Place
from lathesim.engine.wiring import Plan
from lathesim.errors import LessonError
from lathesim.lessons.case import Case, Given
from lathesim.lessons.insertion import Machinery
from lathesim.lessons.part_values import declared_item, placed_at, si_value
from lathesim.units import split_quantity


def is_controller(component: type[Component]) -> bool:
    """Return whether a part drives something by what it measures: it has the roles ``measured`` and ``drive``, on two inputs."""
    ports = component.ports
    return "measured" in ports and "drive" in ports and ports["measured"] != ports["drive"]


def loops_around(plan: Plan, part: str) -> tuple[str, ...]:
    """Return the controllers that measure an axis, in the order of the machine.

    ``part`` is the axis, a controller of it, or a part that reads it. Cross couplings are no loops of one axis and are left out.
    """
    axes = _axes_behind(plan, part)
    controllers = [name for name, other in plan.parts.items() if is_controller(other.component)]
    return tuple(name for name in controllers if axes & _axes_behind(plan, name))


def loops_leading(plan: Plan, part: str) -> tuple[str, ...]:
    """Return the controllers around a part first, then those whose axes lead it by the wires, as a spindle leads a feed per revolution."""
    around = loops_around(plan, part)
    waiting, passed = [part, *around], dict[str, None]()
    while waiting:
        name = waiting.pop()
        if name not in passed:
            passed[name] = None
            waiting += [source for item in plan.parts[name].component.declared(Input) if (source := _source(plan, f"{name}.{item}"))]
    return around + tuple(
        name for name in plan.parts if name in passed and name not in around and is_controller(plan.parts[name].component)
    )


def commands_of_loops(plan: Plan) -> tuple[str, ...]:
    """Return the recorded outputs ``part.name`` with which controllers drive."""
    readings = [f"{name}.{part.component.ports.get('reading', '')}" for name, part in plan.parts.items() if is_controller(part.component)]
    return tuple(name for name in readings if name in plan.channels)


def _axes_behind(plan: Plan, part: str) -> frozenset[str]:
    """Return the parts that move and whose motion reaches ``part``; a controller is reached by what it measures."""
    waiting, passed, axes = [part], set(), set()
    while waiting:
        name = waiting.pop()
        if name in passed:
            continue
        passed.add(name)
        component = plan.parts[name].component
        if any(
            isinstance(component.declarations[component.ports[role]], Output)
            for role in ("displacement", "flow")
            if role in component.ports
        ):
            axes.add(name)
        elif not is_controller(component):
            waiting += [source for item in component.declared(Input) if (source := _source(plan, f"{name}.{item}"))]
        elif name == part and (source := _source(plan, f"{name}.{component.ports['measured']}")):
            waiting.append(source)
    return frozenset(axes)


def _source(plan: Plan, target: str) -> str:
    kind, name = plan.feeds[target]
    return Place.of(name).part if kind == "output" else ""


_GAINS = ("loop_gain", "inner_gain", "integral_gain")
"""Roles of the controller parameters that are positive in a stable loop."""
_GROWING = 4
"""Growing swings in a row that count as an unstable loop (assumed)."""


@dataclass(frozen=True)
class Alarm:
    """The limits of an output [SI]."""

    channel: str
    low: float
    high: float


def alarms_of(case: Case, machinery: Machinery) -> tuple[Alarm, ...]:
    """Return the alarms of the machine template; those of the lesson replace them. Outputs that a replaced part lacks are left out.

    Raises :class:`LessonError` with the place of a faulty entry.
    """
    parts = {part.name: part.component for part in machinery.parts}
    source = case.lesson.machine.source
    written = {
        name: Given(text, source.place(("alarms", name)), source.place(("alarms", name), key=True))
        for name, text in case.lesson.machine.settings.alarms.items()
        if (place := Place.of(name)).part not in case.changed.replace or place.port in parts[place.part].declared(Output)
    }
    return tuple(_alarm(name, given, parts) for name, given in {**written, **case.changed.alarms}.items())


def _alarm(name: str, given: Given, parts: Mapping[str, type[Component]]) -> Alarm:
    declared = declared_item(name, parts, (Output,), "output", given.key_place)
    lower, dots, upper = str(given.value).rpartition("..")
    high = si_value(Given(upper, given.place, given.key_place), declared.unit)
    if not dots:
        low = -high
    else:
        with placed_at(given.place):
            unit = split_quantity(upper)[1]
        bare = lower.strip().lstrip("+-").replace(".", "", 1).isdigit()
        low = si_value(Given(f"{lower} {unit}" if bare else lower, given.place, given.key_place), declared.unit)
    if not low < high:
        raise LessonError(f"the alarm leaves {name} no room.", place=given.place, remedy="Write it as 50 mm, or as -100..500 mm.")
    return Alarm(name, low, high)


class AlarmWatch:
    """Searches the blocks of one run for the first value outside the alarms; only recorded channels are watched.

    An alarm is armed once its value is inside: an axis that does not stand at the start of its program begins with a large error.
    """

    def __init__(self, plan: Plan, alarms: Sequence[Alarm], overrides: Mapping[str, float] | None = None) -> None:
        self._plan = plan
        self._overrides = overrides or {}
        self._rows = {alarm: plan.channels.index(alarm.channel) for alarm in alarms if alarm.channel in plan.channels}
        self._armed: set[Alarm] = set()
        self._loops = {alarm: loops_leading(plan, Place.of(alarm.channel).part) for alarm in self._rows}
        errors = {name: _role(plan, name, "error") for loops in self._loops.values() for name in loops}
        self._errors: dict[str, list[FloatArray]] = {error: [] for error in errors.values() if error in plan.channels}

    def look(self, first: int, values: FloatArray) -> tuple[int, str] | None:
        """Return the first sample of a block (channels, samples) outside its limits and the alarm as a sentence, or none."""
        tripped: tuple[int, Alarm] | None = None
        for alarm, row in self._rows.items():
            outside = (values[row] < alarm.low) | (values[row] > alarm.high)
            if alarm not in self._armed:
                inside = np.flatnonzero(~outside)
                if not len(inside):
                    continue
                self._armed.add(alarm)
                outside[: inside[0]] = False
            sample = int(np.argmax(outside))
            if outside[sample] and (tripped is None or sample < tripped[0]):
                tripped = sample, alarm
        for name, kept in self._errors.items():
            kept.append(values[self._plan.channels.index(name), : None if tripped is None else tripped[0] + 1].copy())
        if tripped is None:
            return None
        sample, alarm = tripped
        return sample, self._sentence(alarm, float(values[self._rows[alarm], sample]), first + sample)

    def _sentence(self, alarm: Alarm, value: float, sample: int) -> str:
        part, item = Place.of(alarm.channel)
        unit = self._plan.unit(alarm.channel)
        at = f"{sample * self._plan.assembly.sample_period:.4g} s"
        if alarm.channel == _role(self._plan, part, "error"):
            what, value = "following error", abs(value)
            limit = f"above the limit of {shown_with_unit(alarm.high, unit)}"
        else:
            what = item.replace("_", " ")
            limit = f"outside {shown_with_unit(alarm.low, unit)} to {shown_with_unit(alarm.high, unit)}"
        cause = self._cause(alarm) or f"slow the axis down, or widen the alarm {alarm.channel}"
        return f"the {what} of {part} is {shown_with_unit(value, unit)} at {at}, {limit}; {cause}."

    def _cause(self, alarm: Alarm) -> str:
        """Return the cause of an alarm: a gain of the wrong sign, or growing swings of the error."""
        for part in self._loops[alarm]:
            gains = [name for role in _GAINS if (name := _role(self._plan, part, role))]
            for name in gains:
                if self._value(name) < 0.0:
                    return f"{UNSTABLE}: {self._shown(name)} has the wrong sign"
            kept = self._errors.get(_role(self._plan, part, "error"))
            if kept and _swings_up(np.concatenate(kept)):
                lower = f"; lower {self._shown(gains[0])}" if gains else ""
                return f"{UNSTABLE}: what {part} drives swings further and further{lower}"
        return ""

    def _value(self, name: str) -> float:
        return self._overrides.get(name, self._plan.values[name])

    def _shown(self, name: str) -> str:
        part, item = Place.of(name)
        declared = self._plan.declaration(name)
        assert isinstance(declared, Parameter)
        return f"the {item.replace('_', ' ').removesuffix(' gain')} gain {shown_with_unit(self._value(name), declared.unit)} of {part}"


def _role(plan: Plan, part: str, role: str) -> str:
    """Return the ``part.name`` that has a role in a controller; empty for another part, and where it declares none."""
    component = plan.parts[part].component
    return f"{part}.{component.ports[role]}" if is_controller(component) and role in component.ports else ""


def _swings_up(error: FloatArray) -> bool:
    """Return whether an error ends in growing swings about zero."""
    ends = np.flatnonzero(np.diff(np.sign(error)) != 0) + 1
    swings = [float(np.max(np.abs(swing))) for swing in np.split(error, ends)[-_GROWING - 1 : -1] if len(swing)]
    return len(swings) == _GROWING and all(later > swing for swing, later in pairwise(swings)) and math.isfinite(swings[-1])
