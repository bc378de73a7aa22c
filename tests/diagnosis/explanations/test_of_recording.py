"""What a pushed table lacks: the force itself, and what it depends on."""

import math
from dataclasses import replace

import numpy as np
import pytest

from lathesim.components.axes import LedAxis
from lathesim.diagnosis.explanations.conditions import Conditions, Motion, Term, Wave, at_one_speed
from lathesim.diagnosis.explanations.lacking_force import lacking, quiet_every, undone
from lathesim.diagnosis.explanations.of_recording import of_channels
from lathesim.engine.assembly import Assembly, Part
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.replay.experiment import RecordedMachine, build_experiments
from lathesim.record import Channel, Record
from tests.diagnosis.pushed_table import POSITION, Hidden, baselines, pair

REFERENCE, SPEED, CURRENT = "x_axis.reference", "x_axis.reference_velocity", "x_axis.current"
DRY = Hidden(dry=8.0)
SPRING = Hidden(law=lambda v, q, t: 400.0 * q)
RIPPLE = Hidden(law=lambda v, q, t: 6.0 * math.sin(2.0 * math.pi * q / 0.004 + 0.5))


def asked(hidden):
    (here, there), (fitted, judged) = pair(hidden), baselines(hidden)
    return of_channels(here, fitted, there, judged)[POSITION]


@pytest.mark.parametrize("late", [0, 8])
def test_a_response_is_undone_whatever_the_residual_drifts_to(late):
    """What a reading is late by comes off, and its last samples are not known."""
    response = np.concatenate([np.zeros(late), 0.3 * (1.0 - 0.98 ** np.arange(500.0 - late))])
    pushed = np.random.default_rng(1).standard_normal(500)
    residual = 1e4 + np.convolve(pushed, response)[:500]
    found = undone(residual, response)
    known = np.isfinite(found)
    assert np.count_nonzero(~known) < 5 + late
    assert found[known] == pytest.approx(pushed[known], abs=1e-4)


def test_noise_of_a_place_is_no_longer_most_of_a_force_in_means():
    slow = np.sin(np.arange(20000) / 1500.0)
    noisy = slow + 8.0 * np.diff(np.random.default_rng(1).standard_normal(20002), n=2)
    every = quiet_every(noisy)
    assert every > 1
    means = noisy[: len(noisy) // every * every].reshape(-1, every).mean(axis=1)
    assert np.std(means) < 2.0 * np.std(slow)
    assert quiet_every(slow) == 1


def test_the_force_that_is_lacking_is_what_was_left_out():
    experiment, fitted = pair(SPRING)[0], baselines(SPRING)[0]
    missing = lacking(experiment, fitted, 0)
    assert (missing.at, missing.unit, missing.is_force) == ("x_axis.disturbance", "N", True)
    hidden = 400.0 * experiment.record[POSITION]
    means = [np.nanmean(one[: len(one) // 20 * 20].reshape(-1, 20), axis=1) for one in (missing.values, hidden)]
    assert np.corrcoef(*means)[0, 1] > 0.8


def test_nothing_is_lacking_at_a_sound_table():
    _, found = asked(Hidden())
    assert found.gain < 10.0


def test_a_dry_friction_left_out_is_found():
    _, found = asked(DRY)
    assert found.gain > 5.0 * found.standard_error
    assert found.terms[0].on in ("sign of velocity", "direction of the last motion", "velocity")
    assert found.after < found.before


def test_a_ripple_left_out_is_found_with_its_period():
    _, found = asked(RIPPLE)
    assert found.gain > 5.0 * found.standard_error
    wave = next(term.wave for term in found.terms if term.wave)
    assert wave.period == pytest.approx(0.004, rel=0.01)


def test_a_current_that_tells_a_force_at_once_is_taken_for_that_force():
    component = LedAxis
    parts = (Part("x_axis", component, {"mass": 2.0, "viscous": 10.0, "force_constant": 4.0}),)
    time = np.arange(2000) * 5e-3
    places = [0.1 * np.sin((2.0 + 0.3 * seed) * time) for seed in (0, 1)]
    records = []
    for seed, place in enumerate(places):
        speed = np.gradient(place, time)
        current = (10.0 * speed + 3.0 * np.sign(speed)) / 4.0 + 0.1 * np.random.default_rng(seed).standard_normal(len(time))
        channels = {REFERENCE: ("m", place), SPEED: ("m/s", speed), CURRENT: ("A", current)}
        records.append(Record(time, {name: Channel(name, *one) for name, one in channels.items()}, {"sample_period": 5e-3}))
    led = RecordedMachine(Assembly(parts, (), 5e-3, 5e-3), (REFERENCE, SPEED), (CURRENT,), {}, {})
    here, there = build_experiments(led, [("fit", records[0]), ("check", records[1])], ())
    fitted, judged = (fit(one.sensed, []) for one in (here, there))
    missing, found = of_channels(here, fitted, there, judged)[CURRENT]
    assert (missing.at, missing.unit, missing.is_force) == ("x_axis.disturbance", "N", True)
    assert found.terms[0].on in ("sign of velocity", "direction of the last motion")
    assert found.parts[0].size == pytest.approx(3.0, rel=0.1)


def test_a_wave_at_one_speed_is_one_over_time_and_over_the_position() -> None:
    """What happens 50 times a second happens 50/57 times a turn where 57 turns are made in a second, whatever the cause is."""
    time = 5e-3 * np.arange(200)
    speed = np.where(time < 0.1, 3500.0 * time, 350.0)
    turning = Motion("spindle", "rad", np.cumsum(speed) * 5e-3, speed, np.gradient(speed, time))
    over_turns, over_time = Term("position", "spindle", Wave("spindle", 7.0, "rad")), Term("time", wave=Wave("", 0.02, "s"))
    assert at_one_speed(over_turns, Conditions(time, (turning,))) == " (or time, at 50 Hz)"
    assert at_one_speed(over_time, Conditions(time, (turning,))) == " (or position of spindle, 0.8976 times a turn)"
    swept = replace(turning, velocity=np.linspace(0.0, 350.0, 200))
    assert at_one_speed(over_turns, Conditions(time, (swept,))) == at_one_speed(Term("time"), Conditions(time, (turning,))) == ""
