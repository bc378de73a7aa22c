"""What acts late and what shows late is a tie where only a noise that was taken for white had told them apart."""

from types import SimpleNamespace
from typing import Any

import pytest

from lathesim.diagnosis.method import Method
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection import lag_ties as late_rivals
from lathesim.diagnosis.selection.lag_ties import ties_of_late_effects
from lathesim.identification.records.model import Trial
from tests.diagnosis.stand_ins import effect_of


def trial(name: str, gain: float, score: float, family: str = "lag") -> Trial:
    """Return a trial of one late value, and what it would come to with forces that may be slow."""
    candidate: Any = SimpleNamespace(
        name=name, part=name, at="x_axis", effect=effect_of(family), family=family, parameters=(f"{name}.delay",)
    )
    model: Any = SimpleNamespace(candidates=(candidate,), fitted=SimpleNamespace(score=score, constant={}))
    return Trial(candidate, model, gain, gain, 10.0, 0.9, 0.9, full_band_gain=gain, full_band_validation_gain=gain)


@pytest.mark.parametrize(
    ("rival", "tied"),
    [
        (trial("lag", 18_100.0, 99_981.0), True),
        (trial("lag", 18_100.0, 99_000.0), False),
        (trial("lag", 15_000.0, 99_981.0), False),
        (trial("friction", 18_100.0, 99_981.0, family="reversal"), False),
    ],
    ids=["alike with slow forces", "worse with them too", "never near", "not late"],
)
def test_only_the_colour_of_the_forces_tells_them_apart(rival: Trial, tied: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(late_rivals, "with_start", lambda fitted, **_: [fitted])
    monkeypatch.setattr(late_rivals, "fit", lambda sensed, free, *given, **kinds: free[0])
    own = trial("filter", 18_900.0, 100_000.0)
    found = SearchResult(own.model, own.model, {"filter": [own, rival]})
    laboratory: Any = SimpleNamespace(experiment=SimpleNamespace(sensed=None), progress=lambda text: None)
    found = ties_of_late_effects(laboratory, found, Method())
    first, second = found.trials["filter"]
    assert first is own
    assert (second.full_band_gain == own.full_band_gain) == tied
    assert second.candidate is rival.candidate
