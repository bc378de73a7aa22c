"""Tap, couple, fit, predict, cut: predicted limits against those found by cutting in the engine."""

from __future__ import annotations

import pytest

from tests.stability.campaign.cutting import measured


@pytest.mark.slow
@pytest.mark.parametrize("group", ["tap", "couple"])
def test_limits_predicted_from_measurements_are_those_of_cutting(group: str) -> None:
    for _, _, ratio in measured(group, 1)["limits"]:
        assert ratio == pytest.approx(1.0, abs=0.03)
