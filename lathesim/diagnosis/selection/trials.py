"""Trials of several candidates, some at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.diagnosis.selection.laboratory import Laboratory
from lathesim.engine.assembly import FloatArray
from lathesim.identification.execution.threads import together
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.fit import Free
from lathesim.identification.records.model import CandidateStanding, Model, Standing, Trial


@dataclass(frozen=True)
class Asked:
    """A candidate to be tried on top of the ``kept`` ones, with what is free beside it and the values it starts from."""

    candidate: Candidate
    kept: tuple[Candidate, ...]
    free: Sequence[Free]
    starts: Sequence[FloatArray]
    promised: float = np.inf
    """Share of what is left with which a start makes the others needless."""
    with_simulated_motion: bool = False
    """Whether frictions sense the simulated motion."""


def side_by_side(laboratory: Laboratory, before: Model, asked: Sequence[Asked]) -> list[Trial]:
    """Return the trials of some candidates, in the order in which they were asked for."""

    def one(asked: Asked) -> Trial:
        return laboratory.trial(
            before, asked.candidate, asked.kept, asked.free, asked.starts, asked.promised, with_simulated_motion=asked.with_simulated_motion
        )

    return [told(laboratory, trial) for trial in together(one, asked)]


def told(laboratory: Laboratory, trial: Trial) -> Trial:
    """Return how a trial went."""
    if np.isfinite(trial.validation_gain):
        removes = f"removes {trial.share_of_all:.1%} of all, {trial.share_of_rest:.0%} of the rest"
        name = f"{trial.candidate.name} at {trial.candidate.at}"
        standing = CandidateStanding(name, trial.gain, trial.validation_gain, trial.share_of_all)
        laboratory.progress(Standing.told(f"  {name}: {trial.gain:.0f} nats, held out {trial.validation_gain:.0f}, {removes}", [standing]))
    return trial
