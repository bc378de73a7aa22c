"""The default folder of results, named after the files that were read, so that no input replaces the results of another."""

from __future__ import annotations

from pathlib import Path

from lathesim.errors import LessonError
from lathesim.lessons.lesson import Lesson
from lathesim.shipped import shipped_folder

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
