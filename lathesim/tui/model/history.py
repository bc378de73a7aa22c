"""Undo and redo of setups."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lathesim.tui.model.setup import Setup


class History:
    """The setup on the bench, with those before it and those undone."""

    def __init__(self, setup: Setup) -> None:
        self._past: list[Setup] = []
        self._undone: list[Setup] = []
        self.present = setup

    def change(self, setup: Setup) -> None:
        """Put another setup on the bench; one that is equal changes nothing."""
        if setup == self.present:
            return
        self._past.append(self.present)
        self._undone.clear()
        self.present = setup

    def undo(self) -> bool:
        """Go back one change; False where there is none."""
        return self._move(self._past, self._undone)

    def redo(self) -> bool:
        """Take back an undo; False where there is none."""
        return self._move(self._undone, self._past)

    def _move(self, origin: list[Setup], target: list[Setup]) -> bool:
        if not origin:
            return False
        target.append(self.present)
        self.present = origin.pop()
        return True
