"""Where results go that are given no other place: a folder named after what was read, so that no input replaces what another one left."""

from __future__ import annotations

from pathlib import Path

from lathesim.errors import LessonError
from lathesim.lessons.lesson import Lesson
from lathesim.shipped import shipped_folder

RUNS_FOLDER = Path("lathesim_runs")


def results_folder(lesson: Lesson, *read: Path | None, variant: str | None = None) -> Path:
    """Return ``lathesim_runs/LESSON`` for a lesson, with a folder more for its variant and for each further file that was ``read``.

    A lesson of ``lesson_configs/`` has its name, another one the way to its file: ``lathesim_runs/case_1/lesson``. A further file has its
    name where it lies beside the lesson, else its way too.
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
    """Refuse (:class:`LessonError`) a folder for results whose ``lesson.yaml`` would replace the lesson that was read."""
    if folder is not None and (folder / "lesson.yaml").resolve() == lesson.path.resolve():
        fact = "the lesson that was read stands here, and the one that is to be written would replace it."
        raise LessonError(fact, place=str(folder / "lesson.yaml"), remedy="Choose another folder with --out.")


def _way(path: Path) -> Path:
    """Return the way to a file from the current folder, or from the root for one outside; from the folder above where a name alone would
    be that of a lesson or of a file in another folder."""
    here = Path.cwd()
    name = path.stem if path.suffix == ".yaml" else path.name.replace(".", "_")
    if here in path.parents:
        way = path.parent.relative_to(here) / name
        known = {*Path("lesson_configs").glob("*.yaml"), *shipped_folder("lesson_configs").glob("*.yaml")}
        if len(way.parts) == 1 and (path.suffix != ".yaml" or name in {lesson.stem for lesson in known}):
            return Path(here.name) / name
        return way.relative_to(RUNS_FOLDER) if RUNS_FOLDER in way.parents else way
    return path.parent.relative_to(path.anchor) / name
