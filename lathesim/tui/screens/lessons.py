"""Lessons: what each teaches, its goals and hints, things to try, and how far one has come."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from rich.text import Text
from textual import on
from textual.binding import Binding
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.widget import Widget
from textual.widgets import Button, Label, Markdown, OptionList, Static
from textual.widgets.option_list import Option

from lathesim.analysis.display_unit import plain_name, pretty_quantities
from lathesim.errors import LatheSimError
from lathesim.lessons.lesson import Lesson, by_unit, lesson_files, load_lesson, results_folder
from lathesim.lessons.questions import Answered, is_right, keep_answer, read_answers, results
from lathesim.lessons.schema import Goal
from lathesim.tui.model.student_book import LessonEntry, Suggestion, suggestion
from lathesim.tui.model.workbench import RUNS, SETUP, fault_words
from lathesim.tui.screens.forms import ChoiceQuestion, TextQuestion
from lathesim.tui.screens.workbench_screen import WorkbenchScreen
from lathesim.tui.widgets.controls import BrowseList
from lathesim.units import split_quantity

_LEVELS = ("beginner", "intermediate", "advanced")
_NOTHING = "○"
_WIDE = 110
"""Columns from which on the app is no longer ``-narrow``."""
_ROOM = {False: 41, True: 29}
"""Columns for title, minutes and level: the width of the list without the sign and the scroll bar."""
_MINUTES = {False: " min", True: "'"}


class LessonsScreen(WorkbenchScreen):
    """The course at the left, by units; the lesson at the right. Enter puts it on the bench, F5 runs it."""

    DEFAULT_CSS = """
    LessonsScreen #listed { width: 46; }
    LessonsScreen.-narrow #listed { width: 33; }
    LessonsScreen #lessons { height: 1fr; }
    LessonsScreen #lessons > .option-list--option-disabled { color: $foreground; }
    LessonsScreen #open { width: 1fr; }
    LessonsScreen #page { padding: 0 1; height: 1fr; }
    LessonsScreen #text { padding: 0; }
    LessonsScreen MarkdownH1 { margin: 0 0 1 0; content-align: left middle; }
    LessonsScreen #tries { height: auto; max-height: 35%; border: none; padding: 0; }
    LessonsScreen .heading { text-style: bold; color: $primary; }
    LessonsScreen #aims { height: auto; max-height: 40%; }
    """
    BINDINGS = [
        Binding("o", "open", "Put on the bench"),
        Binding("y", "try", "Set what to try"),
        Binding("a", "answer", "Answer a question"),
    ]

    def __init__(self) -> None:
        super().__init__()
        self._lessons: list[tuple[Path, Lesson | None, str]] = []
        self._units: list[str] = []
        self._rows: list[int | None] = []
        """The place of the lesson in each row of the list; None for the heading of a unit."""
        self._suggestions: list[Suggestion] = []
        self._here: int | None = None
        """The place of the lesson that was on the bench; a run, or another lesson there, moves the cursor to it."""

    def compose_body(self) -> Iterable[Widget]:
        """Return the list and the page."""
        with Horizontal():
            with Vertical(id="listed"):
                yield BrowseList(id="lessons")
                yield Static("→ next ✓ met • tried ○ new", classes="heading")
                yield Button("Put on the bench (Enter)", id="open", compact=True, variant="primary")
            with Vertical():
                with VerticalScroll(id="page"):
                    yield Markdown("", id="text", open_links=False)
                with VerticalScroll(id="aims"):
                    yield Static("", id="goals")
                yield Label("To try (Enter sets those with ▶), questions (?)", id="heading", classes="heading")
                yield OptionList(id="tries")

    def on_mount(self) -> None:
        """Read the lessons; those of a unit stand together."""
        super().on_mount()
        found: list[tuple[Path, Lesson | None, str]] = []
        for path in lesson_files():
            try:
                found.append((path, load_lesson(path), ""))
            except LatheSimError as error:
                found.append((path, None, fault_words(error)))
        place = {lesson.path: (path, lesson, "") for path, lesson, _ in found if lesson is not None}
        for unit, members in by_unit(lesson for _, lesson, _ in found if lesson is not None).items():
            self._rows += [None, *range(len(self._lessons), len(self._lessons) + len(members))]
            self._lessons += [place[lesson.path] for lesson in members]
            self._units.append(unit or "without a unit")
        faulty = [entry for entry in found if entry[1] is None]
        self._rows += range(len(self._lessons), len(self._lessons) + len(faulty))
        self._lessons += faulty

    def show_changes(self, changed: set[str]) -> None:
        """Mark what was reached, and show the lesson on the bench."""
        if not changed & {SETUP, RUNS} or not self._lessons:
            return
        listed = self.query_one("#lessons", OptionList)
        chosen = self._place(listed.highlighted)
        here = next((place for place, (_, lesson, _) in enumerate(self._lessons) if lesson is not None and self._is_on_bench(lesson)), None)
        if chosen is None or (here is not None and (RUNS in changed or here != self._here)):
            chosen = here or 0
        self._here = here
        units, following = iter(zip(self._units, self._counts(), strict=True)), self._next()
        with self.prevent(OptionList.OptionHighlighted):
            listed.clear_options()
            for place in self._rows:
                if place is None:
                    unit, (met, count) = next(units)
                    listed.add_option(Option(Text.assemble((unit, "bold underline"), f"  {met} of {count}"), disabled=True))
                else:
                    listed.add_option(Option(self._row(place, is_next=place == following)))
            listed.highlighted = self._rows.index(chosen)
        self._show(chosen)
        if self.lathesim.book.fault:
            self.tell_fault(self.lathesim.book.fault)
            self.lathesim.book.fault = ""

    def on_resize(self) -> None:
        """Fit the rows to the width of the list."""
        self.show_changes({SETUP})

    def _place(self, row: int | None) -> int | None:
        """Return the place of the lesson in a row of the list."""
        return self._rows[row] if row is not None and row < len(self._rows) else None

    def _counts(self) -> list[tuple[int, int]]:
        """Return for each unit how many of its lessons have their goals met, and how many it has."""
        found: list[tuple[int, int]] = []
        for place in self._rows:
            if place is None:
                found.append((0, 0))
            elif found and self._lessons[place][1] is not None:
                met, count = found[-1]
                found[-1] = met + (self._sign(*self._lessons[place][:2]) == "✓"), count + 1
        return found

    def _next(self) -> int | None:
        """Return the place of the first lesson of the course whose goals are not met yet."""
        for place, (path, lesson, _) in enumerate(self._lessons):
            if lesson is not None and lesson.settings.unit is not None and self._sign(path, lesson) != "✓":
                return place
        return None

    def _row(self, place: int, *, is_next: bool) -> Text:
        """Return the row of a lesson: its sign, its title, the minutes and a dot for each step of its level."""
        path, lesson, _ = self._lessons[place]
        if lesson is None:
            return Text(f"! {path.name}: at fault", no_wrap=True, overflow="ellipsis")
        sign = self._sign(path, lesson)
        minutes = lesson.settings.minutes
        level = "▪" * (1 + _LEVELS.index(lesson.settings.level)) if lesson.settings.level is not None else ""
        is_narrow = self.app.size.width < _WIDE
        end = f" {minutes:>3}{_MINUTES[is_narrow]}{'' if is_narrow else f' {level:<3}'}" if minutes is not None else ""
        title = Text(lesson.title)
        title.truncate(_ROOM[is_narrow] - len(end), overflow="ellipsis", pad=bool(end))
        return Text.assemble(f"{'→' if is_next else sign} ", title, (end, "dim"), no_wrap=True, overflow="ellipsis")

    def _sign(self, path: Path, lesson: Lesson | None) -> str:
        entry = self.lathesim.book.entry(path.stem)
        if lesson is None:
            return "!"
        if entry.has_met(f"{key} {limit}" for key, limit, _ in _limits(lesson)):
            return "✓"
        return "•" if entry.tries else _NOTHING

    @on(OptionList.OptionHighlighted, "#lessons")
    def _highlight(self, event: OptionList.OptionHighlighted) -> None:
        place = self._place(event.option_index)
        if place is not None:
            self._show(place)

    def _show(self, place: int) -> None:
        path, lesson, fault = self._lessons[place]
        tries = self.query_one("#tries", OptionList)
        tries.clear_options()
        self._suggestions = []
        if lesson is None:
            self.query_one(Markdown).update(f"# {path.name}")
            self.query_one("#goals", Static).update(Text(fault))
            return
        self.query_one(Markdown).update(_page(lesson))
        self.query_one("#goals", Static).update(_goals_text(lesson, self.lathesim.book.entry(path.stem)))
        self._suggestions = [suggestion(text, lesson.variants) for text in lesson.settings.try_]
        for item in self._suggestions:
            tries.add_option(Option(Text(f"{'▶' if item.can_be_set else '-'} {item.text}")))
        for result in results(lesson.settings.questions, self._answers(lesson)):
            sign = "✓" if result.right else "✗" if result.answer else "?"
            tries.add_option(Option(Text(f"{sign} {result.question}{f' {result.answer}' if result.answer else ''}")))
        self.show_command()

    def _chosen(self) -> Lesson | None:
        place = self._place(self.query_one("#lessons", OptionList).highlighted)
        return self._lessons[place][1] if place is not None else None

    @on(OptionList.OptionSelected, "#lessons")
    @on(Button.Pressed, "#open")
    def action_open(self) -> None:
        """Put the lesson on the bench."""
        if self._put_on_bench(anew=True):
            self.app.switch_mode("bench")

    def make_ready(self) -> bool:
        """Put the lesson under the cursor on the bench; if it is already there, keep its changes."""
        return self.query_one("#lessons", OptionList).highlighted is None or self._put_on_bench(anew=False)

    def _put_on_bench(self, *, anew: bool) -> bool:
        lesson = self._chosen()
        if lesson is None:
            self.tell_fault("This lesson is at fault. Mend it first.")
        elif anew or not self._is_on_bench(lesson):
            self.workbench.open_lesson(lesson)
        return lesson is not None

    def _is_on_bench(self, lesson: Lesson) -> bool:
        setup = self.workbench.setup
        return setup is not None and setup.lesson.path.resolve() == lesson.path.resolve()

    def action_try(self) -> None:
        """Go to the things to try."""
        tries = self.query_one("#tries", OptionList)
        tries.highlighted = tries.highlighted or 0
        tries.focus()

    @on(OptionList.OptionSelected, "#tries")
    def _try(self, event: OptionList.OptionSelected) -> None:
        lesson = self._chosen()
        if event.option_index >= len(self._suggestions):
            self._ask(event.option_index - len(self._suggestions))
            return
        item = self._suggestions[event.option_index]
        if not item.can_be_set or lesson is None:
            self.notify("This one is for you to do: put the lesson on the bench.")
            return
        self.make_ready()
        assert self.workbench.setup is not None
        self.workbench.change(item.applied(self.workbench.setup))
        self.app.switch_mode("bench")
        self.notify(f"Set: {self.workbench.setup.summary}. F5 runs it.", markup=False)

    def action_answer(self) -> None:
        """Ask the first question that is not answered right."""
        lesson = self._chosen()
        found = results(lesson.settings.questions, self._answers(lesson)) if lesson is not None else ()
        missing = [place for place, result in enumerate(found) if not result.right]
        if missing:
            self._ask(missing[0])
        else:
            self.notify("All questions are answered." if found else "This lesson has no questions.")

    def _ask(self, place: int) -> None:
        """Ask a question about the newest run of the lesson, and keep the answer beside that run."""
        lesson = self._chosen()
        record = self._newest_record(lesson) if lesson is not None else None
        if lesson is None or record is None:
            self.notify("The questions are about your runs. Run the lesson first, with F5.")
            return
        question = lesson.settings.questions[place]

        def keep(answer: str | None) -> None:
            if answer is None:
                return
            with self.lathesim.faults_told():
                right = is_right(question, answer)
                keep_answer(record, lesson.name, self._answers(lesson), question.ask, answer)
                self.notify("Right." if right else "Not right yet. Look at your runs again.")
                self.show_changes({RUNS})

        if question.choices is not None:
            self.app.push_screen(ChoiceQuestion(question.ask, question.choices), keep)
        else:
            unit = split_quantity(question.within or "")[1]
            self.app.push_screen(TextQuestion(question.ask, placeholder=f"a number with its unit, as 1.5 {unit}".rstrip()), keep)

    def _newest_record(self, lesson: Lesson) -> Path | None:
        """Return the newest record of a lesson; None before its first run."""
        folder = results_folder(lesson)
        own = [run.path for run in self.workbench.runs if run.path.parent == folder and run.path.is_file()]
        return own[-1] if own else max(folder.glob("*.h5"), key=lambda path: path.stat().st_mtime, default=None)

    def _answers(self, lesson: Lesson) -> dict[str, Answered]:
        """Return the last answers to the questions of a lesson, whichever run they stand beside."""
        if not lesson.settings.questions:
            return {}
        kept = sorted(results_folder(lesson).glob("*.answers.json"), key=lambda path: path.stat().st_mtime)
        return read_answers(kept[-1].with_suffix("").with_suffix(".h5")) if kept else {}

    def command(self) -> str:
        """Return the command that does the same as F5."""
        lesson = self._chosen() if self.is_mounted else None
        if lesson is not None and self._is_on_bench(lesson):
            return self.workbench.command()
        return f"lathesim run {lesson.name}" if lesson is not None else "lathesim lessons"


def _page(lesson: Lesson) -> str:
    """Return the page of a lesson in Markdown: its place in the course, what is learnt, the text and the cases."""
    settings = lesson.settings
    words = [settings.unit, f"{settings.minutes} minutes" if settings.minutes is not None else None, settings.level]
    words.append(f"after {', '.join(settings.after)}" if settings.after else None)
    course = " · ".join(word for word in words if word)
    cases = "".join(f"\n- **{name}** {variant.text}" for name, variant in settings.variants.items())
    blocks = [f"# {lesson.title}", f"*{course}*" if course else "", settings.learn, settings.text, f"**Cases**\n{cases}" if cases else ""]
    return "\n\n".join(block for block in blocks if block)


def _limits(lesson: Lesson) -> list[tuple[str, str, Goal]]:
    """Return the limits of a lesson's goals: key in the book, limit as text, goal."""
    found = []
    for goal in lesson.settings.goals:
        for sense, limit in (("at most", goal.at_most), ("at least", goal.at_least)):
            if limit is not None:
                found.append((f"{goal.metric} {sense}", limit, goal))
    return found


