"""Parts of the closed machine-tool controller: continuous loops whose feedback arrives after a transport delay.

The loops inside a feed drive: speed controller, power controller, electronics, motor with its slide.

Source of all: A. Tiwari et al., Learning digital emulators for closed architecture machine tool controllers, J. Manuf. Syst. 68 (2023),
equations (2) to (5). Values are assumed; the paper gives none.
"""

from __future__ import annotations

from lathesim.component import Component, Input, Output, Parameter, State


class ControllerTuning(Component):
    """Gives p13 to p16, the PI gains, as a control that identifies its drive wrongly would set them.

    Modulus optimum of the current loop, symmetrical optimum of the speed loop, with T = k4 + d and Tc = 2 T:

        p15 = L/(2 T),   p16 = R/(2 T),   p13 = 1/(2 k8 Tc),   p14 = p13/(4 Tc)

    Each of the seven factors p28 to p34 is identified value/true value; with all at 1 the gains are those given. The paper names no
    formula, so this one is assumed; p28 to p34 show only through the four gains.

    Source: A. Voda, I. Landau, A method for the auto-calibration of PID controllers, Automatica 31 (1995); A. Tiwari et al. (2023),
    section 2.1.
    """

    group = "controllers"

    speed_proportional = Parameter("A*s/m", 166.7, low=0.0, doc="p13 of an identification without errors")
    speed_integral = Parameter("A/m", 6944.0, low=0.0, doc="p14 of an identification without errors")
    power_proportional = Parameter("V/A", 0.833, low=0.0, doc="p15 of an identification without errors")
    power_integral = Parameter("V/(A*s)", 166.7, low=0.0, doc="p16 of an identification without errors")
    inductance_error = Parameter("1", 1.0, low=1e-3, doc="p28: factor on L = 1/k6")
    resistance_error = Parameter("1", 1.0, low=1e-3, doc="p29: factor on R = k7/k6")
    lag_error = Parameter("1", 1.0, low=1e-3, doc="p30: factor on k4")
    delay_error = Parameter("1", 1.0, low=1e-3, doc="p31: factor on d")
    acceleration_error = Parameter("1", 1.0, low=1e-3, doc="p32: factor on k8")
    current_loop_error = Parameter("1", 1.0, low=1e-3, doc="p33: factor on Tc")
    symmetry_error = Parameter("1", 1.0, low=1e-3, doc="p34: factor on the 4 of the symmetrical optimum")
    lag = Parameter("s", 0.002, low=1e-6, doc="k4, the lag of the power controller")
    delay = Parameter("s", 1e-3, low=0.0, doc="d, the transport delay")

    speed_controller_proportional = Output("A*s/m", doc="p13 as set")
    speed_controller_integral = Output("A/m", doc="p14 as set")
    power_controller_proportional = Output("V/A", doc="p15 as set")
    power_controller_integral = Output("V/(A*s)", doc="p16 as set")

    @staticmethod
    def output(
        speed_proportional: float, speed_integral: float, power_proportional: float, power_integral: float, inductance_error: float,
        resistance_error: float, lag_error: float, delay_error: float, acceleration_error: float, current_loop_error: float,
        symmetry_error: float, lag: float, delay: float,
    ) -> tuple[float, float, float, float]:  # fmt: skip
        slow = (lag * lag_error + delay * delay_error) / (lag + delay)
        loop = slow * current_loop_error
        speed = 1.0 / (acceleration_error * loop)
        return (
            speed_proportional * speed,
            speed_integral * speed / (loop * symmetry_error),
            power_proportional * inductance_error / slow,
            power_integral * resistance_error / slow,
        )


class MultiOscillatoryController(Component):
    """Gives the speed asked for from the position error and what the oscillatory elements add:

        e = reference - measured,   v = kv (kp e + added)

    Source: A. Tiwari et al., Learning digital emulators for closed architecture machine tool controllers, J. Manuf. Syst. 68 (2023),
    equation (1); element i is taken with gain i alone. Left out: limits of the speed.
    """

    group = "controllers"
    ports = {"measured": "measured", "drive": "reference", "reading": "speed", "loop_gain": "loop_gain", "error": "error"}

    reference = Input("m", doc="commanded position")
    measured = Input("m", doc="position as it arrives")
    added = Input("m", default=0.0, doc="sum of the oscillatory elements")

    proportional = Parameter("1", 1.0, low=0.0, doc="kp (p23): share of the error itself")
    loop_gain = Parameter("1/s", 20.0, low=0.0, doc="kv (p24): commanded speed per error")

    error = Output("m", doc="position error, which the oscillatory elements take")
    speed = Output("m/s", doc="commanded speed")

    @staticmethod
    def output_error(reference: float, measured: float) -> float:
        return reference - measured

    @staticmethod
    def output_speed(error: float, added: float, proportional: float, loop_gain: float) -> float:
        return loop_gain * (proportional * error + added)


