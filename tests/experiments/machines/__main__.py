"""Machines of other structures emulated: ``python -m tests.experiments.machines --machines 20 --out DIR``.

Each machine runs the staircase and the staircase at three speeds, is emulated from way-points at 10 Hz with 10 um of noise, and judged
on two programs that were not fitted: the diamond, and strokes of many lengths and speeds. Then the same with the second program designed
from what the first one told, as long as that of the lesson. What is in DIR already is not run again.
"""

from __future__ import annotations

import argparse
import json
import resource
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.experiments.design_experiment import DesignWish
from lathesim.experiments.emulation import EmulationQuestion, emulate
from lathesim.experiments.emulation_report import as_json, write_emulation
from lathesim.experiments.precision import before_design, design_for_precision, write_precision
from lathesim.lessons.lesson import Lesson, find_program, load_lesson
from lathesim.lessons.simulate import prepare, run_prepared
from lathesim.plugins import Registry, load_registry
from tests.experiments.machines.generator import Machine, drawn_machine, waypoints

LESSON = "27_a_controller_that_tells_nothing"
CHANNELS = ("x_axis.position", "y_axis.position")
WAYS = ("undesigned", "designed")
SECONDS = 28.0
"""How long the second program of the lesson lasts."""


def shipped(name: str) -> Path:
    """Return a part program of the lesson."""
    found = find_program(f"closed_controller_{name}.nc", Path())
    assert found is not None
    return found


def designed_program(folder: Path, pilot: Path, registry: Registry) -> Path:
    """Return a program of as many seconds as the second of the lesson, designed for the machine that a first emulation found."""
    place = folder / "designed"
    if not (place / "program.nc").is_file():
        lesson = load_lesson(pilot / "emulated" / "lesson.yaml")
        wish = DesignWish(SECONDS, 24, draws=1, rate=10.0, arcs=False, exchanges=16, criterion="V")
        before = before_design(pilot / "emulated" / "emulation.json", lesson)
        write_precision(design_for_precision(lesson, ["all"], registry, wish, before=before), place)
    return place / "program.nc"


def strokes(folder: Path) -> Path:
    """Return a program of strokes of both axes, out and back, of many lengths, speeds and rests: nothing like those of the lesson."""
    file = folder / "strokes.nc"
    random = np.random.default_rng(16)
    lines = ["G18 G90 G94 G21 G8"]
    for _ in range(10):
        for letter in "XZ":
            way = float(random.choice([0.5, 2.0, 6.0, 10.0, 20.0, 30.0]) * random.choice([-1.0, 1.0]))
            lines += [f"G1 {letter}{way:.1f} F{60 * random.choice([5, 10, 20, 50])}", f"G1 {letter}0.0"]
            lines += [f"G4 P{random.uniform(0.0, 0.15):.3f}"] if random.random() < 0.5 else []
    folder.mkdir(parents=True, exist_ok=True)
    file.write_text("\n".join([*lines, "G4 P1", "M2"]) + "\n", encoding="utf-8")
    return file


def recorded(file: Path, program: Path, machine: Machine, seed: int) -> None:
    """Write way-points of a program with noise to a file."""
    time, _, noisy = waypoints(program, machine, seed)
    rows = np.column_stack([time, *(1e3 * noisy)])
    np.savetxt(file, rows, delimiter=",", header="time,x,y", comments="", fmt="%.5f")


def emulated(folder: Path, number: int, fitted: dict[str, Path], registry: Registry, seed: int, lesson: str) -> dict[str, Any]:
    """Emulate a machine from way-points of programs, beginning at a lesson, and judge it on two that were not fitted."""
    folder.mkdir(parents=True, exist_ok=True)
    machine, unseen = drawn_machine(number), {"diamond": shipped("diamond"), "strokes": strokes(folder)}
    given = []
    for place, (name, program) in enumerate({**fitted, **unseen}.items()):
        recorded(folder / f"{name}.csv", program, machine, 100 * seed + 10 * number + place)
        given.append(f"{program}={folder / f'{name}.csv'}")
    used = resource.getrusage(resource.RUSAGE_SELF)
    found = emulate(load_lesson(lesson), given[: len(fitted)], given[len(fitted) :], registry, EmulationQuestion(importance=False))
    now = resource.getrusage(resource.RUSAGE_SELF)
    write_emulation(found, folder / "emulated")
    told = as_json(found)
    learnt = load_lesson(folder / "emulated" / "lesson.yaml")
    judged = {
        name: {
            "rms_against_truth_m": against_truth(learnt, program, machine, registry), "rms_against_waypoints_m": list(item["rms"].values()),
            "in_band": item["in_band"],
        }
        for (name, program), item in zip(unseen.items(), told["unseen"], strict=True)
    }  # fmt: skip
    return {
        "structure": told["structure"], "known": told["directions"]["known_to_10_percent"], "unseen": judged,
        "wandering_s2_per_s": told["clock_wandering_s2_per_s"], "model_error_share": told["model_error_share"],
        "waypoints": sum(item["waypoints"] for item in told["recordings"]),
        "cpu_s": now.ru_utime + now.ru_stime - used.ru_utime - used.ru_stime,
    }  # fmt: skip


