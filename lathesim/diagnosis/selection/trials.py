"""Trials of several candidates, some at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.diagnosis.selection.laboratory import Bench
from lathesim.engine.assembly import FloatArray
from lathesim.identification.execution.threads import together
from lathesim.identification.records.candidate import Term
from lathesim.identification.records.fit import Free
from lathesim.identification.records.model import Model, Trial


@dataclass(frozen=True)
class Asked:
    """A term to be tried on top of the ``kept`` ones, with what is free beside it and the values it starts from."""

    term: Term
    kept: tuple[Term, ...]
    free: Sequence[Free]
    starts: Sequence[FloatArray]
    promised: float = np.inf
    """Share of what is left with which a start makes the others needless."""
    felt: bool = False
    """Whether frictions sense the simulated motion."""


def side_by_side(bench: Bench, before: Model, asked: Sequence[Asked]) -> list[Trial]:
    """Try some terms and give the trials in the order in which they were asked for."""

    def one(asked: Asked) -> Trial:
        return bench.trial(before, asked.term, asked.kept, asked.free, asked.starts, asked.promised, felt=asked.felt)

    return [told(bench, trial) for trial in together(one, asked)]


def told(bench: Bench, trial: Trial) -> Trial:
    """Say how a trial went."""
    if np.isfinite(trial.held_out_gain):
        removes = f"removes {trial.share_of_all:.1%} of all, {trial.share_of_rest:.0%} of the rest"
        bench.say(f"  {trial.term.name} at {trial.term.at}: {trial.gain:.0f} nats, held out {trial.held_out_gain:.0f}, {removes}")
    return trial
