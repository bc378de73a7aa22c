"""The filter of a derivative is a value of its controller: what the lesson calls uncertain is fitted, and no effect takes its place."""

from pathlib import Path

import numpy as np
import pytest

from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare, run_prepared
from lathesim.plugins import load_registry
from tests.diagnosis.asking import answer_in
from tests.diagnosis.small_case import POSITION, PROGRAM, VOLTAGE, write_lesson

PID = (
    "replace: {x_controller: PositionController}\n"
    "set: {x_controller.proportional: 20000 V/m, x_controller.derivative_gain: 240 V*s/m, x_controller.derivative_filter: %s}\n"
)


def test_a_filter_of_unknown_lag_is_a_value_of_the_controller(tmp_path: Path) -> None:
    lesson = write_lesson(tmp_path, extra=PID % "3 ms")
    for name, changed in (("log.csv", PROGRAM), ("other.csv", PROGRAM.replace("X13.0", "X9.0"))):
        (tmp_path / "small.nc").write_text(changed, encoding="utf-8")
        run = run_prepared(prepare(load_lesson(lesson), load_registry(installed=False)))
        asked = next(name for name in run.channels if name.endswith("x_reference"))
        columns = [1e3 * run.time, 1e3 * run[asked], 1e3 * run[POSITION], run[VOLTAGE] / 2.0]
        np.savetxt(tmp_path / name, np.column_stack(columns), delimiter=",", header="t,asked,motor,voltage", comments="")
    text = write_lesson(tmp_path, extra=PID % "1 ms").read_text(encoding="utf-8")
    text = text.replace("uncertain: {", "uncertain: {x_controller.derivative_filter: 2 ms, ")
    (tmp_path / "lesson.yaml").write_text(text, encoding="utf-8")
    answer = answer_in(tmp_path, "--effect", "SensorFilter", "--effect", "TransportDelay", "--effect", "CoulombFriction")
    assert answer["verdict"] == "parameters_only"
    assert answer["baseline"]["x_controller.derivative_filter"]["refit_with"] == pytest.approx(3e-3, rel=0.02)
