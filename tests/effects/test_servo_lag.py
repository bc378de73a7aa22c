"""A servo lag is the position loop it stands for: held against that loop, integrated finely."""

import math
from pathlib import Path

import numpy as np
import pytest

from lathesim.effects.lag import ServoLag
from lathesim.engine.assembly import FloatArray
from tests.effects.rigs import led_along, record, rig, with_effect

RATE = 2.0 * math.pi * 5.0
SPAN = 0.2


def loop(lag: float, velocity_lag: float, fine: float = 1e-5) -> tuple[FloatArray, FloatArray]:
    """Return place and speed, each 1 ms, of a loop  T_v dv/dt = (x_ref - x)/T - v  that is led to and fro, 2 mm each way, from rest on."""
    time = np.arange(round(SPAN / fine) + 1) * fine
    reference = 1e-3 * (1.0 - np.cos(RATE * time))
    place, speed = np.zeros(len(time)), np.zeros(len(time))
    for now in range(1, len(time)):
        wanted = (reference[now - 1] - place[now - 1]) / lag
        speed[now] = speed[now - 1] + fine * (wanted - speed[now - 1]) / velocity_lag if velocity_lag else wanted
        place[now] = place[now - 1] + fine * speed[now]
    each = round(1e-3 / fine)
    return place[::each], speed[::each]


@pytest.mark.parametrize("velocity_lag", [0.0, 1e-3, 2e-3, 12e-3], ids=["first order", "overdamped", "critical", "swinging"])
def test_a_table_follows_as_its_position_loop_lets_it(tmp_path: Path, velocity_lag: float) -> None:
    followed = record(with_effect(led_along(tmp_path, SPAN), "ServoLag", "x_axis", lag=8e-3, velocity_lag=velocity_lag), SPAN)
    place, speed = loop(8e-3, velocity_lag)
    # it begins in a steady acceleration, the loop here at rest: that has died out after some lags
    later = slice(120, None)
    # the lesson's samples are 10 ms, and the acceleration goes on between them
    assert followed["x_axis.position"][12:] == pytest.approx(place[::10][12:], abs=2e-5)
    assert np.ptp(place[later]) > 1e-3
    assert followed["x_axis.velocity"][12:] == pytest.approx(speed[::10][12:], abs=2e-3)


def test_the_current_is_late_with_the_motion(tmp_path: Path) -> None:
    plain, late = record(led_along(tmp_path), SPAN), record(with_effect(led_along(tmp_path), "ServoLag", "x_axis", lag=8e-3), SPAN)
    assert np.argmax(late["x_axis.current"][8:]) >= np.argmax(plain["x_axis.current"][8:])
    assert not np.allclose(late["x_axis.current"], plain["x_axis.current"], atol=1e-3)


def test_a_loop_that_settles_within_a_sample_stands_where_rest_is_asked_for(tmp_path: Path) -> None:
    """Sampled each 10 ms: a dry friction is not to push on a table that has come to rest."""
    velocity = np.where(np.arange(201) < 100, 0.02, 0.0)
    drive = {"x_axis.reference": np.cumsum(velocity) * 1e-3, "x_axis.reference_velocity": velocity, "x_axis.acceleration": np.zeros(201)}
    still = {
        lag: record(with_effect(rig("led_axis", tmp_path, drive), "ServoLag", "x_axis", lag=lag), SPAN)["x_axis.velocity"][11]
        for lag in (1e-3, 5e-3)
    }
    assert still[1e-3] == 0.0
    assert still[5e-3] > 0.0


def test_it_says_what_else_a_late_position_may_be() -> None:
    assert any("current is in time" in other for other in ServoLag.confused_with)
