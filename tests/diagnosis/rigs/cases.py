"""The cases of the rigs: a schedule that a seed fixes, their recordings and lessons, and what is true of each."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tests.diagnosis.rigs.describe import FAR, SIGMA, Given, files, lesson
from tests.diagnosis.rigs.hidden import (
    BESIDE,
    FAULTS,
    INPUTS,
    KNOWN,
    NEW,
    PAIRS,
    faulty,
    hide,
    outside,
    possible,
    possible_faults,
    right_names,
    without,
)  # fmt: skip
from tests.diagnosis.rigs.machines import FIRST, RIGS, SECOND, Rig
from tests.diagnosis.rigs.plant import COMMAND, CURRENT, ENCODER, HELD, SCALE, Physics, run
from tests.diagnosis.rigs.programs import added, course, cuts, speeds, voltages, wandering

SETS = {"first": FIRST, "second": SECOND, "both": RIGS}
COUNTS = {"sound": 20, "values": 6, "single": 12, "pair": 4, "outside": 3, "fault": 5, "input": 3}
"""Cases of a rig; a sample takes the first few of each."""
VISIBLE = 0.5
"""What an effect has to change in some recorded channel, over what new noise changes there (both root mean squares), to be asked about."""


SIZES = (
    "coulomb", "offset_torque", "converter_offset", "dead_zone", "cogging", "backlash", "pitch", "bristle", "sag", "interpolation",
    "lead_error", "wind_up", "warmed_viscous",
)  # fmt: skip
"""Physics in proportion to which an effect acts; periods, times and ways keep theirs."""


@dataclass(frozen=True)
class Case:
    """One case of one rig: what kind, what is hidden, the seed of its chance, and the descriptions that it is asked in."""

    rig: Rig
    kind: str
    number: int
    keys: tuple[str, ...]
    fault: str
    seed: int
    descriptions: tuple[str, ...]

    @property
    def name(self) -> str:
        """The name of its folder."""
        return f"{self.rig.name}__{self.kind}_{self.number:02d}"


def schedule(seed: int, counts: Mapping[str, int] = COUNTS, rigs: str = "both") -> list[Case]:
    """Return the cases of a set of rigs, in rounds over all of them: whatever stops a run leaves a sample of every rig."""
    cases = []
    for rig in SETS[rigs]:
        place = RIGS.index(rig)
        rng, able = np.random.default_rng([seed, place, 17]), possible(rig)
        new, old = ([str(key) for key in rng.permutation([key for key in able if key in some])] for some in (NEW, KNOWN))
        singles = [key for pair in zip(new, old, strict=False) for key in pair]
        pairs = [PAIRS[int(i)] for i in rng.permutation(len(PAIRS)) if set(PAIRS[int(i)]) <= set(able)]
        beyond, faults = ([str(one) for one in rng.permutation(some(rig))] for some in (outside, possible_faults))
        for kind, number in counts.items():
            for n in range(0 if kind == "input" and rig.open else number):
                hidden = {"single": (singles[n % len(singles)],), "pair": pairs[n % len(pairs)], "outside": (beyond[n % len(beyond)],)}
                fault = {"fault": faults[n % len(faults)], "input": INPUTS[(n + place) % len(INPUTS)]}.get(kind, "")
                own = int(np.random.default_rng([seed, place, sum(map(ord, kind)), n, 17]).integers(2**31))
                # only a lesson of both axes can tell that their columns were exchanged
                asked = ("lathe",) if fault == "other_axis" else rig.descriptions
                cases.append(Case(rig, kind, n, hidden.get(kind, ()), fault, own, asked))
    return sorted(cases, key=lambda case: (case.number, list(counts).index(case.kind)))


def case_of(rig: str, kind: str, seed: int = 1, keys: tuple[str, ...] | None = None, number: int = 12) -> Case:
    """Return the first case of a rig of one kind, that hides some keys where they are given."""
    found = schedule(seed, {kind: number})
    return next(case for case in found if case.rig.name == rig and keys in (None, case.keys))


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
        asked = voltages(rng, rig.seconds, period, 0.8 * rig.voltage) if rig.open else asked
        cut = cuts(rng, samples, period, 0.3 * rig.torque / rig.physics.ratio)
    else:
        asked = course(rng, rig.program, samples, period, rig.top, rig.stroke, rig.acceleration)
        cut = np.zeros(samples)
    beside = course(rng, rig.program[::-1], samples, period, rig.top, rig.stroke, rig.acceleration) if rig.second else asked
    loads = [wandering(rng, samples, period, rig.load * rig.torque) for _ in range(2)]
    return Drawn((asked, beside), (loads[0], loads[1]), cut, rng.standard_normal((4, samples)))


def record(rig: Rig, physics: Physics, drawn: Drawn, more: np.ndarray | float = 0.0) -> dict[str, np.ndarray]:
    """Return the columns of a recording, and what stands behind the converter as ``held``; ``more`` [V] is added to its command."""
    fine = max(8, round(physics.period / 25e-6))
    still = np.zeros(drawn.chance.shape[1])
    out = run(physics, drawn.asked[0], drawn.load[0] + physics.ratio * drawn.cut, drawn.chance[:2], fine, still + more)
    table = {"t": np.arange(out.shape[1]) * physics.period, "r": drawn.asked[0], "u": out[COMMAND], "q": out[ENCODER], "held": out[HELD]}
    table |= {"i": out[CURRENT]} if rig.current else {}
    table |= {"s": out[SCALE]} if rig.scale else {}
    table |= {"load": drawn.cut} if rig.kind == "spindle" else {}
    if rig.second:
        beside = run(rig.second, drawn.asked[1], drawn.load[1], drawn.chance[2:], fine, still)
        table |= {"r_2": drawn.asked[1], "u_2": beside[COMMAND], "q_2": beside[ENCODER], "i_2": beside[CURRENT]}
    elif rig.kind == "lathe":
        table |= {"other": still + FAR}
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


def given_values(case: Case, rng: np.random.Generator) -> Given:
    """Return what the lesson says of the machine: off by its own doubt, or far off in the case of wrong values."""
    given = Given(**{name: float(1.0 + share * np.clip(rng.standard_normal(), -2.0, 2.0)) for name, share in SIGMA.items()})
    if case.kind != "values":
        return given
    size = float(rng.uniform(0.25, 0.6)) * float(rng.choice([-1.0, 1.0]))
    return given._replace(**dict.fromkeys([("inertia",), ("viscous",), ("inertia", "viscous")][case.number % 3], 1.0 / (1.0 + size)))


def large_current(rig: Rig) -> float:
    """Return the current [A] that 1.5 % of the samples of a sound recording exceed."""
    currents = record(replace(rig, current=True), rig.physics, draw(rig, np.random.default_rng(0)))["i"]
    return float(np.quantile(np.abs(currents), 0.985))


def write_case(case: Case, folder: Path, size: float = 1.0) -> list[Path]:
    """Write the recordings of a case once, and a folder with the lesson for each description; return those folders.

    What is hidden has so many times its usual ``size``.
    """
    rig, rng = case.rig, np.random.default_rng(case.seed)
    physics, given, beside, drawn = _all_drawn(case, rng)
    usual = rig.physics
    hidden = {name: value for name, value in physics._asdict().items() if name in SIZES and value != getattr(usual, name)}
    physics = physics._replace(**{name: getattr(usual, name) + size * (value - getattr(usual, name)) for name, value in hidden.items()})
    tables = {}
    for name, one in drawn.items():
        is_pushed, samples = case.kind == "input", one.chance.shape[1]
        tables[name] = record(rig, physics, one, added(rng, case.fault, samples, physics.period, 0.3 * rig.voltage) if is_pushed else 0.0)
    if case.kind == "fault":
        tables = {name: faulty(case.fault, table, rig.physics.encoder) for name, table in tables.items()}
    visible = shown(rig, physics, case.keys, drawn["fit.csv"], drawn["validate.csv"])
    half = "calibration" if rig.calibrating else "held out"
    truth = {
        "case": case.name, "rig": rig.name, "half": half, "kind": case.kind, "fault": case.fault, "words": FAULTS.get(case.fault, ""),
        "right": {key: right_names(rig, key) for key in case.keys}, "beside": [name for key in case.keys for name in BESIDE.get(key, ())],
        "visible": visible, "answerable": all(ratio >= VISIBLE for ratio in visible.values()), "given": given._asdict(),
        "hidden": physics._asdict(),
    }  # fmt: skip
    folders = [folder / f"{case.name}__{description}" for description in case.descriptions]
    for place, description in zip(folders, case.descriptions, strict=True):
        place.mkdir(parents=True, exist_ok=True)
        for name, table in tables.items():
            write_table(place / name, table)
        for name, text in (files(rig, description) | {"lesson.yaml": lesson(rig, description, given, beside)}).items():
            (place / name).parent.mkdir(exist_ok=True)
            (place / name).write_text(text, encoding="utf-8")
        (place / "truth.json").write_text(json.dumps(truth | {"column": f"{half}, {description} side"}, indent=1), encoding="utf-8")
    return folders


def _all_drawn(case: Case, rng: np.random.Generator) -> tuple[Physics, Given, Given, dict[str, Drawn]]:
    """Return what a case hides, what its lesson says of both axes, and its recordings."""
    physics = hide(case.rig, case.keys, rng, large_current(case.rig) if "saturation" in case.keys else 0.0)
    given, beside = given_values(case, rng), given_values(replace(case, kind="sound"), rng)
    return physics, given, beside, {name: draw(case.rig, rng) for name in ("fit.csv", "validate.csv")}


def write_sound(case: Case, path: Path) -> Path:
    """Write a recording of a case without what it hides: the course and the cut of the one that judges, loads and noise of another draw."""
    rng = np.random.default_rng(case.seed)
    *_, drawn = _all_drawn(case, rng)
    judging = drawn["validate.csv"]
    path.parent.mkdir(parents=True, exist_ok=True)
    write_table(path, record(case.rig, case.rig.physics, replace(draw(case.rig, rng), asked=judging.asked, cut=judging.cut)))
    return path


def write_table(path: Path, table: dict[str, np.ndarray]) -> None:
    """Write a recording; what stands behind the converter is no column of it."""
    columns = {name: values for name, values in table.items() if name != "held"}
    np.savetxt(path, np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments="", fmt="%.9g")
