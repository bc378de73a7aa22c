"""How a host really moved: position and velocity of a machine part from what its sensor recorded, and where its states start.

An effect that senses its host is first tried against the *recorded* motion: then the force of a friction or a ripple is a known function
of time, and its size enters the simulated output linearly. With simulated motion a friction that is a little too large sticks where the
machine slid, and a search gets lost. Source: Gautier, Janot, Vandanjon, A new closed-loop output error method for parameter
identification of robot dynamics, IEEE Trans. Control Systems Technology 21 (2013): filtered motion for starts, simulation to decide.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.signal import butter, savgol_filter, sosfilt, sosfilt_zi

from lathesim.component import Parameter, State
from lathesim.engine.assembly import SIDES, Assembly, FloatArray, Part, Place
from lathesim.identification.roles import behind_effects, is_led
from lathesim.identification.signal import SLOPE_ROUNDING, channel_floor

_STEADY = 3e-3
"""Share of its usual speed by which noise may move the velocity of a feed ..."""
_FEWEST, _LONGEST = 5, 0.2
"""... as far as that takes no fewer samples and no longer [s]."""
_MOVING = 0.02
"""Share of the fastest motion above which a part moves."""
_SPREAD = 0.01
"""How far the smoothed recording may be off at its first sample, as a share of the motion's standard deviation (its end effect)."""


def smooth(values: FloatArray, period: float) -> FloatArray:
    """Return values (..., samples) filtered forwards and backwards (no lag), cut off at 100 Hz or at a fifth of the sampling rate [unit of
    the values].

    Both ends are continued, turned about the last value, and each way begins at rest on its first one. This is ``scipy.signal.sosfiltfilt``
    with what it works out anew in each call kept: every run of a search is filtered.
    """
    rate, cutoff = 1.0 / period, _cutoff(period)
    sections, at_rest = _low_pass(cutoff / (0.5 * rate))
    samples = values.shape[-1]
    beyond = min(samples - 2, int(3 * rate / cutoff))
    before, after = 2.0 * values[..., :1] - values[..., beyond:0:-1], 2.0 * values[..., -1:] - values[..., -2 : -beyond - 2 : -1]
    found = np.concatenate([before, values, after], axis=-1)
    at_rest = at_rest.reshape(len(at_rest), *(1,) * (values.ndim - 1), 2)
    for _ in range(2):
        found = sosfilt(sections, found, zi=at_rest * found[..., :1])[0][..., ::-1]
    return np.asarray(found[..., beyond : beyond + samples])


def _cutoff(period: float) -> float:
    """Return the frequency above which a recorded motion is smoothed [Hz]."""
    return min(100.0, 0.2 / period)


@functools.lru_cache(maxsize=16)
def _low_pass(cutoff: float) -> tuple[FloatArray, FloatArray]:
    """Return the sections of a filter that cuts off at a share of half the sampling rate, and their state at rest on a value of 1."""
    sections = butter(2, cutoff, output="sos")
    return sections, sosfilt_zi(sections)


def velocity_of(position: FloatArray, period: float) -> FloatArray:
    """Return the velocity by central differences of the smoothed position (..., samples) [unit/s]."""
    return np.asarray(np.gradient(smooth(position, period), period, axis=-1))


def recorded_motion(assembly: Assembly, recorded: Mapping[str, FloatArray], *, smoothed: bool = True) -> dict[str, FloatArray]:
    """Return, for outputs of machine parts (``part.position``, ``part.velocity``), what the sensors on them recorded, ``smoothed`` or not.

    ``recorded`` maps channels to one value a sample [SI]. A sensor is a part with the ports ``measured`` and ``reading``; a host a part
    with the ports ``displacement`` and ``flow``. A recorded output of the host itself counts too. A reading in another unit, as the volts
    of a tachometer, is divided by the sensor's ``gain``. The motion of a part that is led is given, so no sensor has to show it.
    """
    period = assembly.sample_period
    found: dict[str, FloatArray] = {}
    gained: dict[str, FloatArray] = {}
    for shown in _shown_motion(assembly, recorded):
        values = shown.values / shown.gain
        values = smooth(values, period) if smoothed else values
        if shown.is_place:
            found.setdefault(shown.output, values)
            if shown.flow:
                found.setdefault(shown.flow, np.gradient(values, period))
        else:
            (found if shown.gain == 1.0 else gained)[shown.output] = values
    # a gain may be wrong: where something counts the way, that tells the speed as well
    velocities = {name: values for name, values in gained.items() if name not in found}
    found.update(velocities)
    for source in found.copy():
        host, item = Place.of(source)
        ports = assembly.ports(source)
        if item == ports.get("flow") and "displacement" in ports:
            found.setdefault(f"{host}.{ports['displacement']}", cumulative_trapezoid(found[source], dx=period, initial=0.0))
    return found


