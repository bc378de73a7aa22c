"""A search for what the simulation lacks: the guess, how the candidates stand, the steps, and at its end the answer."""

from __future__ import annotations

from collections.abc import Iterable

from textual.containers import Vertical, VerticalScroll
from textual.widget import Widget
from textual.widgets import RichLog, Static

from lathesim.tui.drawing.case_words import scaled
from lathesim.tui.drawing.curves import Line
from lathesim.tui.drawing.standing_bars import standing_bars
from lathesim.tui.model.case_file import CaseFile, diagnosis_text, judged_guess
from lathesim.tui.widgets.time_plot import TimePlot

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
            lines = [Line(trace.time, before, f"error of {trace.channel} before"), Line(trace.time, after, "after")]
            self.call_after_refresh(better.show_lines, lines, "t / s", unit)
