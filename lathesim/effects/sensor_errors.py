"""What an encoder, a tachometer, a dynamometer or any sensor gets wrong by itself."""

from __future__ import annotations

import math

from lathesim.component import ON, DiscreteState, Input, Noise, Output, Parameter, State
from lathesim.effects.effect import SHAPE, SHAPE_RANGES, Effect, Identification, harmonic_parameters, harmonics
from lathesim.elementary import sin


class TachometerRipple(Effect):
    """Commutator ripple, brush noise and a gain error of a tachometer.

    y_out = y_in (1 + gain_error + ripple (sin a + second and third harmonic) + brush_noise n),   a = order angle + phase

    n is standard normal, new at each sample. A harmonic is sine sin(n a) + cosine cos(n a), both given as shares of the ripple.
    """

    catalogue, family, site = 31, "once per turn", "measured"
    neutral = {"ripple": 0.0, "gain_error": 0.0, "brush_noise": 0.0}
    identification = Identification(
        carried=("rad/s",),
        typical={
            "ripple": (0.001, 0.05),
            "gain_error": (-0.05, 0.05),
            "brush_noise": (0.0, 0.02),
            "order": (1.0, 48.0),
            "phase": (-math.pi, math.pi),
            **SHAPE_RANGES,
        },
        nuisance=("phase",),
        extended=SHAPE,
    )
    fingerprint = "A line of the tachometer at a multiple of the speed, which the encoder does not show."
    confused_with = ("Runout", "TorqueRipple", "EncoderEccentricity")
    experiment = "Compare with the derivative of the encoder."
    source = "Kuo, Tal (eds.), Incremental Motion Control I, SRL 1978, ch. 5 (DC tachometers). Range assumed."

    incoming = Input("{signal}", doc="true speed")
    displacement = Input("rad", doc="angle of the shaft")
    outgoing = Output("{signal}", doc="speed the tachometer shows")
    brush = DiscreteState("1", doc="brush noise of this sample")
    chance = Noise(doc="brush noise of this sample")
    ripple = Parameter("1", 0.0, low=0.0, high=1.0, doc="half of the peak-to-peak ripple over the speed")
    gain_error = Parameter("1", 0.0, low=-0.9, high=9.0, doc="share by which the tachometer shows too much")
    brush_noise = Parameter("1", 0.0, low=0.0, high=1.0, doc="standard deviation of the brush noise over the speed")
    order = Parameter("1", 2.0, low=0.0, doc="ripples per turn")
    phase = Parameter("rad", 0.0, doc="phase at angle zero")
    second_sine, second_cosine, third_sine, third_cosine = harmonic_parameters()

    @staticmethod
    def update(chance: float, brush_noise: float) -> float:
        return brush_noise * chance

    @staticmethod
    def output(
        incoming: float, displacement: float, brush: float, ripple: float, gain_error: float, order: float, phase: float,
        second_sine: float, second_cosine: float, third_sine: float, third_cosine: float,
    ) -> float:  # fmt: skip
        if ripple == 0.0 and gain_error == 0.0:
            return incoming * (1.0 + brush)
        angle = order * displacement + phase
        wave = sin(angle) + harmonics(angle, second_sine, second_cosine, third_sine, third_cosine)
        return incoming * (1.0 + gain_error + ripple * wave + brush)


