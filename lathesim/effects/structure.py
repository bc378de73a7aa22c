"""Structure, part and tool that give way.

Part and tool that give way: the diameter comes out larger than the position says.

The force of the sample before is used, so a force that depends on the depth may close the loop.
"""

from __future__ import annotations

import math

from lathesim.component import DiscreteState, Input, Output, Parameter, State
from lathesim.effects.effect import Effect, Identification


class AxialResonance(Effect):
    """Motor and load as two masses with a spring between them; the part with the effect is the motor side.

    r m x2'' = -S - F_in - (1 - n) b x2',   (1 - r) m x1'' = F - F_m + S - n b x1'
    S = r m (w^2 d + 2 damping w d'),   d = x2 - x1,   w = 2 pi frequency
    F_out = F - b x1' - (F - F_m + S - n b x1') / (1 - r)

    m is the whole moving mass of the host, r the table's share of it, b its viscous friction, n the share of that in motor, bearings and
    nut, F what drives the motor side, F_in all else that acts on the table: guideways hold the table, not the screw, and frictions
    inserted before, or at this effect, answer to its speed. F_m is what acts on the motor side: all that is inserted at the host after it.
    ``deflection`` is table less motor; a scale at the table sees the host's position plus that.
    """

    catalogue, family, site = 13, "lag", "effort"
    beyond = "deflection"
    behind = {"flow": "stretch_speed", "applied": "spring_force", "inertia": "table_inertia"}
    near_side = {"applied": "motor_push", "inertia": "motor_inertia"}
    neutral = {"table_share": 0.0}
    identification = Identification(
        resonance="frequency",
        damping="damping",
        typical={"table_share": (0.05, 0.8), "frequency": (8.0, 300.0), "damping": (0.02, 0.1), "motor_friction": (0.0, 0.5)},
        typical_rotary={"table_share": (0.05, 0.8), "frequency": (5.0, 500.0), "damping": (0.01, 0.1), "motor_friction": (0.0, 1.0)},
    )
    fingerprint = "A line of force and scale that stays in Hz while the speed changes; the table lags in proportion to the jerk."
    confused_with = ("CurrentLoopLag", "TransportDelay", "SensorFilter", "PreslidingFriction")
    experiment = "A chirp or a hammer blow, with two table loads: only a resonance moves with the load."
    source = "Altintas, Verl, Brecher, Uriarte, Pritschow, Machine tool feed drives, CIRP Annals 60 (2011), sec. 3. Range assumed."

    incoming = Input("{signal}", doc="disturbance on the table")
    motor_side = Input("{signal}", default=0.0, doc="disturbance on the motor side")
    applied = Input("{signal}", doc="driving force or torque on the motor side")
    inertia = Input("{signal}*s**2/({displacement})", doc="whole moving mass or inertia")
    flow = Input("({displacement})/s", doc="speed of the motor side")
    resistance = Input("{signal}*s/({displacement})", default=0.0, doc="viscous friction of the host")
    outgoing = Output("{signal}", doc="disturbance with the reaction of the table")
    deflection = Output("{displacement}", doc="table less motor")
    stretch_speed = Output("({displacement})/s", doc="speed of the table less that of the motor")
    spring_force = Output("{signal}", doc="what drives the table: the spring, or the drive where there is none")
    table_inertia = Output("{signal}*s**2/({displacement})", doc="mass or inertia that a friction holds")
    motor_push = Output("{signal}", doc="what drives the motor side: the drive less the spring")
    motor_inertia = Output("{signal}*s**2/({displacement})", doc="mass or inertia that a friction of the motor side holds")
    stretch = State("{displacement}", doc="table less motor")
    stretch_rate = State("({displacement})/s", doc="its rate")
    table_share = Parameter("1", 0.0, low=0.0, high=0.95, doc="share of the moving mass behind the spring")
    frequency = Parameter("Hz", 100.0, low=0.1, high=20000.0, doc="natural frequency of the table with the motor held")
    damping = Parameter("1", 0.05, low=0.0, high=2.0, doc="damping ratio of the same")
    motor_friction = Parameter("1", 0.0, low=0.0, high=1.0, doc="share of the viscous friction on the motor side")

    @staticmethod
    def derivative(
        incoming: float, motor_side: float, applied: float, inertia: float, flow: float, resistance: float, stretch: float,
        stretch_rate: float, table_share: float, frequency: float, damping: float, motor_friction: float,
    ) -> tuple[float, float]:  # fmt: skip
        if table_share == 0.0 or inertia <= 0.0:
            return 0.0, 0.0
        spring = _spring_acceleration(stretch, stretch_rate, frequency, damping)
        held = (1.0 - motor_friction) * resistance * (flow + stretch_rate)
        table = spring + (incoming + held) / (table_share * inertia)
        driven = applied - motor_side - motor_friction * resistance * flow
        return stretch_rate, -table - (driven / inertia + table_share * spring) / (1.0 - table_share)

    @staticmethod
    def output(
        applied: float, inertia: float, stretch: float, stretch_rate: float, table_share: float, frequency: float, damping: float
    ) -> tuple[float, float, float, float, float, float]:
        if table_share == 0.0:
            return 0.0, 0.0, applied, inertia, applied, inertia
        table = table_share * inertia
        spring = -table * _spring_acceleration(stretch, stretch_rate, frequency, damping)
        return stretch, stretch_rate, spring, table, applied - spring, inertia - table

    @staticmethod
    def output_outgoing(
        incoming: float, motor_side: float, applied: float, inertia: float, flow: float, resistance: float, stretch: float,
        stretch_rate: float, table_share: float, frequency: float, damping: float, motor_friction: float,
    ) -> float:  # fmt: skip
        if table_share == 0.0:
            return incoming + motor_side
        spring = table_share * inertia * _spring_acceleration(stretch, stretch_rate, frequency, damping)
        driven = applied - motor_side - motor_friction * resistance * flow
        return applied - resistance * flow - (driven + spring) / (1.0 - table_share)


