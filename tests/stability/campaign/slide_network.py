"""The network of the slides on the data of the slides: 2001 cuts to learn from, 501 to be tested on.

The system is theirs (one mode of 100.66 Hz counts); widths are uniform from 0 to that at which 284 of 501 cuts chatter. They do not give
the range of speeds: 2000 to 8000 rpm is assumed. Source: T. Schmitz, H. Cherukuri, Towards self-aware manufacturing (slides).
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.stability.frequency_limit import limit_at
from lathesim.stability.learned_map import network, stable_by
from lathesim.stability.tool_point import Mode, ToolPoint
from tests.stability.campaign.results import collected

_TOOL = ToolPoint((Mode(math.sqrt(1e6 / 2.5) / (2.0 * math.pi), 315.0 / (2.0 * math.sqrt(2.5e6)), 1e6),), (math.cos(math.radians(70.0)),))
_STIFFNESS = 7e8
_SPEEDS = (2000.0, 8000.0)
_WIDEST = 3.78e-3
_POINTS = (2001, 501)


def measured(group: str, number: int) -> dict[str, Any]:
    """Return the share of test cuts named rightly, for points drawn by ``number``."""
    chance = np.random.default_rng((2001, number))
    grid = np.linspace(*_SPEEDS, 1201)
    limits = np.array([limit_at(_TOOL, _STIFFNESS, float(speed)).width for speed in grid])

    def drawn(count: int) -> tuple[Any, Any, Any]:
        speeds, widths = chance.uniform(*_SPEEDS, count), chance.uniform(0.0, _WIDEST, count)
        return speeds, widths, widths < np.interp(speeds, grid, limits)

    learned, tested = drawn(_POINTS[0]), drawn(_POINTS[1])
    model = network(*learned, seed=100 * number)
    right = (stable_by(model, tested[0], tested[1]) > 0.5) == tested[2]
    return {"right": int(right.sum()), "of": len(right), "chatter": int((~tested[2]).sum())}


def run(draws: int, path: Path) -> None:
    """Measure so many draws of the points and print what they show."""
    rows = collected(path, (("slides", number) for number in range(draws)), measured)
    for row in rows:
        share = row["right"] / row["of"]
        print(
            f"draw {row['case']}: {row['right']} of {row['of']} right ({share:.3f}), {row['chatter']} of them chatter, {row['cpu_s']} s CPU"
        )
