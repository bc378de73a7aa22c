"""Machines of other structures emulated: ``python -m tests.experiments.machines --machines 20 --out DIR``.

Each machine runs the staircase and the staircase at three speeds, is emulated from way-points at 10 Hz with 10 um of noise, and judged
on the diamond, which was not fitted. Then the same with designed programs that last as long. What is in DIR already is not run again.
"""

from __future__ import annotations

import argparse
import json
import resource
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.experiments.design.experiment import Wish
from lathesim.experiments.design.precision import design_for_precision, write_precision
from lathesim.experiments.emulation.emulation import Question, emulate
from lathesim.experiments.emulation.report import as_json, write_emulation
from lathesim.lessons.lesson import find_program, load_lesson
from lathesim.lessons.simulate import prepare, run_prepared
from lathesim.plugins import Registry, load_registry
from tests.experiments.machines.generator import drawn_machine, waypoints

LESSON = "16_a_controller_that_tells_nothing"
CHANNELS = ("x_axis.position", "y_axis.position")
SECONDS = (25.0, 28.0)
UNSEEN = "diamond"


def shipped(name: str) -> Path:
    """Return a part program of the lesson."""
    found = find_program(f"closed_controller_{name}.nc", Path())
    assert found is not None
    return found


def designed_programs(folder: Path, registry: Registry) -> list[Path]:
    """Return two programs designed for the lesson's machine as it is given, as long as those of the lesson."""
    programs = []
    for number, seconds in enumerate(SECONDS, 1):
        place = folder / f"designed_{number}"
        if not (place / "program.nc").is_file():
            wish = Wish(seconds, 40, seed=number, rate=10.0, arcs=False)
            found = design_for_precision(load_lesson(LESSON), ["all"], registry, wish, "D", None, lambda text: None)
            write_precision(found, place)
        programs.append(place / "program.nc")
    return programs


def emulated(folder: Path, number: int, fitted: dict[str, Path], registry: Registry, seed: int) -> dict[str, Any]:
    """Emulate a machine from way-points of programs, and judge it on the diamond, with noise and without."""
    folder.mkdir(parents=True, exist_ok=True)
    machine = drawn_machine(number)
    given = []
    for place, (name, program) in enumerate({**fitted, UNSEEN: shipped(UNSEEN)}.items()):
        time, clean, noisy = waypoints(program, machine, 100 * seed + 10 * number + place)
        np.savetxt(
            folder / f"{name}.csv", np.column_stack([time, *(1e3 * noisy)]), delimiter=",", header="time,x,y", comments="", fmt="%.5f"
        )
        given.append(f"{name if name == UNSEEN else program}={folder / f'{name}.csv'}")
    used = resource.getrusage(resource.RUSAGE_SELF)
    found = emulate(load_lesson(LESSON), given[:-1], given[-1:], registry, Question(importance=False))
    now = resource.getrusage(resource.RUSAGE_SELF)
    write_emulation(found, folder / "emulated")
    record = run_prepared(prepare(load_lesson(folder / "emulated" / "lesson.yaml"), registry, UNSEEN), engine="compiled")
    off = [np.interp(time, record.time, record[name]) - row for name, row in zip(CHANNELS, clean, strict=True)]
    told = as_json(found)
    return {
        "structure": told["structure"], "known": told["directions"]["known_to_10_percent"],
        "rms_against_truth_m": [float(np.sqrt(np.square(row).mean())) for row in off],
        "rms_against_waypoints_m": list(told["unseen"][0]["rms"].values()), "in_band": told["unseen"][0]["in_band"],
        "cpu_s": now.ru_utime + now.ru_stime - used.ru_utime - used.ru_stime,
    }  # fmt: skip


def table(results: list[dict[str, Any]]) -> list[str]:
    """Return the lines of the table over all machines so far."""
    lines = []
    for way in ("undesigned", "designed"):
        own = [item[way] for item in results if way in item]
        if not own:
            continue
        true = [1e3 * float(np.hypot(*item["rms_against_truth_m"])) / np.sqrt(2.0) for item in own]
        read = [1e3 * float(np.hypot(*item["rms_against_waypoints_m"])) / np.sqrt(2.0) for item in own]
        band = [item["in_band"] for item in own]
        lines += [
            f"{way}, {len(own)} machines: rms of an axis on the unseen program, against the truth: median {np.median(true):.4f} mm, worst "
            f"{max(true):.4f} mm; against way-points with noise: median {np.median(read):.4f} mm, worst {max(read):.4f} mm",
            f"  in the 95 % band: {100 * np.mean(band):.1f} % of the points; by machine {100 * min(band):.0f} to {100 * max(band):.0f} %; "
            f"known to 10 %: {np.mean([item['known'] for item in own]):.1f}; "
            f"processor time {np.median([item['cpu_s'] for item in own]):.0f} s",
        ]
    return lines


def main() -> None:
    """Run the campaign and print its table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--machines", type=int, default=20)
    parser.add_argument("--first", type=int, default=0, help="number of the first machine")
    parser.add_argument("--only", choices=("undesigned", "designed"), help="one of both ways")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    registry = load_registry(installed=False)
    out = asked.out.resolve()
    designed = designed_programs(out, registry) if asked.only != "undesigned" else []
    ways: dict[str, dict[str, Path]] = {
        "undesigned": {name: shipped(name) for name in ("staircase", "three_speeds")},
        "designed": {f"designed_{number}": program for number, program in enumerate(designed, 1)},
    }
    if asked.only:
        ways = {asked.only: ways[asked.only]}
    for number in range(asked.first, asked.first + asked.machines):
        for way, fitted in ways.items():
            kept = out / f"machine_{number:02d}" / f"{way}.json"
            if not kept.is_file():
                told = emulated(kept.parent / way, 1000 * asked.seed + number, fitted, registry, asked.seed)
                kept.write_text(json.dumps(told, indent=2), encoding="utf-8")
            print(number, way, kept.read_text(encoding="utf-8"), flush=True)
    results = [
        {way: json.loads((folder / f"{way}.json").read_text(encoding="utf-8")) for way in ways if (folder / f"{way}.json").is_file()}
        for folder in sorted(out.glob("machine_*"))
    ]
    print("\n".join(table(results)), flush=True)


if __name__ == "__main__":
    main()
