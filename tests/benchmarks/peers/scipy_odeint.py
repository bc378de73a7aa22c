"""scipy's odeint (LSODA), called once for each sample; the sampled parts by hand in Python."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.benchmarks.peers.sampled_lathe import SampledLathe, positions

NAME = "scipy odeint, one call a sample"
TOLERANCE = 1e-9


def absent() -> str:
    return ""


def simulate(work: Any) -> np.ndarray:
    from scipy.integrate import odeint

    lathe, span = SampledLathe(work), [0.0, work.period]

    def advance(state: list[float]) -> list[float]:
        return odeint(lambda s, _: lathe.rates(s), state, span, rtol=TOLERANCE, atol=TOLERANCE, hmax=work.period / 2)[1].tolist()  # type: ignore[no-any-return]

    return positions(work, lathe, advance)