class DynamometerDrift(Effect):
    """Charge that leaks away, and a zero that wanders: after the cut the reading does not come back.

    y_out = y_in - s + offset + drift t,   ds/dt = leak (y_in - s)          (leak = 1 / time constant of the charge amplifier)

    ``at: dynamometer`` is its main channel, ``at: dynamometer.thrust`` and ``at: dynamometer.feed`` are the others.
    """

    catalogue, family, site = 50, "slow", "reading"
    neutral = {"leak": 0.0, "drift": 0.0, "offset": 0.0}
    identification = Identification(
        carried=("N",), typical={"leak": (0.001, 0.5), "drift": (-5.0, 5.0), "offset": (-20.0, 20.0)}, nuisance=("offset",)
    )
    fingerprint = "The force decays in the cut, and stands on the other side of zero after it."
    confused_with = ("TemperatureSoftening, after which the zero returns", "WearForceGrowth")
    experiment = "A known static load; the zero before and after."
    source = "Kistler, Multicomponent Dynamometer manuals (time constant of charge amplifiers, drift). Range assumed: 10 to 1000 s."

    incoming = Input("{signal}", doc="force on the dynamometer")
    outgoing = Output("{signal}", doc="reading")
    leaked = State("{signal}", doc="what has leaked away")
    leak = Parameter("1/s", 0.0, low=0.0, high=100.0, doc="1 over the time constant of the leak")
    drift = Parameter("({signal})/s", 0.0, doc="steady wandering of the zero")
    offset = Parameter("{signal}", 0.0, doc="zero at the start")

    @staticmethod
    def derivative(incoming: float, leaked: float, leak: float) -> float:
        return leak * (incoming - leaked)

    @staticmethod
    def output(incoming: float, leaked: float, time: float, leak: float, drift: float, offset: float) -> float:
        return incoming if leak == 0.0 and drift == 0.0 and offset == 0.0 else incoming - leaked + offset + drift * time


class DynamometerCrosstalk(Effect):
    """A channel that picks up a share of another force.

    y_out = y_in + share other
    """

    catalogue, family, site = 50, "force law", "reading"
    neutral = {"share": 0.0}
    identification = Identification(senses_beside="other_force", carried=("N",), typical={"share": (-0.05, 0.05)})
    fingerprint = "One channel carries a copy of another."
    confused_with = ("a real side force",)
    experiment = "A known static load in one direction."
    source = "Kistler, Multicomponent Dynamometer manuals (crosstalk of 1 to 5 %). Range assumed."

    incoming = Input("{signal}", doc="force of this channel")
    other_force = Input("{signal}", doc="force of the other channel")
    outgoing = Output("{signal}", doc="reading of this channel")
    share = Parameter("1", 0.0, low=-1.0, high=1.0, doc="share of the other force")

    @staticmethod
    def output(incoming: float, other_force: float, share: float) -> float:
        return incoming if share == 0.0 else incoming + share * other_force


class DynamometerResonance(Effect):
    """A dynamometer that swings on its own stiffness.

    y'' + 2 damping w y' + w^2 y = w^2 x,   y_out = x + coupling (y - x),   w = 2 pi frequency
    """

    catalogue, family, site = 50, "lag", "reading"
    neutral = {"coupling": 0.0}
    identification = Identification(
        carried=("N",), typical={"coupling": (0.5, 1.0), "frequency": (300.0, 3000.0), "damping": (0.005, 0.05)}
    )
    fingerprint = "Ringing at one frequency after each entry and exit."
    confused_with = ("SensorFilter", "RegenerativeChatter")
    experiment = "A hammer blow without a cut."
    source = "Kistler, Multicomponent Dynamometer manuals (natural frequency mounted, 1 to 3 kHz). Range assumed."

    incoming = Input("{signal}", doc="force on the dynamometer")
    outgoing = Output("{signal}", doc="reading")
    followed = State("{signal}", doc="force through the spring")
    followed_rate = State("({signal})/s", doc="its rate")
    coupling = Parameter("1", 0.0, low=0.0, high=1.0, doc="1 with the resonance, 0 without")
    frequency = Parameter("Hz", 1000.0, low=0.1, high=20000.0, doc="natural frequency")
    damping = Parameter("1", 0.02, low=0.0, high=2.0, doc="damping ratio")

    @staticmethod
    def derivative(
        incoming: float, followed: float, followed_rate: float, coupling: float, frequency: float, damping: float
    ) -> tuple[float, float]:
        if coupling == 0.0:
            return 0.0, 0.0
        angular = 2.0 * math.pi * frequency
        return followed_rate, angular * (angular * (incoming - followed) - 2.0 * damping * followed_rate)

    @staticmethod
    def output(incoming: float, followed: float, coupling: float) -> float:
        return incoming if coupling == 0.0 else incoming + coupling * (followed - incoming)


