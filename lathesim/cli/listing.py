"""``lathesim lessons``, ``components``, ``effects``, ``plugins``, ``schema``, ``help`` and ``wiring``: what there is."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import click

from lathesim.cli.options import (
    ChosenLesson,
    OutputPath,
    of_lesson,
    open_registry,
    plugins_option,
    program_option,
    set_option,
    tell_problems,
    variant_option,
)

if TYPE_CHECKING:
    from lathesim.effects.effect import Effect
    from lathesim.engine.wiring import Plan
    from lathesim.hookspecs import CommandEntry
    from lathesim.manual.chapters import Chapter


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
    from lathesim.manual.component_page import effect_page, first_sentence

    registry = open_registry(plugin_folders)
    if name is not None:
        click.echo(effect_page(cast("type[Effect]", registry.effect(name)), registry.origins[name]))
        return
    for key, component in sorted(registry.effects.items(), key=lambda item: (getattr(item[1], "catalogue", 0) or 1000, item[0])):
        number = getattr(component, "catalogue", 0)
        click.echo(f"{number or '-':>3} {key:<34} {getattr(component, 'family', ''):<20} {first_sentence(component)}")


@click.command()
@plugins_option
def plugins(plugin_folders: tuple[Path, ...]) -> int:
    """List the plug-ins that were loaded and what each kind of hook gave; leaves with 1 where one is at fault."""
    from lathesim.manual.component_page import plugin_lines

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
@click.option("--site", type=OutputPath(folder=True), metavar="DIR", help="Write the manual and the reference as HTML with search.")
@plugins_option
def help_(topic: str | None, site: Path | None, plugin_folders: tuple[Path, ...]) -> None:
    """List the chapters of the manual, or print one; a page of the reference is made from what there is."""
    from lathesim.manual.chapters import GROUPS, chapter, chapters, write_site

    if site is not None:
        write_site(site, [*chapters(), *(_reference(name, plugin_folders) for name in REFERENCE)])
        click.echo(f"The manual is {site / 'index.html'}")
        return
    if topic is None:
        pages = {group: {topic: chapter(topic).title for topic in topics} for group, topics in GROUPS.items()}
        for group, titles in {**pages, "Made from the program": REFERENCE}.items():
            click.echo("\n".join([f"{group}:", *(f"  {topic:<16} {title}" for topic, title in titles.items()), ""]))
        click.echo("'lathesim help TOPIC' prints a page, 'lathesim COMMAND --help' lists the options of a command.")
        return
    text = (_reference(topic, plugin_folders) if topic in REFERENCE else chapter(topic)).text
    if not sys.stdout.isatty():
        click.echo(text)
        return
    from rich.console import Console
    from rich.markdown import Markdown

    Console(width=min(110, Console().width)).print(Markdown(text))


REFERENCE = {
    "options": "Commands and their options",
    "keys": "Keys of a lesson and of a machine template",
    "parts": "Machine parts",
    "effects": "Effects",
    "metrics": "Metrics",
    "errors": "Messages of errors, with their remedies",
}
"""Pages of the manual that are made from what there is, by topic."""


def _reference(topic: str, plugin_folders: tuple[Path, ...]) -> Chapter:
    """Return a page of the reference as Markdown."""
    from lathesim.manual.chapters import Chapter
    from lathesim.manual.component_page import component_page, effect_page

    registry = open_registry(plugin_folders, tell=False)
    if topic == "options":
        sections = [f"## lathesim {name}\n\n```\n{_usage(name, entry)}\n```" for name, entry in registry.commands.items()]
    elif topic == "keys":
        sections = [f"## {kind}\n\n{table}" for kind, table in _key_tables()]
    elif topic == "metrics":
        rows = [f"| `{name}` | `{metric.unit}` | {metric.doc} |" for name, metric in registry.metrics.items()]
        sections = ["\n".join(["| metric | SI unit | meaning |", "|---|---|---|", *rows])]
    elif topic == "errors":
        sections = [_ERRORS, *(f"## {heading}\n\n{table}" for heading, table in _error_tables())]
    else:
        page, found = (component_page, registry.components) if topic == "parts" else (effect_page, registry.effects)
        sections = [f"## {name}\n\n```\n{page(cast('Any', item), registry.origins[name])}\n```" for name, item in found.items()]
    return Chapter(topic, REFERENCE[topic], "\n\n".join([f"# {REFERENCE[topic]}", *sections]) + "\n")


_ERRORS = """A message begins with its place: a file with line and column, a part, an option or a record. Then it says what is wrong, and
what to do. Names in braces stand for what your input has there. Where no remedy stands here, the program works it out."""


def _error_tables() -> Iterator[tuple[str, str]]:
    """Yield a heading and a table of messages for each room of the program."""
    from lathesim.manual.error_list import error_sentences

    for heading, sentences in error_sentences().items():
        rows = [f"| {fact} | {remedy} |".replace("\n", " ") for fact, remedy in sentences.items()]
        yield heading, "\n".join(["| what is wrong | what to do |", "|---|---|", *rows])


def _usage(name: str, entry: CommandEntry) -> str:
    """Return the help of a command as it prints it."""
    command = cast("click.Command", entry.load())
    return command.get_help(click.Context(command, info_name=f"lathesim {name}", max_content_width=110))


def _key_tables() -> Iterator[tuple[str, str]]:
    """Yield a table for each kind of entry: the keys of a lesson and a machine template, and of the mappings in them."""
    from lathesim.lessons.schema import json_schema

    for kind in ("lesson", "machine"):
        made = json_schema(kind)
        for name, entry in {f"a {kind}": made, **(made["$defs"] if kind == "lesson" else {})}.items():
            rows = [f"| `{key}` | {_kind(item)} | {item.get('description', '')} |" for key, item in entry.get("properties", {}).items()]
            yield f"Keys of {name}", "\n".join(["| key | value | meaning |", "|---|---|---|", *rows])


def _kind(item: Mapping[str, Any]) -> str:
    """Return in a word or two what a key of the JSON Schema takes."""
    if "anyOf" in item:
        return ", or ".join(dict.fromkeys(kind for choice in item["anyOf"] if (kind := _kind(choice)) != "null"))
    if "$ref" in item:
        return str(item["$ref"]).rpartition("/")[2]
    if "enum" in item:
        return ", ".join(map(str, item["enum"]))
    kinds = item.get("type", "any")
    return kinds if isinstance(kinds, str) else " or ".join(kinds)


@click.command()
@click.argument("lesson")
@variant_option
@program_option
@set_option
@click.option("--source", "form", flag_value="source", help="The Python module the machine is fused into.")
@click.option("--mermaid", "form", flag_value="mermaid", help="A Mermaid graph of parts and wires.")
@of_lesson
def wiring(chosen: ChosenLesson, form: str | None) -> None:
    """Show what feeds each input of each part of LESSON's machine, in the order in which the parts are updated."""
    plan = chosen.prepared.plan
    if form == "source":
        from lathesim.engine.fuse import fuse

        click.echo(fuse(plan).source)
    else:
        click.echo(mermaid_graph(plan) if form == "mermaid" else wiring_text(plan))


