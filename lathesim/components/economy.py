"""What a lathe and a turned part cost."""

from __future__ import annotations

import math

from lathesim.component import Component, Input, Output, Parameter

_COARSEST = 10.0
"""Resolution [um] from which on an encoder costs no less."""

RADIANS_PER_TURN = 2.0 * math.pi
MICROMETRE = 1.0e-6
BASE_COST = 25000.0
PER_RPM = 1.0
PER_TURN_PER_SECOND_SQUARED = 100.0
PER_BIT = 50.0
PER_AXIS_SPEED = 5000.0
PER_AXIS_ACCELERATION = 5000.0
NOISE_DEVIATIONS = 3.0


def tachometer_cost(largest_noise: float) -> float:
    """Return the price [dollar] of a tachometer by the largest amount of its noise [V]: 1000 without noise, nothing from 1 V on."""
    return 0.0 if largest_noise >= 1.0 else 1000.0 * (1.0 - largest_noise)


def encoder_cost(resolution: float) -> float:
    """Return the price [dollar] of an encoder by its resolution [m]: 500 from 10 um on, 1000 at 1 um, 1900 at 0.1 um, linear between."""
    micrometres = resolution / MICROMETRE
    if micrometres >= _COARSEST:
        return 500.0
    if micrometres >= 1.0:
        return 1000.0 - 500.0 * (micrometres - 1.0) / 9.0
    return 1000.0 + 1000.0 * (1.0 - micrometres)


def axis_cost(top_speed: float, top_acceleration: float, bits: float, resolution: float) -> float:
    """Return the price [dollar] of an axis: 5000 a m/s, 5000 a m/s^2, 50 a bit of its converter, and its encoder."""
    return PER_AXIS_SPEED * top_speed + PER_AXIS_ACCELERATION * top_acceleration + PER_BIT * bits + encoder_cost(resolution)


def spindle_cost(top_speed: float, top_acceleration: float, bits: float, largest_noise: float) -> float:
    """Return the price [dollar] of a spindle (rad/s, rad/s^2): 1 a rpm, 100 a rev/s^2, 50 a bit of both converters, and its tachometer."""
    rpm = top_speed / RADIANS_PER_TURN * 60.0
    return (
        PER_RPM * rpm + PER_TURN_PER_SECOND_SQUARED * top_acceleration / RADIANS_PER_TURN + PER_BIT * bits + tachometer_cost(largest_noise)
    )


