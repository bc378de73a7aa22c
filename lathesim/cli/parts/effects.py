"""``lathesim effects [NAME]``: the physics a simulation may leave out, or the page of one effect."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from lathesim.cli.registry import open_registry, plugins_option

if TYPE_CHECKING:
    from lathesim.effects.effect import Effect


@click.command()
@click.argument("name", required=False)
@plugins_option
def effects(name: str | None, plugin_folders: tuple[Path, ...]) -> None:
    """List the effects that can be inserted in a lesson, or show the page of one: equation, fingerprint, confusions, experiment."""
    from typing import cast

    from lathesim.manual.component_page import component_page, effect_notes, first_sentence

    registry = open_registry(plugin_folders)
    if name is not None:
        effect = cast("type[Effect]", registry.effect(name))
        click.echo(component_page(effect, registry.origins[name]))
        click.echo()
        click.echo(effect_notes(effect))
        return
    ordered = sorted(registry.effects.items(), key=lambda item: (getattr(item[1], "catalogue", 0) or 1000, item[0]))
    for key, component in ordered:
        number = getattr(component, "catalogue", 0)
        click.echo(f"{number or '-':>3} {key:<34} {getattr(component, 'family', ''):<20} {first_sentence(component)}")
