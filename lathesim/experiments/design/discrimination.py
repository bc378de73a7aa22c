"""How far apart rivals stay when each is refitted to the other: T-optimality, over what is uncertain, per second of program.

For rival a with sizes drawn as they may be, T(a, b) is the smallest sum of squares, in noise levels, that rival b leaves of what a would
make the recording read, with the machine's uncertain values free within what the lesson says of them:

    T(a, b) = min over p of  |W (y_a - y_b(p))|^2 + sum ((p - given)/deviation)^2

The logarithm of the ratio of likelihoods is then about normal, N(T/2, T). A run decides for a against b where that logarithm is above
``DECIDES`` and above the share of what a explains at all, T(a, nothing)/2, below which a diagnosis calls two explanations tied: a model is
never quite right. A program is worth the chance that it decides, less the price of its seconds.
Source: Atkinson, Fedorov, Biometrika 62 (1975), 57; Lindley, Ann. Math. Statist. 27 (1956), 986.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.diagnosis.method import STANDARD
from lathesim.engine.assembly import FloatArray
from lathesim.experiments.design.laying import Laid
from lathesim.experiments.design.rivals import NOTHING, Rival
from lathesim.experiments.design.scene import Scene
from lathesim.identification.records.candidate import Candidate as Term

DECIDES = 3.4
"""Logarithm of the likelihood ratio from which on a run decides: 30 to 1."""
_EFFICIENCY = 2e-5
"""Share of T that a diagnosis makes use of: the noise of a machine is more than what its sensors cannot resolve. Calibrated on fourteen
sealed cases of lesson 12: at T from 9.7e5 on ten of twelve were named, at 2.2e5 and below none of two; half decide at 3.4e5."""
_BEYOND = 10.0
"""Ranges beyond its usual bounds to which a rival may go when it is refitted: an unusual size is no proof against it."""
_ALL_BUT_SURE = 2.054
"""Standard normal deviation below which 98 % lie."""
NESTED = (_ALL_BUT_SURE + math.sqrt(_ALL_BUT_SURE**2 + 2.0 * DECIDES)) ** 2
"""T below which a rival does what another one does: where T/2 - DECIDES = 2.054 sqrt(T), so that even a likelihood that knows the noise
fails to decide in 2 % of the runs."""
PRICE = 0.005
"""What a second of program costs, as a share of a decision; assumed."""
_STEP = 0.25
"""Step of the slopes, in standard deviations or as a share of a size: large against rounding, small against curvature."""
_FINER, _FINEST = 0.2, 0.01
"""By how much the steps of the slopes shrink from round to round of a refit, and to which share at most; assumed."""
_FURTHEST = 6.0
"""Standard deviations by which an uncertain value may be off when a rival is refitted."""
_WORTH_A_ROUND = 0.05
"""Share of T that a round of a refit must gain to be followed by another; assumed."""
_HELD = 1e3
"""Largest number of noise levels that counts of one stretch: beyond, no more is told."""


Places = dict[tuple[int, int], tuple[int, list[tuple[int, float]]]]
"""(rival, draw) -> its row, and the (value, step) of the rows behind it, one for each slope."""


@dataclass(frozen=True)
class Worth:
    """What a program is worth: the chance to decide (mean, and for each rival), and T of each pair at each draw (a, b, draws).

    ``explained`` (a, draws) is T of each rival against the machine without it, ``decided`` (a, b, draws) the chance that a run of a decides
    against b alone.
    """

    chance: float
    by_rival: tuple[float, ...]
    apart: FloatArray
    explained: FloatArray
    decided: FloatArray
    seconds: float

    def decided_pair(self, first: int, second: int) -> float:
        """Return the chance that a run tells two rivals, for the truth that is harder to tell; the median over draws."""
        return float(np.median(np.minimum(self.decided[first, second], self.decided[second, first])))

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


def chance_to_decide(apart: FloatArray, explained: FloatArray | float = 0.0) -> FloatArray:
    """Return the chance that a run decides where rivals are ``apart`` (T) and the true one explains as much as ``explained`` (T)."""
    from scipy.special import ndtr

    usable = np.maximum(_EFFICIENCY * apart, 1e-12)
    needed = np.maximum(DECIDES, STANDARD.selection.tie_share * _EFFICIENCY * np.asarray(explained) / 2.0)
    return np.asarray(ndtr((usable / 2.0 - needed) / np.sqrt(usable)))


def worths(scene: Scene, programs: Sequence[Laid], floors: FloatArray, draws: int, conditions: Conditions, refits: int = 0) -> list[Worth]:
    """Return what programs are worth: all their runs are one batch; ``refits`` further rounds follow the rivals where they bend."""
    used = draws if conditions.average else 1
    rows, where = _rows(scene, used)
    found = scene.readings(programs, [rows] * len(programs))
    return [
        _worth(scene, program, readings, rows, where, used, floors, conditions, refits)
        for program, readings in zip(programs, found, strict=True)
    ]


def _sound(draws: int) -> Rival:
    """Return the machine with none of the rivals, held against each of them: what a rival explains is what this one leaves."""
    return Rival(NOTHING, None, np.zeros((draws, 0)))


def _rows(scene: Scene, draws: int) -> tuple[FloatArray, Places]:
    """Return the values to run (members, names), and where each rival's draw and its slopes stand: (first, [(name, step), ...])."""
    rows: list[FloatArray] = []
    where: Places = {}
    for number, rival in enumerate((*scene.rivals, _sound(draws))):
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
    scene: Scene, program: Laid, readings: FloatArray, rows: FloatArray, where: Places, draws: int, floors: FloatArray,
    conditions: Conditions, refits: int,
) -> Worth:  # fmt: skip
    count = len(scene.rivals)
    levels = functools.partial(scene.in_noise_levels, program=program, floors=floors, steady=conditions.steady_floor)
    scaled = levels(readings).reshape(len(readings), -1)
    apart, explained = np.zeros((count, count, draws)), np.zeros((count, draws))
    for a in range(count):
        for draw in range(draws):
            truth = scaled[where[a, draw][0]]
            explained[a, draw] = _refitted(scene, scaled, truth, rows, where[count, draw], conditions)[0]
            for b in range(count):
                if a != b:
                    starts = [_refitted(scene, scaled, truth, rows, where[b, other], conditions) for other in range(draws)]
                    best = min(starts, key=lambda pair: pair[0])
                    if refits and conditions.refit:
                        alike = [(np.inf, row) for row in _alike(scene, a, b, draw)]
                        ends = [_followed(scene, program, truth, b, start, levels, refits) for start in (best, *alike)]
                        best = min(ends, key=lambda pair: pair[0])
                    apart[a, b, draw] = best[0]
    apart = _by_simplicity(apart)
    decided = chance_to_decide(apart, explained[:, None, :])
    chances = np.array([np.delete(decided[a], a, axis=0).min(axis=0) for a in range(count)])
    return Worth(float(chances.mean()), tuple(float(row.mean()) for row in chances), apart, explained, decided, program.seconds)


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
    difference = np.nan_to_num(truth - base, nan=_HELD)
    if not conditions.refit or not steps:
        return _held_power(difference), row
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
    own = _carried_over(first.term, second.term, first.sizes[draw])
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


