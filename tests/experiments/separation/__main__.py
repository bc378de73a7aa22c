"""Sealed cases told apart by designed programs: ``python -m tests.experiments.separation --cases 80 --out DIR``.

For each case ``lathesim experiment`` gets the rivals and writes a program; a machine made by another integrator runs it; ``lathesim
diagnose`` gets the recording and is held against the seal. Beside it today's way: the exercise of the lesson, repeated until it decides.
What is in DIR already is not run again; the table at the end is that of all cases in DIR.
"""

from __future__ import annotations

import argparse
import json
import resource
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lathesim.plugins import Registry, load_registry
from tests.diagnosis.suite.lessons import NAMES
from tests.experiments.separation.axis_truth import AxisTruth
from tests.experiments.separation.table import table
from tests.experiments.separation.ties import Tie, schedule
from tests.experiments.separation.turning_truth import CutTruth, SpindleTruth
from tests.experiments.separation.warm_command import command

TRUTHS = {"axis": AxisTruth, "cut": CutTruth, "spindle": SpindleTruth}


def seconds_used() -> float:
    """Return the processor time of all finished children [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def rival(key: str) -> str:
    """Return a rival as ``--between`` takes it."""
    return f"{NAMES[key].effect}@{NAMES[key].at}"


def is_named_alone(told: dict[str, Any], tie: Tie) -> bool:
    """Return whether a diagnosis names the true rival, alone and in no tie."""
    others = {NAMES[key].effect for key in tie.rivals} - {NAMES[tie.rivals[tie.truth]].effect}
    right = {name for name in NAMES[tie.rivals[tie.truth]].right if name not in others}
    named = [item["effect"] for item in told.get("effects") or []]
    mean = NAMES[tie.rivals[tie.truth]].mean
    return told.get("verdict") == "named" and bool(named) and named[0] in right and all(name in right or name == mean for name in named)


def is_right(told: dict[str, Any], tie: Tie) -> bool:
    """Return whether a diagnosis tells the rivals apart: of what it names, or leaves tied, the true one is the only rival.

    A tie with something that was no rival, as with an effect of the same equation at the same place, does not count against it.
    """
    if told.get("verdict") not in ("named", "tied"):
        return False
    left = {item for effect in told.get("effects") or [] for item in _with_ties(effect)}
    truth = tie.rivals[tie.truth]
    others = [key for key in tie.rivals if key != truth and NAMES[key].effect != NAMES[truth].mean]
    return _stands(truth, left, NAMES[truth].right) and not any(_stands(key, left, (NAMES[key].effect,)) for key in others)


def _with_ties(effect: dict[str, Any]) -> list[tuple[str, str]]:
    """Return an effect with those it is tied with as (effect, place)."""
    found = [(str(effect["effect"]), str(effect["at"]))]
    for text in effect.get("tied_with") or []:
        name, _, place = str(text).partition(" at ")
        found.append((name, place or found[0][1]))
    return found


def _stands(key: str, left: set[tuple[str, str]], names: Sequence[str]) -> bool:
    """Return whether a rival is among what is left, at its place; what sits at a motion may be told at a sensor of it and the other way."""
    own = NAMES[key].at
    return any(name in names and (place.partition(".")[0] == own or _sensor(own) != _sensor(place)) for name, place in left)


def _sensor(place: str) -> bool:
    return any(word in place for word in ("encoder", "scale", "tachometer"))


def said(told: dict[str, Any]) -> str:
    """Return a diagnosis in a few words."""
    if "verdict" not in told:
        return f"none: {told.get('error', '')[-160:]}"
    named = ", ".join(f"{item['effect']}@{item['at']}" for item in told.get("effects") or [])
    return f"{told['verdict']} {named}".strip()


def repeated(truth: Any, tie: Tie, lesson: Path | str, folder: Path, registry: Registry, most: int) -> dict[str, Any]:
    """Run the program of a lesson until the diagnosis of all its recordings is right, at most ``most`` times; return how long that took.

    Where it is not decided, one run more is the least that it takes.
    """
    total, recordings, answers = 0.0, [], []
    for turn in range(most):
        recordings.append(folder / f"recording_{turn + 1}.csv")
        total += truth.record(lesson, recordings[-1], registry)
        before = [part for other in recordings[:-1] for part in ("--with", lesson, other)]
        told = command("diagnose", lesson, recordings[-1], *before, "--no-report", "--json", "-")
        answers.append(said(told))
        (folder / f"diagnosis_{turn + 1}.json").write_text(json.dumps(told), encoding="utf-8")
        if is_right(told, tie):
            return {"seconds": total, "decided": True, "runs": turn + 1, "answers": answers, "alone": is_named_alone(told, tie)}
    return {"seconds": total * (most + 1) / most, "decided": False, "runs": most, "answers": answers, "alone": False}


def one_case(tie: Tie, seed: int, folder: Path, registry: Registry, asked: argparse.Namespace) -> dict[str, Any]:
    """Return what came of a case."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    truth = TRUTHS[tie.rig](tie.rivals[tie.truth], seed)
    before = seconds_used()
    between = ",".join(rival(key) for key in tie.rivals)
    designed = command(
        "experiment", truth.lesson, "--between", between, "--at-most", asked.at_most, "--programs", asked.programs, "--json",
        "--out", folder / "next", *([] if asked.trial else ["--no-trial"]),
    )  # fmt: skip
    result: dict[str, Any] = {
        "rig": tie.rig, "family": tie.family, "rivals": list(tie.rivals), "truth": tie.rivals[tie.truth],
        "size": {name: value for name, (value, _) in truth.hidden.parameters.items()}, "design_cpu_s": seconds_used() - before,
    }  # fmt: skip
    if "error" in designed:
        return {**result, "error": designed["error"]}
    checked = command("program", folder / "next" / "program.nc", "--json")
    told = next((item for item in designed["rivals"] if item["rival"].partition("@")[0] == NAMES[result["truth"]].effect), {})
    result |= {
        "passes_program": "moves" in checked, "decidable": designed["decidable"], "pairs": designed["pairs"],
        "explains": told.get("explains"), "apart": told.get("apart"),
        "verdict_foretold": told.get("verdict"), "chance": told.get("chance_to_decide"),
        "designed": repeated(truth, tie, folder / "next" / "lesson.yaml", folder, registry, asked.runs),
    }  # fmt: skip
    (folder / "exercise").mkdir()
    exercise = truth.lesson
    return {
        **result,
        "exercise": repeated(truth, tie, exercise, folder / "exercise", registry, asked.runs),
        "cpu_s": seconds_used() - before,
    }


def main() -> None:
    """Run the campaign and print its table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=80)
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--at-most", default="8 s")
    parser.add_argument("--programs", type=int, default=40)
    parser.add_argument("--runs", type=int, default=1, help="how often a program is run at most")
    parser.add_argument("--trial", action="store_true", help="let the design try the diagnosis on simulated recordings")
    parser.add_argument("--rigs", default=",".join(TRUTHS))
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    registry = load_registry(installed=False)
    out = asked.out.resolve()
    for number, tie in list(enumerate(schedule(asked.seed, tuple(asked.rigs.split(",")))))[asked.first : asked.first + asked.cases]:
        folder = out / f"case_{number:03d}"
        kept = folder / "result.json"
        if not kept.is_file():
            result = one_case(tie, 1000 * asked.seed + number, folder, registry, asked)
            kept.write_text(json.dumps(result, indent=2), encoding="utf-8")
        print(kept.read_text(encoding="utf-8"), flush=True)
    print("\n".join(table([json.loads(kept.read_text(encoding="utf-8")) for kept in sorted(out.glob("case_*/result.json"))])), flush=True)


if __name__ == "__main__":
    main()
