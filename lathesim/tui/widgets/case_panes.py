"""The panes of a case: what a recording differs in, and what the diagnosis says."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from rich.text import Text
from textual import on
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.widget import Widget
from textual.widgets import RichLog, Select, Static

from lathesim.analysis.display_unit import display_unit, plain_name, pretty_unit
from lathesim.record import FloatArray
from lathesim.tui.drawing.curves import PlotLine
from lathesim.tui.model.case_file import CaseFile, comparison_text, diagnosis_text, judged_guess
from lathesim.tui.widgets.time_plot import TimePlot

if TYPE_CHECKING:
    from lathesim.identification.records import CandidateStanding


_CHANNELS, _PARTS = 4, 6
"""Channels, and parts of each, that are shown."""


def wiring_chain(case: CaseFile) -> Text:
    """Return the parts that make each channel, those in which the mismatch sits in red and with a sign."""
    assert case.comparison is not None
    found = Text.assemble(("Wiring, from the sensor back; ✗ marks where the mismatch sits\n", "dim"))
    for item in case.comparison.replayed[:_CHANNELS]:
        found.append(f"{item.channel}: ")
        for place, part in enumerate(item.parts[:_PARTS]):
            found.append(" <- " if place else "")
            off = part in case.comparison.suspects
            found.append(f"[✗ {part}]" if off else part, style="bold red" if off else "")
        found.append("\n")
    return found


def scaled(unit: str, *values: FloatArray) -> tuple[str, list[FloatArray]]:
    """Return the display unit of values [SI] and the values in it."""
    largest = max((float(np.nanmax(np.abs(item))) for item in values if len(item) and np.isfinite(item).any()), default=0.0)
    factor, name = display_unit(unit, largest)
    return pretty_unit(name) or "1", [item / factor for item in values]


_BAR, _MOST = 10, 8
"""Characters of a whole bar, and candidates that are shown."""


def standing_bars(standings: Iterable[CandidateStanding], width: int) -> Text:
    """Return the best candidates, each with the share of the error it removes as a bar, and its gain on the held-out recording [nats].

    A candidate that was only screened has no gain there yet: its screening score stands in brackets.
    """
    shown = sorted(standings, key=lambda item: (math.isnan(item.held_out), -_gain(item)))[:_MOST]
    if not shown:
        return Text("No candidate has been tried yet.", style="dim")
    names = max(6, min(max(len(item.name) for item in shown), width - _BAR - 18))
    found = Text(no_wrap=True)
    found.append(f"{'effect':<{names}}  {'explains':<{_BAR}}       gain\n", style="bold")
    for place, item in enumerate(shown):
        judged = not math.isnan(item.held_out)
        bar = "█" * round(_BAR * min(1.0, max(0.0, item.share)))
        nats = f"{item.held_out:.0f}" if judged else f"({item.gain:.0f})"
        style = "bold green" if place == 0 and judged and item.held_out > 0.0 else "" if judged else "dim"
        found.append(f"{item.name[:names]:<{names}}  {bar:<{_BAR}} {item.share:>4.0%} {nats:>6}\n", style=style)
    return found


def _gain(item: CandidateStanding) -> float:
    return item.gain if math.isnan(item.held_out) else item.held_out


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
                [
                    (f"{plain_name(item.channel)}: {item.over_floor:.3g} times the noise ({item.channel})", item.channel)
                    for item in case.comparison.channels
                ]
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
                lines = [PlotLine(item.time, recorded, "recorded"), PlotLine(item.time, simulated, "simulated")]
                self.query_one("#both", TimePlot).show_lines(lines, "t / s", unit)
                unit, (residual,) = scaled(item.unit, item.residual)
                self.query_one("#residual", TimePlot).show_lines([PlotLine(item.time, residual, "recorded - simulated")], "t / s", unit)


_GAIN = "Gain: by how much the logarithm of the probability of held-out data rises; in brackets, what is promised and not judged yet."


class DiagnosisPane(Vertical):
    """While the search goes on candidates and steps; afterwards the error before and after, and the answer in words."""

    DEFAULT_CSS = """
    DiagnosisPane { height: 1fr; }
    DiagnosisPane #standing { height: auto; max-height: 9; padding: 0 1; }
    DiagnosisPane #steps { height: 1fr; min-height: 3; padding: 0 1; }
    DiagnosisPane #found { height: 2fr; padding: 0 1; display: none; }
    DiagnosisPane #better { height: 1fr; min-height: 8; display: none; }
    DiagnosisPane.-answered #found, DiagnosisPane.-answered #better { display: block; }
    DiagnosisPane.-answered #standing { display: none; }
    DiagnosisPane.-answered #steps { height: 4; }
    .-low DiagnosisPane.-answered #steps { display: none; }
    """

    def compose(self) -> Iterable[Widget]:
        """Return what is said of the guess, the candidates, the steps and the answer."""
        yield Static("", id="judged", markup=False)
        yield Static("", id="standing", markup=False)
        yield RichLog(id="steps", wrap=True, min_width=20, max_lines=2000)
        yield TimePlot(id="better")
        with VerticalScroll(id="found"):
            yield Static("", id="answer-text", markup=False)

    def say(self, words: str) -> None:
        """Show a remark on the guess."""
        self.query_one("#judged", Static).update(words)

    def begin(self, guess: str) -> None:
        """Make room for a search."""
        self.set_class(False, "-answered")
        self.query_one("#better", TimePlot).styles.display = "none"
        self.say(f"Your guess: {guess}. {_GAIN}")
        self.query_one("#steps", RichLog).clear()
        self.query_one("#standing", Static).update(standing_bars((), self.size.width))

    def tell(self, step: str, case: CaseFile) -> None:
        """Show a step, and how the candidates stand after it."""
        self.query_one("#steps", RichLog).write(step)
        self.query_one("#standing", Static).update(standing_bars(case.standings.values(), self.size.width - 4))

    def answer(self, case: CaseFile) -> None:
        """Show the answer, and how the guess stands beside it."""
        assert case.diagnosis is not None
        self.set_class(True, "-answered")
        self.say(judged_guess(case))
        self.query_one("#answer-text", Static).update("\n".join(diagnosis_text(case)).strip())
        traces = case.diagnosis.evidence.traces
        better = self.query_one("#better", TimePlot)
        better.styles.display = "block" if traces else "none"
        if traces:
            trace = traces[0]
            unit, (before, after) = scaled(trace.unit, trace.recorded - trace.before, trace.recorded - trace.after)
            lines = [PlotLine(trace.time, before, f"error of {trace.channel} before"), PlotLine(trace.time, after, "after")]
            self.call_after_refresh(better.show_lines, lines, "t / s", unit)
