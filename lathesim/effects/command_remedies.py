"""Remedies on the command of an axis: bias, gain, dead zone, friction, ripple, and what a motion takes."""

from __future__ import annotations

import math

from lathesim.component import DiscreteState, Input, Parameter
from lathesim.effects.effect import harmonic_parameters, harmonics
from lathesim.effects.remedy import EffectAtLoop, ModelledRemedy, Remedy, Sizes, followed, with_added

DEAD_ZONE_SHARE = 0.9
"""Share of a dead zone that is stepped over: the whole of it swings about rest."""


class CommandBias(Remedy):
    """Adds a constant to the command:  out = in + share bias.

    Source: offset compensation of common drives (drift compensation).
    """

    answers = ("ForceOffset", "ConverterOffset")
    limits = ("converter", "voltage")
    cannot = "A load that changes is not constant."
    follows = {"bias": "the offset, as a voltage"}
    bias = Parameter("{signal}", 0.0, doc="what is added")

    @classmethod
    def sized_for(cls, effect: EffectAtLoop) -> Sizes | None:
        """Return the offset as a voltage."""
        if effect.effect == "ForceOffset":
            return Sizes({"bias": effect.per_force * effect.values["offset"]}, tuned=("bias",))
        return Sizes({"bias": -effect.values["offset"]})

    @staticmethod
    def output(incoming: float, share: float, bias: float) -> float:
        return incoming if share == 0.0 else incoming + share * bias


class CommandGain(Remedy):
    """Makes up for a drive gain that is off and sags:  out solves  out (1 + error - sag |out|) = in.

    Source: the inverse of DriveGainError; at most a quarter of the sag can be taken up.
    """

    answers = ("DriveGainError",)
    limits = ("voltage",)
    cannot = "A gain that changes with temperature is not constant."
    follows = {"error": "the error of the gain", "sag": "its sag"}
    error = Parameter("1", 0.0, low=-0.9, high=10.0, doc="share by which the gain is too large")
    sag = Parameter("1/({signal})", 0.0, low=0.0, doc="share lost per unit of command")

    @classmethod
    def sized_for(cls, effect: EffectAtLoop) -> Sizes | None:
        """Return the error and the sag of the gain."""
        return Sizes({name: effect.values[name] for name in ("error", "sag")})

    @staticmethod
    def output(incoming: float, share: float, error: float, sag: float) -> float:
        if share == 0.0:
            return incoming
        gain = 1.0 + share * error
        loss = share * sag
        size = abs(incoming)
        inside = gain * gain - 4.0 * loss * size
        if loss <= 0.0 or inside <= 0.0:
            return incoming / gain if loss <= 0.0 else math.copysign(gain / (2.0 * loss), incoming)
        return math.copysign(2.0 * size / (gain + math.sqrt(inside)), incoming)


class InverseDeadZone(Remedy):
    """Steps over the dead zone of an amplifier:  out = in + share half_width sgn(in), evenly within ``soft`` of zero.

    More than the true width would make the drive jump to and fro at rest, so ``share`` stays at 0.9 or below.
    Source: G. Tao, P. Kokotovic, Adaptive Control of Systems with Actuator and Sensor Nonlinearities, Wiley 1996, chapter 3.
    """

    answers = ("AmplifierDeadZone",)
    limits = ("converter",)
    cannot = "A tenth of the zone is left, as more would swing."
    follows = {"half_width": "the half width of the zone"}
    half_width = Parameter("{signal}", 0.0, low=0.0, doc="largest command without an answer")
    soft = Parameter("{signal}", 1e-3, low=1e-12, doc="command up to which the step rises evenly")

    @classmethod
    def sized_for(cls, effect: EffectAtLoop) -> Sizes | None:
        """Return the width of the zone, of which most is stepped over."""
        width = effect.values["half_width"]
        return Sizes({"half_width": width, "soft": max(1e-3, 0.02 * width)}, one_sided=("half_width",), share=DEAD_ZONE_SHARE)

    @staticmethod
    def output(incoming: float, share: float, half_width: float, soft: float) -> float:
        if share == 0.0:
            return incoming
        step = share * half_width
        if incoming > soft:
            return incoming + step
        if incoming < -soft:
            return incoming - step
        return incoming + step * incoming / soft


