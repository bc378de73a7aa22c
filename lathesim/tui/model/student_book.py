"""What is kept in the folder and never sent anywhere: the student's book of what was tried and reached, and how the app was left."""

from __future__ import annotations

import datetime
import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING

from lathesim.errors import WriteError
from lathesim.json_text import parsed_json
from lathesim.whole_file import folder_lock, write_text

if TYPE_CHECKING:
    from lathesim.lessons.grading import GoalResult, Judgement
    from lathesim.tui.model.machine_tree import Setup


BOOK = Path("lathesim_progress.json")
STATE = Path("lathesim_app.json")
SCHEMA = "lathesim-progress/1"


@dataclass(frozen=True)
class Best:
    """The best value of a goal's metric so far, in ``unit``, and whether it meets the goal."""

    value: float
    unit: str
    met: bool
    when: str


@dataclass(frozen=True)
class LessonEntry:
    """The progress in one lesson: the number of complete runs, the time of the last one, and the best value of each goal.

    ``met`` are the goals with their limits that one run met together; it is empty until a run meets all of them.
    """

    tries: int = 0
    last: str = ""
    best: Mapping[str, Best] = field(default_factory=dict)
    met: tuple[str, ...] = ()

    def has_met(self, goals: Iterable[str]) -> bool:
        """Return whether one run met all of these goals, each written as ``metric at most 0.4 mm``; False without goals."""
        wanted = set(goals)
        return bool(wanted) and wanted <= set(self.met)


class StudentBook:
    """Entries by the name of the lesson; read and written again after each run, so that several apps can share the file."""

    def __init__(self, path: Path = BOOK) -> None:
        self.path = path
        self.fault = ""
        """A sentence where the file could not be read; it is kept aside."""
        self.entries: dict[str, LessonEntry] = self._read()

    def entry(self, lesson: str) -> LessonEntry:
        """Return the entry of a lesson, an empty one before the first run."""
        return self.entries.get(lesson, LessonEntry())

    def note(self, lesson: str, judgement: Judgement) -> None:
        """Note a run that came to its end and write the book; raises :class:`RecordError` where it cannot be written."""
        with folder_lock(self.path.parent):
            self.entries = self._read()
            self.entries[lesson] = self._after(lesson, judgement)
            self._write()

    def _after(self, lesson: str, judgement: Judgement) -> LessonEntry:
        from lathesim.lessons.grading import REACHED

        goals = judgement.goals
        now = datetime.datetime.now().astimezone().isoformat(timespec="seconds")
        before = self.entry(lesson)
        best = dict(before.best)
        for goal in goals:
            key = f"{goal.metric} {goal.sense}"
            if goal.value == goal.value and (key not in best or _is_better(goal, best[key])):
                best[key] = Best(goal.value, goal.unit, goal.met, now)
        met = tuple(f"{goal.metric} {goal.sense} {goal.limit}" for goal in goals) if judgement.result == REACHED else before.met
        return LessonEntry(before.tries + 1, now, best, met)

    def _write(self) -> None:
        data = {"schema": SCHEMA, "lessons": {name: asdict(entry) for name, entry in sorted(self.entries.items())}}
        try:
            write_text(self.path, json.dumps(data, indent=2) + "\n")
        except WriteError as error:
            fact = f"your progress cannot be written: {error.fact}"
            raise WriteError(fact, place=str(self.path), remedy="The run itself is kept.") from None

    def _read(self) -> dict[str, LessonEntry]:
        from lathesim.lessons.lesson import present_name

        try:
            data = parsed_json(self.path.read_text(encoding="utf-8"))
            return {present_name(str(name)): _entry(entry) for name, entry in data["lessons"].items()}
        except FileNotFoundError:
            return {}
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            aside = self.path.with_name(f"{self.path.name}.bak")
            try:
                self.path.replace(aside)
            except OSError:
                self.fault = f"{self.path}: your progress cannot be read. Nothing new is noted over it."
                return {}
            self.fault = f"{self.path}: the file was damaged. It is kept as {aside.name} and a new one is begun."
            return {}


def _entry(data: Mapping[str, object]) -> LessonEntry:
    found = data["best"]
    if not isinstance(found, dict):
        raise TypeError("best")
    best = {str(name): Best(float(item["value"]), str(item["unit"]), bool(item["met"]), str(item["when"])) for name, item in found.items()}
    met = data.get("met", ())
    if not isinstance(met, (list, tuple)):
        raise TypeError("met")
    return LessonEntry(int(str(data["tries"])), str(data["last"]), best, tuple(map(str, met)))


def _is_better(goal: GoalResult, best: Best) -> bool:
    """Return whether a run came nearer to a goal; values in another unit, of a goal that was rewritten, count as worse."""
    if goal.unit != best.unit:
        return True
    return goal.value < best.value if goal.sense == "at most" else goal.value > best.value


_SET = re.compile(r"--set\s+([A-Za-z_]\w*\.[A-Za-z_]\w*)=('[^']+'|\"[^\"]+\"|[^\s,;]+)")
_VARIANT = re.compile(r"--variant\s+([\w.+-]*\w)")


@dataclass(frozen=True)
class Suggestion:
    """What to try, in words, and the settings named there."""

    text: str
    values: tuple[tuple[str, str], ...] = ()
    variant: str | None = None

    @property
    def can_be_set(self) -> bool:
        """Whether the text names settings."""
        return bool(self.values or self.variant)

    def applied(self, setup: Setup) -> Setup:
        """Return a setup with what the text names."""
        for name, quantity in self.values:
            setup = setup.with_value(name, quantity)
        return replace(setup, variant=self.variant) if self.variant is not None else setup


def suggestion(text: str, variants: tuple[str, ...]) -> Suggestion:
    """Return what a line of a lesson's ``try`` suggests: ``--set part.name=value`` and ``--variant NAME`` are understood.

    Of a plain text that names one variant alone, as "Run case I", the variant is taken.
    """
    values = tuple((name, value.strip("'\"").rstrip(".")) for name, value in _SET.findall(text))
    named = [name for name in _VARIANT.findall(text) if name in variants]
    if not values and not named:
        named = [word for word in dict.fromkeys(re.findall(r"[\w+-]+", text)) if word in variants]
        named = named if len(named) == 1 else []
    return Suggestion(text, values, named[0] if named else None)


@dataclass(frozen=True)
class KeptState:
    """The theme, the lesson by its name or file, its case, and the name of the screen; empty where nothing was kept."""

    theme: str = ""
    lesson: str = ""
    variant: str = ""
    screen: str = ""

    @classmethod
    def read(cls, path: Path = STATE) -> KeptState:
        """Return what was kept in this folder; what cannot be read counts as nothing."""
        try:
            data = parsed_json(path.read_text(encoding="utf-8"))
            return cls(**{item.name: str(data[item.name]) for item in fields(cls)})
        except (OSError, ValueError, KeyError, TypeError):
            return cls()

    def write(self, path: Path = STATE) -> None:
        """Keep it in this folder, if it differs from what was kept; a folder that cannot be written is left as it is."""
        if self == self.read(path):
            return
        try:
            write_text(path, json.dumps(asdict(self), indent=2) + "\n")
        except WriteError:
            return
