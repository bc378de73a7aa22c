"""What an answer to a recording is worth: right, partly right or wrong, by one rule; and the table of all of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from tests.diagnosis.asking import Answer
from tests.diagnosis.real.cases import Case, Hidden, Size
from tests.diagnosis.scoring import NAMING, SOUND, effects_of

SHOWN = 3
"""Effects of an answer that a table of many ways has room for."""
NEAR = 1.1
"""Ratio of the held-out error to that of the grey box up to which an answer is right."""
RULE = """\
right: verdict and names are those of the truth, and the held-out error is at most 1.1 times that of the grey box
partly: one name is right, beside something else, tied with a wrong one, with another missing or a larger held-out error; or a wider form
wrong: everything else, so an answer without a verdict that names too"""
HEADS = ("case", "truth", "verdict", "names", "held out", "grey box", "worth", "CPU s")


def worth(case: Case, told: Mapping[str, Any], *, by_names: bool = False) -> str:
    """Return "right", "partly" or "wrong"; ``by_names`` where no held-out error of a simulation is there."""
    verdict = told.get("verdict")
    if not case.hidden:
        return "right" if verdict in (("parameters_only",) if case.values else SOUND) else "wrong"
    effects = effects_of(told)
    found = [hidden for hidden in case.hidden if any(_is(hidden, one) for one in effects)]
    if not found:
        return (
            "partly" if any(_is_tied(hidden, one) or _is_near_name(hidden, one) for hidden in case.hidden for one in effects) else "wrong"
        )
    right = (*case.hidden, *case.beside)
    others = [one for one in effects if not any(_is(hidden, one) for hidden in right)]
    tied = [(one, tie) for one in effects for tie in one.get("tied_with") or [] if not any(_is_tie(hidden, one, tie) for hidden in right)]
    exact = len(found) == len(case.hidden) and not others and not tied
    return "right" if exact and (by_names or is_near(case, told)) else "partly"


def _is_tied(hidden: Hidden, effect: Mapping[str, Any]) -> bool:
    return any(_is_tie(hidden, effect, tie) for tie in effect.get("tied_with") or [])


def _is_tie(hidden: Hidden, effect: Mapping[str, Any], tie: str) -> bool:
    """Return whether what an effect is tied with is a hidden one; without a place it stands where the effect does."""
    name, _, at = tie.partition(" at ")
    return hidden.is_named_by(name, at or str(effect.get("at", "")))


def _is_near_name(hidden: Hidden, effect: Mapping[str, Any]) -> bool:
    return effect.get("effect") in hidden.near and hidden.is_at(str(effect.get("at", "")))


def is_near(case: Case, told: Mapping[str, Any]) -> bool:
    """Return whether the held-out error of the deciding channel is no worse than the grey box allows, or than before."""
    if case.deciding is None:
        return True
    before, after = held_out(case, told)
    if before is None or after is None:
        return False
    return bool(after <= (before if case.deciding.grey_box is None else NEAR * case.deciding.grey_box))


def held_out(case: Case, told: Mapping[str, Any]) -> tuple[float | None, float | None]:
    """Return the error of the deciding channel on the held-out recording before and after; None where the answer does not tell it."""
    if case.deciding is None:
        return None, None
    if case.deciding.within == "fit":
        entry = (told.get("fit") or {}).get(case.deciding.channel, {})
    else:
        entry = next((one for one in told.get("missing") or [] if one.get("at") == case.deciding.channel), {})
    if case.deciding.unit == "share":
        return entry.get("share_before"), entry.get("share_after")
    return entry.get("before"), entry.get("after")


def _is(hidden: Hidden, effect: Mapping[str, Any]) -> bool:
    return hidden.is_named_by(str(effect.get("effect", "")), str(effect.get("at", "")))


def named(case: Case, told: Mapping[str, Any]) -> str:
    """Return the effects of an answer with place, sizes and ties; those that are no part of the verdict stand in brackets."""
    parts = []
    for effect in told.get("effects") or []:
        hidden = next((one for one in (*case.hidden, *case.beside) if _is(one, effect)), None)
        sizes = _sizes(effect.get("parameters") or {}, hidden.sizes if hidden else ())
        ties = "".join(f" ~ {tie}" for tie in effect.get("tied_with") or [])
        parts.append(f"{effect.get('effect')} at {effect.get('at')}{f' ({sizes})' if sizes else ''}{ties}")
    if told.get("verdict") not in NAMING and parts:
        parts = [f"[{' + '.join(parts)}]"]
    baseline = {name: {**value, "value": value.get("refit_with")} for name, value in (told.get("baseline") or {}).items()}
    values = _sizes(baseline, case.values)
    return " + ".join([*parts, *([values] if values else [])]) or "-"


def named_at(told: Mapping[str, Any]) -> str:
    """Return the first effects of an answer at their places and how many more there are; no part of the verdict, they stand in brackets."""
    effects = list(dict.fromkeys(f"{one['effect']} at {one['at']}" for one in told.get("effects") or []))
    text = " + ".join([*effects[:SHOWN], *([f"{len(effects) - SHOWN} more"] if len(effects) > SHOWN else [])])
    return text if told.get("verdict") in NAMING or not text else f"[{text}]"


def _sizes(given: Mapping[str, Mapping[str, Any]], true: Sequence[Size]) -> str:
    """Return the sizes of an effect: those with a truth and whether their interval holds it, or else the first one of all."""
    asked = [size for size in true if size.parameter in given]
    if not asked:
        return ", ".join(f"{name} {_number(value.get('value'))} {value.get('unit')}" for name, value in list(given.items())[:1])
    texts = []
    for size in asked:
        value = given[size.parameter]
        low, high = value.get("low"), value.get("high")
        text = f"{size.parameter} {_number(value.get('value'))} {value.get('unit')}"
        if not size.known:
            texts.append(f"{text}, grey box {_number(size.value)}")
        elif low is None or high is None:
            texts.append(f"{text}, no interval")
        else:
            holds = "in" if size.is_within(low, high) else "OUT of"
            texts.append(f"{text}, {_number(size.value)} is {holds} {_number(low)} to {_number(high)}")
    return "; ".join(texts)


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"


def row(case: Case, answer: Answer) -> tuple[str, ...]:
    """Return the line of a case in the table."""
    told = answer.told
    verdict = str(told.get("verdict", "no answer")) + ("" if told.get("adequate", True) else ", not adequate")
    verdict += "" if told.get("complete", True) else ", stopped"
    error, grey = "-", "-"
    if case.deciding is not None:
        before, after = held_out(case, told)
        unit = case.deciding.unit
        error = f"{case.deciding.channel} {_number(before)} -> {_number(after)} {unit}"
        grey = f"{_number(case.deciding.grey_box)} {unit}" if case.deciding.grey_box is not None else "-"
    return case.name, case.truth, verdict, named(case, told), error, grey, worth(case, told), f"{answer.seconds:.0f}"


def table(rows: Iterable[tuple[str, ...]]) -> str:
    """Return the table as Markdown."""
    return "\n".join(f"| {' | '.join(one)} |" for one in (HEADS, ("---",) * len(HEADS), *rows))


def counted(rows: Iterable[tuple[str, ...]]) -> str:
    """Return how many answers are worth what, and how many of the known sizes that they tell lie in their intervals."""
    lines = list(rows)
    marks, names = [line[6] for line in lines], " ".join(line[3] for line in lines)
    inside, outside = names.count(" is in "), names.count(" is OUT of ")
    worth = ", ".join(f"{marks.count(mark)} {mark}" for mark in ("right", "partly", "wrong"))
    return f"{worth}; {inside} of {inside + outside} known sizes lie in their intervals"


def changed(cases: Iterable[Case], now: Mapping[str, Answer], before: Mapping[str, Answer]) -> list[str]:
    """Return for each case that both asked in which cells the answers differ, and the ratio of all processor time."""
    lines, both = [], [case for case in cases if case.name in now and case.name in before]
    for case in both:
        old, new = row(case, before[case.name]), row(case, now[case.name])
        differ = [f"{head}: {first} -> {second}" for head, first, second in zip(HEADS[:-1], old, new, strict=False) if first != second]
        if differ:
            lines.append(f"{case.name}\n    " + "\n    ".join(differ))
    spent = [sum(answers[case.name].seconds for case in both) for answers in (now, before)]
    same = f"{len(both) - len(lines)} of {len(both)} answers are the same"
    return [
        *lines,
        f"{same}; processor time {spent[0]:.0f} s, {spent[1]:.0f} s before" + (f", ratio {spent[0] / spent[1]:.2f}" if spent[1] else ""),
    ]
