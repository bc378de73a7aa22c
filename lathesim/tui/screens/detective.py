"""Detective: a recording against the simulation, a guess, the diagnosis, and what it explains."""

from __future__ import annotations

import shlex
import threading
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from textual import on
from textual.binding import Binding
from textual.containers import Horizontal, VerticalScroll
from textual.widget import Widget
from textual.widgets import Button, Input, Label, OptionList, Static, TabbedContent, TabPane
from textual.widgets.option_list import Option

from lathesim.component import Parameter
from lathesim.errors import LatheSimError
from lathesim.lessons.proposed_lesson import ColumnMeaning
from lathesim.tui.model import case_file
from lathesim.tui.model.case_file import CaseFile, Guess, guessed_columns
from lathesim.tui.model.workbench import REGISTRY, SETUP, fault_words
from lathesim.tui.screens.help import EFFECT, part_page
from lathesim.tui.screens.workbench_screen import WorkbenchScreen
from lathesim.tui.widgets.case_panes import ComparePane, DiagnosisPane
from lathesim.tui.widgets.controls import BrowseList

if TYPE_CHECKING:
    from lathesim.tui.screens.forms import Order

RECORDING, COMPARE, GUESS, DIAGNOSIS, ANSWER = "recording", "compare", "guess", "diagnosis", "answer"
_BESIDE_LIST = 38
"""Columns beside the page of an effect: the list and a scroll bar."""
_HOW_TO_BEGIN = """\
1. Open a recording: of a real machine, or a case that somebody hid for you. Alone? Hide one drawn at random (h).
2. Compare it with the simulation: where do they differ, and on what does it depend?
3. Guess what the simulation lacks.  4. Let the diagnosis search.  5. Open the sealed answer."""


