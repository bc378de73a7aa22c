"""How far apart rivals stay when each is refitted to the other: T-optimality, over what is uncertain, per second of program.

For rival a with sizes drawn as they may be, T(a, b) is the smallest sum of squares, in noise levels, that rival b leaves of what a would
make the recording read, with the machine's uncertain values free within what the lesson says of them:

    T(a, b) = min over p of  |W (y_a - y_b(p))|^2 + sum ((p - given)/deviation)^2

A diagnosis estimates its noise, so that n values with a share k of T in them raise the logarithm of the likelihood by

    G(T) = n/2 ln(1 + k T/n)

A run decides for a against b where G(T(a, b)) is above ``DECIDES`` and above the share of G(T(a, nothing)), what a explains at all, below
which a diagnosis calls two explanations tied: a model is never quite right. How far above is known to a factor, so the chance is
Phi(ln(gained/needed)/spread). A program is worth the chance that it decides, less the price of its seconds.
Source: Atkinson, Fedorov, Biometrika 62 (1975), 57; Lindley, Ann. Math. Statist. 27 (1956), 986; Seber, Wild, Nonlinear Regression (1989),
section 2.1 (likelihood with the variance estimated).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from lathesim.diagnosis.explaining.chance import due
from lathesim.diagnosis.method import STANDARD
from lathesim.engine.assembly import FloatArray
from lathesim.experiments.candidate_programs import Laid
from lathesim.experiments.refit import RefitDescent, linear_refit, starts_alike, steps_of
from lathesim.experiments.rivals import NOTHING, Rival
from lathesim.experiments.scene import Scene

_SETTLED_AT = 0.1
"""Share of what a nested model gains by chance below which two models are one, and no start is tried further."""
DECIDES = 3.4
"""Logarithm of the likelihood ratio from which on a run decides: 30 to 1."""
_EFFICIENCY = 1e-2
"""Share of T that a diagnosis makes use of: the noise of a machine is more than what its sensors cannot resolve. Calibrated on nine sealed
cases: at T from 6.7e4 on all were told, one of them with 0.2 % of what its effect explains, and none at T of 100 and below."""
_SPREAD = 1.0
"""Standard deviation of the logarithm of what a run gains over what is needed: sizes, noise and loads are not known; assumed."""
_ALL_BUT_SURE = 2.054
"""Standard normal deviation below which 98 % lie."""
_SURE = 2.6
"""Standard normal deviation below which 99.5 % lie."""
_LOGARITHM_OF_ALL = 600.0
"""Largest argument of an exponential that is still a number."""
NESTED = (_ALL_BUT_SURE + math.sqrt(_ALL_BUT_SURE**2 + 2.0 * DECIDES)) ** 2
"""T below which a rival does what another one does: where T/2 - DECIDES = 2.054 sqrt(T), so that even a likelihood that knows the noise
fails to decide in 2 % of the runs."""
PRICE = 0.005
"""What a second of program costs, as a share of a decision; assumed."""


Places = dict[tuple[int, int], tuple[int, list[tuple[int, float]]]]
"""(rival, draw) -> its row, and the (value, step) of the rows behind it, one for each slope."""


Ends = dict[tuple[int, int, int], FloatArray]
"""(true rival, other rival, draw) -> the values at which the other one is most like the true one."""


@dataclass(frozen=True)
class ProgramWorth:
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
class Ablation:
    """What an ablation may take away: the average over draws, the refit of the rivals, the price of seconds, the floor that stays."""

    average: bool = True
    refit: bool = True
    price: bool = True
    steady_floor: bool = True


def gained(apart: FloatArray, values: int) -> FloatArray:
    """Return by how much [nats] a likelihood that estimates its noise tells rivals ``apart`` (T) with so many ``values``."""
    return np.asarray(0.5 * values * np.log1p(_EFFICIENCY * np.asarray(apart) / values))


def needed(explained: FloatArray, values: int, least: FloatArray | float = DECIDES) -> FloatArray:
    """Return what a run must gain [nats] to decide, where the true rival explains so much (T): ``least`` at the least."""
    return np.maximum(least, STANDARD.material * gained(explained, values))


def chance_to_decide(apart: FloatArray, explained: FloatArray, values: int, least: FloatArray | float = DECIDES) -> FloatArray:
    """Return the chance that a run decides where rivals are ``apart`` (T) and the true one explains as much as ``explained`` (T)."""
    from scipy.special import ndtr

    return np.asarray(ndtr(np.log(np.maximum(gained(apart, values), 1e-12) / needed(explained, values, least)) / _SPREAD))


def least_gains(rivals: Sequence[Rival]) -> FloatArray:
    """Return what a run must gain [nats] at the least to tell each rival from each other one (a, b)."""
    found = np.full((len(rivals), len(rivals)), DECIDES)
    for (a, one), (b, other) in product(enumerate(rivals), enumerate(rivals)):
        effect = one.term or other.term
        if effect is not None and (one.term is None or other.term is None):
            found[a, b] = due(STANDARD, len(effect.parameters))
    return found


def worths(scene: Scene, programs: Sequence[Laid], floors: FloatArray, draws: int, conditions: Ablation) -> list[ProgramWorth]:
    """Return what programs are worth where rivals are refitted along slopes: all their runs are one batch."""
    held = [_HeldRival.of(scene, program, floors, conditions) for program in programs]
    rows, where = _rows(scene, draws if conditions.average else 1)
    found = scene.readings(programs, [rows] * len(programs))
    scaled = [item.levels(readings).reshape(len(readings), -1) for item, readings in zip(held, found, strict=True)]
    return [item.worth(*item.by_slopes(values, rows, where)[:2], values.shape[1]) for item, values in zip(held, scaled, strict=True)]


def refitted_worth(
    scene: Scene, program: Laid, floors: FloatArray, draws: int, conditions: Ablation, rounds: int, at_least: Callable[[ProgramWorth], bool]
) -> ProgramWorth | None:
    """Return what a program is worth where ``rounds`` follow the rivals where they bend; None once it cannot be ``at_least`` that good.

    A refit makes T smaller, so what is not followed yet stands for the best that can come of it.
    """
    held = _HeldRival.of(scene, program, floors, conditions)
    rows, where = _rows(scene, draws if conditions.average else 1)
    scaled = held.levels(scene.readings([program], [rows])[0]).reshape(len(rows), -1)
    apart, explained, starts = held.by_slopes(scaled, rows, where)
    if not conditions.refit:
        return held.worth(apart, explained, scaled.shape[1])
    for a, b, draw in sorted(starts, key=lambda place: float(apart[place])):
        settled = _settled(explained[a, draw], scaled.shape[1])
        descent = RefitDescent(scene, program, scaled[where[a, draw][0]], scene.rivals[b], held.levels, _SETTLED_AT * NESTED, settled)
        best = np.inf
        for start in (starts[a, b, draw], *starts_alike(scene, a, b, draw)):
            best = min(best, descent.followed(start, rounds)[0])
            if best < _SETTLED_AT * NESTED:
                break
        apart[a, b, draw] = best
        found = held.worth(apart, explained, scaled.shape[1])
        if not at_least(found):
            return None
    return found


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
            steps = steps_of(scene, rival, base)
            where[number, draw] = (len(rows), steps)
            rows.append(base)
            for column, step in steps:
                moved = base.copy()
                moved[column] += step
                rows.append(moved)
    return np.array(rows), where


@dataclass(frozen=True)
class _HeldRival:
    """A program with how its readings count: its rivals held against each other."""

    scene: Scene
    program: Laid
    levels: Callable[[FloatArray], FloatArray]
    conditions: Ablation

    @classmethod
    def of(cls, scene: Scene, program: Laid, floors: FloatArray, conditions: Ablation) -> _HeldRival:
        """Return a program with its noise levels."""
        levels = functools.partial(scene.in_noise_levels, program=program, floors=floors, steady=conditions.steady_floor)
        return cls(scene, program, levels, conditions)

    def by_slopes(self, scaled: FloatArray, rows: FloatArray, where: Places) -> tuple[FloatArray, FloatArray, Ends]:
        """Return T (a, b, draws), T of each rival against the machine without it (a, draws), and the values each refit ends at."""
        count, draws = len(self.scene.rivals), len(where) // (len(self.scene.rivals) + 1)
        refit = functools.partial(linear_refit, self.scene, scaled, refitted=self.conditions.refit, rows=rows)
        apart, explained, ends = np.zeros((count, count, draws)), np.zeros((count, draws)), {}
        for a, draw in product(range(count), range(draws)):
            truth = scaled[where[a, draw][0]]
            explained[a, draw] = refit(truth=truth, place=where[count, draw])[0]
            for b in (number for number in range(count) if number != a):
                starts = [refit(truth=truth, place=where[b, other]) for other in range(draws)]
                apart[a, b, draw], ends[a, b, draw] = min(starts, key=lambda pair: pair[0])
        return apart, explained, ends

    def worth(self, apart: FloatArray, explained: FloatArray, values: int) -> ProgramWorth:
        """Return what the program is worth with rivals that far apart."""
        far = _by_simplicity(apart)
        decided = chance_to_decide(far, explained[:, None, :], values, least_gains(self.scene.rivals)[:, :, None])
        chances = np.array([np.delete(decided[a], a, axis=0).min(axis=0) for a in range(len(decided))])
        by_rival = tuple(float(row.mean()) for row in chances)
        return ProgramWorth(float(chances.mean()), by_rival, far, explained.copy(), decided, self.program.seconds)


def _settled(explained: FloatArray, values: int) -> float:
    """Return T from which on a run decides all but surely, where the true rival explains so much (T)."""
    gain = float(needed(explained, values)) * math.exp(_SURE * _SPREAD)
    return values / _EFFICIENCY * math.expm1(min(2.0 * gain / values, _LOGARITHM_OF_ALL))


def _by_simplicity(apart: FloatArray) -> FloatArray:
    """Return T with that of the other way round where one rival holds the other as a special case: of two that fit, the simpler counts."""
    return np.asarray(np.where(apart < NESTED, np.maximum(apart, apart.transpose(1, 0, 2)), apart))
