"""Where a mismatch sits and what it depends on: the missing force, and the variables that explain it on another recording."""

import numpy as np
import pytest

from lathesim.diagnosis.fit import fit
from lathesim.diagnosis.locate import bars, explained, missing_signal, passed_through, places
from lathesim.diagnosis.variables import direction_of, since_reversal, variables
from tests.diagnosis.pushed_table import MASS, POSITION, VISCOUS, Hidden, baselines, pair

DRAG = Hidden(law=lambda v, q, t: 2000.0 * v * abs(v))
SPRING = Hidden(law=lambda v, q, t: 400.0 * q)


def shares(hidden: Hidden) -> dict[str, float]:
    (rig, held_out), (fitted, judged) = pair(hidden), baselines(hidden)
    return {bar.variable: bar.share for bar in bars(rig, fitted, held_out, judged)}


def test_the_missing_force_is_what_was_left_out() -> None:
    rig, fitted = pair(SPRING)[0], baselines(SPRING)[0]
    missing = missing_signal(rig, fitted, 0)
    assert (missing.at, missing.unit) == ("x_axis.disturbance", "N")
    hidden = 400.0 * rig.record[POSITION]
    inside = slice(200, -200)
    likeness = np.corrcoef(missing.values[inside], hidden[inside])[0, 1]
    assert likeness > 0.8
    assert np.std(missing.values[inside]) == pytest.approx(np.std(hidden[inside]), rel=0.4)


def test_a_hidden_coulomb_friction_depends_on_the_sign_of_velocity() -> None:
    two = pair(Hidden(dry=8.0))
    fitted, judged = (fit(rig.sensed, rig.start_states(rig.sensed.plan), {"x_axis.mass": MASS, "x_axis.viscous": VISCOUS}) for rig in two)
    found = {bar.variable: bar.share for bar in bars(two[0], fitted, two[1], judged)}
    assert found["sign of velocity of x_axis"] > 0.7
    for other in ("time", "speed of x_axis", "position of x_axis", "acceleration of x_axis"):
        assert found[other] < 0.15


def test_a_refit_of_the_baseline_absorbs_some_of_it() -> None:
    """With a larger viscous friction what is left of the step at a reversal is smaller, and still an odd function of velocity."""
    found = shares(Hidden(dry=8.0))
    assert found["velocity of x_axis"] > 0.3
    assert 0.1 < found["sign of velocity of x_axis"] < found["velocity of x_axis"]


def test_a_hidden_spring_depends_on_the_position() -> None:
    found = shares(SPRING)
    assert found["position of x_axis"] > 0.5
    assert max(found, key=lambda name: found[name]) in ("position of x_axis", "position and direction of x_axis")


def test_nothing_explains_the_noise_of_a_sound_machine() -> None:
    assert max(shares(Hidden()).values()) < 0.1


def test_a_variable_counts_only_where_the_other_recording_agrees() -> None:
    """What is there in one recording alone is explained by nothing on the other."""
    rng = np.random.default_rng(0)
    where, other = rng.uniform(-1.0, 1.0, 3000), rng.uniform(-1.0, 1.0, 3000)
    assert explained([where], np.sign(where), [other], np.sign(other)) > 0.9
    assert explained([where], np.sign(where), [other], rng.standard_normal(3000)) < 0.02
    assert explained([where], np.sign(where), [other], -np.sign(other)) == 0.0
    assert explained([where], rng.standard_normal(3000), [other], np.zeros(3000)) == 0.0


def test_two_variables_together_explain_what_neither_does() -> None:
    rng = np.random.default_rng(0)
    first, second = rng.uniform(-1.0, 1.0, (2, 4000))
    signal = np.sign(first) * np.sign(second)
    assert explained([first], signal, [first], signal) < 0.05
    assert explained([first, second], signal, [first, second], signal) > 0.8


def test_the_direction_of_a_motion_and_the_distance_since_it_turned() -> None:
    place = np.array([0.0, 1.0, 2.0, 2.0, 1.0, 0.0, 0.0, 1.0])
    direction = direction_of(np.array([1.0, 1.0, 1.0, 0.001, -1.0, -1.0, 0.0, 1.0]))
    assert direction.tolist() == [1.0, 1.0, 1.0, 0.0, -1.0, -1.0, 0.0, 1.0]
    assert since_reversal(place, direction).tolist() == [0.0, 1.0, 2.0, 2.0, 0.0, 1.0, 1.0, 0.0]


def test_what_the_machine_was_doing_is_told_for_each_moving_part_but_not_what_a_loop_made_its_drive_do() -> None:
    names = set(variables(pair(Hidden())[0]))
    assert {"time", "velocity of x_axis", "sign of velocity of x_axis", "position of x_axis"} <= names
    assert "x_axis.force" not in names


def test_the_place_is_the_channel_that_is_off_and_what_it_passes_through() -> None:
    rig, fitted = pair(Hidden(dry=8.0))[0], baselines(Hidden(dry=8.0))[0]
    (place,) = places(rig, fitted)
    assert place.channel == POSITION
    assert place.over_floor > 50.0
    assert place.parts == ("x_encoder", "x_axis")
    assert 0 < len(place.windows) <= 5
    assert all(0.0 <= begin < end <= 4.0 for begin, end in place.windows)
    assert passed_through(rig.sensed.plan, "x_axis.position") == ("x_axis",)
