"""Waves that are no further effect: harmonics of one that was found, and lines beside it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from lathesim.diagnosis.candidates.periodic_starts import PERIODS
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.model import Model, Trial

_HARMONICS = range(2, 9)


def is_part_of_a_wave(trial: Trial, model: Model, method: Method = STANDARD) -> bool:
    """Return whether a wave is a harmonic of one that the model has at the same place or motion, or a small line beside it: a part of that
    one's form, and no further effect.

    A ripple in proportion to the driving force is something else.
    """
    values = trial.model.fitted.by_name
    period = _period(trial.candidate, values)
    if not period or _in_proportion(trial.candidate, values, method=method):
        return False
    for other in model.candidates:
        whole = _period(other, values) / period
        ratio = max(whole, 1.0 / whole) if whole > 0.0 else 0.0
        if not (_at_one_motion(trial.candidate, other) and ratio):
            continue
        if round(ratio) in _HARMONICS and abs(ratio - round(ratio)) < method.candidates.whole_ratio * ratio:
            return True
        size, of_other = (abs(values.get(f"{candidate.part}.amplitude", 0.0)) for candidate in (trial.candidate, other))
        if abs(ratio - 1.0) < method.candidates.beside_line and size < method.candidates.side_line * of_other:
            return True
    return False


def second_line(trial: Trial, model: Model, method: Method = STANDARD) -> Candidate | None:
    """Return the wave of the model of which another wave, at the same place, is the second harmonic; none where it is of none."""
    values = trial.model.fitted.by_name
    period = _period(trial.candidate, values)
    if not period or _in_proportion(trial.candidate, values, method=method):
        return None
    alike = (other for other in model.candidates if other.at == trial.candidate.at and other.effect.site == trial.candidate.effect.site)
    return next((other for other in alike if abs(_period(other, values) / period - 2.0) < 2.0 * method.candidates.whole_ratio), None)


def _at_one_motion(candidate: Candidate, other: Candidate) -> bool:
    """Return whether two effects sit at one place or at two sensors of one motion, whose difference does not tell which of them is
    wrong."""
    return candidate.at == other.at or bool(candidate.of_motion and candidate.of_motion == other.of_motion)


def _period(candidate: Candidate, values: Mapping[str, float]) -> float:
    """Return the period of a wave, by whatever name its effect calls it, 0 where it is none."""
    return next((values[name] for name in (f"{candidate.part}.{period}" for period in PERIODS) if name in values), 0.0)


def _in_proportion(candidate: Candidate, values: Mapping[str, float], method: Method = STANDARD) -> bool:
    """Return whether a ripple goes with the driving force more than it goes without it, by what is usual of both."""
    usual = dict(zip(candidate.parameters, np.abs(candidate.points).max(axis=0, initial=0.0), strict=True))
    names = [f"{candidate.part}.{name}" for name in ("share", "amplitude")]
    share, amplitude = (abs(values.get(name, 0.0)) / usual[name] if usual.get(name) else 0.0 for name in names)
    return share > method.candidates.goes_with_force * amplitude
