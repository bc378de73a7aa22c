"""Sealed cases told apart by designed programs: ``python -m tests.experiments.separation --cases 80 --out DIR``.

For each case ``lathesim experiment`` gets the rivals and writes a program; a machine made by another integrator runs it; ``lathesim
diagnose`` gets the recording and is held against the seal. Beside it today's way: the exercise of the lesson, repeated until it decides.
What is in DIR already is not run again; the table at the end is that of all cases in DIR. ``--rescore`` runs nothing: it holds the
diagnoses in DIR against their seals once more.
"""

from __future__ import annotations

import argparse
import json
import resource
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.plugins import Registry, load_registry
from tests.experiments.separation.axis_truth import AxisTruth
from tests.experiments.separation.names import NAMES
from tests.experiments.separation.score import is_named_alone, is_right
from tests.experiments.separation.ties import Tie, schedule
from tests.experiments.separation.turning_truth import CutTruth, SpindleTruth
from tests.experiments.separation.warm_command import command

BINS = ((0.0, 0.6), (0.6, 0.9), (0.9, 1.01))
TRUTHS = {"axis": AxisTruth, "cut": CutTruth, "spindle": SpindleTruth}


def seconds_used() -> float:
    """Return the processor time of all finished children [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def rival(key: str) -> str:
    """Return a rival as ``--between`` takes it."""
    return f"{NAMES[key].effect}@{NAMES[key].at}"


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


def rescored(result: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Return a case with its stored diagnoses scored once more."""
    if "designed" not in result:
        return result
    rivals = tuple(result["rivals"])
    tie = Tie(result["rig"], result["family"], rivals, rivals.index(result["truth"]))
    again = dict(result)
    for way, place in (("designed", folder), ("exercise", folder / "exercise")):
        old = result[way]
        one = old["seconds"] / (old["runs"] if old["decided"] else old["runs"] + 1)
        told = [json.loads((place / f"diagnosis_{turn + 1}.json").read_text(encoding="utf-8")) for turn in range(old["runs"])]
        first = next((turn for turn, item in enumerate(told) if is_right(item, tie)), None)
        runs = old["runs"] if first is None else first + 1
        again[way] = {
            **old, "decided": first is not None, "runs": runs, "seconds": one * (runs + 1 if first is None else runs),
            "alone": first is not None and is_named_alone(told[first], tie),
        }  # fmt: skip
    return again


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


def table(results: Sequence[dict[str, Any]]) -> list[str]:
    """Return the lines of the table over all cases so far."""
    done = [item for item in results if "designed" in item]
    if not done:
        return ["no case ended with a program"]
    right = [item["designed"]["decided"] and item["designed"]["runs"] == 1 for item in done]
    usual = [item["exercise"]["decided"] and item["exercise"]["runs"] == 1 for item in done]
    shares = [item["designed"]["seconds"] / item["exercise"]["seconds"] if item["designed"]["decided"] else np.inf for item in done]
    chances = np.array([item["chance"] for item in done], dtype=float)
    alone = [sum(bool(item[way].get("alone")) for item in done) for way in ("designed", "exercise")]
    lines = [
        f"{len(done)} of {len(results)} cases with a program; all of them pass 'program': {all(item['passes_program'] for item in done)}",
        f"right after one run: designed {sum(right)}/{len(done)}, the exercise {sum(usual)}/{len(done)}; "
        f"named alone, in no tie: {alone[0]} and {alone[1]}",
        f"seconds, designed against the exercise repeated: median {np.median(shares):.2f} (at most, as an exercise that does not decide "
        "counts one run more)",
        f"predicted chance {chances.mean():.2f}, right {np.mean(right):.2f}, Brier {np.mean(np.square(chances - right)):.3f}",
    ]
    for low, high in BINS:
        chosen = (chances >= low) & (chances < high)
        if chosen.any():
            seen = np.array(right)[chosen].mean()
            lines.append(f"  foretold {low:.1f} to {min(high, 1.0):.1f}: {chances[chosen].mean():.2f}, right {seen:.2f} of {chosen.sum()}")
    for family in dict.fromkeys((item["rig"], item["family"]) for item in done):
        own = [good for item, good in zip(done, right, strict=True) if (item["rig"], item["family"]) == family]
        lines.append(f"  {family[0]}, {family[1]}: {sum(own)}/{len(own)}")
    cpu = [item["design_cpu_s"] for item in done]
    lines.append(f"processor time of a design: median {np.median(cpu):.0f} s, most {max(cpu):.0f} s")
    return lines


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
    parser.add_argument("--rescore", action="store_true", help="score what is in DIR once more, and run nothing")
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    registry = load_registry(installed=False)
    out = asked.out.resolve()
    first, last = asked.first, asked.first if asked.rescore else asked.first + asked.cases
    for number, tie in list(enumerate(schedule(asked.seed, tuple(asked.rigs.split(",")))))[first:last]:
        folder = out / f"case_{number:03d}"
        kept = folder / "result.json"
        if not kept.is_file():
            result = one_case(tie, 1000 * asked.seed + number, folder, registry, asked)
            kept.write_text(json.dumps(result, indent=2), encoding="utf-8")
        print(kept.read_text(encoding="utf-8"), flush=True)
    results = [rescored(json.loads(kept.read_text(encoding="utf-8")), kept.parent) for kept in sorted(out.glob("case_*/result.json"))]
    print("\n".join(table(results)), flush=True)


if __name__ == "__main__":
    main()