def _carried_over(first: Term, second: Term, sizes: FloatArray) -> dict[str, float]:
    """Return what the sizes of the first would be as parameters of the second: by name, else in order, where the units agree."""
    units, values = [], {}
    for term in (first, second):
        names = [name.partition(".")[2] for name in term.parameters]
        units.append({name: term.effect.declarations[name].unit for name in names})
    for name, size in zip(units[0], sizes, strict=True):
        values[name] = float(size)
    spare = [name for name in units[0] if units[1].get(name) != units[0][name]]
    found = {name: values[name] for name in units[0] if name not in spare}
    for name in units[1]:
        alike = next((other for other in spare if units[0][other] == units[1][name]), None) if name not in found else None
        if alike is not None:
            found[name] = values[alike]
            spare.remove(alike)
    return found


def _least(
    scene: Scene, slopes: FloatArray, difference: FloatArray, steps: Sequence[tuple[int, float]], row: FloatArray
) -> tuple[FloatArray, float]:
    """Return the shift of the values with the least sum of squares, and that sum; rivals' sizes are kept near where slopes hold.

    An uncertain value stays within six standard deviations: beyond, what the lesson says of it counts more than ``NESTED`` by itself.
    """
    from scipy.optimize import lsq_linear

    count = len(steps)
    pull, offset = np.zeros((count, count)), np.zeros(count)
    low, high = np.full(count, -np.inf), np.full(count, np.inf)
    uncertain = len(scene.uncertain)
    for number, (column, step) in enumerate(steps):
        width = float(scene.deviation[column]) if column < uncertain else 4.0 * abs(step)
        pull[number, number] = 1.0 / width
        if column < uncertain:
            off = row[column] - scene.given[column]
            offset[number] = -off / width
            low[number], high[number] = min(-_FURTHEST * width - off, -1e-9 * width), max(_FURTHEST * width - off, 1e-9 * width)
    stacked = np.vstack([np.nan_to_num(slopes), pull])
    goal = np.concatenate([difference, offset])
    shift = np.linalg.lstsq(stacked, goal, rcond=None)[0]
    if np.any(shift < low) or np.any(shift > high):
        orthogonal, triangle = np.linalg.qr(stacked)
        shift = np.asarray(lsq_linear(triangle, orthogonal.T @ goal, (low, high), method="bvls").x)
    return shift, _held_power(goal - stacked @ shift)


