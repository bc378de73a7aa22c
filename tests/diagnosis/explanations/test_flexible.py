"""What the flexible explanation finds in residuals whose truth is known, and that it finds nothing where nothing is."""

import math

import numpy as np
import pytest
from scipy.signal import lfilter

from lathesim.diagnosis.explanations.conditions import Conditions, Motion
from lathesim.diagnosis.explanations.flexible import flexible

_PERIOD = 2e-3
_SAMPLES = 6000


def moved(seed, unit="m", stroke=0.05):
    """Return the conditions of a part that travels to and fro at three speeds."""
    speeds = np.random.default_rng(seed).permutation([0.01, 0.03, 0.06])
    time = np.arange(_SAMPLES) * _PERIOD
    speed = np.repeat(speeds, _SAMPLES // 3)
    way = np.cumsum(speed) * _PERIOD
    position = stroke * np.abs((way / stroke + 0.1 * seed) % 2.0 - 1.0)
    velocity = np.gradient(position, _PERIOD)
    smooth = np.convolve(np.pad(velocity, 10, "edge"), np.hanning(23)[1:-1] / 11.0, "valid")
    scale = 1.0 if unit == "m" else 2.0 * math.pi / 0.01
    return Conditions(time, (Motion("table", unit, scale * position, scale * smooth, scale * np.gradient(smooth, _PERIOD)),))


def noise(seed, memory=0.8):
    """Return noise of unit size that remembers."""
    white = np.random.default_rng(1000 + seed).standard_normal(_SAMPLES)
    return math.sqrt(1.0 - memory**2) * lfilter([1.0], [1.0, -memory], white)


def asked(hidden, **given):
    """Return the flexible explanation of what ``hidden`` makes of two motions, with noise of unit size."""
    unit = given.pop("unit", "m")
    here, there = moved(1, unit), moved(2, unit)
    return flexible(here, hidden(here, 0) + noise(1), (there, hidden(there, 1) + noise(2)), **given)


def test_nothing_is_found_in_noise_that_remembers():
    found = [
        flexible(moved(seed), noise(seed, memory), (moved(seed + 1), noise(seed + 1, memory))) for seed in (3, 4) for memory in (0.0, 0.95)
    ]
    assert all(-1.0 < one.gain < 10.0 for one in found)
    assert sum(one.gain > 0.0 for one in found) <= 1


def test_a_residual_of_zeros_depends_on_nothing():
    found = flexible(moved(3), 0.0 * noise(3), (moved(4), 0.0 * noise(4)))
    assert (found.gain, found.terms) == (0.0, ())


def test_what_steps_with_the_direction_is_a_dry_friction():
    found = asked(lambda conditions, recording: np.sign(conditions.motions[0].velocity))
    assert str(found.terms[0]) in ("depends on sign of velocity of table", "depends on direction of the last motion of table")
    assert found.parts[0].size == pytest.approx(1.0, rel=0.1)
    assert found.gain > 5.0 * found.standard_error
    assert found.before == pytest.approx(math.sqrt(2.0), rel=0.1)
    assert found.after == pytest.approx(1.0, rel=0.1)


@pytest.mark.parametrize(("unit", "said"), [("m", "every 5"), ("rad", "2.0")])
def test_a_wave_over_the_way_is_found_with_its_period_though_its_phase_is_another_one(unit, said):
    period = 0.005 if unit == "m" else math.pi

    def wave(conditions, recording):
        return np.sin(2.0 * np.pi / period * conditions.motions[0].position + recording)

    found = asked(wave, unit=unit)
    assert found.terms[0].wave.period == pytest.approx(period, rel=2e-3)
    assert found.terms[0].wave.of == "table"
    assert not found.terms[0].wave.turning
    assert ("every 5" if unit == "m" else "times a turn") in str(found.terms[0])
    assert found.gain > 5.0 * found.standard_error
    assert found.after == pytest.approx(1.0, rel=0.1)


def test_a_wave_over_time_is_told_by_its_frequency():
    found = asked(lambda conditions, recording: np.sin(2.0 * np.pi * 17.0 * conditions.time + recording))
    assert str(found.terms[0]) == "is periodic in time, at 17 Hz"


def test_what_holds_on_one_recording_only_is_refuted():
    found = asked(lambda conditions, recording: (1.0 - 2.0 * recording) * np.sin(40.0 * conditions.motions[0].position))
    assert found.gain == 0.0
    assert not found.parts
    assert found.after == found.before


def test_what_is_absorbed_is_no_finding_and_what_stands_beside_it_is():
    def hidden(conditions, recording):
        return np.sign(conditions.motions[0].velocity) + 100.0 * conditions.motions[0].velocity

    here, there = (Conditions(one.time, one.motions, absorbed=100.0 * one.motions[0].velocity[None]) for one in (moved(1), moved(2)))
    only = flexible(here, 100.0 * here.motions[0].velocity + noise(1), (there, 100.0 * there.motions[0].velocity + noise(2)))
    assert only.gain < 10.0
    both = flexible(here, hidden(here, 0) + noise(1), (there, hidden(there, 1) + noise(2)))
    assert both.terms[0].on in ("sign of velocity", "direction of the last motion", "velocity")
    assert both.parts[0].size == pytest.approx(1.0, rel=0.2)
    assert both.after == pytest.approx(1.0, rel=0.1)


def test_samples_that_nobody_knows_are_left_out():
    here, there = moved(1), moved(2)
    first, second = np.sign(here.motions[0].velocity) + noise(1), np.sign(there.motions[0].velocity) + noise(2)
    first[:50], second[700:900] = np.nan, np.nan
    found = flexible(here, first, (there, second))
    assert found.gain > 5.0 * found.standard_error
    assert math.isfinite(found.after)


def test_what_a_quantised_sensor_may_be_off_by_is_no_finding():
    def hidden(conditions, recording):
        return 0.5 * np.tanh(conditions.motions[0].velocity / 0.005)

    assert asked(hidden).gain > 30.0
    assert asked(hidden, unresolved=3.0).gain < 30.0


def test_what_hangs_on_a_part_by_a_spring_is_told_by_its_frequency():
    def swung(conditions, recording):
        stretch = rate = 0.0
        own, found = 2.0 * math.pi * 3.0, []
        for push in conditions.motions[0].acceleration.tolist():
            rate += (push - 2.0 * 0.05 * own * rate - own**2 * stretch) * _PERIOD
            stretch += rate * _PERIOD
            found.append(stretch)
        return 2.0 * np.array(found) / np.std(found)

    here, there = moved(1), moved(2)
    swinging = [Conditions(one.time, one.motions, rings=True) for one in (here, there)]
    found = flexible(swinging[0], swung(here, 0) + noise(1), (swinging[1], swung(there, 1) + noise(2)))
    assert found.gain > 3.0 * found.standard_error
    assert found.terms[0].frequency == pytest.approx(3.0, rel=0.3)
    assert "swings at about" in str(found.terms[0])
