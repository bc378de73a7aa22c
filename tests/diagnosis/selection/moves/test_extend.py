"""Finer shapes: an effect keeps its name and gets the harmonics, or the further events, that the recordings show."""

from collections.abc import Callable

import numpy as np
import pytest

from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.search import search
from lathesim.effects.encoder_error import EncoderEccentricity, LostCounts
from lathesim.effects.motor_ripple import TorqueRipple
from lathesim.engine.assembly import FloatArray
from tests.diagnosis.pushed_table import FORCE, PERIOD, POSITION, RESOLUTION, Hidden, as_record, experiments, force, travel

TURN, AMPLITUDE = 0.004, 20e-6
Error = Callable[[FloatArray, FloatArray], FloatArray]
"""What the encoder shows too much [m], of the place [m] and the time [s] of each sample."""


def seen_with(error: Error, seeds: tuple[int, int] = (1, 2)) -> SearchResult:
    """Return what a search finds in two recordings of a table whose encoder has an error."""
    records = []
    for seed in seeds:
        pushed = force(2000, seed)
        place, noise = travel(pushed, Hidden()), 0.3e-6 * np.random.default_rng(seed + 1000).standard_normal(2000)
        seen = place + error(place, np.arange(2000) * PERIOD) + noise
        records.append(as_record({FORCE: ("N", pushed), POSITION: ("m", np.round(seen / RESOLUTION) * RESOLUTION)}))
    return search(*experiments(*records, effects=(EncoderEccentricity, LostCounts, TorqueRipple)))


def wave(place: FloatArray, second: float, third: float) -> FloatArray:
    angle = 2.0 * np.pi * place / TURN + 0.4
    return np.asarray(AMPLITUDE * (np.sin(angle) + second * np.sin(2.0 * angle) + third * np.cos(3.0 * angle)))


def values(found: SearchResult) -> dict[str, float]:
    """Return the values of the one effect that was found."""
    (candidate,) = found.model.candidates
    return {name.partition(".")[2]: found.model.fitted.by_name[name] for name in candidate.parameters}


def test_a_wave_that_is_no_sine_is_one_effect_with_its_harmonics() -> None:
    found = seen_with(lambda q, t: wave(q, 0.3, 0.1))
    assert [candidate.name for candidate in found.model.candidates] == ["EncoderEccentricity"]
    shape = values(found)
    assert shape["amplitude"] == pytest.approx(AMPLITUDE, rel=0.02)
    assert shape["second_sine"] == pytest.approx(0.3, abs=0.02)
    assert shape["third_cosine"] == pytest.approx(0.1, abs=0.02)
    # the others are nothing, and are not told
    assert abs(shape.get("second_cosine", 0.0)) < 0.02
    assert abs(shape.get("third_sine", 0.0)) < 0.02


def test_a_sine_keeps_its_plain_shape() -> None:
    assert set(values(seen_with(lambda q, t: wave(q, 0.0, 0.0)))) == {"amplitude", "turn", "phase"}


def test_counts_may_be_lost_more_than_once() -> None:
    losses = {0.9: 150e-6, 2.1: -90e-6, 3.2: 60e-6}
    found = seen_with(lambda q, t: np.sum([size * (t >= instant) for instant, size in losses.items()], axis=0))
    assert [candidate.name for candidate in found.model.candidates] == ["LostCounts"]
    told = values(found)
    events = {told[f"{which}instant"]: told[f"{which}jump"] for which in ("", "second_", "third_")}
    assert sorted(events) == pytest.approx(sorted(losses), abs=2 * PERIOD)
    assert [events[instant] for instant in sorted(events)] == pytest.approx(list(losses.values()), rel=0.1)


def test_no_two_losses_of_counts_are_alike() -> None:
    """What one recording lost is no size of the machine: the other one lost more, and the other way."""
    losses = iter([(0.9, 150e-6), (2.1, -240e-6)])

    def lost(place: FloatArray, time: FloatArray) -> FloatArray:
        instant, size = next(losses)
        return np.where(time >= instant, size, 0.0)

    found = seen_with(lost)
    assert [candidate.name for candidate in found.model.candidates] == ["LostCounts"]
    on_both = [
        next(value for name, value in fitted.by_name.items() if name.endswith(".jump"))
        for fitted in (found.model.fitted, found.model.validation_fit)
    ]
    assert on_both == pytest.approx([150e-6, -240e-6], rel=0.05)


def test_where_an_encoder_has_its_zero_is_no_loss_of_counts() -> None:
    assert "LostCounts" not in [
        candidate.name for candidate in seen_with(lambda q, t: np.where(t > 2 * PERIOD, 60e-6, 0.0)).model.candidates
    ]
