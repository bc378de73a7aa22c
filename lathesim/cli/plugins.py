"""``lathesim plugins``: what was registered, from where, and which plug-ins are at fault."""

from __future__ import annotations

from pathlib import Path

import click

from lathesim.cli.registry import open_registry, plugins_option, tell_problems


@click.command()
@plugins_option
def plugins(plugin_folders: tuple[Path, ...]) -> int:
    """List the plug-ins that were loaded and what each kind of hook gave; leaves with 1 where one is at fault."""
    registry = open_registry(plugin_folders, tell=False)
    registry.ask()
    kinds = (
        ("components", registry.components),
        ("effects", registry.effects),
        ("metrics", registry.metrics),
        ("readers", registry.readers),
    )
    for word, found in kinds:
        guests = [name for name in found if not registry.origins[name].startswith("lathesim.")]
        click.echo(f"{len(found):>4} {word}" + (f", {len(guests)} of them from plug-ins:" if guests else ""))
        for name in guests:
            click.echo(f"       {name:<30} {registry.origins[name]}")
    click.echo("Plug-ins loaded: " + (", ".join(registry.plugins) or "none besides the stock parts."))
    tell_problems(registry)
    return 1 if registry.problems else 0
