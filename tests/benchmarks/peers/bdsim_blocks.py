"""bdsim: one block for the sampled parts, one for each continuous part.

A clocked block of bdsim answers one sample later, so the sampled parts, which hand on fresh values within an instant, must be one block.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.benchmarks.peers.elsewhere import missing
from tests.benchmarks.peers.sampled_lathe import SampledLathe

NAME = "bdsim, one block a continuous part"
PACKAGE = "bdsim"


def absent() -> str:
    return missing(PACKAGE)


def simulate(work: Any) -> np.ndarray:
    import bdsim
    from bdsim.block import ContinuousBlock, SampledBlock

    lathe = SampledLathe(work)
    p = lathe.p
    kept: list[tuple[float, float]] = []

    class Axis(ContinuousBlock):
        """speed' = (gain volts - disturbance_gain load - speed) / time_constant, position' = speed."""

        nin, nout = 2, 2

        def __init__(self, settings: Any, **options: Any) -> None:
            super().__init__(nstates=2, nin=2, nout=2, **options)
            self.settings = settings

        def output(self, t: float, u: list[Any], x: np.ndarray) -> list[Any]:
            return [float(x[0]), float(x[1])]

        def deriv(self, t: float, u: list[Any], x: np.ndarray) -> np.ndarray:
            s = self.settings
            return np.array([(s.gain * u[0] - s.disturbance_gain * u[1] - x[0]) / s.time_constant, x[0]])

    class Computer(SampledBlock):
        """Everything that happens at the sample instants; gives the three voltages."""

        nin, nout = 6, 3

        def __init__(self, clock: Any, **options: Any) -> None:
            self.instant = 0
            super().__init__(clock=clock, x0=self.acted([0.0] * 6), nin=6, nout=3, **options)

        def acted(self, state: list[float]) -> np.ndarray:
            if not lathe.done:
                lathe.instant(self.instant, state)
                kept.append((state[1], state[3]))
            self.instant += 1
            return np.array([lathe.x_volts, lathe.z_volts, lathe.spindle_volts])

        def output(self, t: float, u: list[Any], x: np.ndarray) -> list[Any]:
            return [float(item) for item in x]

        def next(self, t: float, u: list[Any], x: np.ndarray) -> np.ndarray:
            return self.acted([float(item) for item in u])

    simulator = bdsim.BDSim(animation=False, graphics=False, progress=False, quiet=True, banner=False, sysargs=False)
    diagram = simulator.blockdiagram()
    clock = diagram.clock(work.period, unit="s")
    computer = Computer(clock, name="computer")
    x, z, spindle = Axis(p.x_axis, name="x_axis"), Axis(p.z_axis, name="z_axis"), Axis(p.spindle, name="spindle")
    for block in (computer, x, z, spindle):
        diagram.add_block(block)
    cut = diagram.FUNCTION(lambda vx, px, vz, w: [float(item) for item in lathe.cut((vx, px, vz, 0.0, w))], nin=4, nout=5, name="cut")
    force = diagram.FUNCTION(lambda d, f, v, touching: list(lathe.force(d, f, v, touching > 0.5)), nin=4, nout=3, name="force")
    load = diagram.FUNCTION(
        lambda fc, fl, fr, r, vx, vz, w: list(lathe.load((fc, fl, fr), r, (vx, 0.0, vz, 0.0, w))), nin=7, nout=3, name="load"
    )
    wires = [
        *((block[output], computer[2 * number + output]) for number, block in enumerate((x, z, spindle)) for output in (0, 1)),
        *((computer[number], block[0]) for number, block in enumerate((x, z, spindle))),
        *((load[number], block[1]) for number, block in enumerate((x, z, spindle))),
        (x[0], cut[0]), (x[1], cut[1]), (z[0], cut[2]), (spindle[0], cut[3]),
        (cut[0], force[0]), (cut[1], force[1]), (cut[2], force[2]), (cut[4], force[3]),
        *((force[number], load[number]) for number in range(3)), (cut[3], load[3]), (x[0], load[4]), (z[0], load[5]), (spindle[0], load[6]),
    ]  # fmt: skip
    for source, target in wires:
        diagram.connect(source, target)
    diagram.compile()
    tolerances = {"rtol": 1e-9, "atol": 1e-9}
    simulator.run(diagram, T=work.duration + 0.5 * work.period, solver="RK45", solver_args=tolerances, block=False)
    return np.array(kept).T
