"""How far a replay draws the values that are fitted to it: the found machine is simulated, and what it would have recorded is fitted again.

A replay feeds each part with what was recorded, noise and rounding included: a friction turns round where a noisy speed does, and a lag
that is fitted beside it answers to that. With b the value fitted to what a machine of value v would have recorded, |b - v| is a systematic
error of every value so fitted. It is told and not taken off: the found machine is not the real one. Source: Efron, Tibshirani, An
Introduction to the Bootstrap, 1993, chapter 10 (parametric bootstrap of a bias). Left out: the loads that nobody measured.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from lathesim.identification.estimation.covariance import SIGNIFICANT
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records.fit import Fitted, with_start
from lathesim.identification.replay.experiment import Experiment
from lathesim.record import Record


def replay_bias(experiment: Experiment, fitted: Fitted, *, full_band: bool) -> Mapping[str, float]:
    """Return by name how far off [SI] the second fit is, nothing where noise alone may have made that; a machine of which nothing is fed
    back is no other in the replay than in its own simulation, and has no bias."""
    if not experiment.feeds_back:
        return {}
    again = replace(experiment, record=_as_recorded(experiment, fitted))
    second = fit(again.sensed, with_start(fitted), fitted.constant, rounds=2, full_band=full_band, coloured=True)
    found = {}
    for name in fitted.names:
        off = abs(second.by_name[name] - fitted.by_name[name])
        found[name] = off if off > SIGNIFICANT * second.error_by_noise(name) else 0.0
    return found


def _as_recorded(experiment: Experiment, fitted: Fitted) -> Record:
    """Return what the machine with the fitted values would have recorded, with noise of the size of the floors."""
    names = experiment.own.settable(fitted.by_name)
    simulated = experiment.own.outputs(names, np.array([[fitted.by_name[name] for name in names]]))[0]
    random = np.random.Generator(np.random.Philox(0))
    channels = dict(experiment.record.channels)
    for row, name in enumerate(experiment.machine.compare):
        values = simulated[row] + experiment.floors[name] * random.standard_normal(len(simulated[row]))
        channels[name] = replace(channels[name], values=np.where(np.isfinite(experiment.record[name]), values, np.nan))
    return Record(experiment.record.time, channels, dict(experiment.record.meta))
