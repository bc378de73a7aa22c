"""One case of a lesson: the lesson with one variant and what was changed from outside laid over it, each entry with its place.

One level of change on the machine template: lesson, then variant, then command line; the later entry of a name counts.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path

from lathesim.errors import LessonError, nearest
from lathesim.lessons.insertion import effect_part_name
from lathesim.lessons.lesson import Lesson, find_program
from lathesim.lessons.schema import Changes, InsertEntry, PartEntry
from lathesim.lessons.yaml_source import Location, YamlFile

_NUMBER = tuple("+-.0123456789")
"""Signs with which a constant begins, and the name of an output does not."""


@dataclass(frozen=True)
class Given:
    """A value as it was written (or an SI number), with the places of its value and of its key."""

    value: str | float
    place: str
    key_place: str
    of_command_line: bool = False


@dataclass(frozen=True)
class Insertion:
    """An ``insert:`` entry: the name its part gets, its further keys, and the places of all of them."""

    entry: InsertEntry
    part_name: str
    further: Mapping[str, Given]
    places: Mapping[str, str]

    def place_of(self, key: str) -> str:
        """Return the place of the value of a key."""
        return self.places[key]


@dataclass(frozen=True)
class PartOfCase:
    """A part as the machine template, or an ``add:`` of the lesson, has it, and where that stands."""

    entry: PartEntry
    source: YamlFile
    location: Location


@dataclass(frozen=True)
class ChangedEntries:
    """What the lesson, its variant and the command line change of the machine template, by the keys of a lesson; the last one counts."""

    set: Mapping[str, Given]
    replace: Mapping[str, Given]
    wires: Mapping[str, Given]
    every: Mapping[str, Given]
    tables: Mapping[str, Given]
    alarms: Mapping[str, Given]
    side: Mapping[str, Given]


@dataclass(frozen=True)
class Case:
    """What one run of a lesson is made of."""

    lesson: Lesson
    variant: str | None
    program: Path | None
    seed: int
    duration: Given | None
    sample_period: Given
    step: Given
    parts: Mapping[str, PartOfCase]
    units: Mapping[str, Mapping[str, str]]
    changed: ChangedEntries
    insert: tuple[Insertion, ...]


def case_of(
    lesson: Lesson, variant: str | None = None, overrides: Mapping[str, str | float] | None = None, program: Path | None = None
) -> Case:
    """Return the case of a lesson; ``overrides`` maps ``part.parameter`` or ``part.state`` to a quantity (text, or a number in SI).

    An override of an input that has a constant value changes that constant.
    """
    layers: list[tuple[Changes, Location]] = [(lesson.settings, ())]
    if variant is not None:
        layers.append((variant_changes(lesson, variant), ("variants", variant)))
    changed: dict[str, dict[str, Given]] = {item.name: {} for item in fields(ChangedEntries)}
    parts = {name: PartOfCase(entry, lesson.machine.source, ("parts", name)) for name, entry in lesson.machine.settings.parts.items()}
    units: dict[str, dict[str, str]] = {}
    inserted: list[Insertion] = []
    seed = lesson.settings.seed
    duration: Given | None = None
    for changes, location in layers:
        for key, entries in changed.items():
            written = {name: str(count) for name, count in changes.every.items()} if key == "every" else getattr(changes, key)
            entries |= {name: _given(lesson, value, (*location, key, name)) for name, value in written.items()}
        parts |= _added(lesson, changes, location, parts)
        units |= _units(lesson, changes, location, parts)
        inserted += [_insertion(lesson, entry, (*location, "insert", place)) for place, entry in enumerate(changes.insert)]
        seed = changes.seed if changes.seed is not None else seed
        duration = _given(lesson, changes.duration, (*location, "duration")) if changes.duration is not None else duration
    for name, value in (overrides or {}).items():
        wired = changed["wires"][name].value if name in changed["wires"] else lesson.machine.settings.wires.get(name, "")
        key = "wires" if isinstance(value, str) and str(wired)[:1] in _NUMBER else "set"
        changed[key][name] = Given(value, f"--set {name}={value}", f"--set {name}={value}", of_command_line=True)
    return Case(
        lesson=lesson,
        variant=variant,
        program=program or _program(lesson, layers),
        seed=seed,
        duration=duration,
        sample_period=_period(lesson, "sample_period"),
        step=_period(lesson, "step"),
        parts=parts,
        units=units,
        changed=ChangedEntries(**changed),
        insert=tuple(inserted),
    )


def variant_changes(lesson: Lesson, name: str) -> Changes:
    """Return what a variant of a lesson changes; raises :class:`LessonError` where the lesson has no such variant."""
    variants = lesson.settings.variants
    if name in variants:
        return variants[name]
    if not variants:
        raise LessonError(f"the lesson has no variants, so there is no '{name}'.", place=str(lesson.path), remedy="Leave --variant out.")
    raise LessonError(f"the lesson has no variant '{name}'.", place=str(lesson.path), remedy=f"It has {', '.join(variants)}.")


def _added(lesson: Lesson, changes: Changes, location: Location, parts: Mapping[str, PartOfCase]) -> dict[str, PartOfCase]:
    for name in changes.add:
        if name in parts:
            place = lesson.source.place((*location, "add", name), key=True)
            raise LessonError(f"there is a part '{name}' already.", place=place, remedy="Use 'replace:', or another name.")
    return {name: PartOfCase(entry, lesson.source, (*location, "add", name)) for name, entry in changes.add.items()}


def _units(lesson: Lesson, changes: Changes, location: Location, parts: Mapping[str, PartOfCase]) -> dict[str, dict[str, str]]:
    for name in changes.units:
        if name not in parts:
            place = lesson.source.place((*location, "units", name), key=True)
            raise LessonError(f"there is no part '{name}'.", place=place, remedy=nearest(name, parts))
    return changes.units


def _given(lesson: Lesson, value: str, location: Location) -> Given:
    return Given(value, lesson.source.place(location), lesson.source.place(location, key=True))


def _insertion(lesson: Lesson, entry: InsertEntry, location: Location) -> Insertion:
    further = {name: _given(lesson, value, (*location, name)) for name, value in (entry.__pydantic_extra__ or {}).items()}
    places = {key: lesson.source.place((*location, key)) for key in ("at", "name")}
    written = next((key for key in ("effect", "remedy") if (*location, key) in lesson.source.values), "effect")
    places["effect"] = lesson.source.place((*location, written))
    return Insertion(entry, entry.name or effect_part_name(entry.at, entry.effect), further, places)


def _period(lesson: Lesson, key: str) -> Given:
    given = getattr(lesson.settings, key)
    if given is not None:
        return _given(lesson, given, (key,))
    source = lesson.machine.source
    return Given(getattr(lesson.machine.settings, key), source.place((key,)), source.place((key,), key=True))


def _program(lesson: Lesson, layers: list[tuple[Changes, Location]]) -> Path | None:
    found = None
    for changes, location in layers:
        if changes.program is None:
            continue
        found = find_program(changes.program, lesson.path.parent)
        if found is None:
            place = lesson.source.place((*location, "program"))
            known = [path.name for path in (lesson.path.parent / Path(changes.program).parent).glob("*.nc")]
            remedy = nearest(Path(changes.program).name, known) or "The path is taken from the lesson's folder."
            raise LessonError(f"there is no part program '{changes.program}'.", place=place, remedy=remedy)
    return found
