"""What the answers of the campaign are worth against the bars."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from tests.live.campaign.cases import NAMES, SECONDS
from tests.live.campaign.machines import LEARN

SOON, NEAR = 10.0, 0.5
"""Seconds within which a change is told, and by which its time may be off."""
_CONFIDENT = ("named",)


def table(answers: Iterable[dict[str, Any]]) -> str:
    """Return the bars, asked and measured, as text."""
    known = sorted(answers, key=lambda answer: answer["case"]["number"])
    sound = [answer for answer in known if not answer["case"]["change"]]
    steps = [answer for answer in known if answer["case"]["change"] and not answer["case"]["drift"]]
    drifts = [answer for answer in known if answer["case"]["drift"]]
    false = sum(len(_alarms(answer)) for answer in sound) + sum(len(_before(answer)) for answer in (*steps, *drifts))
    hours = (len(sound) * (SECONDS - LEARN) + sum(answer["case"]["begin"] - LEARN for answer in (*steps, *drifts))) / 3600.0
    first = [(answer, _after(answer)[:1]) for answer in steps]
    later = sum(len(_after(answer)[1:]) for answer in steps)
    after = sum(SECONDS - found[0]["time_s"] for _, found in first if found) / 3600.0
    soon = [bool(found) and found[0]["time_s"] - answer["case"]["begin"] <= SOON for answer, found in first]
    near = [abs(found[0]["since_s"] - answer["case"]["begin"]) <= NEAR for answer, found in first if found]
    known_drifts = [bool(_after(answer)) for answer in drifts]
    inside = [hit for answer in drifts for hit in _inside(answer)[:1]]
    every = [hit for answer in drifts for hit in _inside(answer)]
    changed = [answer for answer in (*steps, *drifts) if answer["verdicts"] and _after(answer)]
    inner = [answer for answer in changed if NAMES[answer["case"]["change"]]]
    outer = [answer for answer in changed if not NAMES[answer["case"]["change"]]]
    cpu = [answer["watch_cpu_s"] / SECONDS for answer in known]
    wrong = [_wrong(answer) for answer in outer]
    rows = [
        ("streams", "60", f"{len(known)}"),
        ("false alarms", "at most 1 in 8 h", f"{false} in {hours:.1f} h"),
        (f"steps of 3 floors and more told within {SOON:g} s", "90 %", _share(soon)),
        ("steps told at all", "", _share([bool(found) for _, found in first])),
        ("further alarms after a step was told", "0", f"{later} in {after:.1f} h"),
        (f"their time within {NEAR:g} s", "", _share(near)),
        ("drifts told", "", _share(known_drifts)),
        ("first time to tolerance inside its interval", "90 to 98 %", _share(inside)),
        ("every time to tolerance inside its interval", "90 to 98 %", _share(every)),
        ("name right", "90 %", _share([_right(answer) for answer in inner])),
        ("of steps", "", _share([_right(answer) for answer in inner if not answer["case"]["drift"]])),
        ("of drifts, at any time", "", _share([_right_later(answer) for answer in inner if answer["case"]["drift"]])),
        ("name within 60 s (window and CPU)", "", _share([_quick(answer) for answer in inner])),
        ("confident wrong name inside the catalogue", "", _share([_wrong(answer) for answer in inner])),
        ("confident name of what lies outside", "0", _share(wrong)),
        ("of one core, watch alone", "under 25 %", f"{100 * max(cpu, default=0.0):.1f} % at most"),
    ]  # fmt: skip
    return "\n".join(f"{name:48s} {asked:18s} {measured}" for name, asked, measured in rows)


def line(answer: dict[str, Any]) -> str:
    """Return a case in a line."""
    case, inside = answer["case"], _inside(answer)
    course = "drift" if case["drift"] else "step"
    what = f"{case['change']} {course} of {case['floors']:.1f} floors at {case['begin']:.1f} s" if case["change"] else "sound"
    alarms = "; ".join(
        f"{item['event']} told {item['time_s']:.1f} s since {item['since_s']:.1f} s, {item['channel']} {item['state']}"
        for item in _alarms(answer)[:3]
    )
    name = "".join(
        f"; {verdict['verdict']} {', '.join(effect for effect, _ in verdict['effects'])} {verdict['cpu_s']:.0f} s".replace("  ", " ")
        for verdict in answer["verdicts"]
    )
    forecast = f"; forecasts inside {sum(inside)} of {len(inside)}" if inside else ""
    return f"{case['number']:2d} {case['machine']:6s}{what}: {alarms or 'silent'}{name}{forecast}"


def _alarms(answer: dict[str, Any]) -> list[dict[str, Any]]:
    return [event for event in answer["events"] if event["event"] in ("change", "drift")]


def _before(answer: dict[str, Any]) -> list[dict[str, Any]]:
    return [event for event in _alarms(answer) if event["time_s"] < answer["case"]["begin"]]


def _after(answer: dict[str, Any]) -> list[dict[str, Any]]:
    return [event for event in _alarms(answer) if event["time_s"] >= answer["case"]["begin"]]


def _inside(answer: dict[str, Any]) -> list[bool]:
    truth = answer["truth"]["reached_s"]
    told = [event for event in answer["events"] if event["event"] == "forecast" and event["time_s"] < truth]
    return [event["low_s"] <= truth <= (event["high_s"] if event["high_s"] is not None else np.inf) for event in told]


def _right(answer: dict[str, Any]) -> bool:
    return _is_right(answer, answer["verdicts"][0])


def _right_later(answer: dict[str, Any]) -> bool:
    return any(_is_right(answer, verdict) for verdict in answer["verdicts"])


def _is_right(answer: dict[str, Any], verdict: dict[str, Any]) -> bool:
    names = [effect for effect, _ in verdict["effects"]]
    return verdict["verdict"] in ("named", "tied") and any(name in NAMES[answer["case"]["change"]] for name in names)


def _quick(answer: dict[str, Any]) -> bool:
    verdict = answer["verdicts"][0]
    return bool(verdict["ended_s"] + verdict["cpu_s"] - _after(answer)[0]["time_s"] <= 60.0)


def _wrong(answer: dict[str, Any]) -> bool:
    return any(verdict["verdict"] in _CONFIDENT and not _is_right(answer, verdict) for verdict in answer["verdicts"])


def _share(hits: list[bool]) -> str:
    return f"{sum(hits)} of {len(hits)}" + (f" ({100.0 * sum(hits) / len(hits):.0f} %)" if hits else "")
