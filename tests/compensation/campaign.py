"""Concealed machines diagnosed, remedied and recorded again: ``python -m tests.compensation.campaign --machines 100 --out DIR``.

A hundred machines are planned: 20 sound ones, 48 with one effect, 32 with a pair, every row of the table of remedies in turn, in an order
drawn once, so that the first n of them are a fair share. The axis of lesson 22 and a two-axis lathe take their turns. A machine is drawn
with ranges of its own, and with nothing of the program's generator. Each takes a minute or more, nearly all of it for the diagnosis; what
DIR has already is not run again. ``--anew`` keeps the diagnoses and repeats what follows from them.

Printed are the share removed of what the effects added, as a lesson and as a part program, and whether the promise was kept.
"""

from __future__ import annotations

import argparse
import json
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.cli.main import run_command_line

Range = tuple[float, float, str]
Kind = tuple[str, str, Mapping[str, Range]]
"""An effect, where it sits, and the range of each parameter."""
SOUND, SINGLE, PAIR = 20, 48, 32
LATHE_EVERY = 5
_PHASE: Range = (-3.0, 3.0, "rad")
_SWING: Mapping[str, Range] = {"frequency": (20.0, 120.0, "Hz"), "damping": (0.03, 0.08, "")}
AXIS: tuple[tuple[Kind, ...], ...] = (
    (
        ("CoulombFriction", "x_axis", {"level": (8.0, 60.0, "N")}),
        ("StribeckFriction", "x_axis", {"excess": (8.0, 30.0, "N"), "stribeck_velocity": (3.0, 12.0, "mm/s")}),
        (
            "AsymmetricFriction",
            "x_axis",
            {"level": (10.0, 50.0, "N"), "asymmetry": (0.1, 0.35, ""), "viscous_difference": (0.0, 50.0, "N*s/m")},
        ),
        ("PreslidingFriction", "x_axis", {"level": (10.0, 50.0, "N"), "distance": (3.0, 20.0, "um"), "excess": (0.0, 5.0, "N")}),
    ),
    (
        ("ForceOffset", "x_axis", {"offset": (-80.0, 80.0, "N")}),
        ("ConverterOffset", "x_drive", {"offset": (0.03, 0.15, "V")}),
        ("DriveGainError", "x_drive", {"error": (0.03, 0.09, ""), "sag": (0.0, 0.01, "1/V")}),
    ),
    (("Backlash", "x_scale", {"width": (5.0, 50.0, "um")}),),
    (
        ("CumulativePitchError", "x_scale", {"slope": (30e-6, 200e-6, "")}),
        ("PeriodicPitchError", "x_scale", {"amplitude": (2.0, 8.0, "um"), "lead": (3.0, 10.0, "mm"), "phase": _PHASE}),
    ),
    (
        (
            "ThermalScrewGrowth",
            "x_scale",
            {"strain": (60e-6, 250e-6, ""), "time_constant": (20.0, 100.0, "s"), "fixed_end": (-0.5, 0.5, "m")},
        ),
    ),
    (
        ("AxialResonance", "x_axis", {"table_share": (0.1, 0.5, ""), **_SWING}),
        ("BaseRocking", "x_scale", {"mobility": (0.3e-3, 3e-3, "1/kg"), "frequency": (12.0, 35.0, "Hz"), "damping": (0.03, 0.08, "")}),
    ),
    (
        ("TorsionalWindUp", "x_scale", {"compliance": (15e-9, 50e-9, "m/N")}),
        ("CurrentLoopLag", "x_drive", {"time_constant": (0.3, 1.5, "ms"), "damping": (0.5, 0.9, "")}),
        ("MotorInductance", "x_drive", {"time_constant": (0.5, 4.0, "ms")}),
    ),
    (("TransportDelay", "x_drive", {"delay": (0.5, 4.0, "ms")}),),
    (("AmplifierDeadZone", "x_drive", {"half_width": (0.05, 0.3, "V")}),),
    (
        ("Cogging", "x_axis", {"amplitude": (3.0, 20.0, "N"), "period": (2.0, 12.0, "mm"), "phase": _PHASE}),
        ("TorqueRipple", "x_axis", {"amplitude": (3.0, 20.0, "N"), "period": (2.0, 12.0, "mm"), "phase": _PHASE}),
        ("EncoderEccentricity", "x_encoder", {"amplitude": (1.0, 6.0, "um"), "turn": (4.0, 12.0, "mm"), "phase": _PHASE}),
    ),
    (
        ("LostCounts", "x_encoder", {"jump": (30.0, 100.0, "um"), "instant": (3.0, 12.0, "s")}),
        ("Quantisation", "x_encoder", {"count": (1.0, 4.0, "um")}),
        ("ChannelTimeShift", "x_scale", {"shift": (1.0, 6.0, "ms")}),
        ("ClockSkew", "x_scale", {"skew": (5e-5, 3e-4, "")}),
    ),
)
"""Rows of the table of remedies on the axis of lesson 22; the last has no remedy in software."""
LATHE: tuple[tuple[Kind, ...], ...] = (
    (("CoulombFriction", "x_axis", {"level": (60.0, 300.0, "N")}), ("CoulombFriction", "z_axis", {"level": (60.0, 300.0, "N")})),
    (("ForceOffset", "x_axis", {"offset": (100.0, 400.0, "N")}),),
    (("Backlash", "z_scale", {"width": (5.0, 40.0, "um")}), ("Backlash", "x_scale", {"width": (5.0, 40.0, "um")})),
    (
        ("CumulativePitchError", "z_scale", {"slope": (50e-6, 300e-6, "")}),
        ("PeriodicPitchError", "z_scale", {"amplitude": (2.0, 8.0, "um"), "lead": (3.0, 6.0, "mm"), "phase": _PHASE}),
    ),
    (
        (
            "SpindleGrowth",
            "z_scale",
            {"growth": (10.0, 40.0, "um"), "time_constant": (3.0, 15.0, "s"), "full_speed": (100.0, 110.0, "rad/s")},
        ),
    ),
    (("TransportDelay", "x_axis", {"delay": (5.0, 15.0, "ms")}),),
    (("TorqueRipple", "x_axis", {"amplitude": (60.0, 200.0, "N"), "period": (2.0, 5.0, "mm"), "phase": _PHASE}),),
    (
        ("RegenerativeChatter", "cutting_force", {"engagement": (0.9, 1.0, ""), "frequency": (60.0, 90.0, "Hz")}),
        ("BeltSlip", "spindle", {"slip": (0.01, 0.04, ""), "creep": (1e-3, 1e-2, "1/(N*m)")}),
        ("SpeedDroop", "spindle", {"droop": (0.1, 0.5, "(rad/s)/(N*m)")}),
    ),
)
"""The same on a two-axis lathe, and what the spindle has; the last has no remedy in software."""
LESSONS = {"axis": "22_what_is_wrong_with_this_machine", "lathe": str(Path(__file__).with_name("concealed_lathe.yaml"))}
ROWS = {"axis": AXIS, "lathe": LATHE}


