"""What an answer of a case is worth, and the table of all of them with intervals."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import norm

QUESTIONS = ("sound called sound", "only values off, said so", "one effect, that name or tied", "one effect, exactly that name",
             "two effects, both named or tied", "outside, not named", "fault, said so", "added input, place and shape told")  # fmt: skip
SOUND = ("no_mismatch", "parameters_only")
"""Verdicts that leave no physics out."""
LATE = ("current_late", "rows")
"""Faults that are one channel shifted in time."""


@dataclass(frozen=True)
class Answer:
    """One answered case: ``truth`` of its folder, the JSON of the program (empty without an answer), its seconds of processor time."""

    truth: dict[str, Any]
    told: dict[str, Any]
    seconds: float

    @property
    def line(self) -> str:
        """The case and what was answered, in a line."""
        effects = " + ".join(
            f"{one['effect']}@{one['at']}" + "".join(f"~{tie}" for tie in one.get("tied_with") or []) for one in self.names
        )
        what = "+".join(self.truth["keys"]) or self.truth["fault"]
        wrong = [question for question, right in marks(self).items() if not right]
        adequate = "" if self.told.get("adequate", True) else " (not adequate)"
        return f"{self.truth['rig']} {self.truth['description']} {self.truth['kind']} {what} | {self.told.get('verdict', 'no answer')}: " \
               f"{effects or '-'}{adequate} | {'WRONG ' + '; '.join(wrong) if wrong else 'right'} | {self.seconds:.0f} s"  # fmt: skip

    @property
    def names(self) -> list[dict[str, Any]]:
        """The effects that it names."""
        return list(self.told.get("effects") or []) if self.told.get("verdict") in ("named", "tied") else []


def marks(answer: Answer) -> dict[str, bool]:
    """Return the questions that a case asks, each answered rightly or wrongly; none of a case that nobody could answer."""
    truth, told = answer.truth, answer.told
    if not truth.get("answerable", True):
        return {}
    verdict = told.get("verdict", "")
    match truth["kind"]:
        case "sound":
            return {QUESTIONS[0]: verdict in SOUND}
        case "values":
            return {QUESTIONS[1]: verdict == "parameters_only"}
        case "single":
            return {QUESTIONS[2]: _found(answer, tied=True), QUESTIONS[3]: _found(answer, tied=False)}
        case "pair":
            return {QUESTIONS[4]: _found(answer, tied=True)}
        case "outside":
            sure = verdict == "named" and told.get("adequate") is not False
            return {QUESTIONS[5]: bool(verdict) and not sure}
    if truth["kind"] == "input":
        place = [part.partition("_")[2] for part in (told.get("location") or {}).get("components", [])][:1]
        return {QUESTIONS[7]: verdict == "unknown" and place == ["dac"] and truth["fault"] in str(told.get("sentence", ""))}
    said = verdict == "recording_fault" and re.search(truth["words"], str(told.get("sentence", told))) is not None
    # a channel that is late by itself has a name in the catalogue too
    by_name = truth["fault"] in LATE and [one["effect"] for one in answer.names] == ["ChannelTimeShift"]
    return {QUESTIONS[6]: said or by_name}


def _found(answer: Answer, *, tied: bool) -> bool:
    """Return whether every hidden effect has its name, and no other effect is named beside what belongs to them."""
    left = [[one["effect"], *(one.get("tied_with") or [])] if tied else [one["effect"]] for one in answer.names]
    for right in answer.truth["right"].values():
        hit = next((given for given in left if set(given) & set(right)), None)
        if hit is None:
            return False
        left.remove(hit)
    return all(set(given) & set(answer.truth["beside"]) for given in left)


def wilson(right: int, count: int, level: float = 0.95) -> tuple[float, float]:
    """Return the interval of a share. Source: E. B. Wilson, J. Am. Stat. Assoc. 22 (1927), 209-212."""
    if not count:
        return 0.0, 1.0
    z = float(norm.ppf(0.5 + 0.5 * level))
    middle = (right + 0.5 * z * z) / (count + z * z)
    half = z / (count + z * z) * float((right * (count - right) / count + 0.25 * z * z) ** 0.5)
    return max(0.0, middle - half), min(1.0, middle + half)


def table(answers: list[Answer]) -> str:
    """Return the table as Markdown: a row a question, a column for each half of the rigs and each description."""
    columns: dict[tuple[bool, str], dict[str, list[bool]]] = defaultdict(lambda: defaultdict(list))
    for answer in answers:
        for question, right in marks(answer).items():
            columns[answer.truth["calibrating"], answer.truth["description"]][question].append(right)
    order = sorted(columns, key=lambda column: (not column[0], ("table", "motor", "lathe").index(column[1])))
    heads = [f"{'calibration' if half else 'held out'}, {description} side" for half, description in order]
    rows = [f"| asked | {' | '.join(heads)} |", f"|---|{'---|' * len(heads)}"]
    for question in QUESTIONS:
        cells = []
        for column in order:
            asked = columns[column][question]
            cells.append(_cell(asked))
        rows.append(f"| {question} | {' | '.join(cells)} |")
    return "\n".join([*rows, "", *_by_case(answers), "", _agreement(answers), _cost(answers), *_verdicts(answers)])


def _cell(asked: list[bool]) -> str:
    low, high = wilson(sum(asked), len(asked))
    return f"{sum(asked)}/{len(asked)} ({100 * low:.0f} to {100 * high:.0f} %)" if asked else "-"


def _by_case(answers: list[Answer]) -> list[str]:
    """Return the table of cases that are right in every description asked: descriptions of one recording are no independent trials."""
    cases: dict[tuple[str, bool], dict[str, bool]] = defaultdict(dict)
    for answer in answers:
        for question, right in marks(answer).items():
            found = cases[question, answer.truth["calibrating"]]
            found[answer.truth["case"]] = found.get(answer.truth["case"], True) and right
    rows = ["| cases right in every description asked | calibration | held out |", "|---|---|---|"]
    for question in QUESTIONS:
        cells = []
        for half in (True, False):
            asked = list(cases[question, half].values())
            cells.append(_cell(asked))
        rows.append(f"| {question} | {' | '.join(cells)} |")
    return rows


def _verdicts(answers: list[Answer]) -> list[str]:
    """Return for sound machines, and for those of wrong values, how many got which verdict."""
    lines = []
    for kind, name in (("sound", "Sound machines"), ("values", "Values off")):
        counted = Counter(answer.told.get("verdict") or "no answer" for answer in answers if answer.truth["kind"] == kind)
        if counted:
            lines.append(f"{name}: {', '.join(f'{verdict} {count}' for verdict, count in counted.most_common())}.")
    return lines


def _cost(answers: list[Answer]) -> str:
    """Return what an answer took, how many cases nobody could answer, and how often something outside got a name."""
    if not answers:
        return "No answers."
    seconds = np.array([answer.seconds for answer in answers])
    hopeless = len({answer.truth["case"] for answer in answers if not answer.truth.get("answerable", True)})
    beyond = [answer for answer in answers if answer.truth["kind"] == "outside"]
    named = sum(bool(answer.names) for answer in beyond)
    sound = sum(answer.told.get("verdict") in SOUND for answer in beyond)
    return (
        f"{np.median(seconds):.0f} s of processor time at the median, {seconds.max():.0f} s at most. {hopeless} cases that no channel "
        f"shows do not count. {named} of {len(beyond)} answers to something outside have a name, {sound} call the machine sound."
    )


def _agreement(answers: list[Answer]) -> str:
    """Return how often the descriptions of a case get the same verdict and the same names."""
    groups: dict[str, list[Answer]] = defaultdict(list)
    for answer in answers:
        groups[answer.truth["case"]].append(answer)
    several = [group for group in groups.values() if len(group) > 1]
    same = sum(len({(one.told.get("verdict"), tuple(sorted(e["effect"] for e in one.names))) for one in group}) == 1 for group in several)
    return f"Same verdict and names in every description: {same} of {len(several)} cases."
