"""A wave of negative size is told as the same wave of positive size, half a turn on."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lathesim.component import Parameter
from lathesim.diagnosis.records.diagnosis import FoundEffect, Interval
from lathesim.diagnosis.reporting.effect_report import _turned, phases_to_turn
from lathesim.diagnosis.reporting.lesson_entry import lesson_entry
from lathesim.effects.drive_errors import Cogging, TorqueRipple
from lathesim.effects.friction import PositionDependentFriction
from lathesim.effects.sensor_errors import EncoderInterpolationError
from lathesim.identification.catalogue import insert_candidates
from lathesim.identification.records import WAVES, Candidate
from tests.diagnosis.pushed_table import experiments, machine, recording


class SignedInterpolationError(EncoderInterpolationError):
    """Both harmonics go with one phase, and either may have any sign.

    y_out = y_in + amplitude sin(2 pi y_in / signal_period + phase) + second sin(4 pi y_in / signal_period + phase)
    """

    amplitude = Parameter("{signal}", 0.0, doc="error once per signal period")
    second = Parameter("{signal}", 0.0, doc="error twice per signal period")


WAVY = (TorqueRipple, Cogging, SignedInterpolationError)


def term_of(effect: Any) -> Candidate:
    """Return the candidate of an effect; of a cogging with its second harmonic."""
    found = next(candidate for candidate in insert_candidates(machine().assembly, (effect,))[1] if candidate.name == effect.__name__)
    return found.shaped if effect is Cogging and found.shaped is not None else found


def law(candidate: Candidate, values: dict[str, float]) -> np.ndarray:
    """Return what the effect adds along a motion."""
    names = candidate.effect.output.__code__.co_varnames[: candidate.effect.output.__code__.co_argcount]
    places = np.linspace(0.0, 0.05, 200)
    given = [{"incoming": place, "displacement": place, "applied": 3.0 + place, **values} for place in places]
    return np.array([candidate.effect.output(**{name: one[name] for name in names}) for one in given])


def values_of(candidate: Candidate, sizes: dict[str, float]) -> dict[str, float]:
    """Return a value for each free name, by its short one."""
    given = {"period": 0.008, "signal_period": 0.003, "phase": 0.5, "second_phase": -0.9, **sizes}
    return {name.partition(".")[2]: given[name.partition(".")[2]] for name in candidate.parameters}


def test_every_size_of_every_wave_in_the_table_belongs_to_a_phase() -> None:
    sizes = {name for names in WAVES.values() for name in names}
    assert [sorted(name.partition(".")[2] for names in term_of(effect).waves.values() for name in names) for effect in WAVY] == [
        sorted(sizes & set(effect.declared(Parameter))) for effect in WAVY
    ]
    cogging = term_of(Cogging)
    phase, second_phase, first, second = (f"{cogging.part}.{name}" for name in ("phase", "second_phase", "amplitude", "second"))
    assert cogging.waves == {phase: (first,), second_phase: (second,)}


def test_a_size_that_cannot_be_negative_is_left_alone() -> None:
    """An uneven friction is no wave about nothing: half a turn on with the other sign it is another friction."""
    assert term_of(PositionDependentFriction).waves == {}


@pytest.mark.parametrize("second", [1.0, -1.0])
@pytest.mark.parametrize("first", [1.0, -1.0])
@pytest.mark.parametrize("effect", WAVY)
def test_what_is_told_does_what_was_fitted(effect: Any, first: float, second: float) -> None:
    candidate = term_of(effect)
    # the first size is the larger one by what is usual, whatever the range of the effect
    usual = dict(zip((name.partition(".")[2] for name in candidate.parameters), np.abs(candidate.points).max(axis=0), strict=True))
    sizes = {"amplitude": first * usual["amplitude"]} | {name: 0.3 * second * usual[name] for name in ("share", "second") if name in usual}
    fitted = values_of(candidate, sizes)
    reported = {name: value for name, value in fitted.items() if name not in effect.identification.nuisance}
    found = _turned(candidate, {name: Interval(value, "1", value - 0.1, value + 0.2) for name, value in reported.items()})
    for name, item in found.items():
        assert item.low < item.value < item.high
        assert abs(item.value) == abs(fitted[name])
    assert found["amplitude"].value > 0.0
    if effect is Cogging:
        assert found["second"].value > 0.0
    named = {f"{candidate.part}.{name}": value for name, value in fitted.items()}
    told = FoundEffect(candidate.name, candidate.at, candidate.family, 1.0, found)
    (experiment,) = experiments(recording(count=200), effects=(effect,))
    entry = lesson_entry(told, candidate, SimpleNamespace(by_name=named), experiment)  # type: ignore[arg-type]
    inserted = {name: float(text.split()[0]) for name, text in entry.items() if name not in ("effect", "at")}
    assert law(candidate, inserted) == pytest.approx(
        law(candidate, fitted), abs=1e-4 * np.ptp(law(candidate, fitted))
    )  # a lesson has six digits


def test_of_two_sizes_with_one_phase_the_larger_by_what_is_usual_decides() -> None:
    candidate = term_of(TorqueRipple)
    phase, amplitude, share = (f"{candidate.part}.{name}" for name in ("phase", "amplitude", "share"))
    assert phases_to_turn(candidate, {amplitude: -1.0, share: 0.04}) == []
    assert phases_to_turn(candidate, {amplitude: -20.0, share: 0.004}) == [phase]
    assert phases_to_turn(candidate, {amplitude: 1.0, share: -0.04}) == [phase]
    assert phases_to_turn(candidate, {}) == []


def test_a_size_that_may_be_of_either_sign_does_not_make_another_one_negative() -> None:
    candidate = term_of(TorqueRipple)
    phase, amplitude, share = (f"{candidate.part}.{name}" for name in ("phase", "amplitude", "share"))
    assert phases_to_turn(candidate, {amplitude: -1.5, share: 0.44}, ("share",)) == [phase]
    assert phases_to_turn(candidate, {amplitude: -1.5, share: 0.44}, ("amplitude", "share")) == []
    sizes = {"amplitude": Interval(-1.5, "N*m", -2.1, -0.9), "share": Interval(0.44, "1", -0.13, 1.0, (False, True))}
    turned = _turned(candidate, sizes)
    assert turned["amplitude"] == Interval(1.5, "N*m", 0.9, 2.1)
    assert turned["share"] == Interval(-0.44, "1", -1.0, 0.13, (True, False))