def _filtered(incoming: float, before: float, lagged: float, time_constant: float, sample_period: float) -> float:
    """Return the lag of a signal that runs straight from ``before`` to ``incoming`` over a sample, ``lagged`` at its beginning."""
    if time_constant == 0.0:
        return incoming
    kept = math.exp(-sample_period / time_constant)
    return incoming + kept * (lagged - before) - (incoming - before) * (time_constant / sample_period) * (1.0 - kept)


class SensorFilter(Effect):
    """A low-pass filter of a sensor or its amplifier: one stage of first order, or up to four one after the other.

    T_k dy_k/dt + y_k = y_(k-1),   T_k = time_constant max(0, min(1, stages - k + 1)),   k = 1 ... 4

    With 2.3 stages there are two equal ones and one of 0.3 of their time constant.

    Solved exactly for a signal that is straight between samples, as a place or a speed is nearly. With ``held`` = 1 it jumps at a sample,
    as a current or a cutting force does that is worked out of a command, and is straight from there on, with the mean that it has in the
    simulation: taken for the other one, it would come half a sample late or early. Where the filter is put in decides which of the two its
    signal is. ``held`` = -1 is the recursive filter of a firmware, y += (1 - exp(-T_s / T)) (x - y), which takes each reading for the
    whole sample before it. Left out: bends between samples; a resonant filter; the filter begins at rest on the first sample.
    """

    catalogue, family, site = 32, "lag", "reading"
    neutral = {"time_constant": 0.0}
    identification = Identification(
        delay="time_constant", held_flag="held", typical={"time_constant": (0.3e-3, 20e-3), "stages": (1.0, 4.0)}, extended=("stages",)
    )
    fingerprint = "One signal lags and is rounded, the same rising as falling; the others are in time."
    confused_with = ("TransportDelay", "ChannelTimeShift", "MotorInductance")
    experiment = "A step: a filter rounds it, a delay moves it."
    source = (
        "Beckwith, Marangoni, Lienhard, Mechanical Measurements, 6th ed. 2007, ch. 5 (first-order response); Franklin, Powell, Workman, "
        "Digital Control of Dynamic Systems, 3rd ed. 1998, sec. 6.3 (first-order hold). Range assumed."
    )

    incoming = Input("{signal}", doc="signal before the filter")
    outgoing = Output("{signal}", doc="signal after the filter")
    first = DiscreteState("{signal}", doc="first stage")
    second = DiscreteState("{signal}", doc="second stage")
    third = DiscreteState("{signal}", doc="third stage")
    fourth = DiscreteState("{signal}", doc="fourth stage")
    before = DiscreteState("{signal}", doc="signal one sample before")
    summed_before = DiscreteState("({signal})*s", doc="sum of the signal one sample before")
    summed = State("({signal})*s", doc="sum of a signal that jumps at a sample")
    time_constant = Parameter("s", 0.0, low=0.0, high=10.0, doc="time constant of a stage")
    stages = Parameter("1", 1.0, low=1.0, high=4.0, doc="number of stages")
    held = Parameter("1", 0.0, low=-1.0, high=1.0, doc="1 where the signal jumps at a sample, -1 for a filter that is computed")

    @staticmethod
    def derivative(incoming: float, time_constant: float, held: float) -> float:
        return incoming if held >= ON and time_constant != 0.0 else 0.0

    @staticmethod
    def update(
        incoming: float, first: float, second: float, third: float, fourth: float, before: float, summed: float, summed_before: float,
        time_constant: float, stages: float, held: float, sample_period: float, time: float,
    ) -> tuple[float, float, float, float, float, float]:  # fmt: skip
        if time <= 0.0 or time_constant == 0.0:
            return incoming, incoming, incoming, incoming, incoming, summed
        end = 2.0 * (summed - summed_before) / sample_period - before if held >= ON else incoming
        computed = held <= -ON
        one = _filtered(end, incoming if computed else before, first, time_constant, sample_period)
        if stages <= 1.0:
            return one, one, one, one, incoming, summed
        two = _filtered(one, one if computed else first, second, time_constant * min(stages - 1.0, 1.0), sample_period)
        three = _filtered(two, two if computed else second, third, time_constant * max(0.0, min(stages - 2.0, 1.0)), sample_period)
        last = _filtered(three, three if computed else third, fourth, time_constant * max(0.0, stages - 3.0), sample_period)
        return one, two, three, last, incoming, summed

    @staticmethod
    def output(incoming: float, fourth: float, time_constant: float) -> float:
        return incoming if time_constant == 0.0 else fourth


