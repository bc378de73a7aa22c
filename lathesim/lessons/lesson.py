"""A lesson and the machine template it names, read from their files; the lessons there are, their former names and their units."""

from __future__ import annotations

import csv
import functools
import typing
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from lathesim.errors import LessonError, ProgramError, nearest
from lathesim.lessons.schema import CourseUnit, LessonSettings, MachineSettings
from lathesim.lessons.validation import validated
from lathesim.lessons.yaml_source import YamlFile, read_source, source_of
from lathesim.shipped import shipped_files, shipped_folder

if typing.TYPE_CHECKING:
    from lathesim.record import Record


@dataclass(frozen=True)
class MachineTemplate:
    """A machine template as it stands in its file."""

    name: str
    path: Path
    settings: MachineSettings
    source: YamlFile


@dataclass(frozen=True)
class Lesson:
    """A lesson as it stands in its file, with the machine it names."""

    name: str
    path: Path
    settings: LessonSettings
    source: YamlFile
    machine: MachineTemplate

    @property
    def title(self) -> str:
        """The title in the file's key ``lesson``."""
        return self.settings.lesson

    @property
    def text(self) -> str:
        """The YAML text of the file."""
        return self.source.text

    @property
    def variants(self) -> tuple[str, ...]:
        """The names of its variants, in the order of the file."""
        return tuple(self.settings.variants)

    def run(
        self,
        variant: str | None = None,
        set: Mapping[str, str | float] | None = None,
        *,
        program: str | Path | None = None,
        seed: int | None = None,
        engine: str | None = None,
    ) -> Record:
        """Return the record of one run; nothing is written.

        ``variant`` is one of ``variants``. ``set`` changes values of parts: ``{"x_controller.proportional": "0.3 V/mm"}``. ``program``,
        ``seed`` and ``engine`` ("compiled" or "plain") take the place of the lesson's. Plug-ins of the workspace take part.
        Raises :class:`LessonError` where a name or value does not fit, and :class:`lathesim.errors.SimulationError` where the run breaks
        down, with the data up to then in its ``record``.
        """
        from lathesim.lessons.simulate import simulate
        from lathesim.workspace import load_with_workspace

        file = None if program is None else find_program(program, self.path.parent)
        if program is not None and file is None:
            raise ProgramError(f"there is no part program '{program}'.")
        return simulate(self, load_with_workspace(), variant, set, program=file, engine=engine, seed=seed)

    def is_right(self, number: int, answer: str) -> bool:
        """Return whether an answer to a question, counted from 1, is right: one of its choices, or a number with its unit.

        Raises :class:`LessonError` where there is no such question, and where the text cannot be an answer to it.
        """
        from lathesim.lessons.questions import is_right

        asked = self.settings.questions
        if not 1 <= number <= len(asked):
            raise LessonError(f"there is no question {number}.", place=self.name, remedy=f"The lesson has {len(asked)}.")
        return is_right(asked[number - 1], answer)


def load_lesson(path_or_name: str | Path) -> Lesson:
    """Return the lesson in a file, or the shipped lesson of that name (``01_contour_error``), with its machine template."""
    path = find_lesson(path_or_name)
    return _lesson_of(read_source(path), path)


def lesson_from_text(text: str, path: Path) -> Lesson:
    """Return the lesson that ``text`` would be if it stood in the file ``path``; raises what :func:`load_lesson` raises."""
    return _lesson_of(source_of(text, str(path)), path)


def _lesson_of(source: YamlFile, path: Path) -> Lesson:
    if "machine" in source.data and "lesson" not in source.data and "parts" in source.data:
        raise LessonError(
            "this is a machine template, not a lesson.", place=str(path), remedy="Write a lesson with the key 'machine' naming it."
        )
    settings = validated(LessonSettings, source)
    return Lesson(path.stem, path, settings, source, _machine_of(settings.machine, path, source))


def load_machine(path: Path) -> MachineTemplate:
    """Return the machine template in a file."""
    source = read_source(path, what="machine template")
    return MachineTemplate(path.stem, path, validated(MachineSettings, source), source)


def find_lesson(path_or_name: str | Path) -> Path:
    """Return the file of a lesson: a path, or the name of one in ``./lesson_configs`` or of a shipped one, in this order.

    A former name of a shipped lesson is as good as its present one, and so is its number alone (``01``).
    """
    given = Path(path_or_name)
    if given.is_file():
        return given
    known = {path.stem: path for path in (*shipped_files("lesson_configs", "*.yaml"), *sorted(Path("lesson_configs").glob("*.y*ml")))}
    name = given.stem if given.suffix in (".yaml", ".yml") else given.name
    if str(given.parent) in (".", "lesson_configs"):
        numbered = [stem for stem in known if name.isdigit() and stem.startswith(f"{name}_")]
        for found in (name, present_name(name), *(numbered if len(numbered) == 1 else ())):
            if found in known:
                return known[found]
    if given.suffix in (".yaml", ".yml") and str(given.parent) != ".":
        there = {path.name for path in given.parent.glob("*.y*ml")} if given.parent.is_dir() else set()
        remedy = nearest(given.name, there) or ("" if given.parent.is_dir() else f"There is no folder '{given.parent}' either.")
        raise LessonError(f"there is no file '{path_or_name}'.", remedy=remedy or "Check the path.")
    raise LessonError(f"there is no lesson '{path_or_name}'.", remedy=nearest(name, known) or "See 'lathesim lessons'.")


