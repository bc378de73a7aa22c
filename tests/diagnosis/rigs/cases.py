"""The cases of the rigs: a schedule that a seed fixes, their recordings and lessons, and what is true of each."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from tests.diagnosis.rigs.case import Case, write_folders
from tests.diagnosis.rigs.describe import FAR, SIGMA, Given, lesson, machine_files
from tests.diagnosis.rigs.faults import faulty
from tests.diagnosis.rigs.hidden import AT_THE_SCALE, BESIDE, EFFECTS, FAULTS, INPUTS, OUTSIDE, Hidden, hide, possible
from tests.diagnosis.rigs.machines import RIGS, Rig
from tests.diagnosis.rigs.motion import added, course, voltages, wandering
from tests.diagnosis.rigs.plant import run

PAIRS = (("coulomb", "gravity"), ("coulomb", "backlash"), ("dead_zone", "coulomb"), ("cogging", "coulomb"), ("gravity", "pitch_wave"),
         ("delay", "coulomb"), ("saturation", "gravity"), ("coulomb", "inductance"))  # fmt: skip
COUNTS = {"sound": 20, "values": 6, "single": 12, "pair": 4, "outside": 3, "fault": 5, "input": 3}
"""Cases of a rig; a sample takes the first few of each."""


def schedule(seed: int, counts: dict[str, int] | None = None) -> list[Case[Rig]]:
    """Return the cases of all rigs."""
    cases = []
    for place, rig in enumerate(RIGS):
        rng = np.random.default_rng([seed, place, 5])
        keys = list(rng.permutation(possible(rig)))
        pairs = [pair for pair in PAIRS if set(pair) <= set(possible(rig)) and (rig.kind != "lathe" or not set(pair) & set(AT_THE_SCALE))]
        if rig.kind == "lathe":
            keys = [key for key in keys if key not in AT_THE_SCALE]
        if not pairs:
            pairs = [("coulomb", "dead_zone")]
        faults = [
            name for name in rng.permutation(list(FAULTS)) if rig.kind != "spindle" or name in ("clock", "sign", "rows", "current_late")
        ]
        pairs = [pairs[int(i)] for i in rng.permutation(len(pairs))]
        for kind, number in (counts or COUNTS).items():
            for n in range(number):
                hidden: tuple[str, ...] = ()
                if kind == "single":
                    hidden = (str(keys[n % len(keys)]),)
                elif kind == "pair":
                    hidden = pairs[n % len(pairs)]
                elif kind == "outside":
                    hidden = ("drag",) if rig.kind == "spindle" else (OUTSIDE[(n + place) % 2],)
                fault = str(faults[n % len(faults)]) if kind == "fault" else ""
                if kind == "input":
                    if rig.kind == "spindle":
                        continue
                    fault = INPUTS[(n + place) % len(INPUTS)]
                own = int(np.random.default_rng([seed, place, sum(map(ord, kind)), n]).integers(2**31))
                cases.append(Case(rig, kind, n, hidden, fault, own, rig.descriptions))
    return cases


def write_case(case: Case[Rig], folder: Path) -> list[Path]:
    """Write the recordings of a case once, and a folder with the lesson for each description; return those folders."""
    rng = np.random.default_rng(case.seed)
    hidden = hide(case.rig, case.keys, rng)
    given = given_values(case, rng)
    tables = {name: _recorded(case, hidden, rng) for name in ("fit.csv", "validate.csv")}
    if case.kind == "fault":
        tables = {name: faulty(case.fault, table, case.rig.physics.encoder) for name, table in tables.items()}
    truth = {"right": {key: list(EFFECTS.get(key, ())) for key in case.keys},
             "beside": [name for key in case.keys for name in BESIDE.get(key, ())], "words": FAULTS.get(case.fault, case.fault),
             "given": asdict(given), "hidden": hidden.physics._asdict()}  # fmt: skip

    def texts(description: str) -> dict[str, str]:
        return machine_files(case.rig, description) | {"lesson.yaml": lesson(case.rig, description, given)}

    return write_folders(case, folder, tables, texts, truth)


def given_values(case: Case[Any], rng: np.random.Generator) -> Given:
    """Return what the lesson says of the machine: off by its own doubt, or far off in the case of wrong values."""
    given = Given(**{name: float(1.0 + share * np.clip(rng.standard_normal(), -2.0, 2.0)) for name, share in SIGMA.items()})
    if case.kind != "values":
        return given
    wrong = [("inertia",), ("viscous",), ("inertia", "viscous")][case.number % 3]
    size = float(rng.uniform(0.25, 0.6)) * float(rng.choice([-1.0, 1.0]))
    return replace(given, **dict.fromkeys(wrong, 1.0 / (1.0 + size)))


def _recorded(case: Case[Rig], hidden: Hidden, rng: np.random.Generator) -> dict[str, np.ndarray]:
    rig, p = case.rig, hidden.physics
    samples = round(rig.seconds / p.period)
    fine = max(8, round(p.period / 25e-6))
    load = wandering(rng, samples, p.period, rig.load * rig.torque)
    chance = rng.standard_normal((2, samples))
    if rig.kind == "spindle":
        asked = voltages(rng, rig.seconds, p.period, rig.top)
        pressed = 0.3 * rig.torque * np.repeat(rng.uniform(0.0, 1.0, int(rig.seconds) + 1), round(1.0 / p.period))[:samples]
        out = run(p, asked, load + pressed, chance, fine, np.zeros(samples))
        return {"t": np.arange(samples) * p.period, "u": asked, "load": pressed, "q": out[3], "i": out[2]}
    asked = course(rng, rig.seconds, p.period, rig.top, rig.stroke, rig.acceleration)
    more = added(rng, case.fault, samples, p.period, 0.3 * rig.voltage) if case.kind == "input" else np.zeros(samples)
    out = run(p, asked, load, chance, fine, more)
    table = {
        "t": np.arange(samples) * p.period,
        "r": asked,
        "other": np.full(samples, FAR),
        "u": out[0],
        "q": out[3],
        "i": out[2],
        "s": out[4],
    }
    table["held"] = out[1]
    return table
