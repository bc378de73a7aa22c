"""The command that does the same as what stands on the bench."""

from __future__ import annotations

from rich.text import Text
from textual.widgets import Static


class CommandLine(Static):
    """One row: ``$ lathesim run ...``; a click copies it."""

    DEFAULT_CSS = """
    CommandLine { height: 1; background: $panel; color: $text-muted; text-wrap: nowrap; text-overflow: ellipsis; }
    """

    def __init__(self, id: str | None = None) -> None:
        super().__init__(id=id)
        self.command = ""

    def show(self, command: str) -> None:
        """Show a command."""
        self.command = command
        self.tooltip = f"{command}\nClick to copy"
        self.update(Text(f"$ {command}", no_wrap=True, overflow="ellipsis"))

    def on_click(self) -> None:
        """Copy the command to the clipboard."""
        self.app.copy_to_clipboard(self.command)
        self.notify("The command was copied.")
