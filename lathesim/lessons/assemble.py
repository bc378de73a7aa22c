"""A lesson to an assembly: template, changes and part program put together, each fault with the place where it was written."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from lathesim.component import Component, Input, Memory, Output, Parameter, State, Table
from lathesim.conformance import line_of
from lathesim.engine.assembly import FloatArray, Part, Place, Wire, of_part
from lathesim.errors import LessonError, PluginError, nearest
from lathesim.lessons.case import Case, Given, Insertion, case_of
from lathesim.lessons.insertion import Machinery, insert_effect
from lathesim.lessons.lesson import Lesson
from lathesim.lessons.part_values import declared_item, no_item, placed_at, seconds, si_value, table_of, take_value
from lathesim.lessons.program_path import limits_of, path_of_program, start_of, tools_of
from lathesim.lessons.schema import PartEntry
from lathesim.lessons.sensor_sides import is_motion_sensor
from lathesim.plugins import Registry
from lathesim.units import same_dimension

_WRITTEN = 2e-3
"""Largest relative rounding of a quantity with three digits."""
_SOURCE = re.compile(r"^[A-Za-z_]\w*\.[A-Za-z_]\w*$")


def assemble(
    lesson: Lesson,
    registry: Registry,
    variant: str | None = None,
    overrides: Mapping[str, str | float] | None = None,
    program: Path | None = None,
) -> Machinery:
    """Return the assembly of a lesson's case.

    ``overrides`` maps ``part.parameter`` and ``part.state`` to a quantity (text, or a number in SI); ``program`` takes the place of the
    lesson's part program. Raises :class:`LessonError` with ``file:line:column``, or the error of the part program.
    """
    return assemble_case(case_of(lesson, variant, overrides, program), registry)


def assemble_case(case: Case, registry: Registry, path: FloatArray | None = None) -> Machinery:
    """Return the assembly of a case, see :func:`assemble`; a ``path`` table takes the place of that of the part program."""
    machine = case.lesson.machine
    _refuse_unknown_parts(case)
    parts = {name: _Placed(case, registry, name) for name in case.parts}
    wires = _wires(case, parts)
    _refuse_settings_without_effect(case, wires)
    path = _path(case, parts) if path is None else path
    machinery = Machinery(
        parts=tuple(placed.part(path) for placed in parts.values()),
        wires=tuple(wires.values()),
        sample_period=(period := seconds(case.sample_period)),
        step=_dividing(period, seconds(case.step)),
        finish=machine.settings.finish,
    )
    for insertion in case.insert:
        machinery = _with_effect(machinery, insertion, case, registry)
    return dataclasses.replace(machinery, record=_record(machinery, case, parts))


class _Placed:
    """A part of the machine with the case's changes: its component and the values that set it."""

    def __init__(self, case: Case, registry: Registry, name: str) -> None:
        entry, source, location = case.parts[name].entry, case.parts[name].source, case.parts[name].location
        replaced = case.changed.replace.get(name)
        units = {**entry.units, **case.units.get(name, {})}
        self.name = name
        self.case = case
        self.entry = entry
        self.every = int(case.changed.every[name].value) if name in case.changed.every else entry.every
        self.side = str(case.changed.side[name].value) if name in case.changed.side else entry.side or ""
        with placed_at(source.place((*location, "component"))):
            template = registry.component(_component_of(entry)).with_units(entry.units)
            self.component = registry.component(_component_of(entry)).with_units(units)
        if replaced:
            with placed_at(replaced.place):
                self.component = registry.component(str(replaced.value)).with_units(units)
        if self.side:
            self._check_side(case.changed.side[name].key_place if name in case.changed.side else source.place((*location, "side")))
        changed = replaced is not None or units != entry.units
        self.parameters: dict[str, float] = {}
        self.start: dict[str, float] = {}
        for group in ("set", "start"):
            for item, text in getattr(entry, group).items():
                where = (*location, group, item)
                overridden = f"{name}.{item}" in case.changed.set
                if not changed or (not overridden and _means_the_same(template, self.component, item)):
                    self._take(item, Given(text, source.place(where), source.place(where, key=True)))
        for item, given in of_part(name, case.changed.set).items():
            self._take(item, given)

    def _check_side(self, place: str) -> None:
        if not is_motion_sensor(self.component):
            fact = f"{self.name} ({self.component.__name__}) measures no motion, so it sits on no side of a spring."
            raise LessonError(fact, place=place, remedy="Give the side of a sensor of a place or a speed.")

    def _take(self, item: str, given: Given) -> None:
        take_value(self.name, self.component, item, given, self.parameters, self.start)

    def part(self, path: FloatArray | None) -> Part:
        """Return the engine's part; a table called ``path`` is the path of the part program."""
        tables = {name: path for name in self.component.declared(Table) if name == "path" and path is not None}
        tables |= _tables(self.case, self.name, self.component)
        lengths = {name: length for name, length in self.entry.memory.items() if name in self.component.declared(Memory)}
        return Part(self.name, self.component, self.parameters, self.start, tables, lengths, self.every, self.side)


