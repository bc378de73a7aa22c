"""The terminal app: its screens, the keys that go with them, the command palette, and the runs, which go on in threads."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, cast

from textual.binding import Binding, BindingsMap, BindingType
from textual.command import DiscoveryHit, Hit, Hits, Provider
from textual.screen import Screen

from lathesim.errors import LatheSimError
from lathesim.hookspecs import ScreenEntry
from lathesim.tui.model.workbench import RUNS, Workbench, fault_words
from lathesim.tui.textual_corrections import RepaintingApp, resume_only_after_a_stop

if TYPE_CHECKING:
    from lathesim.lessons.kept_run import KeptRun
    from lathesim.tui.model.live_run import LiveRun
    from lathesim.tui.model.student_book import StudentBook


_ROOM_FOR_VIEWS = 100
"""Columns from which on the row of keys names those of the views too; the key for help always does."""
Entry = tuple[str, str, Callable[[], object]]
"""What is found, a word about it, and what to do."""


class WorkbenchProvider(Provider):
    """Finds what stands on the workbench."""

    @property
    def _app(self) -> LathesimApp:
        return cast("LathesimApp", self.app)

    async def discover(self) -> Hits:
        """Return the screens before anything is typed."""
        for name, about, action in self._screens():
            yield DiscoveryHit(name, action, help=about)

    async def search(self, query: str) -> Hits:
        """Return what fits the text typed, by its exact name or in plain words."""
        from lathesim.analysis.display_unit import plain_name

        matcher = self.matcher(query)
        for name, about, action in self._entries():
            found = max((name, plain_name(name)), key=matcher.match)
            score = matcher.match(found)
            if score > 0.0:
                yield Hit(score, matcher.highlight(found), action, help=about)

    def _screens(self) -> Iterator[Entry]:
        for entry in self._app.entries:
            yield entry.title, f"screen, {entry.key.upper()}", partial(self._app.switch_mode, entry.name)
        yield "Run or stop", "F5", self._app.action_run_or_stop

    def _actions(self) -> Iterator[Entry]:
        """Return what the keys of each screen do."""
        for entry in self._app.entries:
            for binding in self._app.keys_of(entry):
                if binding.description:
                    about = f"{binding.tooltip or binding.description} ({entry.title}, key {binding.key_display or binding.key})"
                    yield binding.description, about, partial(self._app.do_on, entry.name, binding.action)

    def _entries(self) -> Iterator[Entry]:
        from lathesim.lessons.lesson import lesson_files

        app, workbench = self._app, self._app.workbench
        yield from self._screens()
        yield from self._actions()
        for path in lesson_files():
            yield path.stem, "lesson: put on the bench", partial(app.open_lesson, path)
        for name, component in workbench.registry.components.items():
            yield name, f"component: {_first_line(component)}", partial(app.show_help, "component", name)
        for name, component in workbench.registry.effects.items():
            yield name, f"effect: {_first_line(component)}", partial(app.show_help, "effect", name)
        try:
            plan = workbench.prepared().plan
        except LatheSimError:
            return
        for name in plan.channels:
            yield name, f"channel: {plan.doc(name)}", partial(app.show_channel, name)
        for name in plan.parameters:
            yield name, f"parameter: {plan.doc(name)}", partial(app.show_parameter, name)


def _first_line(component: type) -> str:
    return (component.__doc__ or "").strip().partition("\n")[0]


class LathesimApp(RepaintingApp[None]):
    """The app over a workbench."""

    TITLE = "lathesim"
    CSS_PATH = "app.tcss"
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (110, "-wide"), (160, "-very-wide")]
    VERTICAL_BREAKPOINTS = [(0, "-low"), (36, "-high")]
    DEFAULT_MODE = "bench"
    COMMANDS: ClassVar[set[Any]] = RepaintingApp.COMMANDS | {WorkbenchProvider}
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("f5", "run_or_stop", "Run/Stop", priority=True, show=False),
        Binding("ctrl+z", "undo", "Undo", show=False),
        Binding("ctrl+y", "redo", "Redo", show=False),
        Binding("ctrl+q", "quit", "Quit", priority=True, show=False),
        Binding("question_mark", "keys", "Keys of this screen", key_display="?", show=False),
    ]

    def __init__(self, workbench: Workbench, first: str = "", lessons: Sequence[tuple[str, str]] = (), theme: str = "") -> None:
        """Show ``workbench``, with the screen ``first``. The first of the ``lessons`` that there is, given with its case, is opened once
        the first screen is painted.

        The screens are those of the registry.
        """
        known = workbench.registry.screens.values()
        self.entries = sorted((entry for entry in known if not entry.over), key=lambda entry: (len(entry.key), entry.key))
        """The screens, in the order of their keys."""
        self._views = {entry.name: entry for entry in known if entry.over}
        self.MODES = {entry.name: partial(self._made, entry) for entry in self.entries}  # type: ignore[misc]
        super().__init__()
        self._bindings = BindingsMap.merge((BindingsMap(self._mode_keys), self._bindings))
        self.workbench = workbench
        self._first = first if first in self.MODES else self.DEFAULT_MODE
        self._lessons = [lesson for lesson in lessons if lesson[0]]
        workbench.is_opening = bool(self._lessons)
        if theme in self.available_themes:
            self.theme = theme
        self._watched: LiveRun | None = None
        self._book: StudentBook | None = None
        self.droppable = 0
        """Threads at work that write nothing: leaving need not wait for them."""

    @property
    def _mode_keys(self) -> list[Binding]:
        return [Binding(entry.key, f"switch_mode('{entry.name}')", entry.title, priority=True, show=False) for entry in self.entries]

    @property
    def keys(self) -> list[BindingType]:
        """The keys that hold on every screen."""
        return [*self._mode_keys, *self.BINDINGS]

    def keys_of(self, entry: ScreenEntry) -> list[Binding]:
        """Return the keys of a screen, and behind them those of the views that open over it."""
        return [*[item for item in getattr(entry.load(), "BINDINGS", ()) if isinstance(item, Binding)], *self._view_keys(entry)]

    def _view_keys(self, entry: ScreenEntry) -> list[Binding]:
        views = [view for view in self._views.values() if view.over == entry.name]
        has_room = self.size.width >= _ROOM_FOR_VIEWS
        return [Binding(view.key, f"app.open_view('{view.name}')", view.title, tooltip=view.about, show=has_room) for view in views]

    def action_keys(self) -> None:
        """Show the keys of the screen in front: its own, those of the list or plot with the cursor, and those that hold everywhere."""
        from lathesim.tui.screens.help import KeysView

        screen = self.screen
        entry = next((entry for entry in self.entries if entry.name == self.current_mode and not screen.is_modal), None)
        first = "This dialog" if screen.is_modal else screen.title or "This screen"
        groups: dict[str, list[BindingType]] = {first: [], "Where the cursor is": [], "Everywhere": []}
        for active in screen.active_bindings.values():
            if active.binding.action.startswith(("app.focus", "screen.")):
                continue  # the usual keys of each Textual screen
            place = 0 if active.node is screen else 2 if active.node is self else 1
            list(groups.values())[place].append(active.binding)
        self.push_screen(KeysView(entry.about if entry is not None else "", groups))

    def _made(self, entry: ScreenEntry) -> Screen[Any]:
        screen: Screen[Any] = entry.load()()
        screen.title = entry.title
        screen._bindings = BindingsMap.merge((screen._bindings, BindingsMap(self._view_keys(entry))))
        return screen

    @property
    def navigation(self) -> list[tuple[str, str, str]]:
        """Name, key and title of each screen, and of Run, in the order of the keys."""
        found = [*((entry.name, entry.key, entry.title) for entry in self.entries), ("run", "f5", "RUN")]
        return sorted(found, key=lambda item: (len(item[1]), item[1]))

    def action_open_view(self, name: str) -> None:
        """Open a view over the screen, on the lesson of the bench."""
        setup = self.workbench.setup
        if setup is None:
            return
        with self.faults_told():
            self.push_screen(self._views[name].load()(setup.lesson))

    def tell_fault(self, sentence: str) -> None:
        """Show a sentence about what is at fault, for as long as it takes to read."""
        self.notify(sentence, severity="error", timeout=max(6.0, len(sentence) / 12.0), markup=False)

    @contextmanager
    def faults_told(self) -> Iterator[None]:
        """Return a context in which what is at fault is told, and the rest is left out."""
        try:
            yield
        except (LatheSimError, OSError) as error:
            self.tell_fault(fault_words(error))

    @property
    def book(self) -> StudentBook:
        """The student's progress in the folder the app was opened in."""
        if self._book is None:
            from lathesim.tui.model.student_book import StudentBook

            self._book = StudentBook()
        return self._book

    def on_mount(self) -> None:
        """Show the first screen, and keep the data when the terminal goes away."""
        if self._lessons:
            self.call_after_refresh(self.open_first)
        if self._first != self.DEFAULT_MODE:
            self.switch_mode(self._first)
        self.set_interval(0.1, self._watch_run)
        import asyncio

        if threading.current_thread() is threading.main_thread():
            resume_only_after_a_stop()
        loop = asyncio.get_running_loop()
        for number in (signal.SIGHUP, signal.SIGTERM) if hasattr(signal, "SIGHUP") else ():
            try:
                loop.add_signal_handler(number, self._leave)
            except (NotImplementedError, RuntimeError, ValueError):
                return

    def open_first(self) -> None:
        """Read the lesson the app begins with, then begin the run that was asked for meanwhile."""
        workbench = self.workbench
        wanted = workbench.run_is_wanted
        workbench.is_opening = workbench.run_is_wanted = False
        for lesson, variant in self._lessons:
            with self.faults_told():
                workbench.open_lesson(lesson, variant or None)
                break
        if wanted and workbench.setup is not None:
            self.action_run_or_stop()

    def tell(self, sentence: str) -> None:
        """Show a sentence, from whichever thread it comes."""
        if not self.is_running:
            return
        if threading.get_ident() == self._thread_id:
            self.notify(sentence, markup=False)
        else:
            self.call_later(self.notify, sentence, markup=False)

    def _leave(self) -> None:
        """End the run, keep its data, the lesson and the looks, and go."""
        from lathesim.tui.model.student_book import KeptState

        self.stop_run()
        setup = self.workbench.setup
        word, variant = (setup.lesson_word, setup.variant or "") if setup is not None else ("", "")
        KeptState(self.theme, word, variant, self.current_mode).write()
        self.exit()

    def stop_run(self, patience: float = 10.0) -> None:
        """Stop the run under way, if there is one, and wait until its data are kept."""
        live = self.workbench.live
        if live is not None:
            live.stop()
            live.wait(patience)

    async def action_quit(self) -> None:
        """Leave; a run under way is stopped and kept."""
        self._leave()

    def action_run_or_stop(self) -> None:
        """Run the lesson on the bench or under the cursor, or stop the run under way.

        While the lesson is still being read, note whether it shall run.
        """
        if self.workbench.is_opening:
            self.workbench.want_run(not self.workbench.run_is_wanted)
            return
        from lathesim.tui.screens.workbench_screen import WorkbenchScreen

        live = self.workbench.live
        if live is not None:
            live.stop()
            return
        if isinstance(self.screen, WorkbenchScreen) and not self.screen.make_ready():
            return
        with self.faults_told():
            started = self.workbench.new_run()
            self._watched = started
            self.run_worker(partial(started.run, self.workbench.registry), thread=True, group="run", exit_on_error=False)
            if self.current_mode != "bench":
                self.switch_mode("bench")

    def _watch_run(self) -> None:
        """Announce that a run has ended: to the screens, the book and, where something broke, the person."""
        live = self._watched
        if live is None or not live.is_over:
            return
        self._watched = None
        kept = live.kept
        sentence = live.fault or (kept.failure if kept is not None else "")
        if sentence:
            self.tell_fault(sentence)
        if kept is not None and kept.is_finished:
            with self.faults_told():
                self.book.note(live.lesson, kept.judgement)
                self._point_to_questions(kept)
        self.workbench.tell(RUNS)

    def _point_to_questions(self, kept: KeptRun) -> None:
        """Notify where the questions about a run are answered, if its lesson has any."""
        count = len(kept.case.case.lesson.settings.questions)
        if count:
            self.notify(f"{count} question{'s' * (count > 1)} about this run: press F6, then a.", timeout=8.0)

    def open_lesson(self, path: Path) -> None:
        """Put a lesson on the bench and show it."""
        with self.faults_told():
            self.workbench.open_lesson(path)
            self.switch_mode("bench")

    async def do_on(self, mode: str, action: str) -> None:
        """Go to a screen and do what one of its keys does."""
        await self.switch_mode(mode)
        await self.run_action(action, self.screen)

    async def show_help(self, kind: str, name: str) -> None:
        """Show the page of a component or an effect."""
        from lathesim.tui.screens.help import HelpScreen

        await self.switch_mode("help")
        if isinstance(self.screen, HelpScreen):
            self.screen.show_page(kind, name)

    async def show_channel(self, name: str) -> None:
        """Show a channel in the plot of the bench."""
        from lathesim.tui.screens.bench_screen import BenchScreen

        await self.switch_mode("bench")
        if isinstance(self.screen, BenchScreen):
            self.screen.show_channels((name,))

    async def show_parameter(self, name: str) -> None:
        """Show a parameter where it can be changed."""
        await self.switch_mode("configure")
        show = getattr(self.screen, "show_parameter", None)
        if show is not None:
            show(name)

    def action_undo(self) -> None:
        """Take the last change back."""
        if not self.workbench.undo():
            self.notify("There is nothing to undo.")

    def action_redo(self) -> None:
        """Make an undone change again."""
        if not self.workbench.redo():
            self.notify("There is nothing to redo.")