class EncoderEccentricity(Effect):
    """A disc that is mounted off its axis.

    y_out = y_in + amplitude (sin a + second and third harmonic),   a = 2 pi y_in / turn + phase

    A harmonic is sine sin(n a) + cosine cos(n a), both given as shares of the amplitude; the second comes from a disc that is tilted.
    """

    catalogue, family, site = 28, "once per turn", "measured"
    neutral = {"amplitude": 0.0}
    identification = Identification(
        carried=("m", "rad"),
        typical={"amplitude": (0.5e-6, 10e-6), "turn": (0.002, 0.02), "phase": (-math.pi, math.pi), **SHAPE_RANGES},
        typical_rotary={"amplitude": (1e-5, 1.5e-3), "turn": (2.0 * math.pi, 2.0 * math.pi), "phase": (-math.pi, math.pi), **SHAPE_RANGES},
        nuisance=("phase",),
        extended=SHAPE,
    )
    fingerprint = "A line once per turn of the encoder, in scale less encoder and in the speed, with its phase tied to the disc."
    confused_with = ("PeriodicPitchError", "TorqueRipple", "Runout")
    experiment = "A second reading head opposite the first, or a direct scale."
    source = (
        "Heidenhain, Rotary Encoders and Angle Encoders (technical information: eccentricity); 0.5 to 5 arc minutes, of a ring encoder "
        "with its large drum 2 arc seconds and more. Range assumed."
    )

    incoming = Input("{signal}", doc="true position")
    outgoing = Output("{signal}", doc="position the disc shows")
    amplitude = Parameter("{signal}", 0.0, low=0.0, doc="half of the peak-to-peak error")
    turn = Parameter("{signal}", 0.005, low=1e-6, doc="travel per turn of the encoder")
    phase = Parameter("rad", 0.0, doc="phase at position zero")
    second_sine, second_cosine, third_sine, third_cosine = harmonic_parameters()

    @staticmethod
    def output(
        incoming: float, amplitude: float, turn: float, phase: float, second_sine: float, second_cosine: float, third_sine: float,
        third_cosine: float,
    ) -> float:  # fmt: skip
        if amplitude == 0.0:
            return incoming
        angle = 2.0 * math.pi * incoming / turn + phase
        return incoming + amplitude * (sin(angle) + harmonics(angle, second_sine, second_cosine, third_sine, third_cosine))


class EncoderInterpolationError(Effect):
    """Sine and cosine of unequal size and offset: an error within each signal period.

    y_out = y_in + amplitude sin(2 pi y_in / signal_period + phase) + second sin(4 pi y_in / signal_period + phase)
    """

    catalogue, family, site = 29, "encoder", "measured"
    neutral = {"amplitude": 0.0, "second": 0.0}
    identification = Identification(
        carried=("m", "rad"),
        typical={"amplitude": (0.05e-6, 1e-6), "second": (0.0, 0.5e-6), "signal_period": (4e-6, 100e-6), "phase": (-math.pi, math.pi)},
        typical_rotary={"amplitude": (1e-6, 1e-4), "second": (0.0, 1e-4), "signal_period": (1e-4, 0.02), "phase": (-math.pi, math.pi)},
        nuisance=("phase",),
    )
    fingerprint = "A line at the very short signal period of the scale, whose frequency follows the speed."
    confused_with = ("noise, where the speed is high against the sample rate",)
    experiment = "A pass at 0.1 mm/s."
    source = "Heidenhain, Linear Encoders (technical information: position error within one signal period, 1 to 2 %). Range assumed."

    incoming = Input("{signal}", doc="true position")
    outgoing = Output("{signal}", doc="interpolated position")
    amplitude = Parameter("{signal}", 0.0, low=0.0, doc="error once per signal period (offsets)")
    second = Parameter("{signal}", 0.0, low=0.0, doc="error twice per signal period (amplitudes, phase)")
    signal_period = Parameter("{signal}", 20e-6, low=1e-9, doc="travel per signal period")
    phase = Parameter("rad", 0.0, doc="phase at position zero")

    @staticmethod
    def output(incoming: float, amplitude: float, second: float, signal_period: float, phase: float) -> float:
        if amplitude == 0.0 and second == 0.0:
            return incoming
        angle = 2.0 * math.pi * incoming / signal_period
        return incoming + amplitude * sin(angle + phase) + second * sin(2.0 * angle + phase)


