"""``lathesim init`` and ``check``: copies of all that ships, to work on, and whether own lessons, programs and plug-ins are in order."""

from __future__ import annotations

import shutil
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lathesim.cli.options import open_registry, plugins_option
from lathesim.errors import LatheSimError
from lathesim.whole_file import make_folder, write_new

if TYPE_CHECKING:
    from lathesim.plugins import Registry


@click.command()
@click.argument("folder", type=click.Path(path_type=Path, file_okay=False))
@click.option("--teacher", is_flag=True, help="Copy the solutions of the lessons too.")
@click.option("--yes", is_flag=True, help="Accept the plug-ins that FOLDER already has, without a question.")
def init(folder: Path, teacher: bool, yes: bool) -> None:
    """Copy the lessons, part programs and sample plug-ins to FOLDER, to work on. Nothing that is there is overwritten.

    Every command in FOLDER loads the plug-ins there, which are code. So ``init`` asks first if FOLDER has plug-ins of its own.
    """
    from lathesim.shipped import FOLDERS, SOLUTIONS, shipped_folder
    from lathesim.workspace import mark_workspace

    if not yes:
        _ask_for_plugins(folder)
    copied = kept = 0
    for name in FOLDERS:
        origin = shipped_folder(name)
        for path in sorted(origin.rglob("*")):
            if not path.is_file() or "__pycache__" in path.parts or (not teacher and any(path.match(name) for name in SOLUTIONS)):
                continue
            target = folder / name / path.relative_to(origin)
            make_folder(target.parent)
            try:
                write_new((target,), partial(shutil.copyfile, path))
            except FileExistsError:
                kept += 1
            else:
                copied += 1
    make_folder(folder)
    mark_workspace(folder)
    click.echo(f"{folder}: {copied} files copied" + (f", {kept} that were there left as they are." if kept else "."))
    click.echo(f"Next: cd {folder} && lathesim run lesson_configs/01_contour_error.yaml")


def _ask_for_plugins(folder: Path) -> None:
    """Ask whether the commands in a folder shall load plug-ins that are not shipped with lathesim.

    Raises :class:`LatheSimError` without a terminal, and :class:`click.Abort` if the answer is no.
    """
    import sys

    from lathesim.plugins import plugin_files
    from lathesim.shipped import shipped_folder
    from lathesim.workspace import workspace_plugins

    shipped = {path.name: path.read_bytes() for path in shipped_folder("plugins").glob("*.py")}
    found = plugin_files(folder / "plugins")
    own = [path.name for path in found if not path.name.startswith("_") and path.read_bytes() != shipped.get(path.name)]
    if not own or workspace_plugins(folder) is not None:
        return
    fact = f"{folder / 'plugins'} has plug-ins of its own ({', '.join(own[:5])}), and every command in {folder} will run them from now on."
    if not sys.stdin.isatty():
        raise LatheSimError(fact, remedy="Read them, then write --yes.")
    click.confirm(f"{fact} Is that wanted?", abort=True)


@click.command()
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--dialect", default="auto", show_default=True, help="Dialect of the part programs.")
@plugins_option
def check(files: tuple[Path, ...], dialect: str, plugin_folders: tuple[Path, ...]) -> int:
    """Check lessons and machine templates (.yaml), plug-ins (.py, .fmu, folders) and part programs (any other ending).

    Each file has one line with its kind or its fault. A part of a plug-in that a batch of runs cannot compute in vectors has a further
    line. It names the line of the law that prevents this. Exits with 1 if something is wrong. A plug-in is code, and checking it runs the
    file with all your rights: read the plug-ins of others first.
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
    if path.suffix in (".py", ".fmu") or path.is_dir():
        from lathesim.manual.component_page import checked_plugin

        if path.exists() and path.suffix != ".fmu":
            click.echo(f"{path}: a plug-in is code and is run now.", err=True)
        return checked_plugin(path)
    if not path.exists():
        raise LatheSimError("there is no such file.", place=str(path))
    return _checked_program(path, dialect)


def _checked_program(path: Path, dialect: str) -> str:
    from lathesim.program.path import lay_path
    from lathesim.program.program_checks import checked
    from lathesim.program.program_file import load_program

    program = load_program(path, dialect)
    found = f"a part program with {lay_path(program).segments} path segments, read in the dialect '{program.dialect}'."
    odd = sorted([*program.warnings, *checked(program)], key=lambda warned: warned.line)
    return "\n".join([found, *(f"{path}:{warned.line}: {warned.sentence}" for warned in odd)])


def _checked_yaml(path: Path, registry: Registry) -> str:
    from lathesim.lessons.lesson import load_lesson, load_machine
    from lathesim.lessons.questions import seal
    from lathesim.lessons.simulate import check_lesson, check_machine
    from lathesim.lessons.yaml_source import read_source
    from lathesim.manual.component_page import without_vectors

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