@dataclass(frozen=True)
class Concealed:
    """A machine of the campaign: which lesson, and what is hidden as ``conceal --effect`` takes it."""

    lesson: str
    hidden: tuple[str, ...]


def planned(seed: int) -> list[Concealed]:
    """Return the hundred machines in the order in which they are run."""
    rng = np.random.default_rng(seed)
    wanted = rng.permutation([0] * SOUND + [1] * SINGLE + [2] * PAIR)
    turns = {name: [int(row) for _ in range(40) for row in rng.permutation(len(rows))] for name, rows in ROWS.items()}
    machines = []
    for number, count in enumerate(wanted):
        name = "lathe" if number % LATHE_EVERY == LATHE_EVERY - 1 else "axis"
        rows: list[int] = []
        while len(rows) < count:
            row = turns[name].pop(0)
            # a pair is of two rows, and what no software mends hides alone
            if row not in rows and (count == 1 or row != len(ROWS[name]) - 1):
                rows.append(row)
        kinds = [ROWS[name][row][int(rng.integers(len(ROWS[name][row])))] for row in rows]
        machines.append(Concealed(name, tuple(_told(kind, rng) for kind in kinds) or ("none",)))
    return machines


def _told(kind: Kind, rng: np.random.Generator) -> str:
    effect, at, ranges = kind
    values = ",".join(f"{name}={rng.uniform(low, high):.6g} {unit}".strip() for name, (low, high, unit) in ranges.items())
    return f"{effect}:{values}@{at}"


def diagnosed(folder: Path, machine: Concealed, seed: int) -> None:
    """Conceal a machine and diagnose it, unless that is done."""
    case, diagnosis = folder / "case", folder / "diagnosis.json"
    if diagnosis.is_file():
        return
    effects = [part for text in machine.hidden for part in ("--effect", text)]
    run_command_line(["conceal", LESSONS[machine.lesson], *effects, "--validate", "--seed", str(seed), "--out", str(case)])
    files = [str(case / name) for name in ("lesson.yaml", "recording.csv")]
    run_command_line(["diagnose", *files, "--validate", str(case / "validate.csv"), "--json", str(diagnosis), "--no-report"])


