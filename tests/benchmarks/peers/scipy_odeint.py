"""scipy's odeint (LSODA), called once for each sample; the sampled parts by hand in Python."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.benchmarks.peers.sampled_lathe import SampledLathe

NAME = "scipy odeint, one call a sample"
TOLERANCE = 1e-9


def absent() -> str:
    return ""


def simulate(work: Any) -> np.ndarray:
    from scipy.integrate import odeint

    lathe = SampledLathe(work)
    state, span, kept = [0.0] * 6, [0.0, work.period], []
    for k in range(work.samples):
        lathe.instant(k, state)
        kept.append((state[1], state[3]))
        if lathe.done:
            break
        state = odeint(lambda s, _: lathe.rates(s), state, span, rtol=TOLERANCE, atol=TOLERANCE, hmax=work.period / 2)[1].tolist()
    return np.array(kept).T
