"""How large effects could be on this machine: no friction is larger than all that ever acts there.

Usual sizes are those of a small lathe. A press or a rotary table has a hundred times as much of everything, and what is beyond belief on
the one is usual on the other. The bound is taken from the recording: the largest effort that acts on the host, the whole way and the
largest speed of its motion, and the effort over that speed for what grows with the speed; the smaller the machine the more a belt may slip
for each newton metre.
"""

from __future__ import annotations

import numpy as np

from lathesim.diagnosis.candidates.periodic_starts import PERIODS
from lathesim.engine.assembly import Place
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.roles import acting
from lathesim.units import same_dimension


def possible_sizes(experiment: Experiment) -> dict[str, float]:
    """Return how large parameters of the candidates (free name -> size) could be, as far as they are efforts, ways or speeds, grow with a
    speed, or are losses for each effort. A wavelength is read off the recording and has no bound here."""
    found: dict[str, float] = {}
    for host, bounds in _bounds(experiment).items():
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
