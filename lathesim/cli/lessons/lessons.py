"""``lathesim lessons``: the lessons there are, with their titles and variants."""

from __future__ import annotations

from pathlib import Path

import click


@click.command()
@click.argument("folder", type=click.Path(path_type=Path, file_okay=False, exists=True), required=False)
def lessons(folder: Path | None) -> int:
    """List the lessons that came with lathesim and those in ./lesson_configs, or the lessons in FOLDER."""
    from lathesim.errors import LatheSimError
    from lathesim.lessons.lesson import load_lesson
    from lathesim.lessons.lesson_list import lesson_files

    faults = listed = 0
    for path in lesson_files(folder):
        listed += 1
        try:
            lesson = load_lesson(path)
        except LatheSimError as error:
            click.echo(str(error), err=True)
            faults += 1
            continue
        variants = f"  [{', '.join(lesson.variants)}]" if lesson.variants else ""
        click.echo(f"{lesson.name:<32} {lesson.title}{variants}")
    if not listed:
        click.echo("There are no lessons here.")
    return 1 if faults else 0
