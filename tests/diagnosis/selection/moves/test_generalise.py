"""A finer form takes the place of a simple effect."""

from types import SimpleNamespace
from typing import Any

import pytest

from lathesim.diagnosis.method import Method
from lathesim.diagnosis.selection.moves import generalise as refinement
from tests.diagnosis.stand_ins import effect_of


@pytest.mark.parametrize(
    ("restores_plausibility", "closed_loop_degradation", "eases"),
    [(True, 0.3, True), (False, 0.3, False), (True, 0.8, False), (True, 0.0, False)],
    ids=["much better", "values are strained still", "hardly better", "nothing feeds back"],
)
def test_a_finer_form_that_eases_strained_values_needs_no_gain(
    restores_plausibility: bool, closed_loop_degradation: float, eases: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Springs of some micrometres were explained by a viscosity that the machine cannot have."""
    monkeypatch.setattr(refinement, "of_usual_size", lambda candidate, values, method, **_: True)
    made: Any = SimpleNamespace(
        candidate=None,
        model=SimpleNamespace(fitted=SimpleNamespace(by_name={})),
        restores_plausibility=restores_plausibility,
        closed_loop_degradation=closed_loop_degradation,
    )
    assert refinement._restores_plausibility(made, Method()) == eases


@pytest.mark.parametrize(
    ("family", "gain", "worth"),
    [("once per turn", 500.0, True), ("once per turn", 20.0, False), ("reversal", 500.0, False)],
    ids=["a wave that is surely there", "chance", "no wave"],
)
def test_a_wave_is_fitted_though_it_promises_little_of_the_rest(
    family: str, gain: float, worth: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Over hundreds of turns its length has to be right to a thousandth, and a search begins beside it."""
    monkeypatch.setattr(refinement, "is_implausible", lambda fitted, **_: False)
    item: Any = SimpleNamespace(candidate=SimpleNamespace(effect=effect_of(family)), gain=gain, share=0.02)
    model: Any = SimpleNamespace(candidates=("another",), fitted=None)
    laboratory: Any = None
    assert refinement.may_be_worth(laboratory, model, item, Method()) == worth