def wiring_text(plan: Plan) -> str:
    """Return the parts in the order of their updates, each with what feeds its inputs, its parameters and what it gives."""
    from lathesim.component import Input, Output, Parameter

    assembly = plan.assembly
    lines = [
        f"sample period {assembly.sample_period:g} s, {assembly.steps_per_sample} RK4 steps each; {len(plan.channels)} channels recorded"
    ]
    for name in dict.fromkeys([name for name, _ in plan.laws.instant] + list(plan.parts)):
        part = plan.parts[name]
        declared = part.component.declarations
        every = f", every {part.every} samples" if part.every > 1 else ""
        lines.append(f"\n{name}: {part.component.__name__}{every}")
        for item in declared:
            full = f"{name}.{item}"
            unit = f"[{declared[item].unit}]"
            if full in plan.feeds:
                lines.append(f"  {item:<22} {unit:<10} <- {_feeding(plan, full)}")
            elif isinstance(declared[item], Parameter):
                lines.append(f"  {item:<22} {unit:<10} = {plan.values[full]:g}")
            elif not isinstance(declared[item], Input) and isinstance(declared[item], Output):
                lines.append(f"  {item:<22} {unit:<10} -> {', '.join(_readers(plan, full)) or '(read by nobody)'}")
    return "\n".join(lines)


def _feeding(plan: Plan, target: str) -> str:
    """Return the source of an input, or its value; a default that is no value for a person is left out."""
    from lathesim.component import Input

    source = plan.feeds[target][1]
    if source != target:
        return source
    declared, value = plan.declaration(target), plan.values[target]
    return "(not wired)" if isinstance(declared, Input) and not declared.shown and value == declared.default else f"{value:g}"


def mermaid_graph(plan: Plan) -> str:
    """Return a Mermaid flow chart: a box for each part, an arrow for each wire with the name and unit of what it carries."""
    from lathesim.engine.assembly import Place

    lines = ["flowchart LR"]
    lines += [f'    {name}["{name}<br/><i>{part.component.__name__}</i>"]' for name, part in plan.parts.items()]
    for target, (kind, source) in plan.feeds.items():
        if source != target:
            start, item = Place.of(source)
            arrow = "-->" if kind == "output" else "-.->"
            lines.append(f'    {start} {arrow}|"{item} [{plan.unit(source)}]"| {Place.of(target).part}')
    return "\n".join(lines)


def _readers(plan: Plan, output: str) -> list[str]:
    return [target for target, (kind, source) in plan.feeds.items() if kind == "output" and source == output]