class FrictionFeedforward(ModelledRemedy):
    """Adds the voltage that dry friction takes, in the direction in which the axis moves or last moved:

        out = in + share d (level (1 + asymmetry d) + excess exp(-(|v|/stribeck_velocity)^shape) + amplitude wave(q)) + share difference |v|

    d goes from one sign to the other as the bristles bend, 1 - 2 exp(-way/distance), or at once with ``distance`` 0; v is the speed of the
    model ``lead`` ahead and q its position. At standstill the last direction is held, as friction holds.

    Source: B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994), section 5.
    """

    answers = ("CoulombFriction", "StribeckFriction", "AsymmetricFriction", "PositionDependentFriction", "PreslidingFriction")
    limits = ("converter", "voltage")
    cannot = "Below one level of the converter nothing comes through; at standstill it only holds."
    follows = {"level": "the level of the friction, as a voltage", "lead": "the delay of the loop's command"}

    level = Parameter("{signal}", 0.0, doc="command that sliding friction takes")
    asymmetry = Parameter("1", 0.0, low=-0.95, high=0.95, doc="share by which forward exceeds the mean")
    difference = Parameter("({signal})*s/({drive})", 0.0, doc="command per speed, the same in both directions")
    excess = Parameter("{signal}", 0.0, doc="static less sliding friction")
    stribeck_velocity = Parameter("({drive})/s", 0.005, low=1e-9, doc="speed at which the excess has fallen to 1/e")
    shape = Parameter("1", 1.0, low=0.5, high=4.0, doc="exponent of the excess")
    amplitude = Parameter("{signal}", 0.0, low=0.0, doc="half of what the friction varies by along the way")
    period = Parameter("{drive}", 0.01, low=1e-6, doc="way after which that repeats")
    phase = Parameter("rad", 0.0, doc="its phase at position zero")
    second_sine, second_cosine, third_sine, third_cosine = harmonic_parameters()
    distance = Parameter("{drive}", 0.0, low=0.0, doc="way over which the friction turns round after a reversal; 0: at once")
    lead = Parameter("s", 0.0, low=-0.1, high=0.1, doc="how far ahead the model's speed is taken")
    still = Parameter("({drive})/s", 1e-6, low=1e-12, doc="speed below which the axis stands")
    direction = DiscreteState("1", doc="direction in which it moves or last moved, on its way from one sign to the other")
    added = DiscreteState("{signal}", doc="what is added in this sample")

    @classmethod
    def sized_for(cls, effect: EffectAtLoop) -> Sizes | None:
        """Return the friction as a voltage; none where no voltage moves the axis as a force does."""
        p, volts = effect.values, effect.per_force
        if volts == 0.0:
            return None
        sided = tuple(name for name in ("level", "excess") if p.get(name))
        bends = ("distance",) if "distance" in p else ()
        values = {"level": volts * p["level"]} if "level" in sided else {}
        if "asymmetry" in p:
            values |= {"asymmetry": p["asymmetry"], "difference": volts * p["viscous_difference"]}
        if "excess" in sided:
            values |= {"excess": volts * p["excess"], "stribeck_velocity": p["stribeck_velocity"], "shape": p.get("shape", 1.0)}
        if "amplitude" in p:
            values |= {name: p[name] for name in ("period", "phase", "second_sine", "second_cosine", "third_sine", "third_cosine")}
            values |= {"amplitude": volts * p["amplitude"]}
        values |= {name: p[name] for name in bends}
        return Sizes(values, tuned=("lead", *sided, *bends), one_sided=sided)

    @staticmethod
    def update(
        drive: float, lag: float, inner: float, model_position: float, model_rate: float, level: float, asymmetry: float, difference: float,
        excess: float, stribeck_velocity: float, shape: float, amplitude: float, period: float, phase: float, second_sine: float,
        second_cosine: float, third_sine: float, third_cosine: float, distance: float, lead: float, still: float, direction: float,
        sample_period: float, time: float,
    ) -> tuple[float, float, float, float]:  # fmt: skip
        if time <= 0.0:
            return drive, 0.0, 0.0, 0.0
        position, rate = followed(model_position, model_rate, drive, lag, inner, sample_period)
        slope = (rate - model_rate) / sample_period
        speed = 0.5 * (rate + model_rate) + lead * slope
        if distance > 0.0:
            way = abs(speed) * sample_period
            if speed > still:
                direction = 1.0 + (direction - 1.0) * math.exp(-way / distance)
            elif speed < -still:
                direction = -1.0 + (direction + 1.0) * math.exp(-way / distance)
        elif speed > still:
            direction = 1.0
        elif speed < -still:
            direction = -1.0
        size = level * (1.0 + asymmetry * direction)
        if excess != 0.0:
            size = size + excess * math.exp(-math.pow(abs(speed) / stribeck_velocity, shape))
        if amplitude > 0.0:
            angle = 2.0 * math.pi * 0.5 * (position + model_position) / period + phase
            size = size + amplitude * (math.sin(angle) + harmonics(angle, second_sine, second_cosine, third_sine, third_cosine))
        return position, rate, direction, direction * size + difference * abs(speed)

    output = staticmethod(with_added)


