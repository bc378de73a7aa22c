"""A workspace: a folder that ``lathesim init`` filled with lessons, programs and plug-ins to work on.

Plug-ins are code, so the folder ``plugins/`` of the current folder is loaded only where the user made it a workspace: a marker file
says so and names the folder itself, so a copied or downloaded one does not count.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lathesim.plugins import Registry

MARKER = ".lathesim-workspace"


def mark_workspace(folder: Path) -> None:
    """Make a folder a workspace."""
    text = (
        f"{folder.resolve()}\nThe file lets lathesim load the plug-ins in plugins/ here. 'lathesim init .' writes it anew after a move.\n"
    )
    from lathesim.whole_file import write_text

    write_text(folder / MARKER, text)


def workspace_plugins(folder: Path) -> Path | None:
    """Return the plug-in folder of a workspace, or none where ``folder`` is no workspace or has no plug-ins."""
    try:
        marked = (folder / MARKER).read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        return None
    plugins = folder / "plugins"
    return plugins if marked and marked[0] == str(folder.resolve()) and plugins.is_dir() else None


def load_with_workspace(plugin_folders: Sequence[Path] = (), hook: str = "") -> Registry:
    """Return the registry with the user's plug-in folders and that of the workspace, read anew; with a ``hook`` only what mentions it."""
    from lathesim.plugins import load_registry

    folders = list(plugin_folders)
    own = workspace_plugins(Path.cwd())
    if own is not None and own.resolve() not in [folder.resolve() for folder in folders]:
        folders.append(own.relative_to(Path.cwd()))
    registry = load_registry(folders, hook=hook)
    if folders and not hook:
        registry.ask("components", "effects", "metrics")
    return registry