def _spring_acceleration(stretch: float, stretch_rate: float, frequency: float, damping: float) -> float:
    angular = 2.0 * math.pi * frequency
    return angular * (angular * stretch + 2.0 * damping * stretch_rate)


class TorsionalWindUp(Effect):
    """Screw and coupling that twist under the driving force, seen by a scale at the table.

    x_out = x_in - compliance F / (1 + stiffening |F|),   F = applied - motor_friction b v

    b v is the viscous friction of the host, ``motor_friction`` the share of it in motor, bearings and nut, which twists nothing. Nuts,
    couplings and rolling contacts grow stiffer as they are loaded. A sensor is read before the converter changes the force: what has
    twisted the screw is the force of the sample before. Static: the resonance of the same spring is AxialResonance.
    """

    catalogue, family, site = 14, "lag", "measured"
    seen_from = "load"
    neutral = {"compliance": 0.0}
    identification = Identification(
        carried=("m", "rad"),
        typical={"compliance": (1e-9, 50e-9), "stiffening": (0.0, 2e-3), "motor_friction": (0.0, 1.0)},
        typical_rotary={"compliance": (1e-6, 1e-2), "stiffening": (0.0, 1.0), "motor_friction": (0.0, 1.0)},
        extended=("stiffening",),
    )
    fingerprint = "Table scale less motor encoder is proportional to the driving force, so to the acceleration where friction is small."
    confused_with = ("Backlash", "AxialResonance")
    experiment = "Pass one position with several accelerations."
    source = "Altintas, Manufacturing Automation, 2nd ed. 2012, sec. 5.2; 0.5 to 5 um at full acceleration. Range assumed."

    incoming = Input("{signal}", doc="position by the motor")
    applied = Input("{applied}", previous=True, doc="driving force or torque")
    flow = Input("({signal})/s", default=0.0, previous=True, doc="speed of the host")
    resistance = Input("({applied})*s/({signal})", default=0.0, doc="viscous friction of the host")
    outgoing = Output("{signal}", doc="position of the table")
    twist = DiscreteState("{signal}", doc="wind-up at the sample instant")
    compliance = Parameter("{signal}/({applied})", 0.0, low=0.0, doc="wind-up per driving force, of a small one")
    stiffening = Parameter("1/({applied})", 0.0, low=0.0, doc="one over the force at which the wind-up is half of that")
    motor_friction = Parameter("1", 0.0, low=0.0, high=1.0, doc="share of the viscous friction on the motor side")

    @staticmethod
    def update(applied: float, flow: float, resistance: float, compliance: float, stiffening: float, motor_friction: float) -> float:
        force = applied - motor_friction * resistance * flow
        return compliance * force / (1.0 + stiffening * abs(force))

    @staticmethod
    def output(incoming: float, twist: float, compliance: float) -> float:
        return incoming if compliance == 0.0 else incoming - twist


