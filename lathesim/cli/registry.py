"""The registry a command works with."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from lathesim.plugins import Registry


def open_registry(plugin_folders: tuple[Path, ...], *, tell: bool = True) -> Registry:
    """Return the registry with the user's plug-in folders and that of the workspace; tell each plug-in at fault in one line."""
    from lathesim.engine.compiling.compile_notice import tell_compiling_to

    tell_compiling_to(_told_once())
    registry = load_with_workspace(plugin_folders)
    if tell:
        tell_problems(registry)
    return registry


def load_with_workspace(plugin_folders: tuple[Path, ...]) -> Registry:
    """Return the registry with the user's plug-in folders and that of the workspace, read anew."""
    from lathesim.plugins import load_registry
    from lathesim.workspace import workspace_plugins

    folders = list(plugin_folders)
    own = workspace_plugins(Path.cwd())
    if own is not None and own.resolve() not in [folder.resolve() for folder in folders]:
        folders.append(own.relative_to(Path.cwd()))
    registry = load_registry(folders)
    if folders:
        registry.ask("components", "effects", "metrics")
    return registry


def _told_once() -> Callable[[str], None]:
    """Return what writes sentences of the compiler to the error stream, of each kind ("Compiling once ...") only the first."""
    told: set[str] = set()

    def tell(sentence: str) -> None:
        kind = sentence.partition(",")[0]
        if kind not in told:
            told.add(kind)
            click.echo(sentence, err=True)

    return tell


def tell_problems(registry: Registry) -> None:
    """Write the plug-ins at fault to the error stream."""
    for problem in registry.problems:
        click.echo(f"Left out: {problem}", err=True)
