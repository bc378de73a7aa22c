"""What an answer to a case of known truth is worth, and the table of many with intervals.

The truth of a case is a mapping: ``kind``; ``right``, for each hidden key the names that are right; ``beside``, names that may stand with
them; ``answerable``, whether a channel shows what is hidden; ``fault`` with a pattern ``words``; ``case``, and ``column`` and ``half`` of
the table.
"""

from __future__ import annotations

import argparse
import json
import re
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import norm

from tests.diagnosis.asking import Answer, differences, in_words, kept, truth_of

SOUND, NAMING = ("no_mismatch", "parameters_only"), ("named", "tied")
"""Verdicts that leave no physics out, and those whose effects are part of the answer."""
LATE = ("current_late", "rows")
"""Faults that are one channel shifted in time, which has a name in the catalogue too."""
NAMED = {
    "single": ("one effect, that name or tied", "one effect, exactly that name"),
    "pair": ("two effects, both named or tied",),
}
"""Kinds of cases that hide effects -> questions: with ties, and without."""

Truth = Mapping[str, Any]
Scored = Sequence[tuple[Truth, Answer]]


def effects_of(told: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the effects that an answer names; one that says that it does not know names none."""
    return list(told.get("effects") or []) if told.get("verdict") in NAMING else []


def are_found(effects: Iterable[Mapping[str, Any]], right: Iterable[Collection[str]], beside: Collection[str], *, tied: bool) -> bool:
    """Return whether every hidden effect has its name (or is tied with it), and nothing is named but what may stand beside them."""
    ties = [[str(tie).partition(" at ")[0] for tie in one.get("tied_with") or [] if tied] for one in effects]
    left = [{one["effect"], *others} for one, others in zip(effects, ties, strict=True)]
    for names in right:
        hit = next((given for given in left if given & set(names)), None)
        if hit is None:
            return False
        left.remove(hit)
    return all(given & set(beside) for given in left)


def marks(truth: Truth, answer: Answer) -> dict[str, bool]:
    """Return the questions that a case asks, each answered rightly or wrongly; none of a case that nobody could answer."""
    told, kind = answer.told, truth["kind"]
    verdict = told.get("verdict", "")
    if not truth.get("answerable", True):
        return {}
    if kind in NAMED:
        found = [are_found(effects_of(told), truth["right"].values(), truth["beside"], tied=tied) for tied in (True, False)]
        return dict(zip(NAMED[kind], found, strict=False))
    match kind:
        case "sound":
            return {"sound called sound": verdict in SOUND}
        case "values":
            return {"only values off, said so": verdict == "parameters_only"}
        case "outside":
            sure = verdict == "named" and told.get("adequate") is not False
            return {
                "outside, not named": bool(verdict) and not sure,
                "outside, not called sound": verdict not in ("", *SOUND),
            }
        case "input":
            place = [part.partition("_")[2] for part in (told.get("location") or {}).get("components", [])][:1]
            shape = truth["fault"] in str(told.get("sentence", ""))
            return {"added input, place and shape told": verdict == "unknown" and place == ["dac"] and shape}
    by_name = truth["fault"] in LATE and [one["effect"] for one in effects_of(told)] == ["ChannelTimeShift"]
    return {"fault, said so": by_name or _says_fault(truth, told)}


def _says_fault(truth: Truth, told: Mapping[str, Any]) -> bool:
    text = json.dumps({key: told.get(key) for key in ("sentence", "recording", "left")}, ensure_ascii=False).lower()
    return told.get("verdict") == "recording_fault" and re.search(truth["words"], text) is not None


def line(truth: Truth, answer: Answer) -> str:
    """Return a case and its answer in a line."""
    made = marks(truth, answer)
    wrong = [question for question, right in made.items() if not right]
    hidden = "+".join(truth["right"]) or truth["fault"] or "-"
    worth = f"WRONG {'; '.join(wrong)}" if wrong else ("right" if made else "not asked")
    return f"{truth['case']} {truth['column']} {truth['kind']} {hidden} | {in_words(answer.told)} | {worth} | {answer.seconds:.0f} s"


def wilson(right: int, count: int, level: float = 0.95) -> tuple[float, float]:
    """Return the interval of a share. Source: E. B. Wilson, J. Am. Stat. Assoc. 22 (1927), 209-212."""
    if not count:
        return 0.0, 1.0
    z = float(norm.ppf(0.5 + 0.5 * level))
    middle = (right + 0.5 * z * z) / (count + z * z)
    half = z / (count + z * z) * float((right * (count - right) / count + 0.25 * z * z) ** 0.5)
    return max(0.0, middle - half), min(1.0, middle + half)


def share(right: Sequence[bool]) -> str:
    """Return how many of some are right, with the 95 % interval of that share."""
    low, high = wilson(sum(right), len(right))
    return f"{sum(right)}/{len(right)} ({100 * low:.0f} to {100 * high:.0f} %)" if right else "-"


def table(scored: Scored) -> str:
    """Return as Markdown: each question by column, by case, the misses, how descriptions of a case agree, verdicts, and what it took."""
    if not scored:
        return "No answers."
    lines = _by_question("asked", scored, lambda truth: truth["column"], lambda truth: f"{truth['case']} {truth['column']}")
    if len({truth["case"] for truth, _ in scored}) < len(scored):
        # descriptions of one recording are no independent trials
        lines += [
            "",
            *_by_question("cases right in every description asked", scored, lambda truth: truth["half"], lambda truth: truth["case"]),
        ]
    missed = [f"- {line(*one)}" for one in scored if not all(marks(*one).values())]
    return "\n".join([*lines, "", *_agreement(scored), *_verdicts(scored), _cost(scored), "", f"Misses: {len(missed)}", *missed])


def _by_question(title: str, scored: Scored, column: Callable[[Truth], str], trial: Callable[[Truth], str]) -> list[str]:
    """Return a row for each question and a cell for each column; a trial is right where all of its answers are."""
    cells: dict[str, dict[str, dict[str, bool]]] = defaultdict(lambda: defaultdict(dict))
    for truth, answer in scored:
        for question, right in marks(truth, answer).items():
            trials = cells[question][column(truth)]
            trials[trial(truth)] = trials.get(trial(truth), True) and right
    heads = list(dict.fromkeys(column(truth) for truth, _ in scored))
    rows = [f"| {question} | {' | '.join(share(list(found[head].values())) for head in heads)} |" for question, found in cells.items()]
    return [f"| {title} | {' | '.join(heads)} |", f"|---|{'---|' * len(heads)}", *rows]


def _agreement(scored: Scored) -> list[str]:
    """Return how often the descriptions of a case get the same verdict and the same names."""
    groups: dict[str, list[Answer]] = defaultdict(list)
    for truth, answer in scored:
        groups[truth["case"]].append(answer)
    several = [group for group in groups.values() if len(group) > 1]
    same = sum(
        len({(one.told.get("verdict"), *sorted(e["effect"] for e in effects_of(one.told))) for one in group}) == 1 for group in several
    )
    return [f"Same verdict and names in every description: {same} of {len(several)} cases."] if several else []


def _verdicts(scored: Scored) -> list[str]:
    """Return for sound machines, and for those of wrong values, how many got which verdict."""
    lines = []
    for kind, name in (("sound", "Sound machines"), ("values", "Values off")):
        counted = Counter(answer.told.get("verdict") or "no answer" for truth, answer in scored if truth["kind"] == kind)
        lines += [f"{name}: {', '.join(f'{verdict} {count}' for verdict, count in counted.most_common())}."] if counted else []
    return lines


def _cost(scored: Scored) -> str:
    seconds = np.array([answer.seconds for _, answer in scored])
    hopeless = len({truth["case"] for truth, _ in scored if not truth.get("answerable", True)})
    took = f"{np.median(seconds):.0f} s of processor time at the median, {seconds.max():.0f} s at most"
    return f"{took}. {hopeless} cases that no channel shows do not count."


def show(folders: Sequence[Path], asked: argparse.Namespace) -> None:
    """Print the table of the answers that are kept, and what they answer otherwise than those of another run."""
    answers = kept(folders, asked.kept_as)
    print(table([(truth_of(folder), answer) for folder, answer in answers.items()]))
    if asked.against:
        print("\n" + "\n".join(differences(answers, kept(folders, asked.against))))