class BaseRocking(Effect):
    """A bed that rocks on its feet under the reaction of the drive, and carries the scale with it.

    y'' + 2 damping w y' + w^2 y = -mobility applied,   x_out = x_in - y,   w = 2 pi frequency
    """

    catalogue, family, site = 15, "structure", "measured"
    neutral = {"mobility": 0.0}
    identification = Identification(
        carried=("m",),
        resonance="frequency",
        damping="damping",
        typical={"mobility": (1e-4, 5e-3), "frequency": (10.0, 40.0), "damping": (0.02, 0.1)},
    )
    fingerprint = "A slow swing of 10 to 40 Hz after each jerk, on both axes at once."
    confused_with = ("ToolCompliance", "AxialResonance")
    experiment = "An accelerometer on the bed; the same move with smooth and with abrupt acceleration."
    source = "Altintas, Verl, Brecher, Uriarte, Pritschow, Machine tool feed drives, CIRP Annals 60 (2011), sec. 4. Form and range assumed."

    incoming = Input("{signal}", doc="position relative to an unmoved base")
    applied = Input("{applied}", doc="driving force, whose reaction the base takes")
    outgoing = Output("{signal}", doc="position relative to the rocking base")
    rocking = State("{applied}*s**2", doc="base displacement per mobility")
    rocking_rate = State("{applied}*s", doc="its rate")
    mobility = Parameter("{signal}/(({applied})*s**2)", 0.0, low=0.0, doc="1 over the mass of the base")
    frequency = Parameter("Hz", 20.0, low=0.1, high=2000.0, doc="natural frequency of the base")
    damping = Parameter("1", 0.05, low=0.0, high=2.0, doc="damping ratio of the base")

    @staticmethod
    def derivative(applied: float, rocking: float, rocking_rate: float, frequency: float, damping: float) -> tuple[float, float]:
        return rocking_rate, -_spring_acceleration(rocking, rocking_rate, frequency, damping) - applied

    @staticmethod
    def output(incoming: float, rocking: float, mobility: float) -> float:
        return incoming if mobility == 0.0 else incoming - mobility * rocking


class WorkpieceDeflection(Effect):
    """A part held in the chuck that bends under the thrust force.

    x_out = x_in + compliance F (distance / length)^3          (compliance = length^3 / (3 E I))

    Left out: the part between centres, and a diameter that varies.
    """

    catalogue, family, site = 43, "deflection", "measured"
    neutral = {"compliance": 0.0}
    identification = Identification(carried=("m",), typical={"compliance": (1e-8, 2e-6)})
    fingerprint = "The diameter grows with the third power of the distance from the chuck."
    confused_with = ("a taper, which is linear", "ThermalScrewGrowth", "SquarenessError")
    experiment = "A pass without infeed; a tailstock."
    source = "Gere, Goodno, Mechanics of Materials, 8th ed. 2013, ch. 9 (cantilever): steel, 20 mm by 100 mm, 100 N: 20 um. Range assumed."

    incoming = Input("{signal}", doc="position of the tool relative to a stiff part")
    force = Input("N", previous=True, doc="thrust force on the part")
    distance = Input("m", doc="distance of the tool from the chuck")
    outgoing = Output("{signal}", doc="radius that is left")
    bent = DiscreteState("m", doc="deflection of this sample")
    compliance = Parameter("m/N", 0.0, low=0.0, doc="compliance at the free end")
    length = Parameter("m", 0.1, low=1e-3, doc="distance of the free end from the chuck")

    @staticmethod
    def update(force: float, distance: float, compliance: float, length: float) -> float:
        share = distance / length
        return compliance * force * share * share * share

    @staticmethod
    def output(incoming: float, bent: float, compliance: float) -> float:
        return incoming if compliance == 0.0 else incoming + bent


class ToolCompliance(Effect):
    """Tool and holder that give way under the thrust force.

    x_out = x_in + compliance F
    """

    catalogue, family, site = 44, "deflection", "measured"
    neutral = {"compliance": 0.0}
    identification = Identification(carried=("m",), typical={"compliance": (2e-8, 1e-7)})
    fingerprint = "The diameter is off by a constant in proportion to the force, with a step at entry."
    confused_with = ("an offset of the tool", "SpindleGrowth")
    experiment = "Two depths of cut."
    source = "Altintas, Manufacturing Automation, 2nd ed. 2012, sec. 3.2; 10 to 50 N/um. Range assumed."

    incoming = Input("{signal}", doc="position of a stiff tool")
    force = Input("N", previous=True, doc="thrust force on the tool")
    outgoing = Output("{signal}", doc="radius that is left")
    bent = DiscreteState("m", doc="deflection of this sample")
    compliance = Parameter("m/N", 0.0, low=0.0, doc="compliance of tool and holder")

    @staticmethod
    def update(force: float, compliance: float) -> float:
        return compliance * force

    @staticmethod
    def output(incoming: float, bent: float, compliance: float) -> float:
        return incoming if compliance == 0.0 else incoming + bent
