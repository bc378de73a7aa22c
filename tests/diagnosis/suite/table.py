"""The table of the suite: each question with what was asked of it, the share measured and its interval, and every miss by its case."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import binom

from tests.diagnosis.suite.generate import truth_of
from tests.diagnosis.suite.runner import read_answer
from tests.diagnosis.suite.scoring import Score, score

NORMAL_95 = 1.959964


@dataclass(frozen=True)
class Row:
    """One line: the question, what is asked, what was measured, its 95 % interval, and over how many."""

    question: str
    asked: str
    measured: str
    interval: str
    over: str
    met: bool | None = None


def wilson(good: int, number: int) -> tuple[float, float]:
    """Return the 95 % interval of a share after Wilson, J. Am. Stat. Assoc. 22 (1927)."""
    if number == 0:
        return 0.0, 1.0
    share, squared = good / number, NORMAL_95**2
    middle = (share + squared / (2 * number)) / (1 + squared / number)
    half = NORMAL_95 / (1 + squared / number) * math.sqrt(share * (1 - share) / number + squared / (4 * number**2))
    return max(middle - half, 0.0), min(middle + half, 1.0)


def quantile_interval(values: Sequence[float], level: float) -> tuple[float, float]:
    """Return the 95 % interval of a quantile from the order statistics (binomial, free of a distribution)."""
    ordered, number = sorted(values), len(values)
    low, high = int(binom.ppf(0.025, number, level)) - 1, int(binom.ppf(0.975, number, level))
    return ordered[max(low, 0)] if low >= 0 else -math.inf, ordered[high] if high < number else math.inf


def rows(scores: Sequence[Score]) -> list[Row]:
    """Return the lines of the table."""
    rights: list[tuple[str, str, float | None, Callable[[Score], bool | None]]] = [
        ("false alarms: a name where nothing is hidden", "at most 1 %", -0.01, lambda s: s.false_alarm),
        ("sound machines called sound, or only values off", "", None, lambda s: s.quiet),
        ("right name first, effect of 3 floors or more", "95 %", 0.95, lambda s: s.first_right),
        ("... singles", "", None, lambda s: s.first_right if s.category == "single" else None),
        ("... in another form than the catalogue's", "", None, lambda s: s.first_right if s.category == "other_form" else None),
        ("... and no name too many (singles, other forms)", "", None, lambda s: s.none_too_many),
        ("... of these right as one of a tie", "", None, lambda s: s.by_tie if s.first_right else None),
        ("right family first", "99 %", 0.99, lambda s: s.family_right),
        ("right place, where the name is right", "", None, lambda s: s.place_right),
        ("pairs exact", "85 %", 0.85, lambda s: s.exact if s.category == "pair" else None),
        ("triples exact", "", None, lambda s: s.exact if s.category == "triple" else None),
        ("outside the catalogue: no confident name", "95 %", 0.95, lambda s: s.outside_not_named),
        ("outside the catalogue: said that something is missing", "", None, lambda s: s.outside_reported),
        ("recording faults named", "90 %", 0.9, lambda s: s.fault_named),
        ("poor excitation: right family", "", None, lambda s: s.poor_family),
        ("poor excitation: resolved by the second recording", "80 %", 0.8, lambda s: s.poor_resolved),
        ("parameter intervals that hold the true value", "90 to 98 %", None, lambda s: None),
        ("no answer", "", None, lambda s: s.failed),
    ]  # fmt: skip
    made = []
    for question, asked, bar, answer in rights:
        answers = [covered for s in scores for covered in s.covered] if "intervals" in question else [answer(s) for s in scores]
        made.append(_share(question, asked, bar, [bool(one) for one in answers if one is not None]))
    removed = [s.removed for s in scores if s.removed is not None]
    told = [s.told_removed for s in scores if s.told_removed is not None]
    errors = [error for s in scores for error in s.parameter_errors if math.isfinite(error)]
    seconds = [s.seconds for s in scores if s.seconds is not None]
    made[-2:-2] = [
        _quantile("variance above the noise removed, held out: median", "0.99", removed, 0.5, "{:.3f}", lambda value: value >= 0.99),
        _quantile("... tenth percentile", "0.9", removed, 0.1, "{:.3f}", lambda value: value >= 0.9),
        _quantile("... as the answer tells it, weighed as the noise is: median", "", told, 0.5, "{:.3f}"),
        _quantile("... tenth percentile", "", told, 0.1, "{:.3f}"),
        _quantile("parameter error: median", "3 %", errors, 0.5, "{:.1%}", lambda value: value <= 0.03),
    ]
    made.append(_quantile("seconds for a case: median", "", seconds, 0.5, "{:.1f}"))
    single = [s.seconds for s in scores if s.seconds is not None and s.category == "single"]
    made.append(_quantile("... singles", "20", single, 0.5, "{:.1f}", lambda value: value <= 20.0))
    return made


def _share(question: str, asked: str, bar: float | None, answers: Sequence[bool]) -> Row:
    good, number = sum(answers), len(answers)
    if number == 0:
        return Row(question, asked, "-", "", "0")
    low, high = wilson(good, number)
    share = good / number
    met = None if bar is None else (share <= -bar if bar < 0.0 else share >= bar)
    if asked == "90 to 98 %":
        met = 0.9 <= share <= 0.98
    return Row(question, asked, f"{share:.1%}", f"{low:.1%} to {high:.1%}", f"{good}/{number}", met)


def _quantile(
    question: str, asked: str, values: Sequence[float], level: float, form: str, good: Callable[[float], bool] | None = None
) -> Row:
    if not values:
        return Row(question, asked, "-", "", "0")
    value = float(np.quantile(values, level))
    ends = [form.format(end) if math.isfinite(end) else "?" for end in quantile_interval(values, level)]
    return Row(question, asked, form.format(value), " to ".join(ends), str(len(values)), good(value) if good else None)


def misses(scores: Sequence[Score]) -> list[str]:
    """Return every miss: the case, what is hidden and what was answered."""
    return [f"{s.case} {s.rig}/{s.category} [{', '.join(s.missed)}] hidden: {s.truth}; answer: {s.answer}" for s in scores if s.missed]


def small(scores: Sequence[Score]) -> list[str]:
    """Return the cases that need not be found, being too small: they are shown and not counted."""
    return [f"{s.case} {s.rig}/{s.category} hidden: {s.truth}; answer: {s.answer}" for s in scores if not s.asked]


def scores_of(folders: Sequence[Path], answers: Path) -> list[Score]:
    """Score what has been answered."""
    told = ((folder, read_answer(answers, folder.name)) for folder in folders)
    return [score(folder.name, truth_of(folder), answer) for folder, answer in told if answer is not None]


def print_table(folders: Sequence[Path], answers: Path, markdown: Path | None = None) -> None:
    """Print the table with its misses; write it as Markdown too."""
    scores = scores_of(folders, answers)
    print(f"{len(scores)} of {len(folders)} cases answered\n")
    print("\n".join(_plain(rows(scores))))
    for title, lines in (("Misses", misses(scores)), ("Too small to be asked, shown only", small(scores))):
        print(f"\n{title}: {len(lines)}")
        print("\n".join(lines))
    if markdown is not None:
        markdown.write_text(as_markdown(scores), encoding="utf-8")


def _plain(lines: Sequence[Row]) -> list[str]:
    head = Row("question", "asked", "measured", "95 % interval", "over")
    cells = [(row.question, row.asked, row.measured, row.interval, row.over, _mark(row)) for row in (head, *lines)]
    widths = [max(len(cell[column]) for cell in cells) for column in range(6)]
    return ["  ".join(text.ljust(width) for text, width in zip(cell, widths, strict=True)).rstrip() for cell in cells]


def as_markdown(scores: Sequence[Score]) -> str:
    """Return table and misses as Markdown."""
    lines = ["| question | asked | measured | 95 % interval | over | |", "|---|---|---|---|---|---|"]
    lines += [f"| {row.question} | {row.asked} | {row.measured} | {row.interval} | {row.over} | {_mark(row)} |" for row in rows(scores)]
    missed = misses(scores)
    return "\n".join([*lines, "", f"Every miss ({len(missed)} of {len(scores)} cases):", "", *[f"- {line}" for line in missed], ""])


def _mark(row: Row) -> str:
    return {True: "met", False: "missed", None: ""}[row.met]
