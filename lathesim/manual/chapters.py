"""The chapters of the manual: Markdown files of this folder, in the order in which they are read."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from lathesim.errors import LatheSimError, nearest

TOPICS = (
    "first_hour",
    "app",
    "commands",
    "lessons",
    "writing_lessons",
    "classes",
    "programs",
    "stability",
    "live",
    "diagnosis",
    "real_machines",
    "experiments",
    "contour",
    "reliability",
    "python",
    "plugins",
    "speed",
    "house",
    "glossary",
)


@dataclass(frozen=True)
class Chapter:
    """A chapter: its topic, by which it is asked for, its title, and its text in Markdown."""

    topic: str
    title: str
    text: str


def chapters() -> list[Chapter]:
    """Return all chapters in order."""
    return [chapter(topic) for topic in TOPICS]


def chapter(topic: str) -> Chapter:
    """Return the chapter of a topic; :class:`LatheSimError` with the nearest topic where there is none."""
    if topic not in TOPICS:
        raise LatheSimError(f"the manual has no chapter '{topic}'.", remedy=nearest(topic, TOPICS) or f"It has {', '.join(TOPICS)}.")
    text = (Path(__file__).parent / f"{topic}.md").read_text(encoding="utf-8")
    return Chapter(topic, text.partition("\n")[0].removeprefix("# "), text)
