"""What an effect must say of itself: each mistake is told where it is made, with what to do."""

import pytest

from lathesim.component import Input, Output, Parameter
from lathesim.effects.effect import Effect
from lathesim.effects.force_over_turn import ChipSegmentation
from lathesim.errors import ComponentError


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({}, ""),
        ({"family": " "}, "says nothing as its family"),
        ({"neutral": {}}, "has no neutral values"),
        ({"neutral": {"levle": 0.0}}, "neutral names 'levle', which is no parameter"),
        ({"resonance": "frequenzy"}, "resonance names 'frequenzy', which is no parameter"),
        ({"neutral": {"level": -1.0}}, "lies outside 0 to inf"),
        ({"along": "outgoin"}, "along names 'outgoin', which is no output"),
        ({"site": "effort", "also_at": {"flow": ("speed", "outgoing")}}, "declares no input 'speed' for the port 'flow'"),
    ],
    ids=[
        "sound",
        "no family",
        "no neutral",
        "misspelt neutral",
        "misspelt resonance",
        "neutral out of bounds",
        "misspelt output",
        "no such input",
    ],
)
def test_each_mistake_is_told(changes: dict[str, object], told: str) -> None:
    body = {
        "incoming": Input("{signal}", doc="before"),
        "outgoing": Output("{signal}", doc="behind"),
        "level": Parameter("{signal}", 0.0, low=0.0, doc="size"),
        "family": "constants",
        "neutral": {"level": 0.0},
        "fingerprint": "A constant.",
        "experiment": "Wait.",
        "source": "Assumed.",
        "output": staticmethod(lambda incoming, level: incoming + level),
    }
    if not told:
        assert type("Constant", (Effect,), {**body, **changes}).pairs() == {"effort": ("incoming", "outgoing")}
        return
    with pytest.raises(ComponentError, match=told):
        type("Constant", (Effect,), {**body, **changes})


def test_chips_tell_the_length_that_was_cut() -> None:
    assert type(ChipSegmentation.declarations[ChipSegmentation.identification.along]) is Output