class OscillatoryElement(Component):
    """Gives the sum of the elements before it and of its own answer to the position error:

        Y(s) = g w s / (s^2 + 2 z w s + w^2) E(s)

    It answers to what swings near w and to nothing that stays constant.

    Source: as :class:`MultiOscillatoryController`, equation (1).
    """

    group = "controllers"

    error = Input("m", doc="position error")
    before = Input("m", default=0.0, doc="sum of the elements before this one")

    frequency = Parameter("rad/s", 15.0, low=1e-6, doc="w: where it answers most")
    damping = Parameter("1", 0.4, low=0.0, doc="z: damping ratio")
    gain = Parameter("1", 0.02, low=0.0, doc="g: weight of the element")

    swing = State("m*s^2", doc="twice integrated error of the element")
    rate = State("m*s", doc="its rate")

    added = Output("m", doc="sum up to this element")

    @staticmethod
    def derivative(error: float, swing: float, rate: float, frequency: float, damping: float) -> tuple[float, float]:
        return rate, error - 2.0 * damping * frequency * rate - frequency * frequency * swing

    @staticmethod
    def output(before: float, rate: float, frequency: float, gain: float) -> float:
        return before + gain * frequency * rate


class SpeedController(Component):
    """Gives the current asked for by a PI law of the speed error:

        e = reference - k1 measured,   u = g (kp e + ki integral e)

    Source: equation (2). Left out: limits of the current, anti-windup.
    """

    group = "controllers"
    ports = {"measured": "measured", "drive": "reference", "reading": "current"}

    reference = Input("m/s", doc="commanded speed")
    measured = Input("m/s", doc="speed as it arrives")

    proportional = Parameter("A*s/m", 166.7, low=0.0, doc="kp (p13)")
    integral = Parameter("A/m", 6944.0, low=0.0, doc="ki (p14)")
    gain = Parameter("1", 1.0, low=0.0, doc="g (p25): factor on both")
    feedback_gain = Parameter("1", 1.0, doc="k1: factor on the speed fed back")

    summed = State("m", doc="integral of the speed error")

    current = Output("A", doc="commanded current")

    @staticmethod
    def derivative(reference: float, measured: float, feedback_gain: float) -> float:
        return reference - feedback_gain * measured

    @staticmethod
    def output(
        reference: float, measured: float, summed: float, proportional: float, integral: float, gain: float, feedback_gain: float
    ) -> float:
        return gain * (proportional * (reference - feedback_gain * measured) + integral * summed)


class PowerController(Component):
    """Gives the voltage by a PI law of the current error, behind a lag that feeds its own late output back:

        e = reference - k2 (measured + k3),   k4 dw/dt + w(t - d) = g (kp e + ki integral e)

    Source: equation (3); w(t - d) arrives by a wire from a :class:`DelayLine`. Left out: limits of the voltage.
    """

    group = "controllers"
    ports = {"measured": "measured", "drive": "reference", "reading": "voltage"}

    reference = Input("A", doc="commanded current")
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
        error = reference - feedback_gain * (measured + disturbance)
        return error, (gain * (proportional * error + integral * summed) - late_voltage) * (1.0 / lag)

    @staticmethod
    def output(held: float) -> float:
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
        return rise * (voltage - back_voltage * late_speed) - decay * late_current

    @staticmethod
    def output(flowing: float) -> float:
        return flowing


class MotorSlide(Component):
    """Gives speed and position of a slide on its motor:  dv/dt = k8 i - k9 v(t - d) - F/m,   dx/dt = v.

    Source: equation (5) and the integrator behind it; the force F, zero by default, takes what the published structure leaves out.
    """

    group = "axes"
    ports = {
        "effort": "disturbance", "flow": "velocity", "displacement": "position", "drive": "current", "applied": "drive_force",
        "inertia": "mass", "reading": "position",
    }  # fmt: skip

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
        return acceleration_constant * current - drag * late_speed - disturbance / mass, speed

    @staticmethod
    def output(travel: float, speed: float) -> tuple[float, float, float]:
        return travel, speed, travel

    @staticmethod
    def output_drive_force(current: float, late_speed: float, acceleration_constant: float, drag: float, mass: float) -> float:
        """What the slide would have of acceleration, times its mass."""
        return mass * (acceleration_constant * current - drag * late_speed)
