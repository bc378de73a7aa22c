"""Sensors, what a controller or a recorder sees of a quantity, and converters between numbers and voltages."""

from __future__ import annotations

import math

from lathesim.component import Component, DiscreteState, Input, Noise, Output, Parameter, State

_COUNTED = 1e15
"""Counts beyond which the next number is more than one count away."""


class LinearEncoder(Component):
    """Gives the position of a table in whole counts:  reading = r floor(x/r + 1/2), once a sample.

    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), section Axes; the resolution of 1 um is assumed.
    Left out: interpolation error within a period of the scale, lost counts, offset of the read head.
    """

    group = "converters"

    ports = {"measured": "measured", "reading": "position", "resolution": "resolution"}

    measured = Input("m", doc="actual position of the table")

    resolution = Parameter("m", 1e-6, low=0.0, doc="length of one count; 0 measures exactly")

    counted = DiscreteState("m", doc="position of this sample")

    position = Output("m", doc="measured position")

    @staticmethod
    def update(measured: float, resolution: float) -> float:
        if resolution <= 0.0 or not abs(measured) < _COUNTED * resolution:
            return measured
        return resolution * math.floor(measured / resolution + 0.5)

    @staticmethod
    def output(counted: float) -> float:
        return counted


class AngularEncoder(Component):
    """Gives an angle in whole counts and its backward difference:  reading = r floor(a/r + 1/2),  rate = (reading_k - reading_{k-1})/T.

    Source: G. Ellis, Control System Design Guide, 4th ed. (2012), chapter 14 (resolution of a difference: r/T); the default of 10 000
    counts a turn is that of the motor bench HSM150 (2023). Left out: eccentricity, interpolation error, lost counts.
    """

    group = "converters"

    ports = {"measured": "measured", "reading": "angle", "rate": "rate", "resolution": "resolution"}

    measured = Input("rad", doc="actual angle")

    resolution = Parameter("rad", 6.283185307179586e-4, low=0.0, doc="angle of one count; 0 measures exactly")
    start_rate = Parameter("rad/s", 0.0, doc="rate given at the first sample")

    counted = DiscreteState("rad", doc="angle of this sample")
    difference = DiscreteState("rad/s", doc="rate of this sample")

    angle = Output("rad", doc="measured angle")
    rate = Output("rad/s", doc="measured rate")

    @staticmethod
    def update(
        measured: float, counted: float, resolution: float, start_rate: float, sample_period: float, time: float
    ) -> tuple[float, float]:
        """Round to the nearest count, then take the difference."""
        now = measured
        if resolution > 0.0 and abs(measured) < _COUNTED * resolution:
            now = resolution * math.floor(measured / resolution + 0.5)
        if time <= 0.0:
            return now, start_rate
        return now, (now - counted) / sample_period

    @staticmethod
    def output(counted: float, difference: float) -> tuple[float, float]:
        return counted, difference


class Tachometer(Component):
    """Gives a voltage proportional to speed with white noise, bias and ripple:  V = Kt w + b + s n + r sin(N a).

    n is a standard normal number per sample, a the angle of the spindle, N the ripples per turn.
    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), section Spindle; gain assumed (10 V at 6250 rpm).
    Left out: nonlinearity, temperature. Noise is new at every sample and held over it.
    """

    group = "converters"

    ports = {"measured": "speed", "reading": "voltage", "gain": "gain"}

    speed = Input("rad/s", doc="actual speed of the spindle")
    angle = Input("rad", default=0.0, doc="angle of the spindle, which times the ripple")

    gain = Parameter("V*s/rad", 0.015278874536821952, doc="volts per speed")
    noise = Parameter("V", 0.0, low=0.0, doc="standard deviation of the white noise")
    bias = Parameter("V", 0.0, doc="constant offset")
    ripple = Parameter("V", 0.0, low=0.0, doc="amplitude of the ripple")
    ripples = Parameter("1", 8.0, low=0.0, doc="ripples per turn")

    chance = Noise(doc="white noise of the tachometer")
    held = DiscreteState("V", doc="voltage of this sample")

    voltage = Output("V", doc="voltage of the tachometer")

    @staticmethod
    def update(speed: float, angle: float, gain: float, noise: float, bias: float, ripple: float, ripples: float, chance: float) -> float:
        return gain * speed + bias + noise * chance + ripple * math.sin(ripples * angle)

    @staticmethod
    def output(held: float) -> float:
        return held