def _component_of(entry: PartEntry) -> str:
    """Return the name of the component of a part: of an FMU its file."""
    if (entry.component == "FMU") != (entry.file is not None) or not (entry.file or ".fmu").endswith(".fmu"):
        raise PluginError("an FMU needs both lines.", remedy="Write component: FMU, file: NAME.fmu.")
    return entry.file or entry.component


def _tables(case: Case, part: str, component: type[Component]) -> dict[str, FloatArray]:
    """Return the tables of a part that the lesson names as files."""
    named = of_part(part, case.changed.tables)
    for name, given in named.items():
        if name not in component.declared(Table):
            raise no_item(part, component, name, (Table,), "table", given.key_place)
    return {name: table_of(given, component, name, case.lesson.path.parent) for name, given in named.items()}


def _means_the_same(old: type[Component], new: type[Component], item: str) -> bool:
    """Return whether a template's entry for the old component also means something for the one that takes its place."""
    before, after = old.declarations.get(item), new.declarations.get(item)
    return before is not None and after is not None and before.kind == after.kind and same_dimension(before.unit, after.unit)


def _refuse_unknown_parts(case: Case) -> None:
    parts = case.parts
    inserted = {insertion.part_name for insertion in case.insert}
    entries = [(Place.of(name).part, given, True) for name, given in case.changed.set.items()]
    entries += [(Place.of(name).part, given, False) for name, given in case.changed.wires.items()]
    entries += [(name, given, False) for name, given in case.changed.replace.items()]
    entries += [(name, given, False) for name, given in (*case.changed.every.items(), *case.changed.side.items())]
    for name, given, may_be_effect in entries:
        known = [*parts, *inserted] if may_be_effect else list(parts)
        if name not in known:
            remedy = nearest(name, known) or f"The machine has {', '.join(known)}."
            raise LessonError(f"there is no part '{name}'.", place=given.key_place, remedy=remedy)


class _Written(NamedTuple):
    given: Given
    in_template: bool


def _wires(case: Case, parts: Mapping[str, _Placed]) -> dict[str, Wire]:
    source = case.lesson.machine.source
    written: dict[str, _Written] = {}
    for target, text in case.lesson.machine.settings.wires.items():
        where = ("wires", target)
        written[target] = _Written(Given(text, source.place(where), source.place(where, key=True)), True)
    written |= {target: _Written(given, False) for target, given in case.changed.wires.items()}
    components = {name: placed.component for name, placed in parts.items()}
    wires: dict[str, Wire] = {}
    for target, item in written.items():
        part, name = Place.of(target)
        left_over = item.in_template and part in case.changed.replace and part in parts and name not in components[part].declarations
        if not left_over:
            wires[target] = _wire(target, item.given, components)
    return wires


def _wire(target: str, given: Given, parts: Mapping[str, type[Component]]) -> Wire:
    text = str(given.value)
    fed = declared_item(target, parts, (Input, Parameter), "input", given.key_place)
    if not _SOURCE.match(text):
        return Wire(target, constant=si_value(given, fed.unit))
    source = declared_item(text, parts, (Output, Parameter), "output", given.place)
    if not same_dimension(fed.unit, source.unit):
        guests = [told for told in (_guest_declaration(name, parts) for name in (target, text)) if told]
        remedy = f"{'; '.join(guests)}. Change {'the unit there' if len(guests) == 1 else 'one of them'}." if guests else ""
        raise LessonError(f"wire {target} <- {text}: units differ, {fed.unit} against {source.unit}.", place=given.place, remedy=remedy)
    return Wire(target, text)


def _guest_declaration(name: str, parts: Mapping[str, type[Component]]) -> str:
    """Return where a part from outside the package declares a name, and in which unit; empty for stock parts."""
    part, item = Place.of(name)
    component = parts[part]
    if component.__module__.partition(".")[0] == "lathesim":
        return ""
    unit, place = component.declarations[item].unit, line_of(component, item)
    return f"{component.__name__} declares {item} in {unit}, at {place}"


