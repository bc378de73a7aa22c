"""A comparison of a recording with the simulation: curves, residual, the wiring with the mismatch, and the numbers."""

from __future__ import annotations

from collections.abc import Iterable

from textual import on
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.widget import Widget
from textual.widgets import Select, Static

from lathesim.tui.drawing.case_words import scaled, wiring_chain
from lathesim.tui.drawing.curves import Line
from lathesim.tui.model.case_file import CaseFile, comparison_text
from lathesim.tui.widgets.time_plot import TimePlot


class ComparePane(Vertical):
    """Shows one channel at a time as curves, and all channels as numbers."""

    DEFAULT_CSS = """
    ComparePane #pair { height: 1fr; min-height: 8; }
    ComparePane #pair TimePlot { width: 1fr; }
    ComparePane #chain { height: auto; max-height: 6; padding: 0 1; }
    ComparePane #told { padding: 0 1; }
    """

    def __init__(self) -> None:
        super().__init__()
        self._case: CaseFile | None = None

    def compose(self) -> Iterable[Widget]:
        """Return the channel, its curves, the wiring and the numbers."""
        yield Select[str]([], prompt="Channel", id="channel", compact=True)
        with Horizontal(id="pair"):
            yield TimePlot(id="both")
            yield TimePlot(id="residual")
        yield Static("", id="chain", markup=False)
        with VerticalScroll():
            yield Static("", id="told", markup=False)

    def show(self, case: CaseFile) -> None:
        """Show a case that was compared, the worst channel first."""
        assert case.comparison is not None
        self._case = case
        select = self.query_one("#channel", Select)
        with self.prevent(Select.Changed):
            names = [item.channel for item in case.comparison.channels]
            select.set_options(
                [(f"{item.channel}: {item.over_floor:.3g} times the noise", item.channel) for item in case.comparison.channels]
            )
            if names:
                select.value = names[0]
        self.query_one("#chain", Static).update(wiring_chain(case))
        self.query_one("#told", Static).update("\n".join(comparison_text(case)))
        self.call_after_refresh(self._draw)

    @on(Select.Changed, "#channel")
    def _draw(self) -> None:
        case, name = self._case, self.query_one("#channel", Select).value
        if case is None or case.comparison is None:
            return
        for item in case.comparison.channels:
            if item.channel == name:
                unit, (recorded, simulated) = scaled(item.unit, item.recorded, item.simulated)
                lines = [Line(item.time, recorded, "recorded"), Line(item.time, simulated, "simulated")]
                self.query_one("#both", TimePlot).show_lines(lines, "t / s", unit)
                unit, (residual,) = scaled(item.unit, item.residual)
                self.query_one("#residual", TimePlot).show_lines([Line(item.time, residual, "recorded - simulated")], "t / s", unit)
