"""An app that repaints what was held back while updates were batched."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TypeVar

from textual.app import App

Result = TypeVar("Result")


class RepaintingApp(App[Result]):
    """An app whose screens are painted once a batch of updates ends.

    Textual 8.2 paints nothing during a batch. Markdown and the footer hold a batch open over many turns of the event loop. A screen that
    turns idle meanwhile puts its repaint off, and the end of the batch wakes the app alone. The old screen would stay drawn until an event
    reaches the new one.
    """

    _has_missed = False
    """Whether a picture was dropped because a batch was open."""

    @contextmanager
    def batch_update(self) -> Iterator[None]:
        """Hold repaints back, then wake the screens; a picture that was dropped is painted anew."""
        try:
            with super().batch_update():
                yield
        finally:
            if not self._batch_count:
                self._wake_screens()

    def post_display_hook(self) -> None:
        """Note a picture that the open batch dropped."""
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
