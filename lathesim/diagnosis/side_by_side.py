"""Trials side by side: each waits for simulations now and then, and two of them keep two cores busy.

How many run together does not depend on the machine, so that the same candidates are tried everywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from lathesim.diagnosis.fit import Free
from lathesim.diagnosis.terms import Term
from lathesim.diagnosis.trial import Bench, Model, Trial
from lathesim.engine.assembly import FloatArray

TOGETHER = 2


@dataclass(frozen=True)
class Asked:
    """A term to be tried on top of the ``kept`` ones, with what is free beside it and the values it starts from."""

    term: Term
    kept: tuple[Term, ...]
    free: Sequence[Free]
    starts: Sequence[FloatArray]
    promised: float = np.inf
    """Share of what is left with which a start makes the others needless."""


def side_by_side(bench: Bench, before: Model, asked: Sequence[Asked]) -> list[Trial]:
    """Try some terms, :data:`TOGETHER` at a time, and give the trials in the order in which they were asked for."""
    with ThreadPoolExecutor(TOGETHER) as pool:
        waiting = [pool.submit(bench.trial, before, one.term, one.kept, one.free, one.starts, one.promised) for one in asked]
        try:
            trials = [told(bench, one.result()) for one in waiting]
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return trials


def told(bench: Bench, trial: Trial) -> Trial:
    """Say how a trial went."""
    if np.isfinite(trial.held_out_gain):
        removes = f"removes {trial.share_of_all:.1%} of all, {trial.share_of_rest:.0%} of the rest"
        bench.say(f"  {trial.term.name} at {trial.term.at}: {trial.gain:.0f} nats, held out {trial.held_out_gain:.0f}, {removes}")
    return trial