class AnalogSensor(Component):
    """Gives a voltage proportional to what it measures:  V = g s + b + r n,  n a standard normal number per sample.

    As an analog dynamometer it measures a cutting force, as a torque or power meter the load of the spindle; an ADConverter with
    ``sensor_gain`` wired from ``gain`` turns the voltage back.
    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), section Process control; 2 mV/N is assumed (10 V at 5 kN).
    Left out: bandwidth, drift, crosstalk, saturation (the converter saturates).
    """

    group = "converters"

    ports = {"measured": "measured", "reading": "voltage", "gain": "gain"}

    measured = Input("{signal}", doc="what is measured")

    gain = Parameter("V/({signal})", 0.002, doc="volts per unit of what is measured")
    bias = Parameter("V", 0.0, doc="constant offset")
    noise = Parameter("V", 0.0, low=0.0, doc="standard deviation of the white noise")

    chance = Noise(doc="white noise of the sensor")
    held = DiscreteState("V", doc="voltage of this sample")

    voltage = Output("V", doc="voltage of the sensor")

    @staticmethod
    def update(measured: float, gain: float, bias: float, noise: float, chance: float) -> float:
        return gain * measured + bias + noise * chance

    @staticmethod
    def output(held: float) -> float:
        return held


class Dynamometer(Component):
    """Gives the three forces on the tool as read once a sample:  reading = force + s n,  n a standard normal number.

    Source: Kistler, Multicomponent Dynamometer manuals (a stiff quartz sensor follows the force). Left out: drift, crosstalk, the
    resonance of the mounted dynamometer.
    """

    group = "converters"

    ports = {"measured": "main_force", "reading": "main", "thrust_reading": "thrust", "feed_reading": "feed"}

    main_force = Input("N", doc="force along the cutting speed")
    thrust_force = Input("N", default=0.0, doc="force along the depth")
    feed_force = Input("N", default=0.0, doc="force along the feed")

    noise = Parameter("N", 0.0, low=0.0, doc="standard deviation of the noise of each channel")

    main_chance = Noise(doc="noise of the main force")
    thrust_chance = Noise(doc="noise of the thrust force")
    feed_chance = Noise(doc="noise of the feed force")
    main_held = DiscreteState("N", doc="main force of this sample")
    thrust_held = DiscreteState("N", doc="thrust force of this sample")
    feed_held = DiscreteState("N", doc="feed force of this sample")

    main = Output("N", doc="force along the cutting speed, as read")
    thrust = Output("N", doc="force along the depth, as read")
    feed = Output("N", doc="force along the feed, as read")

    @staticmethod
    def update(
        main_force: float, thrust_force: float, feed_force: float, noise: float, main_chance: float, thrust_chance: float,
        feed_chance: float,
    ) -> tuple[float, float, float]:  # fmt: skip
        return main_force + noise * main_chance, thrust_force + noise * thrust_chance, feed_force + noise * feed_chance

    @staticmethod
    def output(main_held: float, thrust_held: float, feed_held: float) -> tuple[float, float, float]:
        return main_held, thrust_held, feed_held


_NARROW, _WIDE = 0.3826834323650898, 0.9238795325112867
"""Damping ratios of the two pairs of poles of a Butterworth filter of fourth order: the sines of 22.5 and 67.5 degrees."""


class SampledSensor(Component):
    """Gives what is measured, low-passed against aliasing, with noise, and clipped at its range.

    The filter is of fourth order (Butterworth), so that two channels of the same bandwidth differ by nothing but what they measure. Source:
    D. J. Ewins, Modal Testing (2000), section 3.5. Left out: drift, counts of the converter.
    """

    group = "converters"

    ports = {"measured": "measured", "reading": "reading"}

    measured = Input("{signal}", doc="what is measured")

    bandwidth = Parameter("Hz", 4000.0, low=0.1, doc="corner frequency of the filter")
    noise = Parameter("{signal}", 0.0, low=0.0, doc="standard deviation of the white noise")
    range = Parameter("{signal}", 1e9, low=0.0, doc="largest reading; what is beyond is clipped")

    first = State("{signal}", doc="output of the first half of the filter")
    first_rate = State("({signal})/s", doc="its rate")
    second = State("{signal}", doc="output of the filter")
    second_rate = State("({signal})/s", doc="its rate")
    chance = Noise(doc="white noise of the channel")
    held = DiscreteState("{signal}", doc="reading of this sample")

    reading = Output("{signal}", doc="what was read")

    @staticmethod
    def derivative(
        measured: float, bandwidth: float, first: float, first_rate: float, second: float, second_rate: float
    ) -> tuple[float, float, float, float]:
        w = 2.0 * math.pi * bandwidth
        return (
            first_rate,
            w * (w * (measured - first) - 2.0 * _WIDE * first_rate),
            second_rate,
            w * (w * (first - second) - 2.0 * _NARROW * second_rate),
        )

    @staticmethod
    def update(second: float, noise: float, range: float, chance: float) -> float:
        """The filter's output with its noise, clipped."""
        return min(max(second + noise * chance, -range), range)

    @staticmethod
    def output(held: float) -> float:
        return held


