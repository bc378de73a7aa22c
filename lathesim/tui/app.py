"""The terminal app: its screens, the keys that go with them, the command palette, and the runs, which go on in threads."""

from __future__ import annotations

import importlib
import signal
import threading
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, cast

from textual.binding import Binding, BindingType
from textual.command import DiscoveryHit, Hit, Hits, Provider
from textual.screen import Screen

from lathesim.errors import LatheSimError
from lathesim.tui.model.workbench import RUNS, Workbench
from lathesim.tui.textual_corrections import RepaintingApp, resume_only_after_a_stop

if TYPE_CHECKING:
    from lathesim.tui.model.live_run import LiveRun
    from lathesim.tui.model.student_book import StudentBook


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
        """Return what fits the text typed."""
        matcher = self.matcher(query)
        for name, about, action in self._entries():
            score = matcher.match(name)
            if score > 0.0:
                yield Hit(score, matcher.highlight(name), action, help=about)

    def _screens(self) -> Iterator[Entry]:
        for name, key, title in navigation():
            if name != "run":
                yield title, f"screen, {key.upper()}", partial(self._app.switch_mode, name)
        yield "Run or stop", "F5", self._app.action_run_or_stop

    def _actions(self) -> Iterator[Entry]:
        """Return what the keys of each screen do."""
        import importlib

        for name, _, title in navigation():
            if name == "run":
                continue
            module, _, screen = SCREENS[name][2].partition(":")
            for binding in getattr(importlib.import_module(module), screen).BINDINGS:
                if binding.description:
                    key = binding.key_display or binding.key
                    about = f"{binding.tooltip or binding.description} ({title}, key {key})"
                    yield binding.description, about, partial(self._app.do_on, name, binding.action)

    def _entries(self) -> Iterator[Entry]:
        from lathesim.errors import LatheSimError
        from lathesim.lessons.lesson_list import lesson_files

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


SCREENS: dict[str, tuple[str, str, str]] = {
    "help": ("f1", "Help", "lathesim.tui.screens.help:HelpScreen"),
    "bench": ("f2", "Bench", "lathesim.tui.screens.bench:BenchScreen"),
    "results": ("f3", "Results", "lathesim.tui.screens.results:ResultsScreen"),
    "configure": ("f4", "Configure", "lathesim.tui.screens.configure:ConfigureScreen"),
    "lessons": ("f6", "Lessons", "lathesim.tui.screens.lessons:LessonsScreen"),
    "detective": ("f7", "Detective", "lathesim.tui.screens.detective:DetectiveScreen"),
    "plugins": ("f8", "Plug-ins", "lathesim.tui.screens.plugins:PluginsScreen"),
}
"""Name -> key, title, and where the screen is; it is imported when it is first shown."""


def navigation() -> list[tuple[str, str, str]]:
    """Return name, key and title of each screen there is, and of Run, in the order of the keys."""
    entries = [(name, key, title) for name, (key, title, where) in SCREENS.items() if _is_there(where)]
    return sorted([*entries, ("run", "f5", "RUN")], key=lambda entry: entry[1])


def _made(where: str) -> Screen[Any]:
    module, _, name = where.partition(":")
    screen: Screen[Any] = getattr(importlib.import_module(module), name)()
    return screen


def _is_there(where: str) -> bool:
    return (Path(__file__).parent / "screens" / f"{where.partition(':')[0].rpartition('.')[2]}.py").is_file()


class LathesimApp(RepaintingApp[None]):
    """The app over a workbench."""

    TITLE = "lathesim"
    CSS_PATH = "app.tcss"
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (110, "-wide"), (160, "-very-wide")]
    VERTICAL_BREAKPOINTS = [(0, "-low"), (36, "-high")]
    MODES: ClassVar[dict[str, str | Callable[[], Screen[Any]]]] = {
        name: partial(_made, where) for name, (_, _, where) in SCREENS.items() if _is_there(where)
    }
    DEFAULT_MODE = "bench"
    COMMANDS: ClassVar[set[Any]] = RepaintingApp.COMMANDS | {WorkbenchProvider}
    BINDINGS: ClassVar[list[BindingType]] = [
        *(
            Binding(key, f"switch_mode('{name}')", title, priority=True, show=False)
            for name, (key, title, where) in SCREENS.items()
            if _is_there(where)
        ),
        Binding("f5", "run_or_stop", "Run/Stop", priority=True, show=False),
        Binding("ctrl+z", "undo", "Undo", show=False),
        Binding("ctrl+y", "redo", "Redo", show=False),
        Binding("ctrl+q", "quit", "Quit", priority=True, show=False),
    ]

    def __init__(self, workbench: Workbench, first: str = "bench", lesson: str = "") -> None:
        """Show ``workbench``, with the screen ``first``; the ``lesson`` is opened once the first screen is painted."""
        super().__init__()
        self.workbench = workbench
        self._first = first
        self._lesson = lesson
        workbench.is_opening = bool(lesson)
        self._watched: LiveRun | None = None
        self._book: StudentBook | None = None
        self.droppable = 0
        """Threads at work that write nothing: leaving need not wait for them."""

    @property
    def book(self) -> StudentBook:
        """The student's progress in the folder the app was opened in."""
        if self._book is None:
            from lathesim.tui.model.student_book import StudentBook

            self._book = StudentBook()
        return self._book

    def on_mount(self) -> None:
        """Show the first screen, and keep the data when the terminal goes away."""
        if self._lesson:
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
        try:
            workbench.open_lesson(self._lesson)
        except LatheSimError as error:
            self.notify(str(error), severity="error", timeout=12.0, markup=False)
            return
        if wanted:
            self.action_run_or_stop()

    def tell(self, sentence: str) -> None:
        """Show a sentence, from whichever thread it comes."""
        if not self.is_running:
            return
        if threading.get_ident() == self._thread_id:
            self.notify(sentence, markup=False)
        else:
            self.call_later(self.notify, sentence, markup=False)

    def mode_of(self, screen: Screen[Any]) -> str:
        """Return the name of a screen in the table."""
        return next((name for name, (_, _, where) in SCREENS.items() if where.endswith(f":{type(screen).__name__}")), "")

    def _leave(self) -> None:
        """End the run, keep its data, and go."""
        self.stop_run()
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
        try:
            started = self.workbench.new_run()
        except (LatheSimError, OSError) as error:
            self.notify(str(error), severity="error", timeout=12.0, markup=False)
            return
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
            self.notify(sentence, severity="error", timeout=max(8.0, len(sentence) / 12.0), markup=False)
        if kept is not None and kept.is_finished:
            try:
                self.book.note(live.lesson, kept.judgement)
            except LatheSimError as error:
                self.notify(str(error), severity="error", timeout=12.0, markup=False)
        self.workbench.tell(RUNS)

    def open_lesson(self, path: Path) -> None:
        """Put a lesson on the bench and show it."""
        try:
            self.workbench.open_lesson(path)
        except LatheSimError as error:
            self.notify(str(error), severity="error", timeout=12.0, markup=False)
            return
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
        from lathesim.tui.screens.bench import BenchScreen

        await self.switch_mode("bench")
        if isinstance(self.screen, BenchScreen):
            self.screen.show_channels((name,))

    async def show_parameter(self, name: str) -> None:
        """Show a parameter where it can be changed."""
        await self.switch_mode("configure" if "configure" in self.MODES else "bench")
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
