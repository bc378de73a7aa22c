"""How a host really moved: position and velocity of a machine part from what its sensor recorded.

An effect that senses its host is first tried against the *recorded* motion: then the force of a friction or a ripple is a known function
of time, and its size enters the simulated output linearly. With simulated motion a friction that is a little too large sticks where the
machine slid, and a search gets lost. Source: Gautier, Janot, Vandanjon, A new closed-loop output error method for parameter
identification of robot dynamics, IEEE Trans. Control Systems Technology 21 (2013): filtered motion for starts, simulation to decide.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.signal import butter, sosfiltfilt

from lathesim.component import Input
from lathesim.engine.assembly import Assembly, FloatArray, Part, Wire

_CUTOFF = 100.0
_CUTOFF_SHARE = 0.2


def smooth(values: FloatArray, period: float) -> FloatArray:
    """Give values filtered forwards and backwards (no lag), cut off at 100 Hz or at a fifth of the sampling rate [unit of the values]."""
    rate = 1.0 / period
    cutoff = min(_CUTOFF, _CUTOFF_SHARE * rate)
    sections = butter(2, cutoff / (0.5 * rate), output="sos")
    return np.asarray(sosfiltfilt(sections, values, padlen=min(len(values) - 2, int(3 * rate / cutoff))))


def velocity_of(position: FloatArray, period: float) -> FloatArray:
    """Give the velocity by central differences of the smoothed position [unit/s]."""
    return np.gradient(smooth(position, period), period)


def recorded_motion(assembly: Assembly, recorded: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Give, for outputs of machine parts (``part.position``, ``part.velocity``), what the sensors on them recorded, smoothed.

    ``recorded`` maps channels to one value a sample [SI]. A sensor is a part with the ports ``measured`` and ``reading``; a host a part
    with the ports ``displacement`` and ``flow``. A recorded output of the host itself counts too.
    """
    parts = {part.name: part for part in assembly.parts}
    wires = {wire.target: wire for wire in assembly.wires}
    period = assembly.sample_period
    found: dict[str, FloatArray] = {}
    for channel, values in recorded.items():
        if not np.isfinite(values).all():
            continue
        source = measured_output(parts, wires, channel)
        host, _, item = source.partition(".")
        ports = parts[host].component.ports if host in parts else {}
        if item == ports.get("displacement"):
            found.setdefault(f"{host}.{item}", smooth(values, period))
            if "flow" in ports:
                found.setdefault(f"{host}.{ports['flow']}", velocity_of(values, period))
        elif item == ports.get("flow"):
            velocity = smooth(values, period)
            found[f"{host}.{item}"] = velocity
            if "displacement" in ports:
                found.setdefault(f"{host}.{ports['displacement']}", cumulative_trapezoid(velocity, dx=period, initial=0.0))
    return found


def measured_output(parts: Mapping[str, Part], wires: Mapping[str, Wire], channel: str) -> str:
    """Give the output of the machine part that a channel shows: itself, or what its sensor is wired to, past effects in between."""
    name, _, item = channel.partition(".")
    ports = parts[name].component.ports if name in parts else {}
    if item != ports.get("reading"):
        return channel
    target = f"{name}.{ports['measured']}"
    while target in wires and wires[target].source:
        source = wires[target].source
        part = source.partition(".")[0]
        if source.endswith(".outgoing") and "incoming" in parts[part].component.declared(Input):
            target = f"{part}.incoming"
            continue
        return source
    return channel
