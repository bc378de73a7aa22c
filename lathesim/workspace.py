"""A workspace: a folder that ``lathesim init`` filled with lessons, programs and plug-ins to work on.

Plug-ins are code, so the folder ``plugins/`` of the current folder is loaded only where the user made it a workspace: a marker file
says so and names the folder itself, so a copied or downloaded one does not count.
"""

from __future__ import annotations

from pathlib import Path

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