def against_truth(lesson: Lesson, program: Path, machine: Machine, registry: Registry) -> list[float]:
    """Return the rms [m] of each axis by which an emulated lesson is off the machine itself on a program."""
    time, clean, _ = waypoints(program, machine, 0)
    record = run_prepared(prepare(lesson, registry, program=program), engine="compiled")
    return [
        float(np.sqrt(np.square(np.interp(time, record.time, record[name]) - row).mean()))
        for name, row in zip(CHANNELS, clean, strict=True)
    ]


def table(results: list[dict[str, Any]]) -> list[str]:
    """Return the lines of the table over all machines so far."""
    lines = []
    for way in WAYS:
        own = [item[way] for item in results if way in item]
        if not own:
            continue
        lines.append(
            f"{way}, {len(own)} machines, {np.median([item['waypoints'] for item in own]):.0f} way-points; known to 10 %: "
            f"{np.mean([item['known'] for item in own]):.1f}; processor time {np.median([item['cpu_s'] for item in own]):.0f} s"
        )
        for name in own[0]["unseen"]:
            told = [item["unseen"][name] for item in own]
            true, read = (
                [1e3 * float(np.sqrt(np.square(item[key]).mean())) for item in told]
                for key in ("rms_against_truth_m", "rms_against_waypoints_m")
            )
            band = [100.0 * item["in_band"] for item in told]
            lines += [
                f"  {name}: rms of an axis against the truth: median {np.median(true):.4f} mm, worst {max(true):.4f} mm; against "
                f"way-points: median {np.median(read):.4f} mm, worst {max(read):.4f} mm",
                f"    in the 95 % band: {np.mean(band):.1f} % of the points; by machine {min(band):.0f} to {max(band):.0f} %",
            ]
    both = [item for item in results if len(item) == len(WAYS)]
    for name in both[0]["designed"]["unseen"] if both else ():
        size = [[float(np.sqrt(np.square(item[way]["unseen"][name]["rms_against_truth_m"]).mean())) for way in WAYS] for item in both]
        shares = [designed / undesigned for undesigned, designed in size]
        lines.append(f"{name}: designed over undesigned, machine by machine: {np.median(shares):.2f} in the median ({len(shares)})")
    return lines


def main() -> None:
    """Run the campaign and print its table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--machines", type=int, default=20)
    parser.add_argument("--first", type=int, default=0, help="number of the first machine")
    parser.add_argument("--only", choices=WAYS, help="one of both ways")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    registry = load_registry(installed=False)
    out = asked.out.resolve()
    ways = (asked.only,) if asked.only else WAYS
    for number in range(asked.first, asked.first + asked.machines):
        for way in ways:
            kept = out / f"machine_{number:02d}" / f"{way}.json"
            if not kept.is_file():
                fitted, begun_at = {"staircase": shipped("staircase")}, LESSON
                if way == "designed":
                    first = emulated(kept.parent / "first", 1000 * asked.seed + number, fitted, registry, asked.seed, LESSON)
                    (kept.parent / "first.json").write_text(json.dumps(first, indent=2), encoding="utf-8")
                    fitted["designed"] = designed_program(kept.parent, kept.parent / "first", registry)
                    begun_at = str(kept.parent / "first" / "emulated" / "lesson.yaml")
                else:
                    fitted["three_speeds"] = shipped("three_speeds")
                told = emulated(kept.parent / way, 1000 * asked.seed + number, fitted, registry, asked.seed, begun_at)
                kept.write_text(json.dumps(told, indent=2), encoding="utf-8")
            print(number, way, kept.read_text(encoding="utf-8"), flush=True)
    results = [
        {way: json.loads((folder / f"{way}.json").read_text(encoding="utf-8")) for way in ways if (folder / f"{way}.json").is_file()}
        for folder in sorted(out.glob("machine_*"))
    ]
    print("\n".join(table(results)), flush=True)


if __name__ == "__main__":
    main()
