"""Which channel that was not recorded would tell tied effects apart.

Each of two explanations is simulated as it was fitted, in the lesson's own loops. Where a current, a motion or a sensor that nobody
recorded differs between the two, beside what it does at all, a recording of it decides:  d = rms(y_1 - y_2) / std(y_1).
Left out: the noise of that channel, which is not known before it is recorded.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from lathesim.component import Output
from lathesim.diagnosis.method import Method
from lathesim.diagnosis.records.ranked_effect import RankedEffect
from lathesim.diagnosis.records.search import Found
from lathesim.effects.effect import Effect
from lathesim.engine.assembly import FloatArray
from lathesim.engine.batch import Batch
from lathesim.engine.wiring import wire
from lathesim.identification.records.fit import Fitted
from lathesim.identification.replay.closed_loop import SETTLING
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.replay.measured_motion import measured_output
from lathesim.identification.replay.open_loop import seen
from lathesim.identification.signal.analysis import root_mean_square

_RECORDABLE = ("current", "rate", "reading", "flow", "displacement")
"""Roles of outputs that are recorded, the easiest to log first."""


@dataclass(frozen=True)
class DecidingChannel:
    """A channel that tells an effect from those it is tied with: by how much they differ there, as a share of what it does."""

    channel: str
    apart: float

    def __str__(self) -> str:
        return f"Not isolable with these channels: record {self.channel} too, where the explanations differ by {self.apart:.0%}."


def deciding_channel(experiment: Experiment, found: Found, item: RankedEffect, method: Method) -> DecidingChannel | None:
    """Return the channel, the easiest to log, that tells an effect from all it is tied with; none where nothing is tied, or none does."""
    chosen = found.worth.get(item.candidate.part)
    tied = {candidate.part for candidate in item.tied}
    rivals = [trial.model.fitted for trial in found.rivals.get(item.candidate.part, ()) if trial.candidate.part in tied]
    channels = _recordable(experiment)
    if chosen is None or not rivals or not channels:
        return None
    first, *others = _simulated(experiment, channels, [chosen.model.fitted, *rivals])
    sizes = np.maximum(np.std(first, axis=1), 1e-300)
    apart = np.array([[root_mean_square(row) for row in other - first] for other in others]) / sizes
    least = np.min(np.nan_to_num(apart, nan=0.0, posinf=0.0), axis=0)
    return next(
        (DecidingChannel(*pair) for pair in zip(channels, least.tolist(), strict=True) if pair[1] > method.recording_checks.little_off),
        None,
    )


def _recordable(experiment: Experiment) -> list[str]:
    """Return what could be recorded and no compared channel shows, the easiest first."""
    parts = {part.name: part for part in experiment.machine.assembly.parts}
    wires = {item.target: item for item in experiment.machine.assembly.wires}
    shown = {measured_output(parts, wires, name) for name in experiment.machine.compare} | set(experiment.machine.compare)
    found = [
        f"{part.name}.{part.component.ports[role]}"
        for role in _RECORDABLE
        for part in parts.values()
        if part.component.ports.get(role, "") in part.component.declared(Output) and not issubclass(part.component, Effect)
    ]
    return [name for name in dict.fromkeys(found) if name not in shown and measured_output(parts, wires, name) not in shown]


def _simulated(experiment: Experiment, channels: Sequence[str], fits: Sequence[Fitted]) -> list[FloatArray]:
    """Return channels (channels, samples) of the lesson's own simulation for each fit."""
    own = experiment.own
    plan = wire(replace(own.plan.assembly, record=tuple(seen(experiment.with_candidates, name) for name in channels)))
    names = own.settable([name for fitted in fits for name in fitted.by_name])
    given = {name: own.given(name) for name in names}
    rows = np.array([[{**given, **fitted.by_name}[name] for name in names] for fitted in fits])
    samples, begin = (own.samples - 1) * own.every + 1, int(SETTLING * own.samples)
    runs = Batch(plan, samples, noisy=False).run(names, rows, lambda record: record[:, :: own.every][:, begin:].copy())
    return [np.asarray(run) for run in runs]
