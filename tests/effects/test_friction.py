"""Friction: closed forms of sticking, stopping, and the first micrometres."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from lathesim.effects.friction import (
    AsymmetricFriction,
    CoulombFriction,
    PositionDependentFriction,
    PreslidingFriction,
    StribeckFriction,
    ViscousWarmUp,
)
from lathesim.lessons.insertion import Machinery
from lathesim.record import Record
from tests.effects.rigs import pushed_axis, record, time, with_effect

STEP = 2.5e-4
SINE = (0.0, 0.0, 0.0, 0.0)
"""A wave without further harmonics."""


def frictionless(machinery: Machinery) -> Machinery:
    """Return the force axis without viscous friction and with exact encoders, 100 kg."""
    changed = {"x_axis": {"mass": 100.0, "viscous": 0.0}, "x_encoder": {"resolution": 0.0}, "x_scale": {"resolution": 0.0}}
    parts = tuple(dataclasses.replace(part, parameters={**part.parameters, **changed.get(part.name, {})}) for part in machinery.parts)
    return dataclasses.replace(machinery, parts=parts)


def coast(folder: Path, speed: float, *effects: tuple[str, dict[str, float]]) -> Record:
    machinery = frictionless(pushed_axis(folder, np.zeros(501)))
    for name, setting in effects:
        machinery = with_effect(machinery, name, "x_axis", **setting)
    return record(machinery, 0.5, x_axis__speed=speed)


def test_coulomb_stops_a_mass_after_m_v2_over_2_f(tmp_path: Path) -> None:
    found = coast(tmp_path, 0.05, ("CoulombFriction", {"level": 20.0}))
    assert found["x_axis.position"][-1] == pytest.approx(100.0 * 0.05**2 / (2.0 * 20.0), rel=1e-5)
    assert abs(found["x_axis.velocity"][-1]) < 1e-12


def test_two_frictions_share_the_load(tmp_path: Path) -> None:
    once = coast(tmp_path, 0.05, ("CoulombFriction", {"level": 20.0}))
    twice = coast(tmp_path, 0.05, ("CoulombFriction", {"level": 15.0}), ("AsymmetricFriction", {"level": 5.0}))
    assert twice["x_axis.position"][-1] == pytest.approx(once["x_axis.position"][-1], rel=1e-4)


def test_coulomb_holds_what_pushes_less_than_its_level(tmp_path: Path) -> None:
    pushed = with_effect(frictionless(pushed_axis(tmp_path, np.full(501, 19.0))), "CoulombFriction", "x_axis", level=20.0)
    found = record(pushed, 0.5)
    assert np.abs(found["x_axis.position"]).max() < 1e-15
    assert found["x_axis_coulomb_friction.outgoing"][-1] == pytest.approx(19.0)


def test_coulomb_lets_slip_what_pushes_more(tmp_path: Path) -> None:
    pushed = with_effect(frictionless(pushed_axis(tmp_path, np.full(501, 25.0))), "CoulombFriction", "x_axis", level=20.0)
    assert record(pushed, 0.5)["x_axis.velocity"][-1] == pytest.approx(5.0 / 100.0 * 0.5, rel=1e-3)


@pytest.mark.parametrize("effect", [("CoulombFriction", {}), ("AsymmetricFriction", {"asymmetry": 0.2})], ids=["alike", "asymmetric"])
def test_friction_turns_round_with_the_velocity(tmp_path: Path, effect: tuple[str, dict[str, float]]) -> None:
    """A body that is driven back by more than its friction slows down by (A + F) / m until it rests, and comes back by (A - F) / m."""
    push, level, speed, mass = 60.0, 20.0, 0.05, 100.0
    name, more = effect
    forward, backward = (level * (1.0 + sign * more.get("asymmetry", 0.0)) for sign in (1.0, -1.0))
    rest = speed * mass / (push + forward)
    driven = with_effect(frictionless(pushed_axis(tmp_path, np.full(501, -push))), name, "x_axis", level=level, **more)
    found = record(driven, 0.5, x_axis__speed=speed)
    assert found["x_axis.velocity"][-1] == pytest.approx(-(push - backward) / mass * (0.5 - rest), rel=2e-4)


def test_the_stopping_distance_follows_small_changes_of_the_level(tmp_path: Path) -> None:
    """A fit steps by as little: the change of m v^2 / 2 F must come out right, not only its size."""
    levels = 20.0 + 0.01 * np.arange(7)
    distances = [coast(tmp_path, 0.05, ("CoulombFriction", {"level": level}))["x_axis.position"][-1] for level in levels]
    assert np.diff(distances) == pytest.approx(np.diff(100.0 * 0.05**2 / (2.0 * levels)), rel=1e-3)


@pytest.mark.parametrize(("speed", "expected"), [(0.5, 20.0), (-0.5, -20.0)])
def test_coulomb_while_sliding(speed: float, expected: float) -> None:
    assert CoulombFriction.output(0.0, 0.0, 100.0, speed, 20.0, STEP) == expected


def test_a_driving_force_nobody_wired_counts_as_zero() -> None:
    assert CoulombFriction.output(0.0, math.nan, 100.0, 0.0, 20.0, STEP) == 0.0


def test_stribeck_falls_to_one_over_e_at_its_velocity() -> None:
    assert StribeckFriction.output(0.0, 0.0, 100.0, 0.005, 10.0, 0.005, 1.0, STEP) == pytest.approx(10.0 / math.e)
    assert StribeckFriction.output(0.0, 0.0, 100.0, -0.010, 10.0, 0.005, 2.0, STEP) == pytest.approx(-10.0 * math.exp(-4.0))


def test_asymmetric_levels_and_slopes() -> None:
    forward = AsymmetricFriction.output(0.0, 0.0, 100.0, 0.1, 20.0, 0.25, 40.0, STEP)
    backward = AsymmetricFriction.output(0.0, 0.0, 100.0, -0.1, 20.0, 0.25, 40.0, STEP)
    assert (forward, backward) == (pytest.approx(25.0 + 4.0), pytest.approx(-15.0 + 4.0))


def test_positional_friction_turns_over_with_the_direction() -> None:
    there = PositionDependentFriction.output(0.0, 0.0, 100.0, 0.1, 0.0025, 5.0, 0.01, 0.0, *SINE, STEP)
    back = PositionDependentFriction.output(0.0, 0.0, 100.0, -0.1, 0.0025, 5.0, 0.01, 0.0, *SINE, STEP)
    assert (there, back) == (pytest.approx(5.0), pytest.approx(-5.0))


def test_positional_friction_below_the_mean_takes_from_it_while_the_body_moves_and_nothing_at_rest() -> None:
    moving = PositionDependentFriction.output(20.0, 0.0, 100.0, 0.1, 0.0075, 5.0, 0.01, 0.0, *SINE, STEP)
    resting = PositionDependentFriction.output(8.0, 8.0, 100.0, 0.0, 0.0075, 5.0, 0.01, 0.0, *SINE, STEP)
    assert (moving, resting) == (pytest.approx(15.0), pytest.approx(8.0))


def test_warm_up_reaches_63_percent_after_its_time_constant() -> None:
    assert ViscousWarmUp.output(0.0, 0.1, 600.0, -100.0, 600.0, 0.0) == pytest.approx(-10.0 * (1.0 - 1.0 / math.e))


def test_presliding_is_a_spring_of_level_over_distance() -> None:
    small = PreslidingFriction.output(0.0, 0.0, 0.0, 0.0, 1e-9, 20.0, 5e-6, 0.0, 0.005, 0.0)
    assert small == pytest.approx(20.0 / 5e-6 * 1e-9, rel=1e-3)
    far = PreslidingFriction.output(0.0, 0.0, 0.0, 0.0, 1e-3, 20.0, 5e-6, 0.0, 0.005, 0.0)
    assert far == pytest.approx(20.0)


def test_presliding_gives_way_by_dahls_law(tmp_path: Path) -> None:
    """A slow push of half the level bends the bristles by distance * ln 2."""
    force = 10.0 * np.minimum(time(0.5) / 0.4, 1.0)
    settings = {"level": 20.0, "distance": 5e-6, "bristle_damping": 3e4}
    found = record(with_effect(frictionless(pushed_axis(tmp_path, force)), "PreslidingFriction", "x_axis", **settings), 0.5)
    assert found["x_axis.position"][-20:].mean() == pytest.approx(5e-6 * math.log(2.0), rel=0.02)


def test_presliding_does_not_care_about_the_step_of_the_path() -> None:
    """The bristle force is integrated exactly: one stroke in one sample or in a thousand."""
    state = (0.0, 0.0)
    for k in range(1, 1001):
        state = PreslidingFriction.update(*state, 0.01, k * 1e-8, 20.0, 5e-6, 0.0, 0.005, 1.0)
    assert state[0] == pytest.approx(20.0 * (1.0 - math.exp(-2.0)), rel=1e-12)
