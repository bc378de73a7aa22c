"""PathSim: one block for each machine part, fixed-step RK4, sampled parts as scheduled events."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.benchmarks.peers.elsewhere import missing
from tests.benchmarks.peers.part_model import PartModel, part_models

NAME = "PathSim, one block a part"
PACKAGE = "pathsim"
SLOW = True


def absent() -> str:
    return missing(PACKAGE)


def simulate(work: Any) -> np.ndarray:
    from pathsim import Connection, Simulation
    from pathsim.blocks import Block, DynamicalSystem, Function
    from pathsim.events import Schedule
    from pathsim.solvers import RK4

    class Sampled(Block):
        """A part that acts at sample instants and holds in between."""

        def __init__(self, model: PartModel) -> None:
            super().__init__()
            self.model = model
            self.events = [Schedule(t_start=0.0, t_period=work.period, func_act=self.act)]
            self.outputs.update_from_array(np.zeros(len(model.outputs)))

        def __len__(self) -> int:
            return int(self.model.passes_through)

        def act(self, time: float) -> None:
            inputs = self.inputs.to_array().tolist()
            self.model.sample(inputs, (), time)
            self.outputs.update_from_array(np.array(self.model.give(inputs, (), time)))

        def update(self, t: float) -> None:
            if self.model.passes_through:
                self.outputs.update_from_array(np.array(self.model.give(self.inputs.to_array().tolist(), (), t)))

    class Recorder(Block):
        """Keeps its inputs at every sample instant, after all parts have acted."""

        def __init__(self) -> None:
            super().__init__()
            self.kept: list[np.ndarray] = []
            self.events = [Schedule(t_start=0.0, t_period=work.period, func_act=lambda _: self.kept.append(self.inputs.to_array().copy()))]

        def __len__(self) -> int:
            return 0

        def update(self, t: float) -> None:
            pass

    def dynamic(model: PartModel) -> Any:
        assert model.derivative is not None
        law, give = model.derivative, model.give
        return DynamicalSystem(
            lambda x, u, t: np.array(law(u.tolist(), x.tolist(), t)), lambda x, u, t: np.array(give(u.tolist(), x.tolist(), t)),
            np.array(model.start),
        )  # fmt: skip

    def algebraic(model: PartModel) -> Any:
        return Function(lambda *u: np.array(model.give([float(item) for item in u], (), 0.0)))

    models = part_models(work)
    blocks = {m.name: Sampled(m) if m.is_sampled else dynamic(m) if m.derivative else algebraic(m) for m in models}
    recorder = Recorder()
    ports = {name: (m.name, port) for m in models for port, name in enumerate(m.outputs)}
    targets = [*((blocks[m.name], m.sources) for m in models), (recorder, list(work.channels))]
    wires = []
    for block, sources in targets:
        bundles: dict[str, list[tuple[int, int]]] = {}
        for port, source in enumerate(sources):
            bundles.setdefault(ports[source][0], []).append((ports[source][1], port))
        wires += [Connection(blocks[name][[a for a, _ in pairs]], block[[b for _, b in pairs]]) for name, pairs in bundles.items()]
    simulation = Simulation([*blocks.values(), recorder], wires, dt=work.step, Solver=RK4, log=False)
    simulation.run(work.duration, adaptive=False)
    kept = np.array(recorder.kept).T
    return kept[[work.channels.index("x_axis.position"), work.channels.index("z_axis.position")]]
