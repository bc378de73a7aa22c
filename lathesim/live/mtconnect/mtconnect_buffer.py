"""The observations of an MTConnect agent: numbered, bounded, and nothing that is said twice.

Sequence numbers rise by one for each observation over all data items. A value that did not change is not repeated unless its item is
discrete. Time stamps never go backwards. A condition keeps all its active entries.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime

UNAVAILABLE = "UNAVAILABLE"


@dataclass(frozen=True)
class DataItem:
    """One data item: ``id`` and ``name``, ``category`` SAMPLE, EVENT or CONDITION, ``kind`` (as POSITION), units, sub type, component."""

    id: str
    name: str
    category: str
    kind: str
    units: str = ""
    sub_kind: str = ""
    component: tuple[str, str] = ("Controller", "controller")
    discrete: bool = False


@dataclass(frozen=True)
class Observation:
    """What was observed: number, item, time [UTC] and value; for a condition its ``level`` (Normal, Warning, Fault) and ``code``."""

    sequence: int
    item: DataItem
    time: datetime
    value: str
    level: str = ""
    code: str = ""


@dataclass
class ObservationBuffer:
    """Keeps the last ``size`` observations, and for each item the state before the first of them, so that ``current?at`` can be told."""

    items: Sequence[DataItem]
    size: int = 131_072
    next_sequence: int = 1
    _kept: deque[Observation] = field(default_factory=deque)
    _before: dict[str, list[Observation]] = field(default_factory=dict)
    _now: dict[str, list[Observation]] = field(default_factory=dict)
    _latest: datetime = datetime(1970, 1, 1, tzinfo=UTC)

    def __post_init__(self) -> None:
        self._by_key = {key: item for item in self.items for key in (item.name, item.id)}

    @property
    def first_sequence(self) -> int:
        """Return the number of the oldest observation that is kept."""
        return self.next_sequence - len(self._kept)

    @property
    def last_sequence(self) -> int:
        """Return the number of the newest observation."""
        return self.next_sequence - 1

    def item(self, key: str) -> DataItem | None:
        """Return the item with an id or a name."""
        return self._by_key.get(key)

    def observe(self, item: DataItem, time: datetime, value: str, level: str = "", code: str = "") -> bool:
        """Take an observation; return False where it says nothing new. Its time stamp is no earlier than the last one's."""
        active = self._now.get(item.id, [])
        if item.category == "CONDITION":
            now = self._conditions(active, level or value, code)
            if now is None:
                return False
        elif active and active[-1].value == value and (not item.discrete or value == UNAVAILABLE):
            return False
        else:
            now = []
        self._latest = max(self._latest, time)
        new = Observation(self.next_sequence, item, self._latest, value, level, code)
        self.next_sequence += 1
        self._now[item.id] = [*now, new]
        self._kept.append(new)
        if len(self._kept) > self.size:
            self._forget(self._kept.popleft())
        return True

    def _conditions(self, active: list[Observation], level: str, code: str) -> list[Observation] | None:
        """Return the entries that stay beside a new one, or None where it is there already."""
        real = [entry for entry in active if entry.level not in ("Normal", "Unavailable")]
        if level in ("Normal", "Unavailable") and not code:
            return None if active and active[-1].level == level and not real else []
        if any(entry.level == level and entry.code == code for entry in active):
            return None
        return [entry for entry in real if entry.code != code]

    def _forget(self, gone: Observation) -> None:
        self._before[gone.item.id] = _after(self._before.get(gone.item.id, []), gone)

    def unavailable(self, time: datetime) -> None:
        """Take that the source is lost: every item is UNAVAILABLE, once."""
        for item in self.items:
            self.observe(item, time, UNAVAILABLE, "Unavailable" if item.category == "CONDITION" else "")

    def since(self, sequence: int, count: int, wanted: set[str] | None) -> tuple[list[Observation], int]:
        """Return up to ``count`` observations of the wanted items from a number on, and the number after the last that was looked at.

        With a negative count the last ones up to ``sequence`` are returned, in the order of their numbers.
        """
        begin = max(0, sequence - self.first_sequence)
        if count < 0:
            found: list[Observation] = []
            for at in range(min(begin, len(self._kept) - 1), -1, -1):
                if wanted is None or self._kept[at].item.id in wanted:
                    found.append(self._kept[at])
                    if len(found) == -count:
                        break
            return found[::-1], found[-1].sequence if found else self.first_sequence
        found = []
        following = sequence
        for entry in self._from(begin):
            if len(found) == count:
                break
            following = entry.sequence + 1
            if wanted is None or entry.item.id in wanted:
                found.append(entry)
        return found, following

    def _from(self, begin: int) -> Iterator[Observation]:
        if begin > len(self._kept) // 2:
            tail = []
            for at in range(len(self._kept) - 1, begin - 1, -1):
                tail.append(self._kept[at])
            yield from reversed(tail)
        else:
            for at, entry in enumerate(self._kept):
                if at >= begin:
                    yield entry

    def current(self, at: int | None, wanted: set[str] | None) -> list[Observation]:
        """Return the state of each wanted item, now or after the observation ``at``; all active entries of a condition."""
        if at is None:
            states = self._now
        else:
            states = {key: list(entries) for key, entries in self._before.items()}
            for entry in self._kept:
                if entry.sequence > at:
                    break
                states[entry.item.id] = _after(states.get(entry.item.id, []), entry)
        return [entry for item in self.items if wanted is None or item.id in wanted for entry in states.get(item.id, [])]


def _after(active: list[Observation], new: Observation) -> list[Observation]:
    if new.item.category != "CONDITION":
        return [new]
    if new.level in ("Normal", "Unavailable") and not new.code:
        return [new]
    return [*(entry for entry in active if entry.level not in ("Normal", "Unavailable") and entry.code != new.code), new]
