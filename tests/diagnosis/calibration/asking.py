"""Machines drawn at random, and what the program answers: pushed tables, the rigs of both sets, and the concealed cases of the suite."""

from __future__ import annotations

import contextlib
import io
import json
import math
import tempfile
import time
from collections.abc import Container, Iterator
from pathlib import Path

import numpy as np

from tests.diagnosis import pushed_table
from tests.diagnosis.calibration.draws import Draw, shortened
from tests.diagnosis.pushed_table import FORCE, LESSON, MASS, POSITION, VISCOUS, Hidden
from tests.diagnosis.rigs import cases as first
from tests.diagnosis.rigs.second import cases as second
from tests.diagnosis.suite import generate
from tests.diagnosis.suite.schedule import schedule

RIPPLE = ("TorqueRipple", "Cogging")
TURN = 5e-3
"""Travel of the table after which a hidden ripple repeats [m]."""
KINDS = ("sound", "CoulombFriction", "ForceOffset", "TorqueRipple")
DOUBTS = 0.05, 0.1
"""Relative doubts that the lesson of the pushed table declares of mass and viscous friction."""


def tables(seed: int, number: int, at_most: float, kept: Container[str] = ()) -> Iterator[Draw]:
    """Yield pushed tables whose mass and friction are drawn from what the lesson declares, and whose effect is of any size that shows."""
    for index in range(number):
        if (name := f"table {seed}/{index}") in kept:
            continue
        rng = np.random.default_rng([seed, index, 71])
        kind = KINDS[index % len(KINDS)]
        mass, viscous = (value * (1.0 + doubt * rng.standard_normal()) for value, doubt in zip((MASS, VISCOUS), DOUBTS, strict=True))
        size, phase = float(np.exp(rng.uniform(math.log(0.5), math.log(10.0)))), float(rng.uniform(-math.pi, math.pi))
        hidden = _table(kind, size, phase, mass, viscous)
        sizes = {"x_axis.mass": mass, "x_axis.viscous": viscous}
        sizes |= {"CoulombFriction": {"CoulombFriction.level": size}, "ForceOffset": {"ForceOffset.offset": size}}.get(kind, {})
        sizes |= (
            {f"{name}.{key}": value for name in RIPPLE for key, value in (("amplitude", size), ("period", TURN))} if kind in RIPPLE else {}
        )
        right = () if kind == "sound" else (RIPPLE if kind in RIPPLE else (kind,),)
        with tempfile.TemporaryDirectory() as folder:
            _write_table(Path(folder), hidden, int(rng.integers(2**31)))
            told, seconds = _ask(Path(folder), "fit.csv", "validate.csv", at_most)
        yield Draw("table", name, kind, right, sizes, told, seconds)


def _table(kind: str, size: float, phase: float, mass: float, viscous: float) -> Hidden:
    laws: dict[str, pushed_table.Law] = {
        "ForceOffset": lambda v, q, t: size,
        "TorqueRipple": lambda v, q, t: size * math.sin(2.0 * math.pi * q / TURN + phase),
    }
    return Hidden(size if kind == "CoulombFriction" else 0.0, laws.get(kind), mass, viscous)


def _write_table(folder: Path, hidden: Hidden, seed: int) -> None:
    (folder / "lesson.yaml").write_text(LESSON, encoding="utf-8")
    for more, name in enumerate(("fit.csv", "validate.csv")):
        record = pushed_table.recording(hidden, seed=seed + more)
        rows = np.column_stack([record.time, record[FORCE], 1e3 * record[POSITION]])
        np.savetxt(folder / name, rows, delimiter=",", header="t [s],push [N],seen [mm]", comments="", fmt="%.10g")


def rigs(seed: int, sound: int, single: int, at_most: float, kept: Container[str] = ()) -> Iterator[Draw]:
    """Yield sound machines and single effects of all rigs of both sets, each in one description, another one from case to case."""
    counts = {"sound": sound, "single": single}
    every = [
        *((one, first.write_case) for one in first.schedule(seed, counts)),
        *((one, second.write_case) for one in second.schedule(seed, counts)),
    ]
    for case, write in sorted(every, key=lambda one: one[0].number):
        if (name := f"{case.name} {seed}") in kept:
            continue
        with tempfile.TemporaryDirectory() as place:
            folders = write(case, Path(place))  # type: ignore[operator]
            folder = folders[case.number % len(folders)]
            truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
            if not truth.get("answerable", True):
                continue
            told, seconds = _ask(folder, "fit.csv", "validate.csv", at_most)
        hidden = tuple(tuple(names) for names in truth["right"].values())
        yield Draw("rigs", name, case.kind, hidden, {}, told, seconds, tuple(truth["beside"]))


def suite(seed: int, number: int, at_most: float, kept: Container[str] = ()) -> Iterator[Draw]:
    """Yield concealed cases: sound machines and single effects with the values and sizes that are true."""
    asked = [index for index, entry in enumerate(schedule(seed)) if entry.category in ("control", "single")][:number]
    for index in asked:
        if (name := f"suite {seed}/{index}") in kept:
            continue
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            generate.write_case(seed, index, folder)
            truth = generate.truth_of(folder)
            told, seconds = _ask(folder, "fit.csv", "validate.csv", at_most)
        hidden = tuple(tuple(one["right"]) for one in truth["effects"])
        sizes = {name: one["true"] for name, one in truth["baseline"].items()}
        sizes |= {f"{one['effect']}.{key}": size["value"] for one in truth["effects"] for key, size in one["parameters"].items()}
        yield Draw("suite", name, truth["category"], hidden, sizes, told, seconds)


def _ask(folder: Path, fitted: str, held_out: str, at_most: float) -> tuple[dict[str, object], float]:
    """Call ``lathesim diagnose`` as a person does; return what it answers and the seconds of processor time."""
    from lathesim.cli.main import run_command_line

    began, file = time.process_time(), folder / "answer.json"
    words = ["diagnose", folder / "lesson.yaml", folder / fitted, "--validate", folder / held_out, "--json", file, "--no-report"]
    words += [
        "--out",
        folder / "out",
        "--at-most",
        f"{at_most:g}s",
        *(["--plugins", folder / "parts"] if (folder / "parts").is_dir() else []),
    ]
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        run_command_line([str(word) for word in words])
    told = json.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
    return shortened(told), time.process_time() - began
