"""A lesson to a Record: assembled, wired and run, with all that is needed to run it again written into the Record."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lathesim.analysis.failed_run import COMMANDS
from lathesim.component import Component, Parameter, Table
from lathesim.engine.assembly import Part, Place
from lathesim.engine.wiring import Plan, wire
from lathesim.errors import LessonError, SimulationError
from lathesim.lessons.alarms import Alarm, AlarmWatch, alarms_of, commands_of_loops
from lathesim.lessons.assemble import assemble_case
from lathesim.lessons.case import Case, Given, case_of
from lathesim.lessons.grading import check_promises
from lathesim.lessons.insertion import Machinery
from lathesim.lessons.lesson import Lesson, MachineTemplate, find_lesson
from lathesim.lessons.part_values import placed_at, seconds
from lathesim.lessons.program_path import expected_time, raw_stock
from lathesim.lessons.schema import LessonSettings
from lathesim.plugins import Registry

if TYPE_CHECKING:
    from lathesim.engine.run import Attendance, Hints
    from lathesim.record import Record


@dataclass(frozen=True)
class Prepared:
    """A case of a lesson, ready to run: any number of times, with other overrides and seeds.

    ``recording`` names the recording that drives it, if any; ``alarms`` stop a run whose values leave their limits.
    """

    case: Case
    machinery: Machinery
    plan: Plan
    recording: str = ""
    alarms: tuple[Alarm, ...] = ()

    @property
    def duration(self) -> float | None:
        """How long the run lasts [s]; none where an output of the machine ends it."""
        return None if self.case.duration is None else seconds(self.case.duration)

    @property
    def breaks_down(self) -> bool:
        """Whether the variant is there to show how a machine breaks down."""
        return self.case.variant is not None and self.case.lesson.settings.variants[self.case.variant].breaks_down

    @property
    def expected_time(self) -> float | None:
        """About how long the run lasts [s], for a progress bar; none where nothing tells."""
        if self.duration is not None:
            return self.duration
        for part in self.machinery.parts:
            if "path" in part.tables:
                declared = part.component.declarations.get("rapid_speed")
                default = declared.default if isinstance(declared, Parameter) else 0.1
                return expected_time(part.tables["path"], part.parameters.get("rapid_speed", default))
        return None

    @property
    def name(self) -> str:
        """The name of the lesson, with that of the variant."""
        return f"{self.case.lesson.name}_{self.case.variant}" if self.case.variant else self.case.lesson.name


def prepare(
    lesson: Lesson,
    registry: Registry,
    variant: str | None = None,
    overrides: Mapping[str, str | float] | None = None,
    *,
    program: Path | None = None,
) -> Prepared:
    """Return a lesson's case assembled and wired.

    Refused is what :func:`lathesim.lessons.assemble.assemble` and :func:`lathesim.lessons.grading.check_promises` refuse, and what
    cannot be wired (:class:`WiringError`).
    """
    case = case_of(lesson, variant, overrides, program)
    machinery = assemble_case(case, registry)
    check_promises(lesson, machinery, registry)
    return Prepared(case, machinery, wire(machinery), alarms=alarms_of(case, machinery))


def check_machine(machine: MachineTemplate, registry: Registry) -> Plan:
    """Wire a machine template as it stands and give the plan; raises what :func:`prepare` raises.

    A path of one short segment and the example tables of its components stand in for what only a lesson gives.
    """
    from lathesim.path_columns import FEED, LENGTH, PATH_COLUMNS

    settings = LessonSettings(lesson=machine.settings.machine, machine=machine.name)
    lesson = Lesson(machine.name, machine.path, settings, machine.source, machine)
    path = np.zeros((1, len(PATH_COLUMNS)))
    path[0, [LENGTH, FEED]] = 0.001
    case = case_of(lesson)
    machinery = assemble_case(case, registry, path)
    alarms_of(case, machinery)
    return wire(dataclasses.replace(machinery, parts=tuple(_with_example_tables(part) for part in machinery.parts)))


def _with_example_tables(part: Part) -> Part:
    """Return a part with the example of each table that it declares and that nothing gives."""
    examples = getattr(part.component, "example_tables", {})
    missing = [name for name in part.component.declared(Table) if name not in part.tables and name in examples]
    return dataclasses.replace(part, tables={**part.tables, **{name: np.array(examples[name], dtype=float) for name in missing}})


def simulate(
    lesson: Lesson,
    registry: Registry,
    variant: str | None = None,
    overrides: Mapping[str, str | float] | None = None,
    *,
    program: Path | None = None,
    engine: str | None = None,
    seed: int | None = None,
) -> Record:
    """Run a lesson's case and give its Record; ``engine`` and ``seed`` take the place of the lesson's.

    Raises what :func:`prepare` raises, :class:`LessonError` where only a recording drives the lesson, and :class:`SimulationError` with the
    data up to then in its ``record``.
    """
    return run_prepared(prepare(lesson, registry, variant, overrides, program=program), engine=engine, seed=seed)


def run_prepared(
    prepared: Prepared,
    *,
    engine: str | None = None,
    seed: int | None = None,
    hints: Hints | None = None,
    attended: Attendance | None = None,
) -> Record:
    """Run a prepared case, see :func:`simulate`; the alarms of its lesson guard it."""
    from lathesim.engine.run import Attendance, Hints, run

    settings = prepared.case.lesson.settings
    driven = list(settings.recordings.drive) if settings.recordings is not None else []
    if prepared.duration is None and not prepared.plan.assembly.finish and driven:
        fact = f"a recording drives this lesson ({', '.join(driven)}), and none is given."
        remedy = "Name one, as in 'lathesim run LESSON --recording FILE'; without one it needs a 'duration:'."
        raise LessonError(fact, place=prepared.case.lesson.name, remedy=remedy)
    guard = AlarmWatch(prepared.plan, prepared.alarms) if prepared.alarms else None
    try:
        record = run(
            prepared.plan,
            duration=prepared.duration,
            seed=prepared.case.seed if seed is None else seed,
            engine=engine or settings.engine,
            hints=dataclasses.replace(hints or Hints(), expected_time=prepared.expected_time),
            attended=dataclasses.replace(attended or Attendance(), guard=guard),
        )
    except SimulationError as error:
        if error.record is not None:
            error.record = _described(error.record, prepared)  # type: ignore[arg-type]
        raise
    return _described(record, prepared)


def _described(record: Record, prepared: Prepared) -> Record:
    """Return the record with the lesson it came from."""
    case = prepared.case
    changed = {name: str(given.value) for name, given in {**case.changed.set, **case.changed.wires}.items() if given.of_command_line}
    meta = {
        **record.meta,
        "lesson": case.lesson.text,
        "lesson_name": case.lesson.name,
        "variant": case.variant or "",
        "machine": case.lesson.machine.name,
        "program": str(case.program or ""),
        COMMANDS: " ".join(commands_of_loops(prepared.plan)),
        "overrides": ", ".join(f"{name}={value}" for name, value in changed.items()),
    }
    if prepared.recording:
        meta["recording"] = prepared.recording
    stock = raw_stock(prepared.plan)
    if stock is not None:
        meta["stock"] = stock.as_text()
    return dataclasses.replace(record, meta=meta)


def check_lesson(lesson: Lesson, registry: Registry) -> dict[str, type[Component]]:
    """Return the parts of all cases by name.

    Raises :class:`LessonError` if a case cannot be prepared, if an overridden entry of the lesson itself is faulty, or if a name in
    ``after`` leads to no lesson.
    """
    for position, name in enumerate(lesson.settings.after):
        if not (lesson.path.parent / f"{name}.yaml").is_file():
            with placed_at(lesson.source.place(("after", position))):
                find_lesson(name)
    itself = case_of(lesson)
    prepared = [prepare(lesson, registry, variant) for variant in lesson.variants or (None,)]
    for case in (itself, *(item.case for item in prepared)):
        if case.duration is not None:
            seconds(case.duration)
    for key, name in _always_overridden(lesson):
        given: Given = getattr(itself.changed, key)[name]
        case = case_of(lesson, _without_change(lesson, {Place.of(name).part, Place.of(str(given.value)).part}))
        changed: dict[str, Any] = {key: {**getattr(case.changed, key), name: given}}
        try:
            assemble_case(dataclasses.replace(case, changed=dataclasses.replace(case.changed, **changed)), registry)
        except LessonError as error:
            if error.place in (given.place, given.key_place):
                raise
    return {part.name: part.component for item in prepared for part in item.machinery.parts}


def _always_overridden(lesson: Lesson) -> Iterator[tuple[str, str]]:
    """Yield key and name of the entries of a lesson that all its variants override."""
    variants = lesson.settings.variants.values()
    for key in ("set", "wires", "tables"):
        for name in getattr(lesson.settings, key):
            if variants and all(name in getattr(variant, key) for variant in variants):
                yield key, name


def _without_change(lesson: Lesson, parts: set[str]) -> str | None:
    """Return the name of a variant that leaves ``parts`` unchanged, or none if every variant changes one."""
    return next((name for name, variant in lesson.settings.variants.items() if not parts & {*variant.replace, *variant.units}), None)
