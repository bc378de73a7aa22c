"""Which of several trials that cannot be told apart is taken."""

from types import SimpleNamespace
from typing import Any

import pytest

from lathesim.diagnosis.method import Method
from lathesim.diagnosis.selection.acceptance import simplest
from lathesim.effects.identification import Identification


def trial(name: str, gain: float, values: int, catalogue: int, spare: int = 0, share: float = 0.9) -> Any:
    effect = SimpleNamespace(catalogue=catalogue, identification=Identification())
    candidate = SimpleNamespace(name=name, parameters=("value",) * values, spare=("value",) * spare, effect=effect, second=False)
    return SimpleNamespace(candidate=candidate, full_band_gain=gain, full_band_validation_gain=gain, share_of_all=share)


BEST = trial("BaseRocking", 1500.0, 3, 15)


@pytest.mark.parametrize(
    ("other", "taken"),
    [
        (trial("AxialResonance", 1499.0, 4, 13, spare=1), "AxialResonance"),
        (trial("AxialResonance", 1499.0, 4, 13), "BaseRocking"),
        (trial("AxialResonance", 1200.0, 3, 13), "BaseRocking"),
        (trial("TorsionalWindUp", 1490.0, 1, 14), "TorsionalWindUp"),
        (trial("TorsionalWindUp", 1490.0, 1, 14, share=0.5), "BaseRocking"),
        (trial("TorsionalWindUp", 1200.0, 1, 14, share=0.99), "TorsionalWindUp"),
        (trial("TorsionalWindUp", 1200.0, 2, 14, share=0.99), "BaseRocking"),
        (trial("TorsionalWindUp", 1200.0, 1, 14, share=0.985), "BaseRocking"),
        (trial("TorsionalWindUp", 300.0, 1, 14, share=0.999), "BaseRocking"),
    ],
    ids=[
        "the commoner of equals, a value it may do without",
        "one it needs",
        "clearly worse",
        "fewer values",
        "takes away less",
        "far fewer values and as little left",
        "one value fewer",
        "more left",
        "far less gained, in another channel",
    ],
)
def test_of_trials_that_cannot_be_told_apart_the_simplest_is_taken(other: Any, taken: str) -> None:
    best = trial("BaseRocking", 1500.0, 3, 15, share=0.993) if other.share_of_all > 0.95 else BEST
    assert simplest([best, other], Method()).candidate.name == taken