def _refuse_settings_without_effect(case: Case, wires: Mapping[str, Wire]) -> None:
    for name, given in case.changed.set.items():
        if name in wires:
            feeding = wires[name].source or "a constant"
            fact = f"{name} is fed by {feeding}, so setting it changes nothing."
            raise LessonError(fact, place=given.key_place, remedy="Change the wire under 'wires:' instead.")


def _dividing(period: float, step: float) -> float:
    """Return the nearest step [s] that divides the period if both are rounded, as 0.666667 ms and 0.166667 ms, else the given step."""
    steps = max(1, round(period / step))
    return period / steps if abs(period / step - steps) < _WRITTEN * steps else step


def _path(case: Case, parts: Mapping[str, _Placed]) -> FloatArray | None:
    walkers = [name for name, placed in parts.items() if "path" in placed.component.declared(Table)]
    if not walkers:
        return None
    if case.program is None:
        fact = f"{walkers[0]} walks along a path, and the lesson names no part program."
        raise LessonError(fact, place=str(case.lesson.path), remedy="Write 'program: ...', or give --program.")
    machine = case.lesson.machine
    limits, start = limits_of(machine), start_of(machine, case.lesson)
    return path_of_program(case.program, case.lesson.settings.dialect, limits, start, tools_of(case.lesson)).table


def _with_effect(machinery: Machinery, insertion: Insertion, case: Case, registry: Registry) -> Machinery:
    entry = insertion.entry
    with placed_at(insertion.place_of("effect")):
        effect = registry.effect(entry.effect)
    values: list[tuple[str, Given]] = []
    sources: dict[str, str | float] = {}
    constants: dict[str, Given] = {}
    for key, given in insertion.further.items():
        declared = effect.declarations.get(key)
        if isinstance(declared, Input):
            is_wired = bool(_SOURCE.match(str(given.value)))
            sources[key] = str(given.value) if is_wired else 0.0
            if not is_wired:
                constants[key] = given
        elif isinstance(declared, (Parameter, State)):
            values.append((key, given))
        else:
            raise no_item(entry.effect, effect, key, (Parameter, State, Input), "parameter", given.key_place)
    with placed_at(insertion.place_of("at")):
        placed = insert_effect(machinery, effect, entry.at, name=insertion.part_name, sources=sources, every=entry.every)
    if constants:
        # in the units that the inputs have at this host
        declarations = placed.by_name[insertion.part_name].component.declarations
        sources |= {key: si_value(given, declarations[key].unit) for key, given in constants.items()}
        placed = insert_effect(machinery, effect, entry.at, name=insertion.part_name, sources=sources, every=entry.every)
    # an effect may bring further parts with it: what shows a sensor the far side of a spring
    own = placed.by_name[insertion.part_name]
    values += of_part(insertion.part_name, case.changed.set).items()
    parameters: dict[str, float] = {}
    start: dict[str, float] = {}
    for key, given in values:
        take_value(insertion.part_name, own.component, key, given, parameters, start)
    tables = _tables(case, insertion.part_name, own.component)
    with_values = dataclasses.replace(own, parameters={**own.parameters, **parameters}, start=start, tables={**own.tables, **tables})
    return dataclasses.replace(placed, parts=tuple(with_values if part is own else part for part in placed.parts))


def _record(machinery: Machinery, case: Case, parts: Mapping[str, _Placed]) -> tuple[str, ...] | None:
    """Return the channels to record: the lesson's, else the template's without what a replaced part no longer gives; and all of effects."""
    lesson, machine = case.lesson, case.lesson.machine
    of_lesson = lesson.settings.record is not None
    names = lesson.settings.record if of_lesson else machine.settings.record
    if names is None:
        return None
    source = lesson.source if of_lesson else machine.source
    placed = {part.name: part.component for part in machinery.parts}
    kept = []
    for position, name in enumerate(names):
        part, item = Place.of(name)
        if part in placed and item in placed[part].declared(Output):
            kept.append(name)
        elif of_lesson or part not in case.changed.replace:
            declared_item(name, placed, (Output,), "output", source.place(("record", position)))
    kept += [f"{part}.{item}" for part in placed if part not in parts for item in placed[part].declared(Output)]
    return tuple(dict.fromkeys(kept))
