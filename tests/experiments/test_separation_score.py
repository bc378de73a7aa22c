"""A verdict is right by the equation that its effects make together, whatever its parts are called."""

import json
from pathlib import Path

import pytest

from tests.experiments.separation.__main__ import rescored
from tests.experiments.separation.score import is_named_alone, is_right
from tests.experiments.separation.ties import Tie

EVEN = Tie("spindle", "reversal", ("spindle_coulomb", "spindle_asymmetric"), 0)
UNEVEN = Tie("spindle", "reversal", ("spindle_coulomb", "spindle_asymmetric"), 1)


def verdict(*names: str, tied: tuple[str, ...] = (), at: str = "spindle") -> dict[str, object]:
    """Return a verdict that names effects at a place, each with the same ties."""
    return {"verdict": "tied" if tied else "named", "effects": [{"effect": name, "at": at, "tied_with": list(tied)} for name in names]}


@pytest.mark.parametrize(
    ("told", "tie", "right"),
    [
        (verdict("AsymmetricFriction"), UNEVEN, True),
        (verdict("CoulombFriction", "ForceOffset", tied=("AsymmetricFriction",)), UNEVEN, True),
        (verdict("ForceOffset", "CoulombFriction"), UNEVEN, True),
        (verdict("CoulombFriction", "ForceOffset", at="motor"), UNEVEN, False),
        (verdict("CoulombFriction"), UNEVEN, False),
        (verdict("ForceOffset"), UNEVEN, False),
        (verdict("AsymmetricFriction", tied=("CoulombFriction",)), UNEVEN, False),
        (verdict("CoulombFriction"), EVEN, True),
        (verdict("CoulombFriction", "ForceOffset"), EVEN, False),
        (verdict("CoulombFriction", tied=("ForceOffset", "AsymmetricFriction")), EVEN, False),
        (verdict("AsymmetricFriction"), EVEN, False),
        ({"verdict": "unknown", "effects": []}, EVEN, False),
    ],
)
def test_verdicts_on_two_frictions(told: dict[str, object], tie: Tie, right: bool) -> None:
    assert is_right(told, tie) == right


def test_an_effect_named_beside_another_is_not_named_alone() -> None:
    assert is_named_alone(verdict("AsymmetricFriction"), UNEVEN)
    assert not is_named_alone(verdict("AsymmetricFriction", tied=("CoulombFriction",)), UNEVEN)


def test_stored_diagnoses_are_scored_once_more(tmp_path: Path) -> None:
    (tmp_path / "exercise").mkdir()
    (tmp_path / "diagnosis_1.json").write_text(json.dumps(verdict("CoulombFriction", "ForceOffset")))
    (tmp_path / "exercise" / "diagnosis_1.json").write_text(json.dumps(verdict("CoulombFriction")))
    old = {
        "rig": "spindle", "family": "reversal", "rivals": list(UNEVEN.rivals), "truth": "spindle_asymmetric",
        "designed": {"seconds": 12.0, "decided": False, "runs": 1}, "exercise": {"seconds": 17.0, "decided": True, "runs": 1},
    }  # fmt: skip
    new = rescored(old, tmp_path)
    assert (new["designed"]["decided"], new["designed"]["seconds"]) == (True, 6.0)
    assert (new["exercise"]["decided"], new["exercise"]["seconds"]) == (False, 34.0)
