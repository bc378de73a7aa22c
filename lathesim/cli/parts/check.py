"""``lathesim check FILE...``: lessons, machine templates, part programs and plug-ins; of these only plug-ins are run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from lathesim.cli.options import open_registry, plugins_option

if TYPE_CHECKING:
    from lathesim.plugins import Registry


@click.command()
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--dialect", default="auto", show_default=True, help="Dialect of the part programs.")
@plugins_option
def check(files: tuple[Path, ...], dialect: str, plugin_folders: tuple[Path, ...]) -> int:
    """Check lessons and machine templates (.yaml), plug-ins (.py, folders) and part programs (any other ending).

    One line for each file: its kind, or its fault; under it a line for each part that a batch of runs cannot compute in vectors, with the
    line of its law that prevents this. Exits with 1 if something is wrong. A plug-in is code, and checking it runs the file with all your
    rights: read the plug-ins of others first.
    """
    from lathesim.errors import LatheSimError

    registry = open_registry(plugin_folders)
    faults = 0
    for path in files:
        try:
            found = _checked(path, dialect, registry)
        except LatheSimError as error:
            click.echo(str(error), err=True)
            faults += 1
        else:
            click.echo(f"{path}: {found}")
    return 1 if faults else 0


def _checked(path: Path, dialect: str, registry: Registry) -> str:
    """Return in words what a file holds, or raise what is wrong with it."""
    from lathesim.errors import LatheSimError

    if path.suffix in (".yaml", ".yml"):
        return _checked_yaml(path, registry)
    if path.suffix == ".py" or path.is_dir():
        from lathesim.manual.plugin_list import checked_plugin

        if path.exists():
            click.echo(f"{path}: a plug-in is code and is run now.", err=True)
        return checked_plugin(path)
    if not path.exists():
        raise LatheSimError("there is no such file.", place=str(path))
    return _checked_program(path, dialect)


def _checked_program(path: Path, dialect: str) -> str:
    from lathesim.program.checks import checked
    from lathesim.program.loading import load_program
    from lathesim.program.path import lay_path

    program = load_program(path, dialect)
    found = f"a part program with {lay_path(program).segments} path segments, read in the dialect '{program.dialect}'."
    odd = sorted([*program.warnings, *checked(program)], key=lambda warned: warned.line)
    return "\n".join([found, *(f"{path}:{warned.line}: {warned.sentence}" for warned in odd)])


def _checked_yaml(path: Path, registry: Registry) -> str:
    from lathesim.lessons.lesson import load_lesson, load_machine
    from lathesim.lessons.questions import seal
    from lathesim.lessons.simulate import check_lesson, check_machine
    from lathesim.lessons.yaml_source import read_source
    from lathesim.manual.plugin_list import without_vectors

    if "lesson" not in read_source(path).data and "parts" in read_source(path).data:
        machine = load_machine(path)
        parts = check_machine(machine, registry).parts
        found = f"a machine template with {len(machine.settings.parts)} parts."
        return "\n".join([found, *without_vectors({name: part.component for name, part in parts.items()})])
    lesson = load_lesson(path)
    components = check_lesson(lesson, registry)
    if lesson.settings.tool_point is not None:
        from lathesim.stability.lesson_settings import cut_of

        cut_of(lesson)
    variants = f", {len(lesson.variants)} variants" if lesson.variants else ""
    clear = [question for question in lesson.settings.questions if question.answer is not None]
    seals = [f"to seal the answer to '{item.ask}', write instead of it: sealed: {seal(item, item.answer or '')}" for item in clear]
    return "\n".join([f"a lesson on the machine {lesson.machine.name}{variants}.", *without_vectors(components), *seals])
