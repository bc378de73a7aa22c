"""The comparators of the real recordings find what is in an equation made up, and no more."""

import numpy as np
import pytest

from tests.diagnosis.real.comparators.candidates import candidates
from tests.diagnosis.real.comparators.equations import Equation
from tests.diagnosis.real.comparators.grey_box import selected
from tests.diagnosis.real.comparators.regressions import best_shape

TIME = np.arange(4000) * 2e-3


def force(seed, friction=0.0, wave=0.0, noise=0.1):
    """Return the force of a mass of 2 kg with 3 N s/m, unfiltered."""
    rng = np.random.default_rng(seed)
    phases = rng.uniform(-np.pi, np.pi, 3)
    rates = 2.0 * np.pi * np.array([0.3, 0.7, 1.1])
    place = sum(0.05 * np.sin(rate * TIME + phase) for rate, phase in zip(rates, phases, strict=True))
    speed = np.gradient(place, TIME)
    given = {"inertia": (np.gradient(speed, TIME), 2.0, 0.1), "viscous": (speed, 3.0, 0.1)}
    values = sum(value * column for column, value, _ in given.values())
    values = values + friction * np.sign(speed) + wave * np.sin(2.0 * np.pi * place / 0.01) + noise * rng.standard_normal(len(TIME))
    return Equation("force", "axis", "N", values, given, TIME, place, speed, values, lambda column: column)


def named(**hidden):
    model = selected(force(1, **hidden), force(2, **hidden), careful=True)[-1]
    return {term.candidate.effect: term.shape for term in model.terms}


def test_the_grey_box_names_nothing_where_nothing_is_hidden():
    assert not named()


def test_the_grey_box_names_friction_and_a_wave_with_its_period():
    found = named(friction=1.0, wave=0.5)
    assert set(found) == {"CoulombFriction", "Cogging"}
    assert found["Cogging"] == pytest.approx(0.01, rel=0.01)


def test_the_strongest_period_of_a_library_is_that_of_the_wave():
    equation = force(1, wave=0.5)
    cogging = next(one for one in candidates(equation) if one.effect == "Cogging")
    assert best_shape(cogging, equation, equation.values) == pytest.approx(0.01, rel=0.01)
