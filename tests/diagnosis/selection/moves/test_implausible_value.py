"""One value of the lesson that is further off than it holds possible is told as that, as long as it is one of a machine."""

import pytest

from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.search import search
from lathesim.effects.effect import Effect
from lathesim.effects.offset_and_gain import ScaleFactorError
from tests.diagnosis.pushed_table import MASS, Hidden, experiments, machine, recording


def found_with(mass: float, sure: float, *effects: type[Effect]) -> SearchResult:
    """Return what is found of a table of another mass, where the lesson is so sure of it."""
    hidden = Hidden(mass=mass)
    return search(*experiments(recording(hidden, seed=1), recording(hidden, seed=2), effects=effects, of=machine(sure=sure)))


def test_a_load_on_the_table_is_a_value_far_off() -> None:
    found = found_with(2.0 * MASS, 0.05)
    assert found.far_off[0] == "x_axis.mass"
    assert found.model.fitted.by_name["x_axis.mass"] == pytest.approx(2.0 * MASS, rel=0.02)


def test_a_value_beyond_any_machine_is_not_told() -> None:
    """Ten times the mass: no slip of the pen and no load does that, and a value as free as this one would explain anything."""
    assert found_with(10.0 * MASS, 0.5).far_off == ()


def test_a_payload_is_likelier_than_an_encoder_that_is_off_by_a_fifth() -> None:
    """With a viscosity that may be a fifth more, places that are all a fifth too small do as well; that is told."""
    found = found_with(1.25 * MASS, 0.05, ScaleFactorError)
    assert found.far_off[0] == "x_axis.mass"
    assert found.model.candidates == ()
    assert "times the true value at x_encoder" in found.factor_instead
