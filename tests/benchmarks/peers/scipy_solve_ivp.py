"""scipy's solve_ivp (RK45), called once for each sample; the sampled parts by hand in Python."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.benchmarks.peers.sampled_lathe import SampledLathe

NAME = "scipy solve_ivp, one call a sample"
TOLERANCE = 1e-9


def absent() -> str:
    return ""


def simulate(work: Any) -> np.ndarray:
    from scipy.integrate import solve_ivp

    lathe = SampledLathe(work)
    state, span, kept = [0.0] * 6, [0.0, work.period], []
    for k in range(work.samples):
        lathe.instant(k, state)
        kept.append((state[1], state[3]))
        if lathe.done:
            break
        state = solve_ivp(lambda _, s: lathe.rates(s), span, state, rtol=TOLERANCE, atol=TOLERANCE).y[:, -1].tolist()
    return np.array(kept).T
