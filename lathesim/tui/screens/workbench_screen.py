"""What all screens share: the workbench, what changed on it since they were last looked at, the command and the keys at the bottom."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, cast

from textual.app import ComposeResult
from textual.screen import Screen
from textual.widget import Widget
from textual.widgets import Footer

from lathesim.errors import LatheSimError
from lathesim.tui.model.workbench import REGISTRY, RUN, RUNS, SETUP, Workbench
from lathesim.tui.widgets.command_line import CommandLine
from lathesim.tui.widgets.navigation_bar import NavigationBar

if TYPE_CHECKING:
    from lathesim.tui.app import LathesimApp


class WorkbenchScreen(Screen[None]):
    """A screen over the workbench. It fills itself in :meth:`show_changes`, called when it is looked at and something changed."""

    def __init__(self) -> None:
        super().__init__()
        self._stale = {SETUP, RUN, RUNS, REGISTRY}
        self._forget: Callable[[], None] | None = None
        self.busy = ""
        """What is being done in a thread, in words; empty where nothing is."""

    @property
    def lathesim(self) -> LathesimApp:
        """The app."""
        return cast("LathesimApp", self.app)

    @property
    def workbench(self) -> Workbench:
        """The model all screens read."""
        return self.lathesim.workbench

    def compose(self) -> ComposeResult:
        """Return the screens there are, the body, the command and the keys."""
        from lathesim.tui.app import navigation

        yield NavigationBar(navigation(), self.lathesim.mode_of(self))
        yield from self.compose_body()
        yield CommandLine(id="command")
        yield Footer(show_command_palette=True, compact=True)

    def compose_body(self) -> Iterable[Widget]:
        """Return the widgets of the screen."""
        raise NotImplementedError

    def show_changes(self, changed: set[str]) -> None:
        """Show what changed: of ``SETUP``, ``RUN``, ``RUNS``, ``REGISTRY``."""
        raise NotImplementedError

    def on_mount(self) -> None:
        """Listen to the workbench."""
        self._forget = self.workbench.listen(self._hear)
        self.call_after_refresh(self._update)

    def on_unmount(self) -> None:
        """Stop listening."""
        if self._forget is not None:
            self._forget()

    def on_screen_resume(self) -> None:
        """Show what changed while another screen was looked at."""
        self._update()

    def _hear(self, what: str) -> None:
        self._stale.add(what)
        if self.is_current:
            self.call_later(self._update)

    def _update(self) -> None:
        if not self._stale or not self.is_mounted or not self.is_current:
            return
        if not all(widget.is_mounted for widget in self.walk_children(Widget)):
            # It is shown before all that it holds stands. A timer lets the widgets mount; a callback of this screen's idling would not.
            self.set_timer(0.05, self._update)
            return
        changed, self._stale = self._stale, set()
        self.show_changes(changed)
        self.query_one(NavigationBar).show_running(self.workbench.live is not None or self.workbench.run_is_wanted)
        self.show_command()

    def show_command(self) -> None:
        """Show the command anew: what it stands for has changed."""
        self.query_one(CommandLine).show(self.command())

    def command(self) -> str:
        """Return the command that does what this screen does; that of the bench unless a screen has its own."""
        return self.workbench.command()

    def make_ready(self) -> bool:
        """Put the lesson that F5 runs from this screen on the bench; return whether there is one."""
        return True

    def tell_fault(self, sentence: str, **further: Any) -> None:
        """Show a sentence about what is at fault, in place, for as long as it takes to read."""
        self.notify(sentence, severity="error", timeout=max(6.0, len(sentence) / 12.0), markup=False, **further)

    def in_thread(self, busy: str, work: Callable[[], object], done: Callable[[], object], *, writes: bool = True) -> None:
        """Do long work in a thread, one at a time; ``busy`` says what. Afterwards call ``done``, or tell what went wrong.

        Work that ``writes`` nothing is dropped where the app is left meanwhile.
        """
        if self.busy:
            self.notify(f"{self.busy} Wait, or stop it.", severity="warning", markup=False)
            return
        self.busy = busy
        self.show_busy("")
        app = self.lathesim
        app.droppable += not writes

        def run() -> None:
            fault = ""
            try:
                work()
            except LatheSimError as error:
                fault = str(error)
            except OSError as error:
                fault = f"{error.filename or 'a file'}: {error.strerror or error}."
            except KeyboardInterrupt:
                fault = "It was stopped before anything was known."
            except Exception as error:
                fault = f"This is a fault of the program, not of your input: {type(error).__name__}: {error}"
            finally:
                app.droppable -= not writes
            if app.is_running:
                self.call_later(self._worked, fault, done)

        if writes:
            self.run_worker(run, thread=True, exit_on_error=False)
        else:
            threading.Thread(target=run, daemon=True).start()  # the app waits for its workers when it is left

    def _worked(self, fault: str, done: Callable[[], object]) -> None:
        self.busy = ""
        if fault:
            self.tell_fault(fault)
        else:
            done()
        self.show_busy(fault)

    def show_busy(self, fault: str) -> None:
        """Show what is being done (``busy``), or the fault it ended with."""
