"""The variables of a running program: numbered, named, and those that tell about the machine."""

from __future__ import annotations

from collections.abc import Callable, Mapping

Value = float | None
"""A number, or None for a variable that holds nothing (``#0`` of Fanuc)."""

MOST_VARIABLES = 20_000
"""Variables that one program may fill, assumed: far more than any part needs."""


class Variables:
    """Numbered and named variables; calls of subprograms have numbered ones of their own up to ``locals_to``.

    ``system`` answers for the variables of the machine (position, tool), by number or name, and returns None for others.
    With ``empty`` a variable that nothing was assigned to holds nothing, else it is 0.
    """

    def __init__(self, system: Callable[[int | str], Value], *, locals_to: int = 30, empty: bool = False) -> None:
        self._system = system
        self._locals_to = locals_to
        self._empty = empty
        self._numbers: dict[int, Value] = {}
        self._names: dict[str, float] = {}
        self._frames: list[tuple[dict[int, Value], dict[str, float]]] = [({}, {})]

    def number(self, number: int) -> Value:
        """Return the value of a numbered variable."""
        if number == 0 and self._empty:
            return None
        store = self._frames[-1][0] if number <= self._locals_to else self._numbers
        if number in store:
            return store[number]
        told = self._system(number)
        return told if told is not None or self._empty else 0.0

    def name(self, name: str) -> Value:
        """Return the value of a named variable, or None where there is none."""
        store = self._names if name.startswith("_") else self._frames[-1][1]
        return store[name] if name in store else self._system(name)

    def is_of_caller(self, name: str) -> bool:
        """Return whether a named variable is local to a calling program, and so unknown here."""
        return any(name in names for _, names in self._frames[:-1])

    def set_number(self, number: int, value: Value) -> None:
        """Assign to a numbered variable."""
        store = self._frames[-1][0] if number <= self._locals_to else self._numbers
        if number not in store and len(store) >= MOST_VARIABLES:
            raise OverflowError
        store[number] = value

    def set_name(self, name: str, value: float) -> None:
        """Assign to a named variable; a name that begins with an underscore is known everywhere."""
        store = self._names if name.startswith("_") else self._frames[-1][1]
        if name not in store and len(store) >= MOST_VARIABLES:
            raise OverflowError
        store[name] = value

    def enter(self, arguments: Mapping[int, float]) -> None:
        """Begin a call with variables of its own."""
        self._frames.append((dict(arguments), {}))

    def leave(self) -> None:
        """End a call."""
        self._frames.pop()
