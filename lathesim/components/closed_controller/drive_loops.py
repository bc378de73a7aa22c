"""The loops inside a feed drive: speed controller, power controller, electronics, motor with its slide.

Source of all: A. Tiwari et al., Learning digital emulators for closed architecture machine tool controllers, J. Manuf. Syst. 68 (2023),
equations (2) to (5). Values are assumed; the paper gives none.
"""

from __future__ import annotations

from lathesim.component import Component, Input, Output, Parameter, State


class SpeedController(Component):
    """Gives the current asked for by a PI law of the speed error:

        e = reference - k1 measured,   u = g (kp e + ki integral e)

    Source: equation (2). Left out: limits of the current, anti-windup.
    """

    group = "controllers"
    ports = {"measured": "measured", "drive": "reference", "reading": "current"}

    reference = Input("m/s", doc="speed asked for")
    measured = Input("m/s", doc="speed as it arrives")

    proportional = Parameter("A*s/m", 166.7, low=0.0, doc="kp (p13)")
    integral = Parameter("A/m", 6944.0, low=0.0, doc="ki (p14)")
    gain = Parameter("1", 1.0, low=0.0, doc="g (p25): factor on both")
    feedback_gain = Parameter("1", 1.0, doc="k1: factor on the speed fed back")

    summed = State("m", doc="integral of the speed error")

    current = Output("A", doc="current asked for")

    @staticmethod
    def derivative(reference: float, measured: float, feedback_gain: float) -> float:
        """The speed error."""
        return reference - feedback_gain * measured

    @staticmethod
    def output(
        reference: float, measured: float, summed: float, proportional: float, integral: float, gain: float, feedback_gain: float
    ) -> float:
        """The PI law."""
        return gain * (proportional * (reference - feedback_gain * measured) + integral * summed)


class PowerController(Component):
    """Gives the voltage by a PI law of the current error, behind a lag that feeds its own late output back:

        e = reference - k2 (measured + k3),   k4 dw/dt + w(t - d) = g (kp e + ki integral e)

    Source: equation (3); w(t - d) arrives by a wire from a :class:`DelayLine`. Left out: limits of the voltage.
    """

    group = "controllers"
    ports = {"measured": "measured", "drive": "reference", "reading": "voltage"}

    reference = Input("A", doc="current asked for")
    measured = Input("A", doc="current as it arrives")
    late_voltage = Input("V", doc="w(t - d): its own output one delay ago")

    proportional = Parameter("V/A", 0.833, low=0.0, doc="kp (p15)")
    integral = Parameter("V/(A*s)", 166.7, low=0.0, doc="ki (p16)")
    gain = Parameter("1", 1.0, low=0.0, doc="g (p26): factor on both")
    feedback_gain = Parameter("1", 1.0, doc="k2: factor on the current fed back")
    disturbance = Parameter("A", 0.0, doc="k3 (p27): what is added to the current fed back")
    lag = Parameter("s", 0.002, low=1e-6, doc="k4: time constant of the lag")

    summed = State("A*s", doc="integral of the current error")
    held = State("V", doc="voltage")

    voltage = Output("V", doc="voltage to the electronics")

    @staticmethod
    def derivative(
        reference: float, measured: float, late_voltage: float, summed: float, proportional: float, integral: float, gain: float,
        feedback_gain: float, disturbance: float, lag: float,
    ) -> tuple[float, float]:  # fmt: skip
        """The PI law and the lag."""
        error = reference - feedback_gain * (measured + disturbance)
        return error, (gain * (proportional * error + integral * summed) - late_voltage) * (1.0 / lag)

    @staticmethod
    def output(held: float) -> float:
        """The state as it is."""
        return held


class DriveElectronics(Component):
    """Gives the current of the motor:  di/dt = k6 (w - k5 v(t - d)) - k7 i(t - d).

    Source: equation (4).
    """

    group = "axes"
    ports = {"drive": "voltage", "effort": "voltage"}

    voltage = Input("V", doc="voltage of the power controller")
    late_speed = Input("m/s", doc="v(t - d)")
    late_current = Input("A", doc="i(t - d)")

    back_voltage = Parameter("V*s/m", 50.0, doc="k5: voltage per speed")
    rise = Parameter("A/(V*s)", 200.0, low=0.0, doc="k6: 1/inductance")
    decay = Parameter("1/s", 200.0, doc="k7: resistance/inductance")

    flowing = State("A", doc="current")

    current = Output("A", doc="current of the motor")

    @staticmethod
    def derivative(voltage: float, late_speed: float, late_current: float, back_voltage: float, rise: float, decay: float) -> float:
        """The electric circuit."""
        return rise * (voltage - back_voltage * late_speed) - decay * late_current

    @staticmethod
    def output(flowing: float) -> float:
        """The state as it is."""
        return flowing


class MotorSlide(Component):
    """Gives speed and position of a slide on its motor:  dv/dt = k8 i - k9 v(t - d) - F/m,   dx/dt = v.

    Source: equation (5) and the integrator behind it; the force F, zero by default, takes what the published structure leaves out.
    """

    group = "axes"
    ports = {
        "effort": "disturbance",
        "flow": "velocity",
        "displacement": "position",
        "drive": "current",
        "applied": "drive_force",
        "inertia": "mass",
        "reading": "position",
    }

    current = Input("A", doc="current of the motor")
    late_speed = Input("m/s", doc="v(t - d)")
    disturbance = Input("N", default=0.0, doc="F: force on the slide, positive against positive motion")

    acceleration_constant = Parameter("m/(s^2*A)", 0.5, doc="k8: acceleration per current")
    drag = Parameter("1/s", 5.0, doc="k9: deceleration per speed")
    mass = Parameter("kg", 100.0, low=1e-3, doc="m: moving mass, by which a force acts")

    speed = State("m/s", doc="speed of the slide")
    travel = State("m", doc="position of the slide")

    position = Output("m", doc="actual position of the slide")
    velocity = Output("m/s", doc="actual speed of the slide")
    motor_position = Output("m", doc="the same as its motor has it, which the loop is closed over: before a play that is inserted")
    drive_force = Output("N", doc="force of the motor on the slide, less the drag")

    @staticmethod
    def derivative(
        current: float, late_speed: float, disturbance: float, speed: float, acceleration_constant: float, drag: float, mass: float
    ) -> tuple[float, float]:
        """Newton's law."""
        return acceleration_constant * current - drag * late_speed - disturbance / mass, speed

    @staticmethod
    def output(travel: float, speed: float) -> tuple[float, float, float]:
        """The states as they are."""
        return travel, speed, travel

    @staticmethod
    def output_drive_force(current: float, late_speed: float, acceleration_constant: float, drag: float, mass: float) -> float:
        """What the slide would have of acceleration, times its mass."""
        return mass * (acceleration_constant * current - drag * late_speed)
