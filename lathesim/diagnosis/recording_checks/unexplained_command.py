"""How much of a recorded command does not follow from what its controller was given."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from lathesim.component import Component
from lathesim.identification.machine.roles import decides
from lathesim.identification.replay.closed_loop import SETTLING
from lathesim.identification.replay.controller_memory import shown_by
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.signal.analysis import root_mean_square


def shown_commands(experiment: Experiment) -> list[tuple[str, int]]:
    """Return each controller with the compared channel (row) that shows its command: itself, or what a drive makes of it."""
    parts = [part for part in experiment.machine.assembly.parts if makes_a_command(part.component)]
    rows = [(part.name, shown_by(experiment.machine.assembly, part, experiment.machine.compare)[:1]) for part in parts]
    return [(name, row[0]) for name, row in rows if row]


def controller_commands(experiment: Experiment) -> list[tuple[int, str]]:
    """Return place and name of each compared channel that is the command of a controller."""
    parts = {part.name: part.component for part in experiment.machine.assembly.parts}
    return [(row, name) for row, name in enumerate(experiment.machine.compare) if makes_a_command(parts[name.partition(".")[0]])]


def unexplained_share(experiment: Experiment, values: Mapping[str, float]) -> Iterator[tuple[int, float]]:
    """Return for each controller's command its place among the compared channels and the share of it that a replay does not explain."""
    rows = [row for row, _ in controller_commands(experiment)]
    residual = experiment.sensed.one(values) if rows else np.zeros((0, 0))
    for row in rows:
        size = float(np.std(np.nan_to_num(experiment.sensed.recorded[row])))
        settled = residual[row][int(SETTLING * experiment.sensed.samples) :]
        yield row, root_mean_square(settled) / size if size > 0.0 else 0.0


def makes_a_command(component: type[Component]) -> bool:
    """Return whether a part is a controller: it decides, and is no converter or moving part."""
    return decides(component) and "displacement" not in component.ports
