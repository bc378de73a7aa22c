"""``lathesim components [NAME]``: the machine parts, or the page of one."""

from __future__ import annotations

from pathlib import Path

import click

from lathesim.cli.registry import open_registry, plugins_option


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