class MotionFeedforward(ModelledRemedy):
    """Adds what a motion takes more than the loop gives it in time:  out = in + share (g_v v + g_a v' + g_j v''),  of the model.

    A lag or delay d of the command needs d times the rate of the force, so g_a = d b/K and g_j = d m/K. Velocity and acceleration
    feedforward of common controls are its first two terms.

    Source: Y. Altintas, Manufacturing Automation, 2nd ed. 2012, chapter 5 (feedforward of feed drives).
    """

    answers = ("TorsionalWindUp", "ServoLag", "CurrentLoopLag", "MotorInductance", "TransportDelay", "AxialResonance", "BaseRocking")
    limits = ("voltage", "bandwidth")
    cannot = "What disturbs the axis from outside is not known ahead."
    follows = {"jerk_gain": "the lag times the mass, as a voltage"}

    velocity_gain = Parameter("({signal})*s/({drive})", 0.0, doc="command per speed")
    acceleration_gain = Parameter("({signal})*s**2/({drive})", 0.0, doc="command per acceleration")
    jerk_gain = Parameter("({signal})*s**3/({drive})", 0.0, doc="command per jerk")
    slope = DiscreteState("({drive})/s**2", doc="acceleration of the model")
    added = DiscreteState("{signal}", doc="what is added in this sample")

    @classmethod
    def sized_for(cls, effect: EffectAtLoop) -> Sizes | None:
        """Return gains that the simulation finds."""
        gains = ("velocity_gain", "acceleration_gain", "jerk_gain")
        return Sizes(dict.fromkeys(gains, 0.0), tuned=gains)

    @staticmethod
    def update(
        drive: float, lag: float, inner: float, model_position: float, model_rate: float, velocity_gain: float, acceleration_gain: float,
        jerk_gain: float, slope: float, sample_period: float, time: float,
    ) -> tuple[float, float, float, float]:  # fmt: skip
        """Follow the reference; slopes are those over the sample."""
        if time <= 0.0:
            return drive, 0.0, 0.0, 0.0
        position, rate = followed(model_position, model_rate, drive, lag, inner, sample_period)
        rise = (rate - model_rate) / sample_period
        jerk = (rise - slope) / sample_period
        return position, rate, rise, velocity_gain * 0.5 * (rate + model_rate) + acceleration_gain * rise + jerk_gain * jerk

    output = staticmethod(with_added)


class RippleFeedforward(Remedy):
    """Adds the voltage against a force that repeats along the way, found at the measured place:

        out = in + share (amplitude sin(2 pi q/period + phase) + second sin(4 pi q/period + second_phase))

    Source: R. Krishnan, Electric Motor Drives, Prentice Hall 2001, chapter 9 (torque ripple). The phase is found anew where
    an encoder has no index.
    """

    answers = ("TorqueRipple", "Cogging")
    limits = ("converter", "bandwidth")
    cannot = "A ripple faster than half the sampling frequency is not met."
    follows = {"amplitude": "the size of the ripple, as a voltage", "phase": "its phase"}

    measured = Input("{measured}", doc="measured position")
    amplitude = Parameter("{signal}", 0.0, doc="command against the first harmonic")
    second = Parameter("{signal}", 0.0, doc="command against the second harmonic")
    period = Parameter("{measured}", 0.005, low=1e-6, doc="way after which it repeats")
    phase = Parameter("rad", 0.0, doc="phase of the first harmonic at position zero")
    second_phase = Parameter("rad", 0.0, doc="phase of the second harmonic at position zero")
    lead = Parameter("s", 0.0, low=-0.1, high=0.1, doc="how far ahead of the reading it is taken")
    place = DiscreteState("{measured}", doc="measured position of this sample")
    added = DiscreteState("{signal}", doc="what is added in this sample")

    @classmethod
    def sized_for(cls, effect: EffectAtLoop) -> Sizes | None:
        """Return the ripple as a voltage; none where no voltage moves the axis as a force does."""
        p, volts = effect.values, effect.per_force
        if volts == 0.0:
            return None
        values = {"amplitude": volts * p["amplitude"], "period": p["period"], "phase": p["phase"]}
        if "second" in p:
            values |= {"second": volts * p["second"], "second_phase": p["second_phase"]}
        else:
            values["amplitude"] = -values["amplitude"]
        return Sizes(values, tuned=("amplitude", "lead"))

    @staticmethod
    def update(
        measured: float, amplitude: float, second: float, period: float, phase: float, second_phase: float, lead: float, place: float,
        sample_period: float, time: float,
    ) -> tuple[float, float]:  # fmt: skip
        """Take the place half a sample on."""
        moved = measured - place if time > 0.0 else 0.0
        angle = 2.0 * math.pi * (measured + (0.5 + lead / sample_period) * moved) / period
        return measured, amplitude * math.sin(angle + phase) + second * math.sin(2.0 * angle + second_phase)

    output = staticmethod(with_added)
