"""How near the map that learns comes to the best cut of concealed machines, beside a grid and two learners without physics.

Each machine has one mode drawn around 100 Hz (10 %), 5 % damping (30 %), stiffness and cutting stiffness (20 % each), and answers each
cut once. The network and the Gaussian process choose their cuts by the same rule, from their own probabilities, after four cuts spread
over the range. Twenty further machines have a second mode that the map does not know of.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.stability.belief import Belief, Prior, TriedCut, begin, learn
from lathesim.stability.frequency_limit import limit_at
from lathesim.stability.learned_map import adequacy, gaussian_process, limits_after, network, stable_by
from lathesim.stability.next_cut import CutRange, best_stable, next_cut
from lathesim.stability.tool_point import Mode, ToolPoint
from tests.stability.campaign.results import collected

PRIOR = Prior(np.log([100.0, 0.05, 0.01]), np.array([0.1, 0.3, math.hypot(0.2, 0.2)]))
INSIDE = CutRange(np.linspace(1000.0, 4000.0, 121), 6e-3)
CUTS = 20
GROUPS = ("heard", "mute", "grid", "second", "process", "network")
_CALIBRATED_AFTER = {"heard": 8, "mute": 10}
_POINTS = 400
_SPREAD = ((1500.0, 1.5e-3), (3250.0, 3.0e-3), (2250.0, 1.0e-3), (3750.0, 4.5e-3))
_RISK = 0.6
_GRID_STEP = 0.25e-3


@dataclass(frozen=True)
class Machine:
    """A concealed machine: its tool point and cutting stiffness [N/m^2]."""

    tool: ToolPoint
    stiffness: float

    def cut(self, speed: float, width: float, heard: np.random.Generator | None = None) -> TriedCut:
        """Make a cut; ``heard`` draws the noise of the chatter frequency, which is otherwise not told."""
        limit = limit_at(self.tool, self.stiffness, speed)
        stable = width < limit.width
        return TriedCut(speed, width, stable, limit.frequency + heard.standard_normal() if heard and not stable else math.nan)

    def limits(self, speeds: Any) -> Any:
        """Return the limits [m] at speeds [rpm]."""
        return np.array([limit_at(self.tool, self.stiffness, float(speed)).width for speed in speeds])

    def best(self) -> float:
        """Return the best stable speed times width [rpm*m] within the range."""
        speeds = np.linspace(INSIDE.speeds[0], INSIDE.speeds[-1], 601)
        return float((speeds * np.minimum(self.limits(speeds), INSIDE.widest)).max())


def machine(number: int, *, second: bool = False) -> Machine:
    """Return a machine drawn by its number; with a ``second`` mode above the first, of about its stiffness."""
    chance = np.random.default_rng((29, number, int(second)))
    mode = Mode(
        100.0 * (1.0 + 0.1 * chance.standard_normal()),
        0.05 * math.exp(0.3 * chance.standard_normal()),
        1e7 * math.exp(0.2 * chance.standard_normal()),
    )
    modes = [mode]
    stiffness = 1e9 * math.exp(0.2 * chance.standard_normal())
    if second:
        further = Mode(
            mode.frequency * chance.uniform(1.3, 3.0),
            0.05 * math.exp(0.3 * chance.standard_normal()),
            mode.stiffness * chance.uniform(0.6, 1.2),
        )
        modes.append(further)
    return Machine(ToolPoint(tuple(modes), (1.0,) * len(modes)), stiffness)


def measured(group: str, number: int) -> dict[str, Any]:
    """Return what a learner reaches on a machine."""
    if group == "grid":
        return _by_grid(machine(number))
    if group == "second":
        return _with_a_second_mode(number)
    if group in ("network", "process"):
        return _without_physics(group, machine(number))
    return _by_the_map(group, number)


def _by_the_map(group: str, number: int) -> dict[str, Any]:
    hidden = machine(number)
    chance = np.random.default_rng((30, number)) if group == "heard" else None
    best = hidden.best()
    belief, shares, scores = begin(PRIOR, number + 1), [], {}
    for count in range(1, CUTS + 1):
        asked = next_cut(belief, INSIDE)
        belief = learn(belief, hidden.cut(asked.speed, asked.width, chance))
        shares.append(best_stable(belief.cuts) / best)
        if count == _CALIBRATED_AFTER[group]:
            scores = _probabilities(belief, hidden, number)
    return {"shares": shares, **scores}


def _probabilities(belief: Belief, hidden: Machine, number: int) -> dict[str, Any]:
    """Return what each learner says of cuts spread by chance over the range, after the same cuts, and what is true."""
    chance = np.random.default_rng((31, number))
    speeds, widths = chance.uniform(1000.0, 4000.0, _POINTS), chance.uniform(0.0, INSIDE.widest, _POINTS)
    said = {"map": belief.stable_probability(speeds, widths)}
    cuts = belief.cuts
    if len({cut.stable for cut in cuts}) > 1:
        trained = network(np.array([cut.speed for cut in cuts]), np.array([cut.width for cut in cuts]), [cut.stable for cut in cuts])
        said["network"] = stable_by(trained, speeds, widths)
        said["process"] = stable_by(gaussian_process(cuts), speeds, widths)
    return {
        "true": (widths < hidden.limits(speeds)).astype(int).tolist(),
        "said": {name: np.round(values, 5).tolist() for name, values in said.items()},
    }


def _by_grid(hidden: Machine) -> dict[str, Any]:
    """Widen the cut in steps at each of seven speeds until it chatters: from the narrowest width, or from what would beat the best so far.

    The speeds are both ends of the range and five between, or the middles of seven parts of it.
    """
    low, high = float(INSIDE.speeds[0]), float(INSIDE.speeds[-1])
    ends, middles = np.linspace(low, high, 7), low + (high - low) * (np.arange(7) + 0.5) / 7.0
    found: dict[str, Any] = {}
    for name, speeds, beating in (("", ends, False), (" beating", ends, True), (" beating, middles", middles, True)):
        best, asked = 0.0, 0
        for speed, limit in zip(speeds.tolist(), hidden.limits(speeds).tolist(), strict=True):
            for step in itertools.count(1 + int(beating * best / speed / _GRID_STEP)):
                width = step * _GRID_STEP
                if width > INSIDE.widest:
                    break
                asked += 1
                if width >= limit:
                    break
                best = max(best, speed * width)
        found |= {f"cuts{name}": asked, f"share{name}": best / hidden.best()}
    return found


def _without_physics(group: str, hidden: Machine) -> dict[str, Any]:
    cuts: list[TriedCut] = []
    shares, best = [], hidden.best()
    speeds, widths = (grid.ravel() for grid in np.meshgrid(INSIDE.speeds[::4], np.linspace(0.1e-3, INSIDE.widest, 60)))
    for count in range(CUTS):
        if count < len(_SPREAD):
            asked = _SPREAD[count]
        elif len({cut.stable for cut in cuts}) < 2:
            factor = 1.5 if cuts[0].stable else 0.5
            asked = (cuts[-1].speed, min(cuts[-1].width * factor, INSIDE.widest))
        else:
            model = gaussian_process(cuts) if group == "process" else network(
                np.array([cut.speed for cut in cuts]), np.array([cut.width for cut in cuts]), [cut.stable for cut in cuts], restarts=2
            )  # fmt: skip
            stable = stable_by(model, speeds, widths)
            gain = stable * np.maximum(speeds * widths - best_stable(cuts), 0.0)
            place = int(np.argmax(np.where(1.0 - stable <= _RISK, gain, -1.0)))
            asked = (float(speeds[place]), float(widths[place]))
        cuts.append(hidden.cut(*asked))
        shares.append(best_stable(cuts) / best)
    return {"shares": shares}


def _with_a_second_mode(number: int) -> dict[str, Any]:
    hidden = machine(number, second=True)
    chance = np.random.default_rng((32, number))
    belief, told, best = begin(PRIOR, number + 1), 0, hidden.best()
    true, ratios = hidden.limits(INSIDE.speeds), []
    for count in range(1, CUTS + 1):
        asked = next_cut(belief, INSIDE)
        belief = learn(belief, hidden.cut(asked.speed, asked.width, chance))
        good = adequacy(belief)
        told = told or (0 if good.good else count)
        confident = np.minimum(limits_after(belief, good, INSIDE)[0], INSIDE.widest)
        ratios.append(float((confident / true).max()))
    return {"told": told, "good_at_end": good.good, "reason": good.reason, "too_high": ratios, "share": best_stable(belief.cuts) / best}


def calibration_error(said: Any, true: Any, bins: int = 10) -> float:
    """Return the expected calibration error: the mean over bins of |share that is true - mean of what is said|, by their sizes."""
    place = np.minimum((said * bins).astype(int), bins - 1)
    return float(
        sum(abs(true[place == b].mean() - said[place == b].mean()) * np.mean(place == b) for b in range(bins) if (place == b).any())
    )


def run(machines: Sequence[int], path: Path, only: str = "") -> None:
    """Measure so many machines with each learner, or with one, and print the table."""
    groups = (only,) if only else GROUPS
    rows = {}
    for group in groups:
        asked = machines[:20] if group == "second" else machines
        rows[group] = collected(path, ((group, number) for number in asked), measured)
    titles = {"heard": "map, chatter frequency told", "mute": "map, not told", "process": "Gaussian process", "network": "network 6-6"}
    print(
        f"{'share of machines that reach':<32}"
        + "".join(f"{text:>16}" for text in ("90 % after 8", "90 % after 10", "95 % after 20", "median after 8"))
    )
    for group, title in titles.items():
        if group not in rows:
            continue
        table = np.array([row["shares"] for row in rows[group]])
        columns = [(table[:, 7] >= 0.9).mean(), (table[:, 9] >= 0.9).mean(), (table[:, 19] >= 0.95).mean(), np.median(table[:, 7])]
        print(f"{title:<32}" + "".join(f"{100.0 * value:>15.0f}%" for value in columns))
    if "grid" in rows:
        for way in rows["grid"][0]:
            if way.startswith("cuts"):
                cuts, share = (np.median([row[name] for row in rows["grid"]]) for name in (way, way.replace("cuts", "share")))
                print(f"grid of 7 speeds, {way}: median {cuts:.0f} cuts reach {100.0 * share:.0f} %")
    for group in (name for name in ("heard", "mute") if name in rows):
        print(f"\nafter {_CALIBRATED_AFTER[group]} cuts, {titles[group]}: calibration error and Brier score at cuts spread by chance")
        for name in ("map", "network", "process"):
            with_it = [row for row in rows[group] if name in row["said"]]
            said = np.concatenate([row["said"][name] for row in with_it])
            true = np.concatenate([row["true"] for row in with_it]).astype(float)
            print(f"  {name:<10}{calibration_error(said, true):>8.4f}{np.mean((said - true) ** 2):>8.4f}   ({len(with_it)} machines)")
    if "second" not in rows:
        return
    second = rows["second"]
    told = sum(row["told"] > 0 for row in second)
    high = sum(row["too_high"][-1] > 1.2 for row in second)
    anytime = sum(max(row["too_high"][7:]) > 1.2 for row in second)
    print(f"\nsecond mode: said on {told} of {len(second)}; confident limits over 20 % too high on {high} after 20 cuts, ever on {anytime}")
