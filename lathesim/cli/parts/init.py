"""``lathesim init DIR``: a workspace with copies of everything that ships, to work on."""

from __future__ import annotations

import shutil
from functools import partial
from pathlib import Path

import click

from lathesim.errors import LatheSimError
from lathesim.whole_file import make_folder, write_new


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

    from lathesim.shipped import shipped_folder
    from lathesim.workspace import workspace_plugins

    shipped = {path.name: path.read_bytes() for path in shipped_folder("plugins").glob("*.py")}
    found = sorted((folder / "plugins").glob("*.py"))
    own = [path.name for path in found if not path.name.startswith("_") and path.read_bytes() != shipped.get(path.name)]
    if not own or workspace_plugins(folder) is not None:
        return
    fact = f"{folder / 'plugins'} has plug-ins of its own ({', '.join(own[:5])}), and every command in {folder} will run them from now on."
    if not sys.stdin.isatty():
        raise LatheSimError(fact, remedy="Read them, then write --yes.")
    click.confirm(f"{fact} Is that wanted?", abort=True)
