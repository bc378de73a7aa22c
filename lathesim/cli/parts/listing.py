"""``lathesim components``, ``effects``, ``plugins`` and ``schema``: what there is to make a machine of."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, cast

import click

from lathesim.cli.options import plugins_option
from lathesim.cli.registry import open_registry, tell_problems

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
