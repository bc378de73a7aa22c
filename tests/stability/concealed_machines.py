"""How near the map that learns comes to the best cut of concealed machines.

    python -m tests.stability.concealed_machines [CUTS] [MACHINES] [mute]

Each machine has one mode drawn around 100 Hz (10 %), 5 % damping (30 %), stiffness and cutting stiffness (20 % each), and answers each
cut once. With ``mute`` the chatter frequency of a cut that failed is not told.
"""

from __future__ import annotations

import math
import sys

import numpy as np

from lathesim.stability.learning.belief import Prior, begin, learn
from lathesim.stability.learning.next_cut import Range, best_stable, next_cut
from lathesim.stability.learning.tried_cuts import TriedCut
from lathesim.stability.limits.frequency_limit import limit_at
from lathesim.stability.tool_point.modes import Mode, ToolPoint

PRIOR = Prior(np.log([100.0, 0.05, 0.01]), np.array([0.1, 0.3, math.hypot(0.2, 0.2)]))
INSIDE = Range(np.linspace(1000.0, 4000.0, 121), 6e-3)


def shares(machine: int, cuts: int, *, heard: bool, chance: np.random.Generator) -> list[float]:
    """Return the share of the best stable removal rate after each cut on a machine drawn by chance."""
    mode = Mode(
        100.0 * (1.0 + 0.1 * chance.standard_normal()),
        0.05 * math.exp(0.3 * chance.standard_normal()),
        1e7 * math.exp(0.2 * chance.standard_normal()),
    )
    stiffness = 1e9 * math.exp(0.2 * chance.standard_normal())
    tool = ToolPoint((mode,), (1.0,))
    best = max(speed * min(limit_at(tool, stiffness, speed).width, INSIDE.widest) for speed in np.linspace(1000.0, 4000.0, 601).tolist())
    belief, found = begin(PRIOR, machine + 1), []
    for _ in range(cuts):
        asked = next_cut(belief, INSIDE)
        limit = limit_at(tool, stiffness, asked.speed)
        stable = asked.width < limit.width
        heard_at = limit.frequency + chance.standard_normal() if heard and not stable else math.nan
        belief = learn(belief, TriedCut(asked.speed, asked.width, stable, heard_at))
        found.append(best_stable(belief.cuts) / best)
    return found


def main(cuts: int = 8, machines: int = 50, heard: bool = True) -> None:
    """Print the share of machines that reach 90 and 95 % of the best after each cut."""
    chance = np.random.default_rng(11)
    table = np.array([shares(machine, cuts, heard=heard, chance=chance) for machine in range(machines)])
    print("cuts   90 %   95 %  median")
    for count in range(1, cuts + 1):
        column = table[:, count - 1]
        print(f"{count:>4}{100 * (column >= 0.9).mean():>6.0f}%{100 * (column >= 0.95).mean():>6.0f}%{np.median(column):>8.3f}")


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[1:] if word.isdigit()]
    main(*numbers, heard="mute" not in sys.argv)
