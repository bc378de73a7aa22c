"""The top row: the screens with their keys, the one that is shown marked, and Run or Stop."""

from __future__ import annotations

from collections.abc import Sequence

from textual.app import ComposeResult
from textual.containers import Horizontal
from textual.widgets import Static

_SHORT = {"Configure": "Config", "Plug-ins": "Plugins"}
_NARROW = 90
"""Columns below which shorter titles are shown, so that all entries fit into 80."""


class NavigationEntry(Static):
    """A screen or an action: shown as ``F2 Bench``; a click does what the key does."""

    def __init__(self, key: str, title: str, action: str, *, is_here: bool = False, id: str | None = None) -> None:
        super().__init__(id=id, markup=False)
        self._key = key
        self._action = action
        self._title = title
        self.set_class(is_here, "-here")
        self.show(title)

    def show(self, title: str) -> None:
        """Show another title."""
        self._title = title
        self.update(f"{self._key.upper()} {title}")

    def shorten(self, narrow: bool) -> None:
        """Show the short title where there is little room."""
        self.update(f"{self._key.upper()} {_SHORT.get(self._title, self._title) if narrow else self._title}")

    async def on_click(self) -> None:
        """Do it."""
        await self.app.run_action(self._action)


class NavigationBar(Horizontal):
    """One row of entries; the screen that is shown is in reverse and between brackets."""

    DEFAULT_CSS = """
    NavigationBar { height: 1; background: $panel; }
    NavigationEntry { width: auto; padding: 0 1 0 0; }
    NavigationEntry:hover { background: $boost; text-style: underline; }
    NavigationEntry.-here { text-style: bold reverse; }
    NavigationEntry.-running { text-style: bold; color: $error; }
    """

    def __init__(self, entries: Sequence[tuple[str, str, str]], here: str) -> None:
        super().__init__()
        self._entries = entries
        self._here = here

    def compose(self) -> ComposeResult:
        """Return the entries."""
        for name, key, title in self._entries:
            action = f"switch_mode('{name}')" if name != "run" else "run_or_stop"
            yield NavigationEntry(key, title, action, is_here=name == self._here, id=f"go-{name}")

    def on_resize(self) -> None:
        """Fit all entries into the row."""
        for entry in self.query(NavigationEntry):
            entry.shorten(self.size.width < _NARROW)

    def show_running(self, running: bool) -> None:
        """Show Stop while a run is under way, else Run."""
        entry = self.query_one("#go-run", NavigationEntry)
        entry.set_class(running, "-running")
        entry.show("STOP" if running else "RUN")