def counted_motion(
    assembly: Assembly, recorded: Mapping[str, FloatArray], modelled: Mapping[str, FloatArray] | None = None
) -> dict[str, FloatArray]:
    """Return places and velocities of machine parts (``part.position``, ``part.velocity``) as sensors show them, by the gains that they
    have.

    The velocity is as steady as a feed has to be: it is smoothed until what noise and counts add to it is next to nothing. Of a part whose
    motion is ``modelled``, from the same recorded commands, only what that is beside the recorded one is smoothed.
    """
    period = assembly.sample_period
    places: dict[str, FloatArray] = {}
    velocities: dict[str, FloatArray] = {}
    for shown in _shown_motion(assembly, recorded):
        if shown.is_place and shown.output not in places:
            places[shown.output] = smooth(shown.values, period)
            if shown.flow:
                velocities[shown.flow] = _steady_velocity(shown, period, modelled or {})
        elif not shown.is_place and shown.output not in velocities:
            values = shown.values / shown.gain
            noise = channel_floor(values) / (_STEADY * _usual(values))
            velocities[shown.output] = savgol_filter(values, _odd(2.25 * noise**2, len(values), period), 2)
    return {**velocities, **places}


@dataclass(frozen=True)
class _Shown:
    """A place or velocity (``output``) that a channel shows, ``gain`` times as large; ``flow`` is the velocity that belongs to a place."""

    output: str
    values: FloatArray
    gain: float
    is_place: bool
    flow: str


def _shown_motion(assembly: Assembly, recorded: Mapping[str, FloatArray]) -> Iterator[_Shown]:
    """Return what whole channels show of the motion of machine parts, those at the motor first; places only in their unit."""
    side = {part.name: part.side for part in assembly.parts}
    for channel, values in sorted(recorded.items(), key=lambda item: SIDES.index(side.get(Place.of(item[0]).part, ""))):
        source = _shown_through(assembly, channel)
        host, item = Place.of(source)
        ports = assembly.ports(source)
        is_place = item == ports.get("displacement")
        if not np.isfinite(values).all() or not (is_place or item == ports.get("flow")) or is_led(assembly.by_name[host].component):
            continue
        gain = _gain(assembly, channel, source)
        if gain == 1.0 or (gain and not is_place):
            yield _Shown(source, values, gain, is_place, f"{host}.{ports['flow']}" if is_place and "flow" in ports else "")


def _shown_through(assembly: Assembly, channel: str) -> str:
    """Return what a channel shows in the end: a converter reads a tachometer, and that a spindle. What a controller makes of what it
    measures shows nothing of it."""
    shown = channel
    while "drive" not in assembly.ports(shown) and (further := measured_output(assembly, shown)) != shown:
        shown = further
    return shown


def _steady_velocity(shown: _Shown, period: float, modelled: Mapping[str, FloatArray]) -> FloatArray:
    """Return the velocity of a position as the slope of parabolas through n samples each, which takes no notice of a rapid move further
    away: white noise s of the position makes s sqrt(12 / n^3) / T of it, and n is so large that this is a small share of the usual speeds.
    Beside a modelled motion it is that one's velocity and the slope of what the position is beside it.

    Source: Savitzky, Golay, Smoothing and differentiation of data, Analytical Chemistry 36 (1964).
    """
    position = shown.values
    noise = channel_floor(position) / (_STEADY * _usual(velocity_of(position, period)) * period)
    width = _odd(12.0 ** (1.0 / 3.0) * noise ** (2.0 / 3.0), len(position), period)
    place, velocity = (modelled.get(name, np.zeros(len(position))) for name in (shown.output, shown.flow))
    return np.asarray(savgol_filter(position - place, width, 2, deriv=1, delta=period) + velocity)


