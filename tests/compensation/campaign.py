"""Concealed machines diagnosed, remedied and recorded again: ``python -m tests.compensation.campaign --machines 100 --out DIR``.

A machine is drawn with its own ranges, and with nothing of the program's generator. Each takes a minute or two, most of it for the
diagnosis; what is in DIR already is not run again. Printed are the share removed of what the effects added, and whether the promise
was kept.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from lathesim.cli.main import run_command_line

LESSON = "12_what_is_wrong_with_this_machine"
TABLE = "x_scale.position"
SOUND_SHARE, PAIR_SHARE = 0.2, 0.3
RANGES: dict[str, tuple[str, dict[str, tuple[float, float, str]]]] = {
    "CoulombFriction": ("x_axis", {"level": (8.0, 60.0, "N")}),
    "AsymmetricFriction": (
        "x_axis",
        {"level": (10.0, 50.0, "N"), "asymmetry": (0.1, 0.35, ""), "viscous_difference": (0.0, 50.0, "N*s/m")},
    ),
    "PreslidingFriction": ("x_axis", {"level": (10.0, 50.0, "N"), "distance": (3.0, 20.0, "um"), "excess": (0.0, 5.0, "N")}),
    "ForceOffset": ("x_axis", {"offset": (-80.0, 80.0, "N")}),
    "ConverterOffset": ("x_drive", {"offset": (0.03, 0.15, "V")}),
    "DriveGainError": ("x_drive", {"error": (0.03, 0.09, ""), "sag": (0.0, 0.01, "1/V")}),
    "Backlash": ("x_scale", {"width": (5.0, 50.0, "um")}),
    "CumulativePitchError": ("x_scale", {"slope": (30e-6, 200e-6, "")}),
    "PeriodicPitchError": ("x_scale", {"amplitude": (2.0, 8.0, "um"), "lead": (3.0, 10.0, "mm"), "phase": (-3.0, 3.0, "rad")}),
    "ThermalScrewGrowth": (
        "x_scale",
        {"strain": (60e-6, 250e-6, ""), "time_constant": (20.0, 100.0, "s"), "fixed_end": (-0.5, 0.5, "m")},
    ),
    "AxialResonance": ("x_axis", {"table_share": (0.1, 0.5, ""), "frequency": (20.0, 120.0, "Hz"), "damping": (0.03, 0.08, "")}),
    "BaseRocking": ("x_scale", {"mobility": (0.3e-3, 3e-3, "1/kg"), "frequency": (12.0, 35.0, "Hz"), "damping": (0.03, 0.08, "")}),
    "TorsionalWindUp": ("x_scale", {"compliance": (15e-9, 50e-9, "m/N")}),
    "CurrentLoopLag": ("x_drive", {"time_constant": (0.3, 1.5, "ms"), "damping": (0.5, 0.9, "")}),
    "MotorInductance": ("x_drive", {"time_constant": (0.5, 4.0, "ms")}),
    "TransportDelay": ("x_drive", {"delay": (0.5, 4.0, "ms")}),
    "AmplifierDeadZone": ("x_drive", {"half_width": (0.05, 0.3, "V")}),
    "Cogging": ("x_axis", {"amplitude": (3.0, 20.0, "N"), "period": (2.0, 12.0, "mm"), "phase": (-3.0, 3.0, "rad")}),
    "EncoderEccentricity": ("x_encoder", {"amplitude": (1.0, 6.0, "um"), "turn": (4.0, 12.0, "mm"), "phase": (-3.0, 3.0, "rad")}),
}
"""Effect -> where it sits, and the range of each parameter."""


def drawn(rng: np.random.Generator) -> list[str]:
    """Return what is hidden, as ``conceal --effect`` takes it."""
    chance = rng.random()
    if chance < SOUND_SHARE:
        return ["none"]
    names = rng.choice(list(RANGES), 2 if chance > 1.0 - PAIR_SHARE else 1, replace=False)
    found = []
    for name in names:
        at, values = RANGES[name]
        told = ",".join(f"{key}={rng.uniform(low, high):.6g} {unit}".strip() for key, (low, high, unit) in values.items())
        found.append(f"{name}:{told}@{at}")
    return found


def machine(folder: Path, hidden: list[str], seed: int) -> dict[str, object]:
    """Run one machine through the whole way and return what came of it."""
    case, diagnosis, out = folder / "case", folder / "diagnosis.json", folder / "mended"
    effects = [part for text in hidden for part in ("--effect", text)]
    run_command_line(["conceal", LESSON, *effects, "--validate", "--seed", str(seed), "--out", str(case)])
    files = [str(case / name) for name in ("lesson.yaml", "recording.csv")]
    judged = ["--validate", str(case / "validate.csv"), "--json", str(diagnosis), "--no-report"]
    run_command_line(["diagnose", *files, *judged])
    run_command_line(["remedy", files[0], str(diagnosis), "--out", str(out)])
    again = ["conceal", "--again", str(folder / "case_answer.json"), "--lesson", str(out / "lesson.yaml"), "--out", str(folder / "again")]
    run_command_line(again)
    answer = json.loads((out / "remedy.json").read_text())
    result = json.loads((folder / "again" / "result.json").read_text())["rms_deviation"][TABLE]
    promise = answer["promise"].get(f"rms_deviation of {TABLE}")
    kept = promise["low"] <= result["after"] <= promise["high"] if promise else None
    return {"hidden": hidden, "remedies": [item["remedy"] for item in answer["remedies"]], "removed": result["removed_share"], "kept": kept}


def main() -> None:
    """Run the campaign and print its table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machines", type=int, default=100)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    results = []
    for number in range(asked.machines):
        folder = asked.out / f"machine_{number:03d}"
        kept = folder / "result.json"
        if not kept.is_file():
            folder.mkdir(parents=True, exist_ok=True)
            rng = np.random.default_rng([asked.seed, number])
            kept.write_text(json.dumps(machine(folder, drawn(rng), 1000 + number)))
        results.append(json.loads(kept.read_text()))
        print(results[-1], flush=True)
    mended = [item["removed"] for item in results if item["remedies"] and item["removed"] is not None]
    sound = [item for item in results if item["hidden"] == ["none"]]
    promised = [item["kept"] for item in results if item["kept"] is not None]
    print(f"removed: median {np.median(mended):.3f}, tenth percentile {np.percentile(mended, 10):.3f}, least {min(mended):.3f}")
    alone = sum(not item["remedies"] for item in sound)
    print(f"promise kept in {np.mean(promised):.2f} of {len(promised)}; left alone {alone} of {len(sound)} sound")


if __name__ == "__main__":
    main()
