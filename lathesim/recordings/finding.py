"""Something found in a recording that a person should know."""

from __future__ import annotations

from dataclasses import dataclass


def counted(number: int, noun: str, one: str = "", several: str = "") -> str:
    """Return ``1 sample is``, ``2 samples are``: a number, what it counts, and the verb ``one`` or ``several`` where there is one."""
    text = f"{number} {noun} {one}" if number == 1 else f"{number} {noun}s {several}"
    return text.strip()


@dataclass(frozen=True)
class Finding:
    """What was found in a recording, and what was done about it.

    ``kind`` is a word for programs (``unit``, ``gap``, ``frozen`` ...), ``channel`` the channel (several with ``, `` between, empty for
    the whole recording), ``fact`` and ``done`` read as a sentence. ``serious`` ones make the recording unfit to name physics from.
    """

    kind: str
    channel: str
    fact: str
    done: str
    serious: bool = False

    def __str__(self) -> str:
        place = f"{self.channel}: " if self.channel else ""
        return f"{place}{self.fact}; {self.done}." if self.done else f"{place}{self.fact}."
