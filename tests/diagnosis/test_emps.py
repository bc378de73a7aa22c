"""The open-loop figure of the EMPS benchmark: its simulation against closed forms, and what it takes from an answer."""

import numpy as np
import pytest

from tests.diagnosis.emps import PERIOD, Axis, _simulate, told

simulate = _simulate.py_func


def test_an_axis_that_coasts_stops_where_dry_and_viscous_friction_leave_it():
    position = simulate(np.zeros(2000), 0.0, 0.1, 95.0, 200.0, 0.0, 20.0, 0.0)
    way = 95.0 / 200.0 * (0.1 - 20.0 / 200.0 * np.log1p(200.0 * 0.1 / 20.0))  # m, integral of (v + F/b) exp(-b t/M) - F/b
    assert position[-1] == pytest.approx(way, rel=1e-12)
    assert np.ptp(position[-1000:]) == 0.0


def test_a_held_force_brings_each_direction_to_its_own_speed():
    forth, back = (simulate(np.full(6000, force), 0.0, 0.0, 95.0, 200.0, -40.0, 20.0, -3.0) for force in (37.0, -43.0))
    assert (forth[-1] - forth[-2]) / PERIOD == pytest.approx((37.0 + 3.0 - 20.0) / 160.0, rel=1e-4)
    assert (back[-1] - back[-2]) / PERIOD == pytest.approx(-(43.0 - 3.0 - 20.0) / 240.0, rel=1e-4)


def test_the_effects_of_an_answer_become_the_values_of_the_axis():
    baseline = {"x_axis.mass": {"refit_with": 95.0}, "x_axis.viscous": {"refit_with": 205.0}}

    def effect(name, **sizes):
        return {"effect": name, "parameters": {key: {"value": value} for key, value in sizes.items()}}

    uneven = [effect("AsymmetricFriction", level=20.0, asymmetry=0.1, viscous_difference=-37.0), effect("ForceOffset", offset=-3.0)]
    assert told({"baseline": baseline, "effects": uneven}) == Axis(95.0, 205.0, -37.0, 20.0, -1.0)
    with pytest.raises(ValueError, match="Backlash is no effect of this model"):
        told({"baseline": baseline, "effects": [effect("Backlash", width=1e-6)]})
