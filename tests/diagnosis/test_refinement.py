"""A finer form takes the place of a simple effect."""

from types import SimpleNamespace
from typing import Any

import pytest

from lathesim.diagnosis import refinement
from lathesim.diagnosis.belief import Settings


@pytest.mark.parametrize(
    ("relieves", "spoils", "eases"),
    [(True, 0.3, True), (False, 0.3, False), (True, 0.8, False), (True, 0.0, False)],
    ids=["much better", "values are strained still", "hardly better", "nothing feeds back"],
)
def test_a_finer_form_that_eases_strained_values_needs_no_gain(
    relieves: bool, spoils: float, eases: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Springs of some micrometres were explained by a viscosity that the machine cannot have."""
    monkeypatch.setattr(refinement, "of_usual_size", lambda term, values, settings: True)
    made: Any = SimpleNamespace(term=None, model=SimpleNamespace(fitted=SimpleNamespace(by_name={})), relieves=relieves, spoils=spoils)
    assert refinement._eases(made, Settings()) == eases
