"""What all screens share: the workbench, what changed on it since they were last looked at, the command and the keys at the bottom."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, cast

from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal
from textual.screen import ModalScreen, Screen, ScreenResultType
from textual.widget import Widget
from textual.widgets import Button, Footer, Static

from lathesim.tui.model.workbench import REGISTRY, RUN, RUNS, SETUP, Workbench, fault_words

if TYPE_CHECKING:
    from lathesim.tui.app import LathesimApp


class Dialog(ModalScreen[ScreenResultType]):
    """Lies over a screen and gives an answer, none where it is left; ``?`` shows its keys, unless a field takes the letter."""

    BINDINGS = [
        Binding("escape", "dismiss(None)", "Leave the dialog"),
        Binding("question_mark", "app.keys", "Keys of this dialog", key_display="?", show=False),
    ]

    @on(Button.Pressed, "#leave")
    def _leave(self) -> None:
        self.dismiss(None)


def dialog_buttons(take: str, leave: str) -> Horizontal:
    """Return the buttons of a dialog by their words: the one that takes what was chosen, if there is any, and the one that leaves it."""
    buttons = [Button(take, id="take", compact=True)] if take else []
    buttons.append(Button(leave, id="leave", compact=True))
    buttons[0].variant = "primary"
    return Horizontal(*buttons, classes="buttons")


class KeyRow(Footer):
    """The keys at the bottom, made anew only where they are other ones: a focus that moves on leaves them mostly as they are."""

    _made: tuple[object, ...] = ()

    def compose(self) -> ComposeResult:
        """Return the keys that work now."""
        self._made = self._keys() if self._bindings_ready else ()
        yield from super().compose()

    def bindings_changed(self, screen: Screen[Any]) -> None:
        """Make the keys anew where they changed."""
        if not self._bindings_ready or self._keys() != self._made:
            super().bindings_changed(screen)

    def _keys(self) -> tuple[object, ...]:
        palette = self.app.COMMAND_PALETTE_BINDING
        return tuple((key, *active[1:]) for key, active in self.screen.active_bindings.items() if active.binding.show or key == palette)


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


_SHORT = {"Configure": "Config", "Plug-ins": "Plugins"}
_NARROW = 90
"""Columns below which shorter titles are shown, so that all entries fit into 80."""


class NavigationEntry(Static):
    """A screen or an action: shown as ``F2 Bench``; a click does what the key does."""

    def __init__(self, key: str, title: str, action: str, *, is_here: bool = False, id: str | None = None) -> None:
        super().__init__(id=id, markup=False)
        self._key = key
        self._action = action
        self._title = title
        self.set_class(is_here, "-here")
        self.show(title)

    def show(self, title: str) -> None:
        """Show another title."""
        self._title = title
        self.update(f"{self._key.upper()} {title}")

    def shorten(self, narrow: bool) -> None:
        """Show the short title where there is little room."""
        self.update(f"{self._key.upper()} {_SHORT.get(self._title, self._title) if narrow else self._title}")

    async def on_click(self) -> None:
        """Do it."""
        await self.app.run_action(self._action)


class NavigationBar(Horizontal):
    """One row of entries; the screen that is shown is in reverse and between brackets."""

    DEFAULT_CSS = """
    NavigationBar { height: 1; background: $panel; }
    NavigationEntry { width: auto; padding: 0 1 0 0; }
    NavigationEntry:hover { background: $boost; text-style: underline; }
    NavigationEntry.-here { text-style: bold reverse; }
    NavigationEntry.-running { text-style: bold; color: $error; }
    """

    def __init__(self, entries: Sequence[tuple[str, str, str]], here: str) -> None:
        super().__init__()
        self._entries = entries
        self._here = here

    def compose(self) -> ComposeResult:
        """Return the entries."""
        for name, key, title in self._entries:
            action = f"switch_mode('{name}')" if name != "run" else "run_or_stop"
            yield NavigationEntry(key, title, action, is_here=title == self._here, id=f"go-{name}")

    def on_resize(self) -> None:
        """Fit all entries into the row."""
        for entry in self.query(NavigationEntry):
            entry.shorten(self.size.width < _NARROW)

    def show_running(self, running: bool) -> None:
        """Show Stop while a run is under way, else Run."""
        entry = self.query_one("#go-run", NavigationEntry)
        entry.set_class(running, "-running")
        entry.show("STOP" if running else "RUN")


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
        yield NavigationBar(self.lathesim.navigation, self.title or "")
        yield from self.compose_body()
        yield CommandLine(id="command")
        yield KeyRow(show_command_palette=True, compact=True)

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

    def tell_fault(self, sentence: str) -> None:
        """Show a sentence about what is at fault, in place, for as long as it takes to read."""
        self.lathesim.tell_fault(sentence)

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
            except KeyboardInterrupt:
                fault = "It was stopped before anything was known."
            except Exception as error:
                fault = fault_words(error)
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
