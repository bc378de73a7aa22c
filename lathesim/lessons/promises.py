"""What a lesson says about its runs beyond the machine: goals, published values, uncertainties and the mapping of recordings.

None of it changes a run, so a slip there would stay unseen; it is held against the machine and the metrics before anything runs.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from lathesim.component import Component, Declaration, Input, Output, Parameter, State
from lathesim.engine.assembly import Assembly, Place
from lathesim.errors import LessonError, nearest
from lathesim.lessons.case import Given
from lathesim.lessons.lesson import Lesson
from lathesim.lessons.part_values import no_item, placed_at, si_value
from lathesim.lessons.schema import DrivingSignal, LessonSettings, RecordedSignal
from lathesim.lessons.yaml_source import Location, Source
from lathesim.plugins import Registry
from lathesim.units import convertible, is_count, si_factor, split_quantity


def check_promises(lesson: Lesson, assembly: Assembly, registry: Registry) -> None:
    """Refuse (:class:`LessonError`) goals and published values of no metric, and names or units that the machine does not have."""
    settings = lesson.settings
    check_goals(settings, lesson.source, registry)
    parts = {part.name: part.component for part in assembly.parts}
    for name, text in settings.uncertain.items():
        if name.startswith("tool_point."):
            continue  # of the cut, not of a part
        declared = _item(lesson, name, parts, (Parameter, State), "parameter", ("uncertain", name))
        with placed_at(lesson.source.place(("uncertain", name))):
            share = split_quantity(text)[1] == "%"
        if not share:
            _value(lesson.source, text, ("uncertain", name), declared.unit)
    _check_recordings(lesson, parts)


def check_goals(settings: LessonSettings, source: Source, registry: Registry) -> None:
    """Refuse (:class:`LessonError`) goals and published values of no metric, or of another unit."""
    for position, goal in enumerate(settings.goals):
        location: Location = ("goals", position)
        unit = _metric_unit(source, goal.metric, (*location, "metric"), registry, key=False)
        for limit in ("at_most", "at_least"):
            if getattr(goal, limit) is not None:
                _value(source, getattr(goal, limit), (*location, limit), unit)
    published: list[tuple[Mapping[str, str], Location]] = [(settings.published, ("published",))]
    published += [(variant.published, ("variants", name, "published")) for name, variant in settings.variants.items()]
    for entries, place in published:
        for metric, text in entries.items():
            _value(source, text, (*place, metric), _metric_unit(source, metric, (*place, metric), registry, key=True))


def _check_recordings(lesson: Lesson, parts: Mapping[str, type[Component]]) -> None:
    recordings = lesson.settings.recordings
    if recordings is None:
        return
    if recordings.time.rate is not None:
        _value(lesson.source, recordings.time.rate, ("recordings", "time", "rate"), "Hz")
    _same_kind(lesson, recordings.time.unit, "s", ("recordings", "time", "unit"))
    for name, signal in recordings.drive.items():
        declared = _item(lesson, name, parts, (Input, Parameter), "input", ("recordings", "drive", name))
        _check_signal(lesson, signal, declared.unit, ("recordings", "drive", name))
    for name, shown in recordings.compare.items():
        declared = _item(lesson, name, parts, (Output,), "output", ("recordings", "compare", name))
        _check_signal(lesson, shown, declared.unit, ("recordings", "compare", name))


def _check_signal(lesson: Lesson, signal: RecordedSignal, unit: str, location: Location) -> None:
    if isinstance(signal, DrivingSignal) and signal.value is not None:
        _value(lesson.source, signal.value, (*location, "value"), unit)
        with placed_at(lesson.source.place((*location, "unit"))):
            si_factor(signal.unit)
        for name, text in (("above", signal.above), ("until_below", signal.until_below)):
            if text is not None:
                _value(lesson.source, text, (*location, name), signal.unit)
        if signal.lasting is not None:
            _value(lesson.source, signal.lasting, (*location, "lasting"), "s")
        return
    if not is_count(signal.unit):  # their size is looked for when the columns are mapped
        _same_kind(lesson, signal.unit, unit, (*location, "unit"))
    if signal.resolution is not None:
        _value(lesson.source, signal.resolution, (*location, "resolution"), unit)


def _same_kind(lesson: Lesson, given: str, unit: str, location: Location) -> None:
    place = lesson.source.place(location)
    with placed_at(place):
        same = convertible(given, unit)
    if not same:
        raise LessonError(f"the column is given in {given}, and {unit} is wanted.", place=place, remedy=f"Use a unit like {unit}.")


def _metric_unit(source: Source, name: str, location: Location, registry: Registry, *, key: bool) -> str:
    metric: Any = registry.metrics.get(name)
    if metric is None:
        remedy = nearest(name, registry.metrics) or f"There are {', '.join(registry.metrics)}."
        raise LessonError(f"there is no metric '{name}'.", place=source.place(location, key=key), remedy=remedy)
    return str(metric.unit)


def _value(source: Source, text: str, location: Location, unit: str) -> float:
    place = source.place(location)
    return si_value(Given(text, place, place), unit)


def _item(
    lesson: Lesson, name: str, parts: Mapping[str, type[Component]], kinds: tuple[type[Declaration], ...], word: str, location: Location
) -> Declaration:
    part, item = Place.of(name)
    place = lesson.source.place(location, key=True)
    if part not in parts:
        raise LessonError(f"there is no part '{part}'.", place=place, remedy=nearest(part, parts) or f"The machine has {', '.join(parts)}.")
    declared = parts[part].declarations.get(item)
    if not isinstance(declared, kinds):
        raise no_item(part, parts[part], item, kinds, word, place)
    return declared
