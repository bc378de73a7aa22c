"""``lathesim init DIR``: a workspace with copies of everything that ships, to work on."""

from __future__ import annotations

from pathlib import Path

import click

from lathesim.whole_file import make_folder


@click.command()
@click.argument("folder", type=click.Path(path_type=Path, file_okay=False))
@click.option("--teacher", is_flag=True, help="Copy the solutions of the lessons too.")
def init(folder: Path, teacher: bool) -> None:
    """Copy the lessons, part programs and sample plug-ins to FOLDER, to work on. Nothing that is there is overwritten."""
    import shutil

    from lathesim.shipped import FOLDERS, SOLUTIONS, shipped_folder
    from lathesim.workspace import mark_workspace

    copied = kept = 0
    for name in FOLDERS:
        origin = shipped_folder(name)
        for path in sorted(origin.rglob("*")):
            if not path.is_file() or "__pycache__" in path.parts or (not teacher and any(path.match(name) for name in SOLUTIONS)):
                continue
            target = folder / name / path.relative_to(origin)
            if target.exists():
                kept += 1
                continue
            make_folder(target.parent)
            shutil.copyfile(path, target)
            copied += 1
    make_folder(folder)
    mark_workspace(folder)
    click.echo(f"{folder}: {copied} files copied" + (f", {kept} that were there left as they are." if kept else "."))
    click.echo(f"Next: cd {folder} && lathesim run lesson_configs/01_contour_error.yaml")
