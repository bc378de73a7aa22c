"""Forces that a diagnosis may take for nothing: ``python -m tests.experiments.small_forces --out DIR``.

For each size a program is designed that tells the force from nothing. It is run on a machine of another integrator that has the force, and
diagnosed. The table holds the chance that was foretold against how often the force was named.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from lathesim.experiments.design_experiment import Designed, DesignWish, design_experiment
from lathesim.experiments.experiment_files import write_program_and_lesson
from lathesim.experiments.rivals import NamedRival
from lathesim.lessons.lesson import load_lesson
from lathesim.plugins import Registry, load_registry
from tests.experiments.separation.axis_truth import LESSON, AxisTruth
from tests.experiments.separation.warm_command import command

FORCES = {"ForceOffset": ("offset", "force_offset", "gravity"), "CoulombFriction": ("level", "coulomb", "coulomb")}
"""Effect -> its parameter, what the rig calls it, and the key of the rig's effect."""
SIZES = (0.1, 0.3, 1.0, 3.0)


def designed(effect: str, size: float, folder: Path, registry: Registry, asked: argparse.Namespace) -> Designed:
    """Return the program that tells a force of about a size [N] from nothing, written to a folder."""
    rivals = [NamedRival(effect, "x_axis", {FORCES[effect][0]: (0.8 * size, 1.25 * size)}), NamedRival("nothing", "", {})]
    found = design_experiment(load_lesson(LESSON), rivals, registry, DesignWish(8.0, asked.programs, seed=asked.seed))
    write_program_and_lesson(found, folder)
    return found


def main() -> None:
    """Print a line for each force and size, and the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--programs", type=int, default=6)
    parser.add_argument("--machines", type=int, default=2, help="machines for each size")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    registry = load_registry(installed=False)
    chances, named = [], []
    for effect, (_, own, key) in FORCES.items():
        for size in SIZES:
            folder = asked.out.resolve() / f"{effect}_{size:g}"
            found = designed(effect, size, folder, registry, asked)
            for number in range(asked.machines):
                truth = AxisTruth(key, 1000 * asked.seed + number)
                truth.physics = truth.sound._replace(**{own: size})
                recording = folder / f"recording_{number}.csv"
                truth.record(folder / "lesson.yaml", recording, registry)
                told = command("diagnose", folder / "lesson.yaml", recording, "--no-report", "--json", "-")
                (folder / f"diagnosis_{number}.json").write_text(json.dumps(told), encoding="utf-8")
                effects = [item["effect"] for item in told.get("effects") or []]
                chances.append(found.worth.by_rival[0])
                named.append(effect in effects)
                answer = f"{told.get('verdict')} {', '.join(effects)}".strip()
                print(f"{effect} of {size:g} N: T {found.worth.explained[0].mean():.3g}, chance {chances[-1]:.2f}, {answer}", flush=True)
    said, right = np.array(chances), np.array(named, dtype=float)
    print(f"{len(said)} runs: foretold {said.mean():.2f}, named {right.mean():.2f}, Brier {np.square(said - right).mean():.3f}")


if __name__ == "__main__":
    main()
