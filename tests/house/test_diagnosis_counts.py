"""The size and shape of the diagnosis: figures that may only go down."""

import json
from pathlib import Path

from tests.house.counts import counts
from tests.house.descents import own_descents

KEPT = Path(__file__).parent / "diagnosis_counts.json"
"""The figures of commit a0113a3, before the folder was put on shelves, and those that may not be exceeded: lower them where one falls."""


SIZES = {"files", "floors", "arrows", "limits", "lines"}
"""Figures that grow with what the diagnosis can do."""


def test_no_figure_of_the_shape_of_the_diagnosis_grows() -> None:
    most = json.loads(KEPT.read_text(encoding="utf-8"))["at most"]
    now = {name: number for name, number in counts().items() if name not in SIZES}
    assert {name: (number, most[name]) for name, number in now.items() if number > most[name]} == {}


def test_no_import_runs_up() -> None:
    assert counts()["arrows that run up"] == 0


def test_a_loop_that_solves_for_a_step_is_counted(tmp_path: Path) -> None:
    (tmp_path / "lathesim").mkdir()
    text = """
def descended(values):
    for _ in range(9):
        step = solve_for(values)
        if left(values + step) > left(values):
            break
        values = values + step
    return values


def solve_for(values):
    return np.linalg.lstsq(slopes(values), left(values))[0]
"""
    (tmp_path / "lathesim" / "own.py").write_text(text, encoding="utf-8")
    assert own_descents(tmp_path) == ["own.descended"]
