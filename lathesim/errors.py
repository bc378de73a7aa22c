"""The errors a person may see, and the search for the name that was meant.

Every message has the same shape: place, fact, nearest name, remedy. A :class:`LatheSimError` is the input's fault (exit code 1);
anything else that escapes is a fault of the program (exit code 3).
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Sequence


class LatheSimError(Exception):
    """A fault of the input, told in one clear message.

    ``place`` is where it stands (``file:line:column`` or a part's name), ``fact`` what is wrong, ``remedy`` what to do about it.
    """

    def __init__(self, fact: str, *, place: str = "", remedy: str = "") -> None:
        self.fact = fact
        self.place = place
        self.remedy = remedy
        super().__init__(visible(self.message, keep="\n\t"))

    @property
    def message(self) -> str:
        """The whole sentence as a person reads it."""
        text = f"{self.place}: {self.fact}" if self.place else self.fact
        return f"{text} {self.remedy}" if self.remedy else text


class ComponentError(LatheSimError):
    """A component class contradicts itself or breaks the contract."""


class PluginError(LatheSimError):
    """A plug-in cannot be loaded."""


class UnitError(LatheSimError):
    """A quantity has no unit, an unknown unit, or the wrong one."""


class WiringError(LatheSimError):
    """Parts and wires do not make a machine that can be run."""


class ProgramError(LatheSimError):
    """A part program cannot be read; the place is ``file:physical line``."""


class Fault(Exception):  # noqa: N818 - it becomes an error with its place
    """What is wrong and what to do about it, found where the file is not known; whoever knows it makes an error of it with :meth:`at`.

    ``line`` is the physical line at fault, 0 for the one being read.
    """

    def __init__(self, fact: str, remedy: str, line: int = 0) -> None:
        super().__init__(fact)
        self.fact, self.remedy, self.line = fact, remedy, line

    def at(self, file: str, line: int) -> ProgramError:
        """Return the error with its place, ``line`` being the one that was read."""
        return ProgramError(self.fact, place=f"{file}:{self.line or line}", remedy=self.remedy)


class SeveralFaultsError(ProgramError):
    """Several lines of a part program cannot be read; ``errors`` are told one below the other, and the first gives place and remedy."""

    def __init__(self, errors: Sequence[ProgramError], more: int = 0) -> None:
        self.errors = tuple(errors)
        self.more = more
        super().__init__(errors[0].fact, place=errors[0].place, remedy=errors[0].remedy)

    @property
    def message(self) -> str:
        """All sentences, a line each."""
        return "\n".join([*(error.message for error in self.errors), *([f"and {self.more} more"] if self.more else [])])


class LessonError(LatheSimError):
    """A lesson or a machine template is wrong; the place is ``file:line:column``."""


class RecordError(LatheSimError):
    """A record cannot be read or written."""


class WriteError(RecordError):
    """A file cannot be written; nothing was replaced."""


class RecordingError(LatheSimError):
    """A recording made elsewhere cannot be used as it is mapped."""


class SimulationError(LatheSimError):
    """A run had to end early; the data up to then are kept in ``record`` where there are any."""

    def __init__(self, fact: str, *, place: str = "", remedy: str = "", record: object = None) -> None:
        super().__init__(fact, place=place, remedy=remedy)
        self.record = record


def visible(text: str, keep: str = "") -> str:
    """Return a text with its control characters as escapes, except those in ``keep``: raw escape codes would steer the terminal."""
    if text.isascii() and text.isprintable():
        return text
    hidden = {character for character in text if unicodedata.category(character) in ("Cc", "Cf", "Cs")} - set(keep)
    return text.translate({ord(character): character.encode("unicode_escape").decode() for character in hidden}) if hidden else text


def listed(names: Sequence[str]) -> str:
    """Return ``"a, b and c"``."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def nearest(name: str, names: Iterable[str]) -> str:
    """Return ``"Did you mean 'x'?"`` for the name most like ``name``, or an empty text where none is near."""
    import difflib

    found = difflib.get_close_matches(name, list(names), n=1, cutoff=0.6)
    return f"Did you mean '{found[0]}'?" if found else ""
