"""What this program corrects in Textual 8.2: lost repaints, and threads left over when a terminal is closed."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TypeVar

from textual.app import App

Result = TypeVar("Result")


class RepaintingApp(App[Result]):
    """An app whose screens are painted once a batch of updates ends.

    Textual 8.2 paints nothing during a batch. Markdown and the footer keep a batch open over many turns of the event loop. A screen that
    becomes idle meanwhile postpones its repaint, and the end of the batch wakes only the app. The old screen would stay drawn until an
    event reaches the new one.
    """

    _has_missed = False
    """Whether a frame was dropped because a batch was open."""

    @contextmanager
    def batch_update(self) -> Iterator[None]:
        """Postpone repaints, then wake the screens; a dropped frame is painted again."""
        try:
            with super().batch_update():
                yield
        finally:
            if not self._batch_count:
                self._wake_screens()

    def post_display_hook(self) -> None:
        """Note a frame that the open batch dropped."""
        super().post_display_hook()
        self._has_missed = self._has_missed or self._batch_count > 0

    def _wake_screens(self) -> None:
        try:
            screens = self.screen_stack
        except KeyError:
            return  # there is no screen yet
        missed, self._has_missed = self._has_missed, False
        for screen in screens:
            if missed:
                screen.refresh()
            else:
                screen.check_idle()


def resume_only_after_a_stop() -> None:
    """Let a SIGCONT resume the terminal only after a SIGTSTP suspended it.

    A terminal that is closed sends SIGHUP and SIGCONT. Textual 8.2 answers each SIGCONT with new threads for input and output. Those of an
    app that was never suspended have nobody to end them, and the process outlives its app.
    """
    if not hasattr(signal, "SIGCONT"):
        return
    suspend, resume = signal.getsignal(signal.SIGTSTP), signal.getsignal(signal.SIGCONT)
    if not callable(suspend) or not callable(resume):
        return
    is_suspended = False

    def stopped(number: int, frame: FrameType | None) -> None:
        nonlocal is_suspended
        is_suspended = True
        suspend(number, frame)

    def continued(number: int, frame: FrameType | None) -> None:
        nonlocal is_suspended
        if is_suspended:
            is_suspended = False
            resume(number, frame)

    signal.signal(signal.SIGTSTP, stopped)
    signal.signal(signal.SIGCONT, continued)