class LatheDesign(Component):
    """Holds the choices of a design project, and gives what the lathe costs:  C = 25000 + C_s + C_x + C_z  (dollar).

        C_s    = 1 per rpm of top speed + 100 per rev/s^2 + 50 per bit of A/D and D/A + tachometer (1000 (1 - noise/V), at least 0)
        C_axis = 5000 per m/s of top speed + 5000 per m/s^2 + 50 per bit of the D/A + encoder (500 at 10 um, 1000 at 1 um, 1900 at 0.1 um)
        top speed = K V_max,   top acceleration = K V_max/tau

    Wire the parameters of axes, spindle, converters, encoders and tachometer from those of this part, so that what is simulated is what is
    paid for. Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), Example 3, equation (40). That the largest amount of the noise
    is three standard deviations is assumed. Left out: what drives of more torque or stiffer guides would cost; an encoder finer than
    0.1 um is not to be had.
    """

    group = "process"

    spindle_gain = Parameter("rad/(s*V)", 26.09, low=0.1, doc="speed of the spindle per volt")
    spindle_time_constant = Parameter("s", 0.21, low=1e-3, doc="time constant of the spindle")
    spindle_ad_bits = Parameter("1", 12.0, low=1.0, high=32.0, doc="bits of the converter behind the tachometer")
    spindle_da_bits = Parameter("1", 12.0, low=1.0, high=32.0, doc="bits of the converter before the spindle")
    tachometer_noise = Parameter("V", 0.5, low=0.0, doc="largest amount of the tachometer's noise")
    x_gain = Parameter("m/(s*V)", 0.01878, low=1e-5, doc="speed of the x axis per volt")
    x_time_constant = Parameter("s", 0.0243, low=1e-3, doc="time constant of the x axis")
    x_bits = Parameter("1", 8.0, low=1.0, high=32.0, doc="bits of the converter before the x axis")
    x_resolution = Parameter("m", 1e-6, low=1e-7, doc="resolution of the encoder of the x axis")
    z_gain = Parameter("m/(s*V)", 0.01878, low=1e-5, doc="speed of the z axis per volt")
    z_time_constant = Parameter("s", 0.0243, low=1e-3, doc="time constant of the z axis")
    z_bits = Parameter("1", 8.0, low=1.0, high=32.0, doc="bits of the converter before the z axis")
    z_resolution = Parameter("m", 1e-6, low=1e-7, doc="resolution of the encoder of the z axis")
    largest_voltage = Parameter("V", 10.0, low=0.1, high=100.0, doc="range of all converters, to both sides")

    spindle_price = Output("dollar", doc="what the spindle costs, C_s")
    x_price = Output("dollar", doc="what the x axis costs, C_x")
    z_price = Output("dollar", doc="what the z axis costs, C_z")
    machine_cost = Output("dollar", doc="what the lathe costs, C")
    tachometer_deviation = Output("V", doc="standard deviation of the tachometer's noise")

    @staticmethod
    def output(
        spindle_gain: float, spindle_time_constant: float, spindle_ad_bits: float, spindle_da_bits: float, tachometer_noise: float,
        x_gain: float, x_time_constant: float, x_bits: float, x_resolution: float, z_gain: float, z_time_constant: float, z_bits: float,
        z_resolution: float, largest_voltage: float,
    ) -> tuple[float, float, float, float, float]:  # fmt: skip
        """Equation (40)."""
        turning = spindle_gain * largest_voltage
        spindle = spindle_cost(turning, turning / spindle_time_constant, spindle_ad_bits + spindle_da_bits, tachometer_noise)
        along_x = x_gain * largest_voltage
        along_z = z_gain * largest_voltage
        x = axis_cost(along_x, along_x / x_time_constant, x_bits, x_resolution)
        z = axis_cost(along_z, along_z / z_time_constant, z_bits, z_resolution)
        return spindle, x, z, BASE_COST + spindle + x + z, tachometer_noise / NOISE_DEVIATIONS


class TurningEconomy(Component):
    """Gives the time and the cost of one part, with its share of tool changes and edges:

        time_per_part = t + t_handling + u t_change
        part_cost     = m time_per_part + u c_edge

    t is the time since the start, u the share of the edge's life that was used up on the part (1/u parts a tool change), m the cost of
    machine and operator per time. The values at the end of a run are those of the part.
    Source: W. W. Gilbert, Economics of Machining, in Machining Theory and Practice, ASM (1950); G. Boothroyd, W. A. Knight, Fundamentals
    of Machining and Machine Tools (1989), chapter on the economics of machining. The default values are assumed.
    Left out: scrap, set-up of the batch, regrinding.
    """

    group = "tool and part"

    used_life = Input("1", doc="used-up share of the edge's life, since the start")

    machine_rate = Parameter("dollar/s", 60.0 / 3600.0, low=0.0, doc="cost of machine and operator per time")
    handling_time = Parameter("s", 0.0, low=0.0, doc="time to load and unload a part")
    tool_change_time = Parameter("s", 60.0, low=0.0, doc="time to change the edge")
    edge_cost = Parameter("dollar", 2.0, low=0.0, doc="cost of an edge")

    time_per_part = Output("s", doc="time for the part so far, with its share of tool changes")
    part_cost = Output("dollar", doc="cost of the part so far, with its share of edges")

    @staticmethod
    def output(
        time: float, used_life: float, machine_rate: float, handling_time: float, tool_change_time: float, edge_cost: float
    ) -> tuple[float, float]:
        spent = time + handling_time + used_life * tool_change_time
        return spent, machine_rate * spent + used_life * edge_cost
