"""The effect that the page of plug-ins shows: a lesson has it, and a diagnosis names it with its size."""

from pathlib import Path

import numpy as np
import pytest

from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare, run_prepared
from lathesim.plugins import load_registry
from tests.cli.test_readme import block
from tests.diagnosis.asking import answer_in
from tests.diagnosis.small_case import POSITION, PROGRAM, VOLTAGE, write_lesson


def test_the_drag_of_a_cable_is_named_with_its_stiffness(tmp_path: Path) -> None:
    plugins = tmp_path / "plugins"
    plugins.mkdir()
    (plugins / "cable.py").write_text(block("python", "class CableDrag"), encoding="utf-8")
    lesson = write_lesson(tmp_path, extra="insert: [{effect: CableDrag, at: x_axis, stiffness: 2 kN/m, rest: 6 mm}]\n")
    for name, program in (("log.csv", PROGRAM), ("other.csv", PROGRAM.replace("X13.0", "X9.0"))):
        (tmp_path / "small.nc").write_text(program, encoding="utf-8")
        run = run_prepared(prepare(load_lesson(lesson), load_registry([plugins], installed=False)))
        asked = next(name for name in run.channels if name.endswith("x_reference"))
        columns = [1e3 * run.time, 1e3 * run[asked], 1e3 * run[POSITION], run[VOLTAGE] / 2.0]
        np.savetxt(tmp_path / name, np.column_stack(columns), delimiter=",", header="t,asked,motor,voltage", comments="")
    (tmp_path / "lesson.yaml").write_text(write_lesson(tmp_path).read_text(encoding="utf-8"), encoding="utf-8")
    asked_about = [word for name in ("CableDrag", "ForceOffset", "Cogging") for word in ("--effect", name)]
    (named,) = answer_in(tmp_path, "--plugins", str(plugins), *asked_about)["effects"]
    assert (named["effect"], named["at"], named["tied_with"]) == ("CableDrag", "x_axis", [])
    assert named["parameters"]["stiffness"]["value"] == pytest.approx(2000.0, rel=1e-3)
