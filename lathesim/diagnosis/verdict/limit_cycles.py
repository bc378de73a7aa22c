"""Channels that are off by no more than a loop swings by chance between two steps of the converter that reads its sensor.

A converter decides at the last digit of a reading when a step is taken, and in a closed loop each step decides on the next one: two
machines that are alike swing alike, and not in step. How far apart they are is how far the steps move the lesson's own simulation at all,

    s = rms(y with the converters' steps - y without).

What a converter read was not recorded, so no replay can follow that.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from lathesim.component import Parameter
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.diagnosis import ChannelFit
from lathesim.identification.replay.closed_loop import SETTLING
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.signal.analysis import root_mean_square


def off_by_chance(
    experiment: Experiment, values: Mapping[str, float], fit: Mapping[str, ChannelFit], method: Method = STANDARD
) -> set[str]:
    """Return the channels that the lesson's own simulation with some ``values`` is off by (``fit``) no more than the steps of converters
    move it; none where no converter reads a sensor."""
    converters = [(part.name, part.component) for part in experiment.machine.assembly.parts if "bits" in part.component.ports]
    fine = {f"{name}.{item.ports['bits']}": item.declared(Parameter)[item.ports["bits"]].high for name, item in converters}
    if not fine:
        return set()
    names = experiment.own.settable([*values, *fine])
    given = {name: values.get(name, experiment.own.given(name)) for name in names}
    rows = [[chosen[name] for name in names] for chosen in (given, given | fine)]
    with_steps, without = experiment.own.outputs(names, np.array(rows))
    begin = int(SETTLING * experiment.own.samples)
    moved = {name: root_mean_square((with_steps - without)[row][begin:]) for row, name in enumerate(experiment.machine.compare)}
    return {name for name, size in moved.items() if 0.0 < fit[name].after < method.shared.alike * size}