def _held_power(difference: FloatArray) -> float:
    """Return the sum of squares of a difference in noise levels, of which no stretch counts more than ``_HELD``."""
    return float(np.square(np.clip(difference, -_HELD, _HELD)).sum())


def _followed(
    scene: Scene,
    program: Laid,
    truth: FloatArray,
    rival: int,
    start: tuple[float, FloatArray],
    levels: Callable[[FloatArray], FloatArray],
    rounds: int,
) -> tuple[float, FloatArray]:
    """Return T and values at the end of a descent: each round takes slopes where it stands, over ever smaller steps.

    Of the shift, a half and a tenth of it the best end is taken. The descent ends after ``rounds``, where a round gains less than a
    twentieth, or where the rival does what the other one does.
    """
    term = scene.rivals[rival].term
    columns = scene.columns(scene.rivals[rival])
    uncertain = len(scene.uncertain)

    def kept(row: FloatArray) -> FloatArray:
        if term is not None:
            reach = _BEYOND * (term.high - term.low)
            row[columns] = np.clip(row[columns], np.where(term.low < 0.0, term.low - reach, term.low), term.high + reach)
        return row

    def left(scaled: FloatArray, row: FloatArray) -> tuple[FloatArray, float]:
        length = min(len(scaled), len(truth))
        difference = np.nan_to_num(truth[:length] - scaled[:length], nan=_HELD)
        penalty = np.square((row[:uncertain] - scene.given[:uncertain]) / scene.deviation).sum()
        return difference, _held_power(difference) + float(penalty)

    def run(rows: FloatArray) -> FloatArray:
        return levels(scene.readings([program], [rows])[0]).reshape(len(rows), -1)

    row = kept(start[1].copy())
    best = (np.inf, row)
    for turn in range(rounds):
        finer = max(_FINEST, _FINER**turn)
        steps = [(column, finer * step) for column, step in _steps(scene, scene.rivals[rival], row)]
        scaled = run(np.array([row, *[row + step * (np.arange(len(row)) == column) for column, step in steps]]))
        difference, cost = left(scaled[0], row)
        best = min(best, (cost, row), key=lambda pair: pair[0])
        if cost < 0.1 * NESTED:
            break
        slopes = np.array([(scaled[1 + number] - scaled[0])[: len(difference)] / step for number, (_, step) in enumerate(steps)]).T
        shift, _ = _least(scene, slopes, difference, [(column, step / finer) for column, step in steps], row)
        moved = []
        for share in (1.0, 0.5, 0.1):
            end = row.copy()
            end[[column for column, _ in steps]] += share * shift
            moved.append(kept(end))
        ends = [left(readings, end)[1] for readings, end in zip(run(np.array(moved)), moved, strict=True)]
        place = int(np.argmin(ends))
        gains = ends[place] < (1.0 - _WORTH_A_ROUND) * cost
        if ends[place] < best[0]:
            best = (ends[place], moved[place])
        if not gains and finer == _FINEST:
            break
        row = moved[place] if ends[place] < cost else row
    return best
