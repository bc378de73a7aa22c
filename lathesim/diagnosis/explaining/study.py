"""What every step of a diagnosis takes first: the recordings in their machine, the limits, and how large effects could be there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from lathesim.diagnosis.candidates.periodic_starts import PERIODS
from lathesim.diagnosis.method import Method
from lathesim.engine.assembly import Place
from lathesim.identification.execution import Deadline, Progress
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.roles import acting
from lathesim.units import same_dimension


@dataclass(frozen=True)
class Study:
    """A machine with its recordings: ``estimation`` is fitted, ``validation`` judges, ``earlier`` is from before a change, if any.

    Before ``ends`` the search is over, and the answer holds what is known by then.
    """

    estimation: Experiment
    validation: Experiment
    method: Method
    progress: Progress
    earlier: Experiment | None = None
    ends: Deadline = field(default_factory=Deadline)

    @cached_property
    def possible(self) -> Mapping[str, float]:
        """How large parameters (free name -> size) could be on this machine, whatever is usual on others."""
        return possible_sizes(self.estimation, _bounds(self.estimation))

    @cached_property
    def pushing(self) -> Mapping[str, float]:
        """The largest effort on a part that nothing but a recorded input pushes, for each effort of a candidate there (name -> size)."""
        machine, found = self.estimation.machine, {}
        for part, bounds in _bounds(self.estimation).items():
            ports = machine.assembly.ports(part)
            others = (f"{part}.{ports['effort']}" in one for one in (machine.assembly.sources, machine.drive))
            if f"{part}.{ports['drive']}" in machine.drive and not any(others):
                unit = machine.assembly.by_name[part].component.declarations[ports["effort"]].unit
                found[part] = {unit: bounds[unit]}
        return possible_sizes(self.estimation, found)

    @property
    def least_share(self) -> float:
        """The share of the error that an effect must explain: any where an earlier recording shows the errors of the lesson."""
        return self.method.material if self.earlier is None else 0.0

    @property
    def share_of_rest(self) -> float:
        """The share of what is left that a second effect and a finer form must explain: any beside an earlier recording."""
        return self.method.share_of_rest if self.earlier is None else 0.0

    @property
    def judges_itself(self) -> bool:
        """Whether one stroke alone was recorded, which judges what is fitted to it."""
        return self.validation is self.estimation or (self.validation.record is self.estimation.record and self.validation.weights is None)


def possible_sizes(experiment: Experiment, largest: Mapping[str, Mapping[str, float]]) -> dict[str, float]:
    """Return how large parameters of the candidates (free name -> size) could be, as far as they are efforts, ways or speeds, grow with a
    speed, or are losses for each effort: of which the ``largest`` are known, part -> unit -> size. A wavelength has no bound here.

    Usual sizes are those of a small lathe, and a press has a hundred times as much of everything. The bound is the largest effort that acts
    on the host, the whole way and the largest speed of its motion, and the effort over that speed for what grows with the speed; the
    smaller the machine the more a belt may slip for each newton metre.
    """
    found: dict[str, float] = {}
    for host, bounds in largest.items():
        for candidate in (
            candidate.shaped or candidate
            for candidate in experiment.candidates
            if candidate.at == host and candidate.part in experiment.sensed.plan.parts
        ):
            declarations = experiment.sensed.plan.parts[candidate.part].component.declarations
            for name in candidate.parameters:
                item = Place.of(name).port
                size = next((size for of, size in bounds.items() if same_dimension(of, declarations[item].unit)), None)
                found |= {name: size} if size is not None and item not in PERIODS else {}
    return found


def _bounds(experiment: Experiment) -> dict[str, dict[str, float]]:
    """Return for each part that is pushed the units of an effort, a way, a speed, an effort over a speed, and a loss for each effort, with
    the largest of each: part -> unit -> size."""
    channels = experiment.sensed.plan.channels
    motion = experiment.motion
    sources = dict(acting(experiment.machine.assembly))
    found: dict[str, dict[str, float]] = {}
    for part in experiment.machine.assembly.parts:
        ports, declarations = part.component.ports, part.component.declarations
        target = f"{part.name}.{ports.get('drive', '')}"
        if not {"effort", "flow", "drive"} <= set(ports):
            continue
        pushes = declarations.get(ports.get("applied", ""), declarations[ports["drive"]])
        if pushes.unit != declarations[ports["effort"]].unit:
            continue
        if target in experiment.machine.drive and pushes is declarations[ports["drive"]]:
            pushing = experiment.record[target]
        elif sources.get(target) in channels:
            pushing = experiment.sensed.channel([], [], channels.index(sources[target]))
        else:
            continue
        unit, flow = (declarations[ports[role]].unit for role in ("effort", "flow"))
        effort = float(np.max(np.abs(np.nan_to_num(pushing)), initial=0.0))
        place, velocity = (motion.get(f"{part.name}.{ports.get(role, '')}", np.zeros(1)) for role in ("displacement", "flow"))
        speed = float(np.max(np.abs(velocity)))
        found[part.name] = {unit: effort, flow: speed}
        if "displacement" in ports:
            found[part.name][declarations[ports["displacement"]].unit] = float(np.ptp(place))
        if speed > 0.0 and effort > 0.0:
            found[part.name] |= {f"({unit})/({flow})": effort / speed, f"({flow})/({unit})": speed / effort}
        if effort > 0.0:
            found[part.name] |= {f"1/({unit})": 1.0 / effort}
    return found
