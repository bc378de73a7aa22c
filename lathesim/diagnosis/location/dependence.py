"""What the missing force depends on, and how large it is beside what acts at its place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lathesim.diagnosis.location.missing_force import missing_signal
from lathesim.diagnosis.location.operating_conditions import held_by_friction, samples_per_turn, variables
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.condition import Kind
from lathesim.engine.assembly import FloatArray
from lathesim.identification.records.fit import Fitted
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.signal.rounding import LARGER_PART

_BINS = 14

_STRETCHES = 40


@dataclass(frozen=True)
class DependenceScore:
    """How much of a channel's missing signal a variable explains on the validation recording (1 all, 0 nothing).

    ``within`` is the share of what the variable could explain: of the samples where it has a value (time since entry has none out of the
    cut) and, for an angle, of what is faster than a turn.
    """

    channel: str
    variable: str
    share: float
    within: float
    kind: Kind = Kind.OTHER


def bars(
    experiment: Experiment, fitted: Fitted, validation: Experiment, judged: Fitted, method: Method = STANDARD
) -> list[DependenceScore]:
    """Return the bars of every channel and variable, the tallest first."""
    here, there = variables(experiment, method=method), variables(validation, method=method)
    result = []
    for row, channel in enumerate(experiment.machine.compare):
        missing, other = missing_signal(experiment, fitted, row), missing_signal(validation, judged, row)
        learned, scored, mean_is_known = missing.values, other.values, missing.mean_is_known and other.mean_is_known
        power = float(np.sum(scored[_counted(validation)] ** 2))
        learned, scored = (
            beyond(learned, held_by_friction(experiment, fitted, row, method=method)),
            beyond(scored, held_by_friction(validation, judged, row, method=method)),
        )
        for name, variable in here.items():
            if name in there and power > 0.0:
                places_here = _only(variable.values, _counted(experiment))
                places_there = _only(there[name].values, _counted(validation))
                first, second = learned, scored
                if variable.kind is Kind.ANGLE:
                    first, second = _within_a_turn(learned, variable.values[0]), _within_a_turn(scored, there[name].values[0])
                elif variable.kind is Kind.PARTIAL and np.isfinite(places_here[0]).any():
                    usual = float(np.mean(learned[np.isfinite(places_here[0])]))
                    first, second = learned - usual, scored - usual
                table = _Table.of(places_here, first, places_there, second, mean_is_known=mean_is_known)
                gain, possible = table.explained(), table.possible
                if gain < method.shared.dependence * possible and gain <= method.location.beyond_chance * table.by_chance(
                    method.location.chance_draws
                ):
                    gain = 0.0
                within = gain / possible if possible > 0.0 else 0.0
                result.append(DependenceScore(channel, name, gain / power, within, variable.kind))
    return sorted(result, key=lambda bar: -bar.share)


def _counted(experiment: Experiment) -> npt.NDArray[np.bool_]:
    return np.ones(experiment.sensed.samples, dtype=bool) if experiment.weights is None else experiment.weights > LARGER_PART


def _only(where: Sequence[FloatArray], counted: npt.NDArray[np.bool_]) -> list[FloatArray]:
    return [np.where(counted, values, np.nan) for values in where]


def beyond(missing: FloatArray, held: FloatArray) -> FloatArray:
    """Return what is missing beyond what may be held there unseen."""
    return np.asarray(np.sign(missing) * np.maximum(np.abs(missing) - held, 0.0))


def _within_a_turn(signal: FloatArray, angle: FloatArray) -> FloatArray:
    """Return a signal less its mean over the turn around each sample."""
    width = min(samples_per_turn(angle), len(signal))
    inside = np.isfinite(angle)
    ones = np.ones(width)
    number = np.convolve(inside.astype(np.float64), ones, mode="same")
    return signal - np.convolve(np.where(inside, signal, 0.0), ones, mode="same") / np.maximum(number, 1.0)


def explained(where: list[FloatArray], learned: FloatArray, other: list[FloatArray], scored: FloatArray) -> float:
    """Return the share of ``scored`` explained by the mean of ``learned`` over bins of the variables."""
    gain = _Table.of(where, learned, other, scored).explained()
    power = float(np.sum(scored * scored))
    return max(0.0, gain / power) if power > 0.0 else 0.0


@dataclass(frozen=True)
class _Table:
    """A signal learned in bins of some variables, in one recording, and what it is scored on in another.

    ``learned`` (bins, stretches) is its sum in each bin of each of 40 stretches of the recording, ``number`` how many samples each bin has
    there; ``scored`` and ``weight`` (bins,) are sum and number of samples in the other, ``possible`` its squares where all variables have
    a value.
    """

    learned: FloatArray
    number: FloatArray
    scored: FloatArray
    weight: FloatArray
    possible: float
    mean_is_known: bool = True

    @classmethod
    def of(
        cls, where: list[FloatArray], learned: FloatArray, other: list[FloatArray], scored: FloatArray, *, mean_is_known: bool = True
    ) -> _Table:
        """Sort two signals into the bins of their variables; both the bins and the means are those of the first."""
        here, there = (np.all(np.isfinite(np.array(values)), axis=0) for values in (where, other))
        stretch = np.minimum(np.arange(len(learned)) * _STRETCHES // max(len(learned), 1), _STRETCHES - 1)[here]
        where, other = [values[here] for values in where], [values[there] for values in other]
        learned, scored = learned[here], scored[there]
        edges = [_edges(values) for values in where] if len(learned) else [np.zeros(0) for _ in where]
        count = int(np.prod([len(edge) + 1 for edge in edges]))
        bins, bins_there = _bin(where, edges), _bin(other, edges)
        sums = np.bincount(bins * _STRETCHES + stretch, weights=learned, minlength=count * _STRETCHES)
        return cls(
            np.asarray(sums.reshape(count, _STRETCHES), dtype=np.float64),
            np.bincount(bins, minlength=count).astype(np.float64),
            np.asarray(np.bincount(bins_there, weights=scored, minlength=count), dtype=np.float64),
            np.bincount(bins_there, minlength=count).astype(np.float64),
            float(np.sum(scored**2)) if len(learned) else 0.0,
            mean_is_known,
        )

    def explained(self) -> float:
        """Return how much of the squares of what is scored the learned means explain."""
        return float(self._gains(np.ones((_STRETCHES, 1)))[0])

    def by_chance(self, draws: int) -> float:
        """Return how much chance explains: the most that is explained in some ``draws`` of the sign of each stretch of what is
        learned.

        Slow noise stays slow noise, and what depends on the variables averages out. Source: Shao, The dependent wild bootstrap, J. American
        Statistical Association 105 (2010).
        """
        signs = np.random.Generator(np.random.Philox(0)).choice([-1.0, 1.0], size=(draws, _STRETCHES))
        return max(0.0, float(np.max(self._gains(signs.T))))

    def _gains(self, signs: FloatArray) -> FloatArray:
        """Return sum(y^2) - sum((y - mean)^2) = sum over bins of 2 mean sum(y) - mean^2 number, for each column of signs."""
        means = self.learned @ signs / np.maximum(self.number, 1.0)[:, None]
        if not self.mean_is_known:
            # what is learned knows no constant, and neither does what it is held against
            means = means + (self.scored.sum() - self.weight @ means) / max(float(self.weight.sum()), 1.0)
        return np.asarray(2.0 * self.scored @ means - self.weight @ means**2)


def _edges(values: FloatArray) -> FloatArray:
    """Return the edges between bins of about as many samples each; a variable of few levels has a bin for each."""
    levels = np.unique(values)
    if len(levels) <= _BINS:
        return np.asarray(0.5 * (levels[1:] + levels[:-1]))
    return np.asarray(np.unique(np.quantile(values, np.linspace(0.0, 1.0, _BINS + 1)))[1:-1])


def _bin(values: list[FloatArray], edges: list[FloatArray]) -> npt.NDArray[np.int64]:
    index = np.zeros(len(values[0]), dtype=np.int64)
    for array, edge in zip(values, edges, strict=True):
        index = index * (len(edge) + 1) + np.searchsorted(edge, array)
    return index