def _together(entry: LessonEntry, limits: list[tuple[str, str, Goal]]) -> str:
    """Return in words whether one run met all goals, if there are several and each was met by some run."""
    if len(limits) < 2 or not all(key in entry.best and entry.best[key].met for key, _, _ in limits):
        return ""
    return "; one run met all" if entry.has_met(f"{key} {limit}" for key, limit, _ in limits) else "; no run met all of them together"


def _goals_text(lesson: Lesson, entry: LessonEntry) -> Text:
    """Return the goals with the best values reached; each run opens one step more of their hints."""
    limits = _limits(lesson)
    if not limits:
        return Text(f"No goals. Runs so far: {entry.tries}.")
    text = Text(f"Goals (runs so far: {entry.tries}{_together(entry, limits)})", style="bold")
    for key, limit, goal in limits:
        best = entry.best.get(key)
        sign = "✓" if best is not None and best.met else "✗" if best is not None else "○"
        reached = f", best {best.value:.4g} {best.unit}" if best is not None else ""
        metric, _, sense = key.partition(" ")
        text.append(pretty_quantities(f"\n{sign} {plain_name(metric)} {sense} {limit}{reached} "), style="not bold")
        text.append(metric, style="not bold dim")
        if goal.hint and not (best is not None and best.met):
            text.append("".join(f"\n  Hint: {hint}" for hint in goal.hint[: entry.tries]), style="not bold italic")
            if entry.tries < len(goal.hint):
                which = ("first", "next")[entry.tries > 0]
                text.append(f"\n  A hint opens after your {which} run.", style="not bold italic")
    return text
