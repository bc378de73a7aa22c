"""Recordings whose numbers are damaged are compared, or refused in one sentence: no library's words, no warning, no number that is none."""

import json
import random
from collections import Counter
from pathlib import Path

import h5py
import numpy as np
import pytest

from lathesim.diagnosis.comparison.compare import as_json, compare, load_recording
from lathesim.diagnosis.comparison.compare_text import comparison_lines
from lathesim.errors import LatheSimError
from lathesim.lessons.lesson import Lesson, load_lesson
from lathesim.plugins import Registry, load_registry
from lathesim.recordings import binary_files

SAMPLES = 300
TIME = np.arange(SAMPLES) * 1e-3
DRIVEN = {"x_controller.reference": ("m", 1e-3 * (1.0 - np.cos(8.0 * TIME)))}
COMPARED = {
    "x_encoder.position": ("m", 1e-3 * (1.0 - np.cos(8.0 * TIME - 0.1))),
    "x_scale.position": ("m", 1e-3 * (1.0 - np.cos(8.0 * TIME - 0.1))),
    "x_controller.voltage": ("V", 0.3 * np.sin(8.0 * TIME)),
    "x_drive.current": ("A", 0.3 * np.sin(8.0 * TIME)),
}
VALUES = (np.nan, np.inf, -np.inf, 1e300, -1e300, 1e29, -1e29, 1e15, 1e-300, 5e-324, 0.0)
FACTORS = (1e-300, 1e300, 1e28, 1e20, 1e-20, 1e-160, -1.0, 0.0)


def damaged(case: int) -> dict[str, np.ndarray]:
    """Return the columns with one to six of them changed at a place, over a stretch, or throughout."""
    chance = random.Random(case)
    columns = {name: values.copy() for name, (_, values) in (DRIVEN | COMPARED).items()} | {"t": TIME.copy()}
    for _ in range(chance.choice((1, 1, 2, 3, 6))):
        name, value = chance.choice(list(columns)), chance.choice(VALUES)
        begin = chance.randrange(SAMPLES)
        piece = slice(begin, begin + chance.randrange(1, SAMPLES))
        column = columns[name]
        match chance.randrange(9):
            case 0:
                column[begin] = value
            case 1:
                column[piece] = value
            case 2:
                column[:] = value
            case 3:
                column *= chance.choice(FACTORS)
            case 4:
                column[piece] = column[begin]
            case 5:
                column[:] = np.random.default_rng(case).standard_normal(SAMPLES) * chance.choice((1.0, 1e25, 1e-25))
            case 6:
                column[::2] = value
            case 7:
                columns[name] = columns[chance.choice(list(columns))].copy()
            case _:
                column[:] = np.frombuffer(chance.randbytes(8 * SAMPLES))
    return columns


@pytest.fixture(scope="module")
def registry() -> Registry:
    return load_registry(installed=False)


@pytest.fixture(scope="module")
def lesson(tmp_path_factory: pytest.TempPathFactory) -> Lesson:
    path = tmp_path_factory.mktemp("lesson") / "axis.yaml"
    drive, seen = (
        ", ".join(f"{name}: {{column: {name}, unit: {unit}}}" for name, (unit, _) in given.items()) for given in (DRIVEN, COMPARED)
    )
    path.write_text(
        "lesson: An axis\nmachine: cascade_axis\nduration: 1 s\nrecordings:\n  time: {column: t, unit: s}\n"
        f"  drive: {{{drive}}}\n  compare: {{{seen}}}\n",
        encoding="utf-8",
    )
    return load_lesson(path)


def compared(lesson: Lesson, registry: Registry, file: Path, cases: range) -> Counter[str]:
    """Compare damaged recordings; return how many were compared and how many refused."""
    ended: Counter[str] = Counter()
    for case in cases:
        with np.errstate(over="ignore", invalid="ignore"):
            columns = damaged(case)
        with h5py.File(file, "w") as recording:
            for name, values in columns.items():
                recording[name] = values
        try:
            found = compare("axis", *load_recording(lesson, file, registry))
            told = "\n".join(comparison_lines(found))
            json.dumps(as_json(found), allow_nan=False)
            assert not any(word in ("nan", "inf", "-inf") for word in told.split()), told
            ended["compared"] += 1
        except LatheSimError as error:
            assert len(str(error).splitlines()) == 1
            ended["refused"] += 1
        except Exception as error:
            raise AssertionError(f"case {case}: {error!r}") from error
    return ended


def test_damaged_numbers_make_no_fault(lesson: Lesson, registry: Registry, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(binary_files, "refuse_deadly_file", lambda path, script: None)  # the file itself is sound
    ended = compared(lesson, registry, tmp_path / "run.h5", range(10, 20))
    assert ended["compared"] > 3


@pytest.mark.slow
def test_a_thousand_recordings_of_damaged_numbers_make_no_fault(
    lesson: Lesson, registry: Registry, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(binary_files, "refuse_deadly_file", lambda path, script: None)
    ended = compared(lesson, registry, tmp_path / "run.h5", range(20, 1020))
    assert ended["compared"] > 300 and ended["refused"] > 100
