"""How far apart rivals stay when each is refitted to the other: T-optimality, over what is uncertain, per second of program.

For rival a with sizes drawn as they may be, T(a, b) is the smallest sum of squares, in noise levels, that rival b leaves of what a would
make the recording read, with the machine's uncertain values free within what the lesson says of them:

    T(a, b) = min over p of  |W (y_a - y_b(p))|^2 + sum ((p - given)/deviation)^2

The logarithm of the ratio of likelihoods is then about normal, N(T/2, T). A program is worth the chance that it decides, less the price
of its seconds. Source: Atkinson, Fedorov, Biometrika 62 (1975), 57; Lindley, Ann. Math. Statist. 27 (1956), 986.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.experiments.design.laying import Laid
from lathesim.experiments.design.rivals import Rival
from lathesim.experiments.design.scene import Scene

DECIDES = 3.4
"""Logarithm of the likelihood ratio from which on a run decides: 30 to 1."""
_EFFICIENCY = 2e-5
"""Share of T that a diagnosis makes use of: it tries many effects and doubts what a likelihood believes. From four sealed cases of lesson
12: at T = 4e5 two of two were named, at 6e5 one of two."""
_BEYOND = 10.0
"""Ranges beyond its usual bounds to which a rival may go when it is refitted: an unusual size is no proof against it."""
NESTED = 30.0
"""T below which a rival does what another one does: not even a likelihood with all values known would be sure; assumed."""
PRICE = 0.005
"""What a second of program costs, as a share of a decision; assumed."""
_STEP = 0.25
"""Step of the slopes, in standard deviations or as a share of a size: large against rounding, small against curvature."""
_HELD = 1e3
"""Largest number of noise levels that counts of one stretch: beyond, no more is told."""


Places = dict[tuple[int, int], tuple[int, list[tuple[int, float]]]]
"""(rival, draw) -> its row, and the (value, step) of the rows behind it, one for each slope."""


@dataclass(frozen=True)
class Worth:
    """What a program is worth: the chance to decide (mean, and for each rival), and T of each pair at each draw (a, b, draws)."""

    chance: float
    by_rival: tuple[float, ...]
    apart: FloatArray
    seconds: float

    @property
    def score(self) -> float:
        """The chance to decide, less the price of the seconds."""
        return self.chance - PRICE * self.seconds


@dataclass(frozen=True)
class Conditions:
    """What an ablation may take away: the average over draws, the refit of the rivals, the price of seconds, the floor that stays."""

    average: bool = True
    refit: bool = True
    price: bool = True
    steady_floor: bool = True


def chance_to_decide(apart: FloatArray) -> FloatArray:
    """Return the chance that the likelihood ratio gets above ``DECIDES`` where rivals are ``apart`` (T)."""
    from scipy.special import ndtr

    usable = np.maximum(_EFFICIENCY * apart, 1e-12)
    return np.asarray(ndtr((usable / 2.0 - DECIDES) / np.sqrt(usable)))


def worths(scene: Scene, programs: Sequence[Laid], floors: FloatArray, draws: int, conditions: Conditions, refits: int = 0) -> list[Worth]:
    """Return what programs are worth: all their runs are one batch; ``refits`` further rounds follow the rivals where they bend."""
    used = draws if conditions.average else 1
    rows, where = _rows(scene, used)
    found = scene.readings(programs, [rows] * len(programs))
    return [
        _worth(
            scene, program, readings, rows, where, used, scene.weight(program, floors, steady=conditions.steady_floor), conditions, refits
        )
        for program, readings in zip(programs, found, strict=True)
    ]


def _rows(scene: Scene, draws: int) -> tuple[FloatArray, Places]:
    """Return the values to run (members, names), and where each rival's draw and its slopes stand: (first, [(name, step), ...])."""
    rows: list[FloatArray] = []
    where: Places = {}
    for number, rival in enumerate(scene.rivals):
        for draw in range(draws):
            base = scene.values(rival, rival.sizes[draw])
            steps = _steps(scene, rival, base)
            where[number, draw] = (len(rows), steps)
            rows.append(base)
            for column, step in steps:
                moved = base.copy()
                moved[column] += step
                rows.append(moved)
    return np.array(rows), where


def _steps(scene: Scene, rival: Rival, base: FloatArray) -> list[tuple[int, float]]:
    """Return which values are refitted for a rival, with the step of each slope."""
    steps = [(place, _STEP * float(size)) for place, size in enumerate(scene.deviation)]
    if rival.term is None:
        return steps
    for place, column in enumerate(scene.columns(rival)):
        low, high = float(rival.term.low[place]), float(rival.term.high[place])
        spread = float(rival.term.usual[place] - rival.term.least[place])
        step = _STEP * (abs(base[column]) or abs(spread) or 1.0)
        steps.append((column, step if base[column] + step <= high else -min(step, base[column] - low)))
    return [(column, step) for column, step in steps if step != 0.0]


def _worth(
    scene: Scene, program: Laid, readings: FloatArray, rows: FloatArray, where: Places, draws: int, weight: FloatArray,
    conditions: Conditions, refits: int,
) -> Worth:  # fmt: skip
    count = len(scene.rivals)
    scaled = (readings * weight[None, :, None]).reshape(len(readings), -1)
    apart = np.zeros((count, count, draws))
    for a in range(count):
        for draw in range(draws):
            truth = scaled[where[a, draw][0]]
            for b in range(count):
                if a != b:
                    starts = [_refitted(scene, scaled, truth, rows, where[b, other], conditions) for other in range(draws)]
                    best = min(starts, key=lambda pair: pair[0])
                    if refits and conditions.refit:
                        alike = [(np.inf, row) for row in _alike(scene, a, b, draw)]
                        ends = [_followed(scene, program, truth, b, start, weight, refits) for start in (best, *alike)]
                        best = min(ends, key=lambda pair: pair[0])
                    apart[a, b, draw] = best[0]
    apart = _by_simplicity(apart)
    others = np.array([[min(apart[a, b, draw] for b in range(count) if b != a) for draw in range(draws)] for a in range(count)])
    chances = chance_to_decide(others)
    return Worth(float(chances.mean()), tuple(float(row.mean()) for row in chances), apart, program.seconds)