def _usual(velocity: FloatArray) -> float:
    """Return the speed that is usual where a part moves; infinite where it never does."""
    speed = np.abs(velocity)
    moving = speed[speed > _MOVING * speed.max(initial=0.0)]
    return float(np.median(moving)) if len(moving) else np.inf


def _odd(samples: float, count: int, period: float) -> int:
    """Return an odd number of samples next to the one asked for, as far as it may be."""
    longest = max(_FEWEST, min(int(_LONGEST / period), count - 1))
    width = int(np.clip(samples, _FEWEST, longest))
    return width + 1 - width % 2


def _gain(assembly: Assembly, channel: str, source: str) -> float:
    """Return by what a reading is to be divided to be what it shows: 1 where it has its unit; 0 where nobody knows."""
    if assembly.declared(channel).unit == assembly.declared(source).unit:
        return 1.0
    name = assembly.ports(channel).get("gain")
    return assembly.by_name[Place.of(channel).part].value(name) if name else 0.0


def measured_output(assembly: Assembly, channel: str) -> str:
    """Return the output of the machine part that a channel shows: itself, or what its sensor is wired to, past effects in between; of the
    rate that an encoder makes of its counts the velocity that belongs to the place."""
    name, item = Place.of(channel)
    ports = assembly.ports(channel)
    if item == ports.get("rate"):
        place = measured_output(assembly, f"{name}.{ports['reading']}")
        host, shown = Place.of(place)
        moving = assembly.ports(place)
        return f"{host}.{moving['flow']}" if shown == moving.get("displacement") and "flow" in moving else channel
    if item != ports.get("reading") or "measured" not in ports:
        return channel
    return behind_effects(assembly, f"{name}.{ports['measured']}") or channel


def start_from(part: Part, state: str, motion: Mapping[str, FloatArray], period: float) -> tuple[float, float] | None:
    """Return the recorded start of a state, and how sure it is; none where no recorded output of the part (``part.output`` -> values)
    tells.

    An output shows a state as it is (``position`` showing ``travel``), or in proportion, output = a + b state: the speed of a table that of
    its motor. At its end a smoothed place has no more of its curvature: a speed is no surer than by how much it changes while the
    smoothing lasts, half a period of its cut-off.
    """
    component = part.component
    unit = component.declarations[state].unit
    shown = [component.ports[role] for role in ("displacement", "flow") if role in component.ports]
    settled = round(0.5 / (_cutoff(period) * period))
    for output in sorted(shown, key=lambda name: component.declarations[name].unit != unit):
        values = motion.get(f"{part.name}.{output}")
        line = (0.0, 1.0) if component.declarations[output].unit == unit else line_of(part, output, state)
        if values is not None and line is not None:
            constant, slope = line
            changed = abs(float(values[: settled + 1][-1] - values[0])) if output == component.ports.get("flow") else 0.0
            return (float(values[0]) - constant) / slope, max(_SPREAD * float(np.std(values)), changed) / abs(slope) + 1e-12
    return None


def line_of(part: Part, output: str, state: str) -> tuple[float, float] | None:
    """Return a and b of an output that is a + b times a state and nothing else that moves; none of any other one."""
    component = part.component
    parameters, states = component.declared(Parameter), component.declared(State)
    taken = component.taken_for(output)
    if state not in taken or any(name not in parameters and name not in states for name in taken):
        return None
    given = {name: item.default for name, item in parameters.items()} | dict(part.parameters)

    def output_at(value: float, others: float) -> float:
        return component.value_of(output, given | dict.fromkeys(states, others) | {state: value})

    at = [output_at(value, 0.0) for value in (0.0, 1.0, 2.0)]
    slope = at[1] - at[0]
    straight = abs(at[2] - at[1] - slope) <= SLOPE_ROUNDING * abs(slope) and output_at(1.0, 1.0) == at[1]
    return (at[0], slope) if slope and straight else None
