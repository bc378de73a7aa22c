"""``lathesim plugins``: what was registered, from where, and which plug-ins are at fault."""

from __future__ import annotations

from pathlib import Path

import click

from lathesim.cli.registry import open_registry, plugins_option, tell_problems


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