class LostCounts(Effect):
    """Counts that are lost, at one instant or at up to three.

    y_out = y_in + jump (t >= instant) + second_jump (t >= second_instant) + third_jump (t >= third_instant)
    """

    catalogue, family, site = 30, "encoder", "measured"
    neutral = {"jump": 0.0}
    identification = Identification(
        carried=("m", "rad"),
        typical={
            "jump": (-200e-6, 200e-6), "instant": (0.0, 60.0), "second_jump": (-200e-6, 200e-6), "second_instant": (0.0, 60.0),
            "third_jump": (-200e-6, 200e-6), "third_instant": (0.0, 60.0),
        },
        typical_rotary={
            "jump": (-0.05, 0.05), "instant": (0.0, 60.0), "second_jump": (-0.05, 0.05), "second_instant": (0.0, 60.0),
            "third_jump": (-0.05, 0.05), "third_instant": (0.0, 60.0),
        },
        extended=("second_jump", "second_instant", "third_jump", "third_instant"),
        nuisance=("jump", "instant", "second_jump", "second_instant", "third_jump", "third_instant"),
        size_of_recording=("jump",),
    )  # fmt: skip
    fingerprint = "A step of the position difference that never comes back."
    confused_with = ("Backlash, whose step comes back with the next reversal",)
    experiment = "Return to the index mark."
    source = "Heidenhain, Linear Encoders (technical information: reference marks). Range assumed."

    incoming = Input("{signal}", doc="true position")
    outgoing = Output("{signal}", doc="counted position")
    jump = Parameter("{signal}", 0.0, doc="what the lost counts amount to")
    instant = Parameter("s", 1.0, low=0.0, doc="when they are lost")
    second_jump = Parameter("{signal}", 0.0, doc="what is lost at a second instant")
    second_instant = Parameter("s", 1.0, low=0.0, doc="when that is lost")
    third_jump = Parameter("{signal}", 0.0, doc="what is lost at a third instant")
    third_instant = Parameter("s", 1.0, low=0.0, doc="when that is lost")

    @staticmethod
    def output(
        incoming: float, time: float, jump: float, instant: float, second_jump: float, second_instant: float, third_jump: float,
        third_instant: float,
    ) -> float:  # fmt: skip
        if jump == 0.0:
            return incoming
        shown = incoming
        if time >= instant:
            shown += jump
        if time >= second_instant:
            shown += second_jump
        if time >= third_instant:
            shown += third_jump
        return shown


class Quantisation(Effect):
    """A reading in whole counts.

    y_out = round(y_in / count) count
    """

    catalogue, family, site = 30, "encoder", "measured"
    neutral = {"count": 0.0}
    identification = Identification(typical={"count": (0.05e-6, 5e-6)}, spacing="count", typical_rotary={"count": (1e-5, 1e-2)})
    fingerprint = "A staircase of one height."
    confused_with = ("noise of the sensor", "EncoderInterpolationError")
    experiment = "Creep over a few counts."
    source = "Widrow, Kollar, Quantization Noise, Cambridge 2008, ch. 1. Range assumed."

    incoming = Input("{signal}", doc="true value")
    outgoing = Output("{signal}", doc="value in whole counts")
    count = Parameter("{signal}", 0.0, low=0.0, doc="height of a step; 0 for none")

    @staticmethod
    def output(incoming: float, count: float) -> float:
        return incoming if count == 0.0 else math.floor(incoming / count + 0.5) * count
