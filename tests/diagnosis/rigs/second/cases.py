"""The cases of the second set: a schedule that a seed fixes, their recordings and lessons, and what is true of each."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from tests.diagnosis.rigs.case import Case, write_folders
from tests.diagnosis.rigs.cases import given_values
from tests.diagnosis.rigs.faults import faulty
from tests.diagnosis.rigs.hidden import FAULTS
from tests.diagnosis.rigs.motion import wandering
from tests.diagnosis.rigs.second.describe import files, lesson
from tests.diagnosis.rigs.second.hidden import BESIDE, KNOWN, NEW, PAIRS, hide, outside, possible, right_names, without
from tests.diagnosis.rigs.second.machines import RIGS
from tests.diagnosis.rigs.second.physics import Physics
from tests.diagnosis.rigs.second.plant import COMMAND, CURRENT, ENCODER, HELD, SCALE, run
from tests.diagnosis.rigs.second.programs import course, cuts, speeds
from tests.diagnosis.rigs.second.rig import Rig

COUNTS = {"sound": 20, "values": 6, "single": 12, "pair": 4, "outside": 3, "fault": 5}
"""Cases of a rig; a sample takes the first few of each."""
WORDS = FAULTS | {"sign_of_place": FAULTS["sign"], "other_axis": r"axis|exchanged|swapped|other"}
VISIBLE = 0.5
"""What an effect has to change in some recorded channel, over what new noise changes there (both root mean squares), to be asked about."""


def schedule(seed: int, counts: dict[str, int] | None = None) -> list[Case[Rig]]:
    """Return the cases of all rigs; singles alternate between effects that only this set hides and the others."""
    cases = []
    for place, rig in enumerate(RIGS):
        rng, able = np.random.default_rng([seed, place, 17]), possible(rig)
        new, old = ([str(key) for key in rng.permutation([key for key in able if key in some])] for some in (NEW, KNOWN))
        singles = [key for pair in zip(new, old, strict=False) for key in pair]
        pairs = [PAIRS[int(i)] for i in rng.permutation(len(PAIRS)) if set(PAIRS[int(i)]) <= set(able)]
        beyond, faults = [str(key) for key in rng.permutation(outside(rig))], [str(name) for name in rng.permutation(_faults(rig))]
        for kind, number in (counts or COUNTS).items():
            for n in range(number):
                hidden = {"single": (singles[n % len(singles)],), "pair": pairs[n % len(pairs)], "outside": (beyond[n % len(beyond)],)}
                fault = faults[n % len(faults)] if kind == "fault" else ""
                own = int(np.random.default_rng([seed, place, sum(map(ord, kind)), n, 17]).integers(2**31))
                cases.append(Case(rig, kind, n, hidden.get(kind, ()), fault, own, _descriptions(rig, fault)))
    return cases


def _descriptions(rig: Rig, fault: str) -> tuple[str, ...]:
    """Return the descriptions that a case is asked in: only a lesson of both axes can tell that their columns were exchanged."""
    return ("lathe",) if fault == "other_axis" else rig.descriptions


def _faults(rig: Rig) -> list[str]:
    names = ["clock", "rows", "behind_converter", "counts"]
    names += ["current_late", "sign"] if rig.current else ["sign_of_place"]
    names += ["unit_1000"] if rig.kind in ("axis", "lathe") else []
    return names + (["other_axis"] if rig.kind == "lathe" else [])


@dataclass(frozen=True)
class Drawn:
    """What is drawn of a recording: the courses of both axes, loads on their shafts, the recorded load of a spindle, and chance."""

    asked: tuple[np.ndarray, np.ndarray]
    load: tuple[np.ndarray, np.ndarray]
    cut: np.ndarray
    chance: np.ndarray


def draw(rig: Rig, rng: np.random.Generator) -> Drawn:
    """Draw a recording of a rig."""
    period = rig.physics.period
    samples = round(rig.seconds / period)
    if rig.kind == "spindle":
        asked = speeds(rng, samples, period, rig.top, rig.acceleration)
        cut = cuts(rng, samples, period, 0.3 * rig.torque / rig.physics.ratio)
    else:
        asked = course(rng, rig.program, samples, period, rig.top, rig.stroke, rig.acceleration)
        cut = np.zeros(samples)
    beside = course(rng, rig.program[::-1], samples, period, rig.top, rig.stroke, rig.acceleration) if rig.second else asked
    loads = [wandering(rng, samples, period, rig.load * rig.torque) for _ in range(2)]
    return Drawn((asked, beside), (loads[0], loads[1]), cut, rng.standard_normal((4, samples)))


def record(rig: Rig, physics: Physics, drawn: Drawn) -> dict[str, np.ndarray]:
    """Return the columns of a recording, and what stands behind the converter as ``held``."""
    fine = max(8, round(physics.period / 25e-6))
    out = run(physics, drawn.asked[0], drawn.load[0] + physics.ratio * drawn.cut, drawn.chance[:2], fine)
    table = {"t": np.arange(out.shape[1]) * physics.period, "r": drawn.asked[0], "u": out[COMMAND], "q": out[ENCODER], "held": out[HELD]}
    table |= {"i": out[CURRENT]} if rig.current else {}
    table |= {"s": out[SCALE]} if rig.scale else {}
    table |= {"load": drawn.cut} if rig.kind == "spindle" else {}
    if rig.second:
        more = run(rig.second, drawn.asked[1], drawn.load[1], drawn.chance[2:], fine)
        table |= {"r_2": drawn.asked[1], "u_2": more[COMMAND], "q_2": more[ENCODER], "i_2": more[CURRENT]}
    return table


def shown(rig: Rig, physics: Physics, keys: tuple[str, ...], drawn: Drawn, other: Drawn) -> dict[str, float]:
    """Return for each hidden effect the largest share, over the channels, of its change in what another chance changes."""
    here, again = record(rig, physics, drawn), record(rig, physics, replace(other, asked=drawn.asked, cut=drawn.cut))
    ratios = {}
    for key in keys:
        absent = record(rig, without(rig, physics, key), drawn)
        changed, chance = (_channels(here, other) for other in (absent, again))
        ratios[key] = max(change / max(noise, 1e-300) for change, noise in zip(changed, chance, strict=True))
    return ratios


def _channels(one: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> list[float]:
    """Return the root mean squares by which two recordings differ: in each channel, and in scale less encoder."""
    sizes = [_size(one[name] - other[name]) for name in ("u", "q", "i", "s") if name in one]
    return sizes + ([_size(one["s"] - one["q"] - other["s"] + other["q"])] if "s" in one else [])


def _size(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def write_case(case: Case[Rig], folder: Path) -> list[Path]:
    """Write the recordings of a case once, and a folder with the lesson for each description; return those folders."""
    rig, rng = case.rig, np.random.default_rng(case.seed)
    physics = hide(rig, case.keys, rng)
    given, beside = given_values(case, rng), given_values(replace(case, kind="sound"), rng)
    drawn = {name: draw(rig, rng) for name in ("fit.csv", "validate.csv")}
    tables = {name: record(rig, physics, one) for name, one in drawn.items()}
    if case.kind == "fault":
        tables = {name: faulty(case.fault, table, rig.physics.encoder) for name, table in tables.items()}
    visible = shown(rig, physics, case.keys, drawn["fit.csv"], drawn["validate.csv"])
    truth = {"right": {key: right_names(rig, key) for key in case.keys},
             "beside": [name for key in case.keys for name in BESIDE.get(key, ())], "visible": visible,
             "answerable": all(ratio >= VISIBLE for ratio in visible.values()), "words": WORDS.get(case.fault, case.fault),
             "given": asdict(given), "hidden": physics._asdict()}  # fmt: skip

    def texts(description: str) -> dict[str, str]:
        return files(rig, description) | {"lesson.yaml": lesson(rig, description, given, beside)}

    return write_folders(case, folder, tables, texts, truth)
