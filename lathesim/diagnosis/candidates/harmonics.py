"""Waves that are no further effect: harmonics of one that was found, and lines beside it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from lathesim.diagnosis.candidates.periodic_starts import PERIODS
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.model import Model, Trial

_HARMONICS = range(2, 9)
_WHOLE = 0.005
"""Share of a ratio of two periods by which it may be off a whole number."""
_GOES_WITH = 0.3
"""A ripple goes with the driving force from this ratio of its two sizes on, each over what is usual of it."""
_BESIDE = 0.1
"""Share of a period by which another one lies beside it."""
_SIDE_LINE = 0.05
"""Share of a wave's size that a line beside it has because the replay is sampled, or the wave is no pure one."""


def is_part_of_a_wave(trial: Trial, model: Model) -> bool:
    """Return whether a wave is a harmonic of one that the model has at the same place or motion, or a small line beside it: a part of that
    one's form, and no further effect.

    A ripple in proportion to the driving force is something else.
    """
    values = trial.model.fitted.by_name
    period = _period(trial.candidate, values)
    if not period or _in_proportion(trial.candidate, values):
        return False
    for other in model.candidates:
        whole = _period(other, values) / period
        ratio = max(whole, 1.0 / whole) if whole > 0.0 else 0.0
        if not (_at_one_motion(trial.candidate, other) and ratio):
            continue
        if round(ratio) in _HARMONICS and abs(ratio - round(ratio)) < _WHOLE * ratio:
            return True
        size, of_other = (abs(values.get(f"{candidate.part}.amplitude", 0.0)) for candidate in (trial.candidate, other))
        if abs(ratio - 1.0) < _BESIDE and size < _SIDE_LINE * of_other:
            return True
    return False


def second_line(trial: Trial, model: Model) -> Candidate | None:
    """Return the wave of the model of which another wave, at the same place, is the second harmonic; none where it is of none."""
    values = trial.model.fitted.by_name
    period = _period(trial.candidate, values)
    if not period or _in_proportion(trial.candidate, values):
        return None
    alike = (other for other in model.candidates if other.at == trial.candidate.at and other.effect.site == trial.candidate.effect.site)
    return next((other for other in alike if abs(_period(other, values) / period - 2.0) < 2.0 * _WHOLE), None)


def _at_one_motion(candidate: Candidate, other: Candidate) -> bool:
    """Return whether two effects sit at one place or at two sensors of one motion, whose difference does not tell which of them is
    wrong."""
    return candidate.at == other.at or bool(candidate.of_motion and candidate.of_motion == other.of_motion)


def _period(candidate: Candidate, values: Mapping[str, float]) -> float:
    """Return the period of a wave, by whatever name its effect calls it, 0 where it is none."""
    return next((values[name] for name in (f"{candidate.part}.{period}" for period in PERIODS) if name in values), 0.0)


def _in_proportion(candidate: Candidate, values: Mapping[str, float]) -> bool:
    """Return whether a ripple goes with the driving force more than it goes without it, by what is usual of both."""
    usual = dict(zip(candidate.parameters, np.abs(candidate.points).max(axis=0, initial=0.0), strict=True))
    names = [f"{candidate.part}.{name}" for name in ("share", "amplitude")]
    share, amplitude = (abs(values.get(name, 0.0)) / usual[name] if usual.get(name) else 0.0 for name in names)
    return share > _GOES_WITH * amplitude