def lesson_files(folder: Path | None = None) -> Iterator[Path]:
    """Return the lesson files in ``./lesson_configs`` and those that came with lathesim, or those in a folder; each name once."""
    seen: set[str] = set()
    for place in [folder] if folder is not None else [Path("lesson_configs"), shipped_folder("lesson_configs")]:
        for path in sorted([*place.glob("*.yaml"), *place.glob("*.yml")]):
            if path.name not in seen:
                seen.add(path.name)
                yield path


@functools.cache
def former_names() -> dict[str, str]:
    """Return the former names of shipped lessons with their present names."""
    with (shipped_folder("lesson_configs") / "tables" / "former_names.csv").open(encoding="utf-8", newline="") as file:
        return {row["former"]: row["present"] for row in csv.DictReader(file)}


def present_name(name: str) -> str:
    """Return the present name of a lesson that is called by its present or a former one."""
    return former_names().get(name, name)


def by_unit(lessons: Iterable[Lesson]) -> dict[str, list[Lesson]]:
    """Return lessons by the units of the course, in its order; those without a unit come last, under an empty name."""
    listed = list(lessons)
    units = {unit: [lesson for lesson in listed if (lesson.settings.unit or "") == unit] for unit in (*typing.get_args(CourseUnit), "")}
    return {unit: found for unit, found in units.items() if found}


def find_program(named: str | Path, beside: Path) -> Path | None:
    """Return the file of a part program: relative to the folder ``beside``, to where one stands, or the shipped one of that name."""
    given = Path(named)
    for path in (beside / given, given, shipped_folder("part_programs") / given.name):
        if path.is_file():
            return path
    return None


def _machine_of(named: str, lesson: Path, source: YamlFile) -> MachineTemplate:
    given = Path(named)
    if given.suffix in (".yaml", ".yml"):
        candidates = [lesson.parent / given, given]
    else:
        folders = [lesson.parent / "machines", lesson.parent, shipped_folder("lesson_configs") / "machines"]
        candidates = [folder / f"{named}.yaml" for folder in folders]
    for path in candidates:
        if path.is_file():
            return load_machine(path)
    known = [path.stem for folder in {path.parent for path in candidates} for path in folder.glob("*.yaml")]
    remedy = nearest(named, known) or "Write the name of a file in machines/, or its path."
    raise LessonError(f"there is no machine template '{named}'.", place=source.place(("machine",)), remedy=remedy)


RUNS_FOLDER = Path("lathesim_runs")


def results_folder(lesson: Lesson, *read: Path | None, variant: str | None = None) -> Path:
    """Return ``lathesim_runs/LESSON`` for a lesson, with one more folder for its variant and for each further file that was ``read``.

    For a lesson of ``lesson_configs/``, LESSON is its name; for others it is the path to the file: ``lathesim_runs/case_1/lesson``. A file
    beside the lesson adds its name, others their path.
    """
    path = lesson.path.resolve()
    known = path.parent in (Path("lesson_configs").resolve(), shipped_folder("lesson_configs").resolve())
    folder = RUNS_FOLDER / (lesson.name if known else _way(path))
    if variant is not None:
        folder /= variant
    for file in read:
        if file is not None:
            full = file.resolve()
            folder /= full.name.replace(".", "_") if full.parent == path.parent else _way(full)
    return folder


def keep_read_lesson(lesson: Lesson, folder: Path | None) -> None:
    """Raise :class:`LessonError` if the ``lesson.yaml`` of a results folder would replace the lesson that was read."""
    if folder is not None and (folder / "lesson.yaml").resolve() == lesson.path.resolve():
        fact = "the new lesson.yaml would replace the lesson that was read."
        raise LessonError(fact, place=str(folder / "lesson.yaml"), remedy="Choose another folder with --out.")


def _way(path: Path) -> Path:
    """Return the path to a file from the current folder, or from the root for a file outside. It starts one folder higher if the bare name
    could be a shipped lesson or a file of another folder."""
    here = Path.cwd()
    name = path.stem if path.suffix == ".yaml" else path.name.replace(".", "_")
    if here in path.parents:
        way = path.parent.relative_to(here) / name
        known = {*Path("lesson_configs").glob("*.yaml"), *shipped_folder("lesson_configs").glob("*.yaml")}
        if len(way.parts) == 1 and (path.suffix != ".yaml" or name in {lesson.stem for lesson in known}):
            return Path(here.name) / name
        return way.relative_to(RUNS_FOLDER) if RUNS_FOLDER in way.parents else way
    return path.parent.relative_to(path.anchor) / name
