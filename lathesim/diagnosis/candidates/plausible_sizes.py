"""How large effects could be on this machine: no friction is larger than all that ever acts there.

Usual sizes are those of a small lathe. A press or a rotary table has a hundred times as much of everything, and what is beyond belief on
the one is usual on the other. The bound is taken from the recording: the largest effort that acts on the host, and that over its largest
speed for what grows with the speed; the smaller the machine the more a belt may slip for each newton metre.
"""

from __future__ import annotations

import numpy as np

from lathesim.identification.machine.roles import acting
from lathesim.identification.replay.experiment import Rig
from lathesim.identification.replay.measured_motion import recorded_motion
from lathesim.units import same_dimension

_MOST_LOST = 0.3
"""Share of the largest speed that could be lost under the largest load."""


def possible_sizes(rig: Rig) -> dict[str, float]:
    """Give how large parameters of the candidates (free name -> size) could be, as far as they are efforts, grow with a speed, or are
    losses for each effort."""
    found: dict[str, float] = {}
    for host, bounds in _bounds(rig).items():
        for term in (term.shaped or term for term in rig.candidates if term.at == host and term.part in rig.sensed.plan.parts):
            declarations = rig.sensed.plan.parts[term.part].component.declarations
            for name in term.parameters:
                unit = declarations[name.partition(".")[2]].unit
                size = next((size for of, size in bounds.items() if same_dimension(of, unit)), None)
                found |= {name: size} if size is not None else {}
    return found


def _bounds(rig: Rig) -> dict[str, dict[str, float]]:
    """Give for each part that is pushed the units of an effort, of one over a speed, and of a loss for each effort, with the largest of
    each: part -> unit -> size."""
    channels = rig.sensed.plan.channels
    motion = recorded_motion(rig.with_candidates, {name: rig.record[name] for name in rig.machine.compare})
    sources = dict(acting(rig.machine.assembly))
    found: dict[str, dict[str, float]] = {}
    for part in rig.machine.assembly.parts:
        ports, declarations = part.component.ports, part.component.declarations
        target = f"{part.name}.{ports.get('drive', '')}"
        if not {"effort", "flow", "drive"} <= set(ports) or declarations[ports["drive"]].unit != declarations[ports["effort"]].unit:
            continue
        if target in rig.machine.drive:
            pushing = rig.record[target]
        elif sources.get(target) in channels:
            pushing = rig.sensed.channel([], [], channels.index(sources[target]))
        else:
            continue
        unit, flow = (declarations[ports[role]].unit for role in ("effort", "flow"))
        effort = float(np.max(np.abs(np.nan_to_num(pushing)), initial=0.0))
        speed = float(np.max(np.abs(motion.get(f"{part.name}.{ports['flow']}", np.zeros(1)))))
        found[part.name] = {unit: effort}
        if speed > 0.0 and effort > 0.0:
            found[part.name] |= {f"({unit})/({flow})": effort / speed, f"({flow})/({unit})": _MOST_LOST * speed / effort}
        if effort > 0.0:
            found[part.name] |= {f"1/({unit})": _MOST_LOST / effort}
    return found
