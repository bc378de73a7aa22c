"""A list to look through: a click looks at an entry, a double click or Enter takes it."""

from __future__ import annotations

from textual import events
from textual.widgets import OptionList


class BrowseList(OptionList):
    """An option list in which a single click only highlights; entries take one row each."""

    DEFAULT_CSS = """
    BrowseList { text-wrap: nowrap; text-overflow: ellipsis; border: none; padding: 0; }
    BrowseList:focus { border: none; }
    """

    def on_click(self, event: events.Click) -> None:
        """Highlight what was clicked; take it on a double click."""
        event.prevent_default()
        clicked = event.style.meta.get("option")
        if clicked is None:
            return
        self.highlighted = clicked
        if event.chain > 1:
            self.action_select()
