"""Score of one answer: reads the truth of a case and what the runner kept of the program under test, and nothing else."""

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass, field
from typing import Any

from tests.diagnosis.suite.generate import largest_size

SEEN_FROM = 3.0
"""Floors from which on an effect has to be found."""
SURE = 0.8
"""Probability from which on a name counts as given with confidence."""
QUIET, NAMING = ("no_mismatch", "parameters_only"), ("named", "tied")
RIGHT_WRONG = (
    "first_right", "family_right", "exact", "none_too_many", "outside_not_named", "outside_reported", "fault_named", "poor_family",
    "poor_resolved",
)  # fmt: skip
"""Questions that are answered rightly (True) or wrongly (False)."""


@dataclass
class Score:
    """What an answer is worth; None where a question does not arise in the case."""

    case: str
    rig: str
    category: str
    truth: str
    answer: str
    seconds: float | None = None
    search_seconds: float | None = None
    failed: bool = False
    false_alarm: bool | None = None
    quiet: bool | None = None
    first_right: bool | None = None
    by_tie: bool = False
    family_right: bool | None = None
    place_right: bool | None = None
    exact: bool | None = None
    none_too_many: bool | None = None
    outside_not_named: bool | None = None
    outside_reported: bool | None = None
    fault_named: bool | None = None
    poor_family: bool | None = None
    poor_resolved: bool | None = None
    told_removed: float | None = None
    removed: float | None = None
    parameter_errors: list[float] = field(default_factory=list)
    covered: list[bool] = field(default_factory=list)

    @property
    def missed(self) -> list[str]:
        """The questions answered wrongly."""
        wrong = [name.replace("_", " ") for name in RIGHT_WRONG if getattr(self, name) is False]
        return (["false alarm"] if self.false_alarm else []) + (["no answer"] if self.failed else []) + wrong

    @property
    def asked(self) -> bool:
        """Whether any question arises: what moves no channel by enough floors need not be found."""
        return self.false_alarm is not None or any(getattr(self, name) is not None for name in RIGHT_WRONG)


def score(case: str, truth: dict[str, Any], told: dict[str, Any]) -> Score:
    """Score what the runner kept of a case: ``answer`` is the program's JSON, ``second`` that of the experiment resolving a poor case."""
    answer, kind = told["answer"], truth["category"]
    hidden = " + ".join(f"{one['effect'] or one['key']} ({largest_size(one):.3g} floors)" for one in truth["effects"])
    said = summary(answer) if answer else f"no answer: {told['error'].splitlines()[-1][:200]}"
    made = Score(case, truth["rig"], kind, hidden or (f"fault {truth['fault']['kind']}" if truth["fault"] else kind), said)
    made.failed = "verdict" not in answer
    made.seconds, made.search_seconds = told["seconds"], answer.get("wall_time_s")
    if kind in ("control", "parameters"):
        made.false_alarm = bool(named(answer))
        made.quiet = answer.get("verdict") in QUIET
    elif kind == "fault":
        made.fault_named = names_fault(truth["fault"], answer)
    elif kind == "outside":
        made.outside_not_named = not made.failed and not confident(answer)
        if largest_size(truth["effects"][0]) >= SEEN_FROM:
            made.outside_reported = not made.failed and answer["verdict"] not in QUIET
    elif kind == "poor":
        second = (told.get("second") or {}).get("answer") or {}
        made.answer += f"; then {summary(second)}" if second else ""
        _score_poor(made, truth, answer, second)
    elif any(largest_size(one) >= SEEN_FROM for one in truth["effects"]):
        _score_names(made, truth, answer)
    return made


