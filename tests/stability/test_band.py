"""The band of the lobes against what is known of its edges."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lathesim.stability import uncertain_cut
from lathesim.stability.frequency_limit import limit_at, limit_of_response
from lathesim.stability.lesson_settings import Cut
from lathesim.stability.tool_point import FrequencyResponse, Mode, ToolPoint
from lathesim.stability.uncertain_cut import Spread, band

SPEEDS = (1000.0, 3300.0, 5000.0)
TOOL = ToolPoint((Mode(300.0, 0.03, 2e7, 0.4),), (0.7,))
EDGE = 1.959964


def factor(deviation: float) -> float:
    """Return the 97.5 % quantile of what is drawn log-normally around 1."""
    return math.exp(EDGE * math.sqrt(math.log1p(deviation**2)))


@pytest.mark.parametrize("damping", [0.0, 1e5])
def test_the_edges_are_the_limits_at_the_edges_of_a_damping_ratio(damping: float) -> None:
    found = band(Cut(TOOL, 1e9, damping, 0.036), [Spread("damping", 1, 0.3)], SPEEDS)
    assert found.apart <= uncertain_cut.CLOSE
    for row, times in ((0, 1.0 / factor(0.3)), (1, 1.0), (2, factor(0.3))):
        tool = ToolPoint((Mode(300.0, 0.03 * times, 2e7, 0.4),), TOOL.factors)
        right = [limit_at(tool, 1e9, speed, process_damping=damping, diameter=0.036).width for speed in SPEEDS]
        assert found.edges[row] == pytest.approx(right, rel=0.03)


def test_a_measured_response_feels_the_process_damping() -> None:
    lines = np.arange(20.0, 2000.0, 2.0)
    response = FrequencyResponse(lines, TOOL.receptance(lines) / 0.7)
    direction = 0.4
    cut = Cut(response, 1e9, 1e5, 0.036, factor=0.7, direction=direction)
    found = band(cut, [Spread("stiffness", 0, 0.2)], SPEEDS).edges
    normal = math.cos(direction) ** 2
    right = [limit_of_response(response, 0.7, normal, 1e9, speed, process_damping=1e5, diameter=0.036).width for speed in SPEEDS]
    for row, times in ((0, 1.0 / factor(0.2)), (1, 1.0), (2, factor(0.2))):
        assert found[row] == pytest.approx([times * width for width in right], rel=0.01)


def test_the_bound_on_the_draws_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(uncertain_cut, "_FEWEST", 8)
    monkeypatch.setattr(uncertain_cut, "_MOST", 16)
    found = band(Cut(TOOL, 1e9), [Spread("damping", 0, 0.5), Spread("frequency", 0, 0.1), Spread("stiffness", 1, 0.5)], SPEEDS)
    assert found.draws == 32
    assert found.apart > uncertain_cut.CLOSE