class DetectiveScreen(WorkbenchScreen):
    """Five steps as tabs: recording, compare, guess, diagnosis, answer."""

    DEFAULT_CSS = """
    DetectiveScreen TabbedContent { height: 1fr; }
    DetectiveScreen TabPane { padding: 0; }
    DetectiveScreen #status { height: auto; max-height: 3; padding: 0 1; background: $panel; }
    DetectiveScreen #how { height: auto; padding: 0 1; }
    DetectiveScreen #nearby { height: 1fr; border: round $secondary; border-title-color: $foreground; }
    DetectiveScreen .row { height: 1; }
    DetectiveScreen .row Input { width: 1fr; }
    DetectiveScreen .row Label { padding: 0 1; }
    DetectiveScreen #effects { width: 34; height: 1fr; }
    """
    AUTO_FOCUS = "#nearby"
    BINDINGS = [
        Binding("c", "compare", "Compare"),
        Binding("g", "guess", "Guess"),
        Binding("s", "diagnose", "Search/Stop", tooltip="Search for what the simulation lacks, or stop and keep what is known"),
        Binding("i", "insert", "Insert+run", tooltip="Insert what was found into the lesson and run it"),
        Binding("h", "conceal", "Hide", tooltip="Hide an effect for somebody else, or for a class"),
        Binding("v", "reveal", "Reveal", tooltip="Open the sealed answer"),
    ]

    def __init__(self) -> None:
        super().__init__()
        self.case: CaseFile | None = None
        self._nearby: list[Path] = []
        self._effects: list[str] = []
        self._fault = ""
        self._stop = threading.Event()
        self._reveal_paths = ("", "")

    def compose_body(self) -> Iterable[Widget]:
        """Return the steps."""
        yield Static("", id="status", markup=False)
        with TabbedContent(id="tabs"):
            with TabPane("1 Recording", id=RECORDING):
                yield Static(_HOW_TO_BEGIN, id="how", markup=False)
                yield BrowseList(id="nearby")
                with Horizontal(classes="row"):
                    yield Label("or a path")
                    yield Input(placeholder="case_1 or recording.csv", id="path", compact=True)
                with Horizontal(classes="row"):
                    yield Button("Open", id="open", compact=True, variant="primary")
                    yield Button("Compare (c)", id="do-compare", compact=True)
                    yield Button("Hide an effect (h)", id="do-conceal", compact=True)
            with TabPane("2 Compare", id=COMPARE):
                yield ComparePane()
            with TabPane("3 Guess", id=GUESS):
                with Horizontal():
                    yield BrowseList(id="effects")
                    with VerticalScroll():
                        yield Static("", id="page", markup=False)
                with Horizontal(classes="row"):
                    yield Label("Place")
                    yield Input(placeholder="x_axis", id="place", compact=True)
                    yield Label("Size")
                    yield Input(placeholder="20 N", id="size", compact=True)
                with Horizontal(classes="row"):
                    yield Button("This is my guess", id="take-guess", compact=True, variant="primary")
                    yield Button("Nothing is missing", id="guess-nothing", compact=True)
            with TabPane("4 Diagnosis", id=DIAGNOSIS):
                with Horizontal(classes="row"):
                    yield Button("Search (s)", id="do-diagnose", compact=True, variant="primary")
                    yield Button("Insert and run (i)", id="do-insert", compact=True)
                yield DiagnosisPane()
            with TabPane("5 Answer", id=ANSWER):
                with Horizontal(classes="row"):
                    yield Label("Case folder")
                    yield Input(id="seal", compact=True)
                with Horizontal(classes="row"):
                    yield Label("Answer")
                    yield Input(id="sealed", compact=True)
                yield Button("Reveal (v)", id="do-reveal", compact=True, variant="primary")
                with VerticalScroll():
                    yield Static("", id="truth", markup=False)

    def show_changes(self, changed: set[str]) -> None:
        """Look for recordings near the lesson, and for effects to guess."""
        self.query_one("#nearby").border_title = "Cases and recordings in this folder and beside the lesson; Enter opens one"
        if SETUP in changed:
            setup = self.workbench.setup
            self._nearby = case_file.recordings_nearby(setup.lesson.path.parent if setup is not None else None)
            listed = self.query_one("#nearby", BrowseList)
            listed.fill(f"{'case     ' if path.is_dir() else 'recording'}  {path}" for path in self._nearby)
            if not self._nearby:
                listed.add_option(Option("None here. Type a path below, or hide an effect with h.", disabled=True))
        if REGISTRY in changed:
            self._effects = list(self.workbench.registry.effects)
            self.query_one("#effects", BrowseList).fill(self._effects)
        self._show_status()

    def _show_status(self) -> None:
        case = self.case
        words = "Choose a recording: a case that was hidden for you, or one of a real machine."
        if case is not None:
            words = f"{case.recording} against the lesson '{case.lesson.title}'."
        self.query_one("#status", Static).update(f"{words} {self.busy}{self._fault}".strip())
        self.query_one("#do-diagnose", Button).label = "Stop (s)" if self.busy.startswith("Searching") else "Search (s)"

    def _go(self, tab: str) -> None:
        """Show a step; what had the focus in another one loses it, else it would call its own step back."""
        if self.query_one(TabbedContent).active != tab:
            self.set_focus(None)
        self.query_one(TabbedContent).active = tab

    @on(OptionList.OptionSelected, "#nearby")
    def _open_nearby(self, event: OptionList.OptionSelected) -> None:
        self.open(self._nearby[event.option_index])

    @on(Input.Submitted, "#path")
    @on(Button.Pressed, "#open")
    def _open_typed(self) -> None:
        typed = self.query_one("#path", Input).value.strip()
        place = self.query_one("#nearby", BrowseList).highlighted
        if typed:
            self.open(Path(typed).expanduser())
        elif place is not None:
            self.open(self._nearby[place])

    def open(self, path: Path) -> None:
        """Open a case folder or a recording, and compare it."""
        with self.lathesim.faults_told():
            self.case = case_file.open_case(path, self.workbench.setup)
            setup = self.workbench.setup
            if setup is None or setup.lesson.path.resolve() != self.case.lesson.path.resolve():
                self.workbench.open_lesson(self.case.lesson)
            if not self.case.has_mapping:
                self._ask_mapping(self.case)
                return
            folder = path if path.is_dir() else path.parent
            self.query_one("#seal", Input).value = str(folder)
            self.query_one("#sealed", Input).value = str(folder.parent / f"{folder.name}_answer.json")
            self._show_status()
            self.action_compare()

    def _ask_mapping(self, case: CaseFile) -> None:
        from lathesim.tui.screens.forms import MappingForm

        prepared = self.workbench.prepared()
        columns = guessed_columns(case.recording, prepared, self.workbench.registry)
        self.app.push_screen(MappingForm(case.recording, columns, [*prepared.plan.channels, *prepared.plan.feeds]), self._take_mapping)

    def _take_mapping(self, columns: list[ColumnMeaning] | None) -> None:
        case, setup = self.case, self.workbench.setup
        if columns is None or case is None or setup is None:
            return
        with self.lathesim.faults_told():
            path = case_file.write_mapping(case, setup.variant, columns)
            self.workbench.open_lesson(path)
            assert self.workbench.setup is not None
            self.case = CaseFile(self.workbench.setup.lesson, case.recording)
            self.notify(f"The meaning of the columns is kept in {path}.", markup=False)
            self.action_compare()

    @on(Button.Pressed, "#do-compare")
    def action_compare(self) -> None:
        """Hold the recording against the simulation."""
        if self.case is None:
            self.tell_fault("Choose a recording first.")
            return
        work = partial(case_file.compare, self.case, self.workbench.setup, self.workbench.registry)
        self.in_thread("Comparing ...", work, self._show_compared, writes=False)

    def _show_compared(self) -> None:
        case = self.case
        if case is None or case.comparison is None:
            return
        self.query_one(ComparePane).show(case)
        if not self.query_one("#place", Input).value:
            self.query_one("#place", Input).value = case.comparison.suspect
        self._go(COMPARE)

    def action_guess(self) -> None:
        """Go to the guess."""
        self._go(GUESS)
        self.query_one("#effects", BrowseList).focus()

    @on(OptionList.OptionHighlighted, "#effects")
    def _look_at_effect(self, event: OptionList.OptionHighlighted) -> None:
        registry, name = self.workbench.registry, self._effects[event.option_index]
        effect = registry.effect(name)
        self.query_one("#page", Static).update(part_page(registry, EFFECT, name, max(40, self.size.width - _BESIDE_LIST)))
        sizes = [name for name in effect.declared(Parameter) if name not in cast("Any", effect).identification.nuisance]
        self.query_one("#size", Input).placeholder = f"{sizes[0]} with its unit" if sizes else "nothing to guess"

    @on(OptionList.OptionSelected, "#effects")
    @on(Button.Pressed, "#take-guess")
    def _take_guess(self) -> None:
        place = self.query_one("#effects", BrowseList).highlighted
        if place is None:
            self.tell_fault("Choose an effect in the list.")
            return
        at, size = (self.query_one(f"#{name}", Input).value.strip() for name in ("place", "size"))
        self.take_guess(Guess(self._effects[place], at, size))

    @on(Button.Pressed, "#guess-nothing")
    def _guess_nothing(self) -> None:
        self.take_guess(Guess())

    def take_guess(self, guess: Guess) -> None:
        """Take a guess down; the search may begin."""
        if self.case is None:
            self.tell_fault("Choose a recording first.")
            return
        self.case.guess = guess
        self.query_one(DiagnosisPane).say(f"Your guess: {guess.words}. s starts the search.")
        self._go(DIAGNOSIS)

    @on(Button.Pressed, "#do-diagnose")
    def action_diagnose(self) -> None:
        """Search for what was left out, or stop the search and keep what is known."""
        if self.busy.startswith("Searching"):
            self.stop_search()
            return
        case = self.case
        if case is None:
            self.tell_fault("Choose a recording first.")
            return
        if case.guess is None:
            self.notify("Guess first. 'Nothing is missing' is a guess too.")
            self.action_guess()
            return
        self._stop.clear()
        self.query_one(DiagnosisPane).begin(case.guess.words)
        self._go(DIAGNOSIS)
        work = partial(case_file.diagnose, case, self.workbench.setup, self.workbench.registry, self._tell_from_thread, self._stop)
        self.in_thread("Searching ...", work, self._show_diagnosed, writes=False)

    def stop_search(self) -> None:
        """Let the search stop at its next step, and keep what is known."""
        self._stop.set()
        self.busy = "Searching: stops at the next step ..."
        self._show_status()

    def _tell_from_thread(self, step: str) -> None:
        """Report a step of work from a thread; nothing once the screen is gone."""
        self.call_later(self._tell_step, step)

    def _tell_step(self, step: str) -> None:
        if self.case is not None:
            self.query_one(DiagnosisPane).tell(step, self.case)

    def _show_diagnosed(self) -> None:
        if self.case is not None and self.case.diagnosis is not None:
            self.query_one(DiagnosisPane).answer(self.case)

    @on(Button.Pressed, "#do-insert")
    def action_insert(self) -> None:
        """Insert what was found into the lesson, run it, and compare again."""
        case, setup = self.case, self.workbench.setup
        if case is None or case.diagnosis is None or setup is None:
            self.tell_fault("There is no diagnosis yet: s starts the search.")
            return
        if not case.diagnosis.lines.insert:
            self.notify("Nothing was found that could be inserted.")
            return
        found = case_file.with_what_was_found(case, setup)
        with self.lathesim.faults_told():
            found.prepared(self.workbench.registry)
            self.workbench.change(found)
            self.lathesim.action_run_or_stop()
            self.action_compare()

    @on(Button.Pressed, "#do-reveal")
    def action_reveal(self) -> None:
        """Open the sealed answer."""
        self._go(ANSWER)
        seal, answer = (self.query_one(f"#{name}", Input).value.strip() for name in ("seal", "sealed"))
        if seal and answer:
            self.reveal(seal, answer)
        else:
            self.tell_fault("Write the case folder and the file of the answer.")

    def reveal(self, seal: str, answer: str) -> None:
        """Show the sealed answer, or why it cannot be opened."""
        try:
            lines = case_file.reveal(Path(seal), Path(answer), self.case)
        except (LatheSimError, OSError) as error:
            lines = [f"✗ {fault_words(error)}"]
        self.query_one("#truth", Static).update("\n".join(lines))

    @on(Button.Pressed, "#do-conceal")
    def action_conceal(self) -> None:
        """Hide an effect for somebody else."""
        from lathesim.tui.screens.choices import effect_choice
        from lathesim.tui.screens.forms import ConcealForm

        setup = self.workbench.setup
        if setup is None:
            return
        with self.lathesim.faults_told():
            choice = partial(effect_choice, self.workbench.prepared(), self.workbench.registry, "")
            self.app.push_screen(ConcealForm(setup.lesson.name, choice), self._conceal)

    def _conceal(self, order: Order | None) -> None:
        setup = self.workbench.setup
        if order is None or setup is None:
            return

        def make() -> None:
            tell = self._tell_from_thread
            for folder in order.folders:
                made = case_file.conceal(
                    setup.lesson, self.workbench.registry, folder, hidden=order.hidden, validate=order.validate, tell=tell
                )
                self.call_later(self.notify, "\n".join(made), markup=False, timeout=10.0)

        self.in_thread("Hiding and recording ...", make, partial(self.show_changes, {SETUP}))

    def show_busy(self, fault: str) -> None:
        """Show what is being done, or what went wrong with it."""
        self._fault = f"✗ {fault}" if fault else ""
        self._show_status()
        self.show_command()

    def command(self) -> str:
        """Return the command of the step one is at."""
        case = self.case
        if case is None:
            return "lathesim compare LESSON RECORDING"
        active = self.query_one(TabbedContent).active if self.is_mounted else COMPARE
        lesson, recording = str(case.lesson.path), str(case.recording)
        if active == ANSWER:
            return shlex.join(["lathesim", "reveal", str(case.recording.parent), self.query_one("#sealed", Input).value or "ANSWER"])
        if active in (GUESS, DIAGNOSIS):
            second = ["--validate", str(case.validation)] if case.validation is not None else []
            return shlex.join(["lathesim", "diagnose", lesson, recording, *second])
        return shlex.join(["lathesim", "compare", lesson, recording])

    @on(TabbedContent.TabActivated)
    def _show_command(self) -> None:
        self.show_command()
