"""Who is told when a machine has to be compiled, and when it cannot be."""

from __future__ import annotations

from collections.abc import Callable

Listener = Callable[[str], None]
_listeners: list[Listener] = []


def tell_compiling_to(listener: Listener | None) -> None:
    """Let ``listener`` take the sentences about compiling from now on, in place of the one before; none says nothing."""
    _listeners[:] = [] if listener is None else [listener]


def say(sentence: str) -> None:
    """Notify the listener, if there is one."""
    for listener in _listeners:
        listener(sentence)
