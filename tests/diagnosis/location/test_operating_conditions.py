"""What a machine was doing: the variables of a cut, turns of the spindle, and where dry friction holds unseen."""

import math

import numpy as np
import pytest

from lathesim.diagnosis.location.dependence import bars, beyond
from lathesim.diagnosis.location.operating_conditions import held_by_friction, resting, since_rest, since_reversal, turns, variables
from lathesim.diagnosis.location.spindle_orders import told, turn_lines
from lathesim.diagnosis.records.diagnosis import VariableBar
from lathesim.diagnosis.reporting.evidence import strongest_variables
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records.fit import Fitted
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.replay.validation_split import parted
from tests.diagnosis.one_cut import CUT, FORCE, PERIOD, TURN, cut_machine, cut_record
from tests.diagnosis.pushed_table import FORCE as PUSH
from tests.diagnosis.pushed_table import POSITION, Hidden, as_record, baseline, experiments, recording

ENTRY, OUT, ANGLE = "time since entry of cutting", "time out of the cut of cutting", "spindle angle in the cut of cutting"


def named(*wrong: str) -> tuple[str, ...]:
    fitted, judge, _ = parted(cut_machine(), "cut.csv", cut_record(wrong), ())
    first, second = fit(fitted.sensed, baseline(fitted)), fit(judge.sensed, baseline(judge))
    found = bars(fitted, first, judge, second)
    both = [VariableBar(bar.channel, bar.variable, bar.share, bar.share, bar.within, bar.within, bar.kind) for bar in found]
    return strongest_variables(tuple(both), [])


def test_a_cut_has_times_and_angles_only_where_they_make_sense() -> None:
    experiment = parted(cut_machine(), "cut.csv", cut_record(), ())[2]
    found = variables(experiment)
    inside = np.zeros(len(experiment.record), dtype=bool)
    inside[CUT] = True
    inside = inside[: len(experiment.record)]
    assert np.array_equal(np.isfinite(found[ENTRY].values[0]), inside)
    assert np.array_equal(np.isfinite(found[OUT].values[0]), ~inside)
    assert found[ENTRY].values[0][CUT][:3] == pytest.approx([0.0, PERIOD, 2.0 * PERIOD], abs=1e-12)
    turned = found[ANGLE].values[0][CUT]
    assert 0.0 <= turned.min() < turned.max() < 2.0 * np.pi
    angle, counted = turns(experiment)["cutting"]
    assert np.array_equal(counted, inside)
    assert (angle[-1] - angle[0]) / (2.0 * np.pi) == pytest.approx((len(angle) - 1) * PERIOD / TURN, rel=1e-6)


@pytest.mark.parametrize(("wrong", "variable"), [("entry", ENTRY), ("line", ANGLE), ("drift", OUT)])
def test_what_is_wrong_with_a_cut_is_located_in_its_variable(wrong: str, variable: str) -> None:
    assert variable in named(wrong)


def test_of_a_sound_cut_no_variable_is_named() -> None:
    assert named() == ()


def test_a_line_of_the_spindle_is_told_with_its_size() -> None:
    experiment = parted(cut_machine(), "cut.csv", cut_record(("line",)), ())[1]
    lines = turn_lines(experiment, fit(experiment.sensed, baseline(experiment)))
    assert [(channel, part, order) for channel, part, order, _ in lines] == [(FORCE, "cutting", 1)]
    assert lines[0][3].amplitude == pytest.approx(20.0, rel=0.05)
    assert told(lines, {FORCE: "N"})[0].startswith("A line once per turn of the spindle, ")


def resting_table() -> tuple[Experiment, Fitted]:
    """A table that is pushed for a second, and then held by its friction against a third of it."""
    pushed = np.where(np.arange(1000) < 500, 40.0 * np.sin(2.0 * np.pi * np.arange(1000) * 2e-3), 3.0)
    place = np.where(np.arange(1000) < 500, 1e-3 * np.sin(2.0 * np.pi * np.arange(1000) * 2e-3), 0.0)
    experiment = experiments(as_record({PUSH: ("N", pushed), POSITION: ("m", place)}))[0]
    level = next(name for candidate in experiment.candidates for name in candidate.parameters if candidate.name == "CoulombFriction")
    return experiment, fit(experiment.sensed, [], {level: 8.0})


def test_what_depends_on_two_variables_at_once_is_located_in_both() -> None:
    """A friction in proportion to the speed that is another one at each place: neither alone tells of it."""
    hidden = Hidden(law=lambda v, q, t: 150.0 * v * math.sin(q / 0.02))
    (experiment, other) = experiments(recording(hidden, count=4000, seed=1), recording(hidden, count=4000, seed=2))
    found = bars(experiment, fit(experiment.sensed, baseline(experiment)), other, fit(other.sensed, baseline(other)))
    assert found[0].variable == "position and velocity of x_axis"
    assert found[0].share > found[1].share + 0.1


def test_the_distance_since_rest_begins_anew_after_each_stop() -> None:
    place = np.array([0.0, 0.0, 1.0, 2.0, 2.0, 2.0, 3.0, 4.0, 3.0])
    direction = np.array([0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, -1.0])
    assert since_rest(place, direction).tolist() == [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
    assert since_reversal(place, direction)[7] == 3.0


def test_at_rest_friction_holds_up_to_its_level_unseen() -> None:
    experiment, fitted = resting_table()
    held = held_by_friction(experiment, fitted, 0)
    assert held[600:990] == pytest.approx(8.0)
    assert held[100] == 0.0
    assert beyond(np.array([-10.0, 5.0, 9.0]), np.array([8.0, 8.0, 0.0])) == pytest.approx([-2.0, 0.0, 9.0])
    assert resting(experiment, fitted)[0].startswith("x_axis stands still in 5")


def test_without_dry_friction_nothing_is_held() -> None:
    experiment, _ = resting_table()
    assert not held_by_friction(experiment, fit(experiment.sensed, []), 0).any()
    assert resting(experiment, fit(experiment.sensed, [])) == []
