"""The stored answers: which cases, how each is made and asked again, and where two answers differ."""

from __future__ import annotations

import json
import math
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from lathesim.diagnosis.diagnose import ask, diagnose
from lathesim.diagnosis.records.diagnosis import as_json
from lathesim.identification.replay.loading import Recorded
from tests.diagnosis.asking import ask_here, words_of
from tests.diagnosis.one_cut import write_cut
from tests.diagnosis.pushed_table import EFFECTS, Hidden, machine, recording
from tests.diagnosis.rigs.cases import case_of, write_case
from tests.shared_data import SHARED

FILE = Path(__file__).parent / "answers.jsonl"
LESSONS = Path(__file__).parents[1] / "lessons"
SEED = 26
RIGS = (
    ("screw_tacho_1k", "outside"), ("screw_cascade_1k", "fault"), ("belt_pid_500", "values"), ("gear_pid_1k", "single"),
    ("lathe_z", "fault"), ("rotary_2k", "outside"), ("spindle_speed_500", "values"), ("servo_current_2k", "sound"),
    ("vertical_cascade_1k", "input"), ("belt_gear_500", "input"), ("coarse_200", "single"),
)  # fmt: skip
"""A rig and the kind of its first case of this seed."""
TABLES = {
    "sound": Hidden(), "friction": Hidden(dry=10.0), "mass": Hidden(mass=46.0), "mass and friction": Hidden(dry=10.0, mass=46.0),
    "drag": Hidden(law=lambda v, q, t: 4000.0 * v * abs(v)), "bump": Hidden(law=lambda v, q, t: 12.0 if t > 2.0 else 0.0),
}  # fmt: skip
"""Pushed tables and what their lesson does not know."""
CUTS = ("line", "drift", "chips")
"""What is wrong with a recorded cut."""
REAL = {"emps": ("emps.yaml", "emps/DATA_EMPS.mat"), "hsm150": ("hsm150.yaml", "hsm150/idf_pos_0.06_1.mat")}
QUICK = ("table sound", "table mass")
"""Cases that are asked in every run of the tests."""
NAMES = (
    *(f"table {hidden}" for hidden in TABLES), *(f"cut {wrong}" for wrong in CUTS), *(f"rig {rig} {kind}" for rig, kind in RIGS), *REAL,
)  # fmt: skip
OF_A_RUN = {"wall_time_s", "report", "sentence", "summary"}
"""Keys that say something of a run and nothing of the answer, or say the rest of it in words."""


def stored() -> dict[str, Any]:
    """Return the stored answers by name."""
    lines = FILE.read_text(encoding="utf-8").splitlines() if FILE.is_file() else []
    return {item["case"]: item["answer"] for item in map(json.loads, lines)}


def store(answers: dict[str, Any]) -> None:
    """Write answers, one a line."""
    lines = [json.dumps({"case": name, "answer": answers[name]}) for name in NAMES if name in answers]
    FILE.write_text("\n".join(lines) + "\n", encoding="utf-8")


def is_here(name: str) -> bool:
    """Return whether a case can be asked: the real recordings are not part of the project."""
    return name not in REAL or SHARED.is_dir()


def asked(name: str) -> dict[str, Any]:
    """Return the answer of the program to a case, as its JSON file has it, without what belongs to the run."""
    kind, _, rest = name.partition(" ")
    if name in REAL:
        lesson, recording = REAL[name]
        answer = ask_here(LESSONS / lesson, SHARED / "data" / recording)
    elif kind == "table":
        answer = _of_table(TABLES[rest])
    else:
        with tempfile.TemporaryDirectory() as folder:
            answer = ask_here(*(write_cut(Path(folder), (rest,)) if kind == "cut" else _rig(Path(folder), *rest.split())))
    return {key: value for key, value in answer.items() if key not in OF_A_RUN}


def _rig(folder: Path, rig: str, kind: str) -> list[str | Path]:
    """Return the words that ask about a rig, in the last of its descriptions."""
    return words_of(write_case(case_of(rig, kind, SEED, number=1), folder)[-1])


def _of_table(hidden: Hidden) -> dict[str, Any]:
    recordings = tuple(Recorded(f"{name}.csv", recording(hidden, seed=seed), ()) for seed, name in ((1, "fit"), (2, "check")))
    return json.loads(json.dumps(as_json(diagnose(ask("A table", machine(), recordings, EFFECTS)))))  # type: ignore[no-any-return]


SHARE = 0.005
"""How far two shares may be apart on two processors: half of the percent in which they are shown. A share of what is left above the floor
is a small difference of large numbers: other kernels of the same BLAS give 0.4801 and 0.4819 for one sound table."""


def differences(stored: Any, now: Any, tolerance: float, place: str = "answer") -> Iterator[str]:
    """Return where two answers differ: what is stored must be there, numbers within ``tolerance`` of each other; what is new may be."""
    if isinstance(stored, dict) and isinstance(now, dict):
        for key, value in stored.items():
            if key not in now:
                yield f"{place}.{key} is gone"
            else:
                yield from differences(value, now[key], tolerance, f"{place}.{key}")
    elif isinstance(stored, list) and isinstance(now, list) and len(stored) == len(now):
        for number, pair in enumerate(zip(stored, now, strict=True)):
            yield from differences(*pair, tolerance, f"{place}[{number}]")
    elif isinstance(stored, float) and isinstance(now, float):
        apart = SHARE if tolerance and place.endswith("share") else 0.0
        if not (stored == now or math.isclose(stored, now, rel_tol=tolerance, abs_tol=apart)):
            yield f"{place}: {stored!r} was stored, {now!r} is answered"
    elif stored != now:
        yield f"{place}: {stored!r} was stored, {now!r} is answered"
