"""An app that repaints its screens after a batch of updates."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
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
