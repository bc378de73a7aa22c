"""The read-outs of the bench."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table
from textual.widgets import Static

from lathesim.tui.drawing.readings import Reading


class ReadOuts(Static):
    """A table: what, what is, what is asked for."""

    def show(self, readings: Sequence[Reading]) -> None:
        """Show read-outs."""
        table = Table.grid(padding=(0, 1), expand=True)
        for column in ("left", "right", "right"):
            table.add_column(justify=column, no_wrap=True)
        table.add_row("", "actual", "command", style="dim")
        for reading in readings:
            table.add_row(reading.title, f"[b]{reading.actual}[/b]", reading.wanted)
        self.update(table)
