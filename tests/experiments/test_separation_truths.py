"""The machines that play the truth of sealed cases: they read a part program by themselves, and command what the lesson commands."""

from pathlib import Path

import numpy as np
import pytest

from lathesim.component import Parameter
from lathesim.effects.register import stock_effects
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare, run_prepared
from lathesim.plugins import Registry
from tests.experiments.separation.hidden_axis import AXIS_EFFECTS
from tests.experiments.separation.hidden_turning import CUTTING_EFFECTS, SPINDLE_EFFECTS
from tests.experiments.separation.names import NAMES
from tests.experiments.separation.part_program import read_course
from tests.experiments.separation.ties import CONTAINED, schedule
from tests.experiments.separation.turning_truth import FACE, STOCK, CutTruth, SpindleTruth, chip_of, course_of


def test_chips_are_those_of_the_lesson(registry: Registry) -> None:
    run = run_prepared(prepare(load_lesson(str(CutTruth.lesson)), registry), engine="plain")
    for own, name in zip(chip_of(course_of(CutTruth.lesson)), ("feed", "depth_of_cut", "cutting_speed"), strict=True):
        other = np.asarray(run[f"geometry.{name}"])[: len(own)]
        # a block may begin a sample earlier or later
        assert np.mean(np.abs(own - other)) < 2e-3 * np.max(other), name
        assert np.count_nonzero(own) == pytest.approx(np.count_nonzero(other), abs=20), name


def test_spindle_follows_the_words_of_the_program(registry: Registry) -> None:
    run = run_prepared(prepare(load_lesson(str(SpindleTruth.lesson)), registry), engine="plain")
    own, other = course_of(SpindleTruth.lesson).spindle, np.asarray(run["exercise.spindle_reference"])
    count = 15900  # the program ends at 16 s
    assert np.mean(np.abs(own[:count] - other[:count]) > 1e-6) < 2e-3
    assert own.max() == pytest.approx(2400.0 * np.pi / 30.0)


def test_feed_of_each_turn_and_layers_add_up(tmp_path: Path) -> None:
    program = tmp_path / "two_passes.nc"
    program.write_text("G90 G95 G71\nG97 S600.0 M3\nG0 X21.0 Z14.0\nG1 Z20.0 F0.1\nG0 X23.0\nZ14.0\nG0 X20.5\nG1 Z20.0 F0.2\nM30\n")
    feed, depth, speed = chip_of(read_course(program))
    first, second = depth == depth[np.flatnonzero(depth)[0]], np.isclose(depth, 0.0005)
    assert depth[first][0] == pytest.approx(STOCK - 0.021)
    assert feed[first].max() == pytest.approx(1e-4, rel=1e-3)
    assert np.median(feed[second]) == pytest.approx(2e-4, rel=1e-3)
    # 600 turns a minute at 0.1 mm a turn are 1 mm/s, from the face of the stock on
    assert np.count_nonzero(first) == pytest.approx(1e3 * (0.020 - FACE) / 1e-3, abs=5)
    assert speed[second].mean() == pytest.approx(20.0 * np.pi * 0.0205, rel=1e-3)


def test_words_that_the_reader_does_not_know_are_refused(tmp_path: Path) -> None:
    program = tmp_path / "arc.nc"
    program.write_text("G90 G94\nG2 X1.0 Z1.0 R1.0 F100.0\n")
    with pytest.raises(ValueError, match="G2"):
        read_course(program)


def test_nothing_is_hidden_that_a_rival_makes_exactly() -> None:
    cases = schedule(1, ("axis", "cut", "spindle"))[:200]
    assert len({(case.rig, case.family) for case in cases[:9]}) == 9
    assert not [case for case in cases for other in case.rivals if (case.rivals[case.truth], other) in CONTAINED]


@pytest.mark.parametrize(("truth", "key"), [(CutTruth, "runout"), (SpindleTruth, "tacho_ripple")])
def test_each_recording_has_noise_of_its_own(
    truth: type[CutTruth] | type[SpindleTruth], key: str, registry: Registry, tmp_path: Path
) -> None:
    machine = truth(key, 7)
    seconds = [machine.record(truth.lesson, tmp_path / f"{number}.csv", registry) for number in range(2)]
    first, second = (np.genfromtxt(tmp_path / f"{number}.csv", delimiter=",", skip_header=1) for number in range(2))
    assert seconds == [pytest.approx(16.999)] * 2
    assert not np.array_equal(first, second)
    assert np.corrcoef(first[:, -1], second[:, -1])[0, 1] > 0.99


def test_names_and_sizes_of_hidden_effects_are_those_of_the_program() -> None:
    rig = {"rated": 500.0, "lead": 0.005, "acceleration": 2.0, "mass": 60.0, "viscous": 200.0, "bandwidth": 100.0}
    draws = {**AXIS_EFFECTS, **SPINDLE_EFFECTS, **CUTTING_EFFECTS}
    assert set(draws) == set(NAMES)
    for key, name in NAMES.items():
        hidden = draws[key](np.random.default_rng(1), rig)
        assert {*name.right, *([name.mean] if name.mean else [])} <= set(stock_effects())
        declared = stock_effects()[name.effect].declared(Parameter)
        assert {factor for size in hidden.parameters for factor in size.split("*")} <= set(declared), key