def remedied(folder: Path, machine: Concealed) -> dict[str, Any]:
    """Remedy a diagnosed machine in both forms, record it again, and return what came of it."""
    case, diagnosis = folder / "case", folder / "diagnosis.json"
    result: dict[str, Any] = {"machine": machine.lesson, "hidden": list(machine.hidden)}
    if not diagnosis.is_file():
        return {**result, "failed": "no diagnosis"}
    out = folder / "mended"
    shutil.rmtree(out, ignore_errors=True)
    asked = ["remedy", str(case / "lesson.yaml"), str(diagnosis), "--out", str(out), "--as"]
    # the program form writes the lesson too
    without_program = run_command_line([*asked, "program"])
    if without_program and run_command_line([*asked, "lesson"]):
        return {**result, "failed": "no remedy"}
    result |= _answer(json.loads((out / "remedy.json").read_text()), json.loads(diagnosis.read_text()))
    for form, lesson in (("lesson", "lesson.yaml"), ("program", "lesson_program.yaml")):
        again = folder / f"again_{form}"
        shutil.rmtree(again, ignore_errors=True)
        if not result["remedies"] or (form == "program" and without_program):
            result[form] = {}
            continue
        recorded = ["conceal", "--again", str(folder / "case_answer.json"), "--lesson", str(out / lesson), "--out", str(again)]
        result[form] = _result(again / "result.json") if run_command_line(recorded) == 0 else {}
    result["kept"] = {
        name: size["low"] <= result["lesson"]["after_of"][name] <= size["high"]
        for name, size in result.pop("promise").items()
        if name in result["lesson"].get("after_of", {})
    }  # fmt: skip
    return result


def _answer(answer: dict[str, Any], diagnosis: dict[str, Any]) -> dict[str, Any]:
    tables = {name.rpartition(" ")[2]: size for name, size in answer["promise"].items() if name.startswith("rms_deviation of ")}
    return {
        "verdict": diagnosis["verdict"],
        "named": [f"{item['effect']}@{item['at']}" for item in diagnosis["effects"]],
        "remedies": [item["remedy"] for item in answer["remedies"]],
        "not_mended": [f"{item['effect']}: {item['why']}" for item in answer["not_mended"]],
        "promise": tables,
    }


def _result(file: Path) -> dict[str, Any]:
    """Return what was removed of the deviation of all tables together."""
    tables = json.loads(file.read_text())["rms_deviation"]
    before, after = (float(np.sqrt(sum(item[key] ** 2 for item in tables.values()))) for key in ("before", "after"))
    return {
        "before": before,
        "after": after,
        "removed": 1.0 - after / before if before > 0.0 else None,
        "after_of": {name: item["after"] for name, item in tables.items()},
    }


def told(results: list[dict[str, Any]]) -> None:
    """Print the table of the campaign."""
    print(f"{len(results)} machines, {sum('failed' in item for item in results)} without an answer")
    for form in ("lesson", "program"):
        parts = [item[form] for item in results if isinstance(item.get(form), dict)]
        removed = [item["removed"] for item in parts if item.get("removed") is not None]
        if removed:
            sizes = f"median {np.median(removed):.3f}, tenth percentile {np.percentile(removed, 10):.3f}, least {min(removed):.3f}"
            print(f"as {form}: removed on {len(removed)} machines: {sizes}; worse than before {sum(value < 0.0 for value in removed)}")
    kept = [holds for item in results for holds in item.get("kept", {}).values()]
    if kept:
        print(f"promise kept in {sum(kept)} of {len(kept)}")
    sound = [item for item in results if item["hidden"] == ["none"] and "failed" not in item]
    print(f"left alone {sum(not item['remedies'] for item in sound)} of {len(sound)} sound machines")
    last = {kind[0] for rows in ROWS.values() for kind in rows[-1]}
    hopeless = [item for item in results if item["hidden"][0].partition(":")[0] in last and "failed" not in item]
    print(f"without a remedy {sum(not item['remedies'] for item in hopeless)} of {len(hopeless)} that no software mends")


def main() -> None:
    """Run the campaign and print its table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machines", type=int, default=100)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--anew", action="store_true", help="keep the diagnoses, repeat the remedies")
    asked = parser.parse_args()
    results = []
    for number, machine in list(enumerate(planned(asked.seed)))[asked.first : asked.machines]:
        folder = asked.out / f"machine_{number:03d}"
        kept = folder / "result.json"
        if asked.anew and not (folder / "diagnosis.json").is_file():
            continue
        if asked.anew or not kept.is_file():
            folder.mkdir(parents=True, exist_ok=True)
            diagnosed(folder, machine, 5000 + number)
            kept.write_text(json.dumps(remedied(folder, machine)))
        results.append(json.loads(kept.read_text()))
        print(json.dumps(results[-1]), flush=True)
    told(results)


if __name__ == "__main__":
    main()
