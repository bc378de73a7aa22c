"""``lathesim lessons``, ``components``, ``effects``, ``plugins``, ``schema`` and ``help``: what there is."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, cast

import click

from lathesim.cli.options import open_registry, plugins_option, tell_problems

if TYPE_CHECKING:
    from lathesim.effects.effect import Effect


@click.command()
@click.argument("name", required=False)
@plugins_option
def components(name: str | None, plugin_folders: tuple[Path, ...]) -> None:
    """List the machine parts, or show the page of one: equation, inputs, outputs, parameters with units and bounds."""
    from lathesim.manual.component_page import component_page, first_sentence

    registry = open_registry(plugin_folders)
    if name is not None:
        click.echo(component_page(registry.component(name), registry.origins[name]))
        return
    for key, component in registry.components.items():
        click.echo(f"{key:<34} {first_sentence(component)}")


@click.command()
@click.argument("name", required=False)
@plugins_option
def effects(name: str | None, plugin_folders: tuple[Path, ...]) -> None:
    """List the effects that can be inserted in a lesson, or show the page of one: equation, fingerprint, confusions, experiment."""
    from lathesim.manual.component_page import component_page, effect_notes, first_sentence

    registry = open_registry(plugin_folders)
    if name is not None:
        effect = cast("type[Effect]", registry.effect(name))
        click.echo(f"{component_page(effect, registry.origins[name])}\n\n{effect_notes(effect)}")
        return
    ordered = sorted(registry.effects.items(), key=lambda item: (getattr(item[1], "catalogue", 0) or 1000, item[0]))
    for key, component in ordered:
        number = getattr(component, "catalogue", 0)
        click.echo(f"{number or '-':>3} {key:<34} {getattr(component, 'family', ''):<20} {first_sentence(component)}")


@click.command()
@plugins_option
def plugins(plugin_folders: tuple[Path, ...]) -> int:
    """List the plug-ins that were loaded and what each kind of hook gave; leaves with 1 where one is at fault."""
    from lathesim.manual.plugin_list import plugin_lines

    registry = open_registry(plugin_folders, tell=False)
    for line in plugin_lines(registry):
        click.echo(line)
    tell_problems(registry)
    return 1 if registry.problems else 0


@click.command()
@click.argument("kind", type=click.Choice(["lesson", "machine"]), default="lesson")
def schema(kind: str) -> None:
    """Print the JSON Schema of a lesson (or of a machine template), for editors that check YAML while you type."""
    import json

    from lathesim.lessons.schema import json_schema

    click.echo(json.dumps(json_schema(kind), indent=2))


@click.command()
@click.argument("folder", type=click.Path(path_type=Path, file_okay=False, exists=True), required=False)
def lessons(folder: Path | None) -> int:
    """List the course by units: the lessons that came with lathesim and those in ./lesson_configs, or the lessons in FOLDER.

    Each line has the name, the minutes, the level, the title and the variants of a lesson.
    """
    from lathesim.errors import LatheSimError
    from lathesim.lessons.lesson import Lesson, by_unit, lesson_files, load_lesson

    faults = 0
    found: list[Lesson] = []
    for path in lesson_files(folder):
        try:
            found.append(load_lesson(path))
        except LatheSimError as error:
            click.echo(str(error), err=True)
            faults += 1
    for unit, members in by_unit(found).items():
        click.echo(unit or "without a unit")
        for lesson in members:
            minutes = f"{lesson.settings.minutes} min" if lesson.settings.minutes is not None else ""
            variants = f"  [{', '.join(lesson.variants)}]" if lesson.variants else ""
            click.echo(f"  {lesson.name:<34} {minutes:>7}  {lesson.settings.level or '':<12}  {lesson.title}{variants}")
    if not found and not faults:
        click.echo("There are no lessons here.")
    return 1 if faults else 0


@click.command("help")
@click.argument("topic", required=False)
def help_(topic: str | None) -> None:
    """List the chapters of the manual, or print one."""
    from lathesim.manual.chapters import chapter, chapters

    if topic is None:
        for found in chapters():
            click.echo(f"{found.topic:<18} {found.title}")
        click.echo("\n'lathesim help TOPIC' prints a chapter, 'lathesim COMMAND --help' tells the options of a command.")
        return
    text = chapter(topic).text
    if not sys.stdout.isatty():
        click.echo(text)
        return
    from rich.console import Console
    from rich.markdown import Markdown

    Console(width=min(110, Console().width)).print(Markdown(text))
