"""An effect that promises much by the linear estimate and gains nothing does not keep others from being fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import pytest

from lathesim.diagnosis.candidates.screening import screen
from lathesim.diagnosis.explaining import rounds
from lathesim.diagnosis.explaining.trial import modelled
from lathesim.diagnosis.records.found import Screened
from tests.diagnosis.pushed_table import Hidden, baselines, pair, study

PROMISES = {"TorqueRipple": 1000.0, "CoulombFriction": 800.0, "ForceOffset": 360.0}
"""Gains by the linear estimate [nats]: of an effect that is not there, of the one that is, and of one that is fitted beside it."""


def test_what_promised_nearly_as_much_as_the_best_is_fitted_too(monkeypatch: pytest.MonkeyPatch) -> None:
    def promising(*args: Any) -> tuple[Screened, ...]:
        ranked = [replace(one, gain=PROMISES[one.candidate.name]) for one in screen(*args)]
        return tuple(sorted(ranked, key=lambda one: -one.gain))

    monkeypatch.setattr(rounds, "screen", promising)
    hidden = Hidden(dry=20.0)
    asked = study(*pair(hidden))
    trials: Sequence[rounds.Tried] = rounds.Rounds(asked).on(modelled(asked, (), baselines(hidden)[0]))
    assert [one.candidate.name for one in trials] == list(PROMISES)
    assert max(trials, key=lambda one: one.predicted.nats).candidate.name == "CoulombFriction"