class Accelerometer(SampledSensor, units={"signal": "m/s^2"}):
    """Gives the acceleration of the place where it sits, low-passed against aliasing, with noise, and clipped at its range.

    The filter is of fourth order (Butterworth), so that two channels of the same bandwidth differ by nothing but what they measure. Source:
    D. J. Ewins, Modal Testing (2000), section 3.5. Left out: its mass, its own resonance, drift.
    """


def nearest_level(voltage: float, low: float, high: float, bits: float) -> float:
    """Return the level low + k q nearest to a voltage, with q = (high - low)/(2^bits - 1) and k from 0 to 2^bits - 1."""
    steps = math.pow(2.0, bits) - 1.0
    quantum = (high - low) / steps
    if voltage <= low or quantum <= 0.0:
        return low
    if voltage >= high:
        return high
    if math.isnan(voltage):
        return voltage
    return low + math.floor((voltage - low) / quantum + 0.5) * quantum


class DAConverter(Component):
    """Gives the voltage held for one sample: the command saturated and rounded to the nearest level.

    The levels are V_min + k q, q = (V_max - V_min)/(2^n - 1), k from 0 to 2^n - 1. With a symmetric range zero volts is not a level, so
    an axis at rest is never quite without voltage.
    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), section Spindle; 8 bits fitted to its Table 1.
    Left out: offset, settling, differential nonlinearity.
    """

    group = "converters"

    ports = {"drive": "command", "measured": "command", "reading": "voltage"}

    command = Input("V", doc="commanded voltage")

    smallest_voltage = Parameter("V", -10.0, doc="lower end of the range")
    largest_voltage = Parameter("V", 10.0, doc="upper end of the range")
    bits = Parameter("1", 8.0, low=1.0, high=32.0, doc="number of bits")

    held = DiscreteState("V", doc="voltage of this sample")

    voltage = Output("V", doc="voltage of the converter")

    @staticmethod
    def update(command: float, smallest_voltage: float, largest_voltage: float, bits: float) -> float:
        return nearest_level(command, smallest_voltage, largest_voltage, bits)

    @staticmethod
    def output(held: float) -> float:
        return held


class ADConverter(Component):
    """Gives a sensor's voltage as the computer sees it, saturated, rounded to V_min + k q, and divided by the sensor's gain.

    q = (V_max - V_min)/(2^n - 1). Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), section Spindle; 12 bits assumed.
    Left out: offset, conversion time, aliasing filter.
    """

    group = "converters"

    ports = {"measured": "voltage", "reading": "reading", "bits": "bits"}

    voltage = Input("V", doc="voltage of the sensor")

    smallest_voltage = Parameter("V", -10.0, doc="lower end of the range")
    largest_voltage = Parameter("V", 10.0, doc="upper end of the range")
    bits = Parameter("1", 12.0, low=1.0, high=32.0, doc="number of bits")
    sensor_gain = Parameter("V/({signal})", 1.0, doc="volts of the sensor per unit of what it measures")

    held = DiscreteState("V", doc="level of this sample")

    reading = Output("{signal}", doc="measured value")
    level = Output("V", doc="voltage of the level")

    @staticmethod
    def update(voltage: float, smallest_voltage: float, largest_voltage: float, bits: float) -> float:
        return nearest_level(voltage, smallest_voltage, largest_voltage, bits)

    @staticmethod
    def output(held: float, sensor_gain: float) -> tuple[float, float]:
        """Back into the unit of what is measured; a sensor without gain reads 0."""
        return (held / sensor_gain if sensor_gain != 0.0 else 0.0), held