def named(answer: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the effects an answer names, the surest first; an answer that says it does not know names none."""
    return list(answer.get("effects") or []) if answer.get("verdict") in NAMING else []


def confident(answer: dict[str, Any]) -> bool:
    """Whether an answer gives a name as sure, and the model with it as complete."""
    given = named(answer)
    if answer.get("verdict") != "named" or not given:
        return False
    probability = given[0].get("probability")
    return answer.get("adequate") is not False and (probability is None or probability > SURE)


def matches(true: dict[str, Any], given: dict[str, Any]) -> bool:
    """Whether a named effect is the true one, or says it is tied with it."""
    return bool({given.get("effect", ""), *(given.get("tied_with") or [])} & set(true["right"]))


def _place(given: dict[str, Any]) -> str:
    return str(given.get("at", "")).partition(".")[0]


def _score_names(made: Score, truth: dict[str, Any], answer: dict[str, Any]) -> None:
    effects = truth["effects"]
    given = _without_means(effects, named(answer))
    data_is_hidden = len(effects) == 1 and effects[0]["data"]
    calls_it_data = data_is_hidden and answer.get("verdict") == "recording_fault" and _of_channel(effects[0], answer)
    made.first_right = calls_it_data or (bool(given) and any(matches(true, given[0]) for true in effects))
    made.by_tie = made.first_right and not calls_it_data and not any(given[0].get("effect") in true["right"] for true in effects)
    made.family_right = made.first_right or (bool(given) and any(given[0].get("family") in true["families"] for true in effects))
    if made.category in ("pair", "triple"):
        made.exact = _exactly(effects, given) if all(largest_size(one) >= SEEN_FROM for one in effects) else None
    else:
        # what is one effect in another form may be several of the catalogue's: a friction that falls with speed, and the level it falls to
        made.none_too_many = len(given) <= len(effects) or all(any(one.get("effect") in true["right"] for true in effects) for one in given)
    if given and made.first_right:
        made.place_right = any(matches(true, given[0]) and _place(given[0]) == true["at"] for true in effects)
    # an answer without a fit has removed nothing; one that calls the recording at fault is not asked
    if not calls_it_data:
        made.told_removed = answer.get("removed_share") or 0.0
        made.removed = removed_by_fit(truth, answer) or 0.0
    for true in effects:
        # at another place it has other values: a wave of the scale is one of the encoder, turned round. The place has a line of its own
        match = next((one for one in given if one.get("effect") == true["effect"] and _place(one) == true["at"]), None)
        if match is not None:
            _score_parameters(made, true, match)


def _without_means(effects: list[dict[str, Any]], given: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the named effects without the mean that an uneven effect of the truth has, where that is named as well: it is there."""
    means = {true.get("mean") for true in effects if any(matches(true, one) for one in given)}
    means -= {name for true in effects for name in true["right"]}
    return [one for one in given if one.get("effect") not in means]


def _of_channel(true: dict[str, Any], answer: dict[str, Any]) -> bool:
    """Whether an answer that calls the recording at fault speaks of the part where it is."""
    return true["at"] in json.dumps(answer, ensure_ascii=False)


def _exactly(effects: list[dict[str, Any]], given: list[dict[str, Any]]) -> bool:
    """Whether each true effect is named by one of the given ones, and none is left over."""
    rest = list(given)
    for true in effects:
        found = next((one for one in rest if one.get("effect") in true["right"]), None) or next(
            (one for one in rest if matches(true, one)), None
        )
        if found is None:
            return False
        rest.remove(found)
    return not rest


def _score_parameters(made: Score, true: dict[str, Any], given: dict[str, Any]) -> None:
    values = {name: _quantity(entry) for name, entry in (given.get("parameters") or {}).items()}
    for name, entry in true["parameters"].items():
        factors = name.split("*")
        if not all(factor in values for factor in factors):
            continue
        value = 1.0
        for factor in factors:
            value *= values[factor][0]
        made.parameter_errors.append(abs(value - entry["value"]) / abs(entry["value"]))
        low, high = values[name][1:] if len(factors) == 1 else (None, None)
        if low is not None and high is not None:
            made.covered.append(low <= entry["value"] <= high)


def _quantity(entry: dict[str, Any]) -> tuple[float, float | None, float | None]:
    value = entry["value"]
    return math.nan if value is None else float(value), entry.get("low"), entry.get("high")


def removed_by_fit(truth: dict[str, Any], answer: dict[str, Any]) -> float | None:
    """Return the share of the variance above the true noise that the answer's own before and after remove, held out.

    Over the channels in the lesson's own simulation, and over what two channels say together (a scale less the encoder, a current less the
    command), where the load that moves both of them is no noise.
    """
    before, after = _of_differences(truth, answer)
    for channel, fit in (answer.get("fit") or {}).items():
        # without a held-out recording an answer is judged on the fitted one
        noise = truth["floors"].get("fit" if isinstance(fit, dict) and fit.get("recording") == "fit.csv" else "validate", {})
        floor = next((noise[name] for name, output in truth["outputs"].items() if output == channel and name in noise), None)
        if floor is None or not isinstance(fit, dict) or fit.get("before") is None or fit.get("after") is None:
            continue
        before += max((fit["before"] / floor) ** 2 - 1.0, 0.0)
        after += max((fit["after"] / floor) ** 2 - 1.0, 0.0)
    return 1.0 - after / before if before > 0.0 else None


def _of_differences(truth: dict[str, Any], answer: dict[str, Any]) -> tuple[float, float]:
    """Return what is missing before and after at a channel that another one foretells, above the true noise of their difference."""
    noise = truth["floors"].get("validate", {})
    before = after = 0.0
    for item in answer.get("missing") or []:
        shown = [channel for channel, output in truth["outputs"].items() if output == item["at"]]
        told = {f"{channel}-{other}" for channel in shown for other in truth["outputs"]}
        floor = next((size for name, size in noise.items() if name in told), None)
        if floor and item.get("before") is not None and item.get("after") is not None:
            before += max((item["before"] / floor) ** 2 - 1.0, 0.0)
            after += max((item["after"] / floor) ** 2 - 1.0, 0.0)
    return before, after


def names_fault(fault: dict[str, Any], answer: dict[str, Any]) -> bool:
    """Whether the answer calls it a fault of the recording, names a channel of it and says what kind it is."""
    if answer.get("verdict") != "recording_fault":
        return False
    text = json.dumps({key: answer.get(key) for key in ("sentence", "recording", "left")}, ensure_ascii=False).lower()
    channels = [*fault["channel"].split("|"), *(name.lower() for name in fault["outputs"])]
    return any(channel in text for channel in channels) and re.search(fault["words"], text) is not None


def _score_poor(made: Score, truth: dict[str, Any], answer: dict[str, Any], second: dict[str, Any]) -> None:
    """A poor recording is answered well by the right name, or by its family with an experiment that then gives the name."""
    true = truth["effects"][0]
    given = named(answer)
    family = any(matches(true, one) or one.get("family") in true["families"] for one in given)
    seen = largest_size(true, "fit") >= SEEN_FROM
    if seen:
        made.poor_family = family
    if largest_size(true, "resolve") < SEEN_FROM:
        return
    resolved = bool(named(second)) and matches(true, named(second)[0])
    outright = answer.get("verdict") == "named" and bool(given) and given[0].get("effect") in true["right"]
    # what a poor recording hides within the given values cannot be named from it: then only the experiment counts
    made.poor_resolved = outright or (resolved and (not seen or (family and any(one.get("separating_experiment") for one in given))))


def summary(answer: dict[str, Any]) -> str:
    """Return an answer in a line."""
    if "verdict" not in answer:
        return "no answer"
    told = []
    for one in answer.get("effects") or []:
        ties = f" ~ {', '.join(one['tied_with'])}" if one.get("tied_with") else ""
        told.append(f"{one.get('effect')} at {one.get('at')} ({one.get('probability', 0) or 0:.2f}){ties}")
    share = answer.get("removed_share")
    removed = f", removed {share:.3f}" if isinstance(share, (int, float)) else ""
    adequate = "" if answer.get("adequate", True) else ", incomplete"
    return f"{answer['verdict']}: {' + '.join(told) or '-'}{removed}{adequate}"
