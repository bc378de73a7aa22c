"""scipy's solve_ivp (RK45), called once for each sample; the sampled parts by hand in Python."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.benchmarks.peers.sampled_lathe import SampledLathe, positions

NAME = "scipy solve_ivp, one call a sample"
TOLERANCE = 1e-9


def absent() -> str:
    return ""


def simulate(work: Any) -> np.ndarray:
    from scipy.integrate import solve_ivp

    lathe, span = SampledLathe(work), [0.0, work.period]

    def advance(state: list[float]) -> list[float]:
        return solve_ivp(lambda _, s: lathe.rates(s), span, state, rtol=TOLERANCE, atol=TOLERANCE).y[:, -1].tolist()  # type: ignore[no-any-return]

    return positions(work, lathe, advance)