def _by_simplicity(apart: FloatArray) -> FloatArray:
    """Return T with that of the other way round where one rival holds the other as a special case: of two that fit, the simpler counts."""
    other = apart.transpose(1, 0, 2)
    return np.asarray(np.where(apart < NESTED, np.maximum(apart, other), apart))


def _refitted(
    scene: Scene, scaled: FloatArray, truth: FloatArray, rows: FloatArray, place: tuple[int, list[tuple[int, float]]],
    conditions: Conditions,
) -> tuple[float, FloatArray]:  # fmt: skip
    """Return T after a linear refit of a rival, and the values that it ends at."""
    first, steps = place
    base = scaled[first]
    row = rows[first]
    difference = np.clip(np.nan_to_num(truth - base, nan=_HELD), -_HELD, _HELD)
    if not conditions.refit or not steps:
        return float(difference @ difference), row
    slopes = np.array([(scaled[first + 1 + number] - base) / step for number, (_, step) in enumerate(steps)]).T
    shift, cost = _least(scene, slopes, difference, steps, row)
    moved = row.copy()
    for (column, _), amount in zip(steps, shift, strict=True):
        moved[column] += amount
    return cost, moved


def _alike(scene: Scene, a: int, b: int, draw: int) -> list[FloatArray]:
    """Return values at which a rival is as much like another one as the names of its parameters allow: where one effect holds the other
    as a special case, or both have a pitch and a phase, no descent from elsewhere finds that. Phases are also turned by half a turn:
    one effect may count as a push what the other counts as a drag."""
    first, second = scene.rivals[a], scene.rivals[b]
    row = scene.values(second, second.sizes[draw])
    if first.term is None or second.term is None:
        if second.term is not None:
            row[scene.columns(second)] = second.term.neutral
        return [row]
    own = {name.partition(".")[2]: value for name, value in zip(first.term.parameters, first.sizes[draw], strict=True)}
    for place, column in enumerate(scene.columns(second)):
        item = second.term.parameters[place].partition(".")[2]
        neutral = second.term.effect.neutral.get(item)
        if item in own:
            row[column] = min(max(own[item], float(second.term.low[place])), float(second.term.high[place]))
        elif neutral is not None:
            row[column] = neutral
    phases = [scene.columns(second)[place] for place, name in enumerate(second.term.parameters) if name.endswith("phase")]
    if not phases:
        return [row]
    turned = row.copy()
    turned[phases] += np.where(turned[phases] > 0.0, -np.pi, np.pi)
    return [row, turned]


def _least(
    scene: Scene, slopes: FloatArray, difference: FloatArray, steps: Sequence[tuple[int, float]], row: FloatArray
) -> tuple[FloatArray, float]:
    """Return the shift of the values with the least sum of squares, and that sum; rivals' sizes are kept near where slopes hold."""
    pull = np.zeros((len(steps), len(steps)))
    offset = np.zeros(len(steps))
    uncertain = len(scene.uncertain)
    for number, (column, step) in enumerate(steps):
        width = float(scene.deviation[column]) if column < uncertain else 4.0 * abs(step)
        pull[number, number] = 1.0 / width
        if column < uncertain:
            offset[number] = -(row[column] - scene.given[column]) / width
    stacked = np.vstack([np.nan_to_num(slopes), pull])
    goal = np.concatenate([difference, offset])
    shift = np.linalg.lstsq(stacked, goal, rcond=None)[0]
    left = goal - stacked @ shift
    return shift, float(left @ left)


def _followed(
    scene: Scene, program: Laid, truth: FloatArray, rival: int, start: tuple[float, FloatArray], weight: FloatArray, rounds: int
) -> tuple[float, FloatArray]:
    """Return T and values after further rounds of the refit, each with slopes taken where it stands; the best end counts."""
    term = scene.rivals[rival].term
    columns = scene.columns(scene.rivals[rival])
    best: tuple[float, FloatArray] | None = None
    row = start[1].copy()
    for _ in range(rounds):
        if term is not None:
            reach = _BEYOND * (term.high - term.low)
            row[columns] = np.clip(row[columns], np.where(term.low < 0.0, term.low - reach, term.low), term.high + reach)
        steps = _steps(scene, scene.rivals[rival], row)
        moved = np.array([row, *[row + step * (np.arange(len(row)) == column) for column, step in steps]])
        scaled = (scene.readings([program], [moved])[0] * weight[None, :, None]).reshape(len(moved), -1)
        length = min(scaled.shape[1], len(truth))
        difference = np.clip(np.nan_to_num(truth[:length] - scaled[0][:length], nan=_HELD), -_HELD, _HELD)
        penalty = np.square((row[: len(scene.uncertain)] - scene.given[: len(scene.uncertain)]) / scene.deviation).sum()
        cost = float(difference @ difference + penalty)
        if best is None or cost < best[0]:
            best = (cost, row.copy())
        slopes = np.array([(scaled[1 + number][:length] - scaled[0][:length]) / step for number, (_, step) in enumerate(steps)]).T
        shift, _ = _least(scene, slopes, difference, steps, row)
        for (column, _), amount in zip(steps, shift, strict=True):
            row[column] += amount
    return best if best is not None else start
