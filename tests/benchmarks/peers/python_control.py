"""python-control: the plant is a nonlinear input/output system, asked for its response over each sample; the sampled parts by hand."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.benchmarks.peers.elsewhere import missing
from tests.benchmarks.peers.sampled_lathe import SampledLathe, positions

NAME = "python-control, one response a sample"
PACKAGE = "control"


def absent() -> str:
    return missing(PACKAGE)


def simulate(work: Any) -> np.ndarray:
    import control

    lathe = SampledLathe(work)

    def update(_: float, s: Any, u: Any, __: Any) -> list[float]:
        lathe.x_volts, lathe.z_volts, lathe.spindle_volts = u
        return lathe.rates(s)

    states = ["x_speed", "x", "z_speed", "z", "rotation", "turned"]
    plant = control.nlsys(update, None, states=states, inputs=["x_volts", "z_volts", "spindle_volts"], outputs=states, name="plant")
    span = np.array([0.0, work.period])

    def advance(state: list[float]) -> list[float]:
        volts = np.array([[volts, volts] for volts in (lathe.x_volts, lathe.z_volts, lathe.spindle_volts)])
        response = control.input_output_response(plant, span, volts, state, solve_ivp_kwargs={"rtol": 1e-9, "atol": 1e-9})
        return response.states[:, -1].tolist()  # type: ignore[no-any-return]

    return positions(work, lathe, advance)
