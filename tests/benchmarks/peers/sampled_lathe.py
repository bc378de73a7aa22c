"""The two-axis lathe of ``lathe.c`` in plain Python, for peers that bring their own integrator.

``instant`` does what happens at a sample instant, ``rates`` gives the derivative of the six states in between, with what the instant
holds. What the work's program does not use is left out, as in the C file.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np

KIND, LENGTH, START_X, START_Z, END_X, END_Z, FEED, SPINDLE_MODE, SPINDLE_SPEED = 0, 1, 2, 3, 4, 5, 11, 13, 14
CELLS = 2000
TURN = 2.0 * math.pi


def nearest_level(voltage: float, low: float, high: float, bits: float) -> float:
    quantum = (high - low) / (2.0**bits - 1.0)
    if voltage <= low:
        return low
    if voltage >= high:
        return high
    return low + math.floor((voltage - low) / quantum + 0.5) * quantum


class Controller:
    """A PID with conditional integration."""

    def __init__(self, settings: Any, low: float, high: float, period: float) -> None:
        self.kp, self.ki, self.kd = settings.proportional, settings.integral, settings.derivative_gain
        self.low, self.high, self.period = low, high, period
        self.error = self.sum = 0.0
        self.started = False

    def voltage(self, reference: float, measured: float, correction: float = 0.0) -> float:
        error = reference - measured
        slope = (error - self.error) / self.period if self.started else 0.0
        total = self.sum + error * self.period
        voltage = self.kp * error + self.ki * total + self.kd * slope + correction
        growth = self.ki * error
        if (voltage > self.high and growth > 0.0) or (voltage < self.low and growth < 0.0):
            total = self.sum
            voltage = self.kp * error + self.ki * total + self.kd * slope + correction
        self.error, self.sum, self.started = error, total, True
        return min(max(voltage, self.low), self.high)


class SampledLathe:
    """The lathe at the sample instants and between them; see the module's text."""

    def __init__(self, work: Any) -> None:
        parts: dict[str, dict[str, float]] = {}
        for name, value in work.parameters.items():
            part, _, parameter = name.partition(".")
            parts.setdefault(part, {})[parameter] = float(value)
        self.p = SimpleNamespace(**{part: SimpleNamespace(**values) for part, values in parts.items()})
        self.path = work.path.tolist()
        self.noise = {name: values.tolist() for name, values in work.noise.items()}
        self.period = work.period
        p = self.p
        self.x_control, self.z_control, self.spindle_control = (
            Controller(control, dac.smallest_voltage, dac.largest_voltage, work.period)
            for control, dac in ((p.x_controller, p.x_dac), (p.z_controller, p.z_dac), (p.spindle_controller, p.spindle_dac))
        )
        self.removed = [0.0] * CELLS
        self.row, self.travelled, self.samples_left, self.planned_speed, self.path_speed = 0, 0.0, 0.0, -1.0, 0.0
        self.at_end = self.done = self.started = False
        self.coupling_sum = self.coupling_before = self.x_before = self.z_before = self.used = 0.0
        self.feed_command = -1.0
        self.x_volts = self.z_volts = self.spindle_volts = self.uncut = self.standing = self.cutting_block = 0.0
        self.wear_factor = 1.0
        self.lead_sine, self.lead_cosine = math.sin(p.cutting_force.lead_angle), math.cos(p.cutting_force.lead_angle)

    # ---- between the instants -------------------------------------------------------------------------------------------------

    def cut(self, s: Any) -> tuple[float, float, float, float, bool]:
        """Depth, feed, cutting speed, radius, and whether the tool touches."""
        x = s[1]
        turning = abs(s[4])
        radius = x if x > 0.0 else 0.0
        if not self.standing > x or self.cutting_block < 0.5:
            return 0.0, 0.0, turning * radius, radius, False
        depth = max(self.uncut - x, 0.0)
        feed = 0.0
        if turning > self.p.cutting.slowest_spindle:
            feed = TURN / turning * min(math.sqrt(s[0] * s[0] + s[2] * s[2]), 1.4142135623730951 * abs(s[2]))
        return depth, feed, turning * radius, radius, True

    def force(self, depth: float, feed: float, speed: float, touching: bool) -> tuple[float, float, float]:
        """Cutting, longitudinal and radial force."""
        p = self.p.cutting_force
        if not touching or depth <= 0.0 or feed <= 0.0 or speed < p.slowest_cutting_speed:
            return 0.0, 0.0, 0.0
        log_feed, log_depth, log_speed = math.log(feed / 1.0e-3), math.log(depth / 1.0e-3), math.log(speed / (1.0 / 60.0))
        area = self.wear_factor * feed * depth
        cutting = p.cutting_feed_exponent * log_feed + p.cutting_depth_exponent * log_depth + p.cutting_speed_exponent * log_speed
        thrust = p.thrust_feed_exponent * log_feed + p.thrust_depth_exponent * log_depth + p.thrust_speed_exponent * log_speed
        thrust = area * p.thrust_pressure * math.exp(thrust)
        return area * p.cutting_pressure * math.exp(cutting), thrust * self.lead_sine, thrust * self.lead_cosine

    def load(self, forces: tuple[float, float, float], radius: float, s: Any) -> tuple[float, float, float]:
        """Disturbance of both axes, torque of the spindle."""
        p, spindle = self.p.load, s[4]
        along = math.sqrt(s[0] * s[0] + s[2] * s[2] + p.slowest_feed * p.slowest_feed)
        feed_x, feed_z = s[0] / along, s[2] / along
        away_x, away_z = -feed_z, feed_x
        if away_x + (away_z if self.p.stock.free_end >= 0.0 else -away_z) < 0.0:
            away_x, away_z = feed_z, -feed_x
        torque = radius * forces[0] * spindle / math.sqrt(spindle * spindle + p.slowest_spindle * p.slowest_spindle)
        return forces[1] * feed_x - forces[2] * away_x, forces[1] * feed_z - forces[2] * away_z, torque

    def rates(self, s: Any) -> list[float]:
        """The derivative of (x speed, x, z speed, z, spindle speed, spindle angle)."""
        depth, feed, speed, radius, touching = self.cut(s)
        x_load, z_load, torque = self.load(self.force(depth, feed, speed, touching), radius, s)
        x, z, spindle = self.p.x_axis, self.p.z_axis, self.p.spindle
        return [
            (x.gain * self.x_volts - x.disturbance_gain * x_load - s[0]) / x.time_constant,
            s[0],
            (z.gain * self.z_volts - z.disturbance_gain * z_load - s[2]) / z.time_constant,
            s[2],
            (spindle.gain * self.spindle_volts - spindle.disturbance_gain * torque - s[4]) / spindle.time_constant,
            s[4],
        ]

    # ---- at the instants ------------------------------------------------------------------------------------------------------

    def instant(self, k: int, s: Any) -> None:
        """Everything that happens at sample instant ``k``; ``done`` rises at the end of the program."""
        p = self.p
        self._walk(s)
        segment, moving = self.path[self.row], self._moving()
        x_reference = self._on_path(segment, START_X, END_X)
        z_reference = self._on_path(segment, START_Z, END_Z)
        direction_x = (moving[END_X] - moving[START_X]) / moving[LENGTH]
        direction_z = (moving[END_Z] - moving[START_Z]) / moving[LENGTH]
        self.cutting_block = 1.0 if segment[KIND] == 1.0 else 0.0
        spindle_reference = segment[SPINDLE_SPEED] if segment[SPINDLE_MODE] == 1.0 else 0.0
        programmed = self.path_speed * TURN / abs(spindle_reference) if self.cutting_block and spindle_reference != 0.0 else 0.0
        x_seen = p.x_encoder.resolution * math.floor(s[1] / p.x_encoder.resolution + 0.5)
        z_seen = p.z_encoder.resolution * math.floor(s[3] / p.z_encoder.resolution + 0.5)
        self._take_stock(s[1], s[3])
        tachometer = p.tachometer
        volts = tachometer.gain * s[4] + tachometer.bias + tachometer.noise * self.noise["tachometer.chance"][k]
        volts += tachometer.ripple * math.sin(tachometer.ripples * s[5])
        adc = p.tachometer_adc
        reading = nearest_level(volts, adc.smallest_voltage, adc.largest_voltage, adc.bits) / tachometer.gain
        coupling = self._coupling((x_reference - x_seen) * direction_z - (z_reference - z_seen) * direction_x)
        depth, feed, speed, _, touching = self.cut(s)
        self._wear(speed, touching)
        force = self.force(depth, feed, speed, touching)[0]
        volts = p.dynamometer.gain * force + p.dynamometer.bias + p.dynamometer.noise * self.noise["dynamometer.chance"][k]
        adc = p.dynamometer_adc
        force_seen = nearest_level(volts, adc.smallest_voltage, adc.largest_voltage, adc.bits) / p.dynamometer.gain
        self.feed_command = self._controlled_feed(force_seen, programmed)
        x = self.x_control.voltage(x_reference, x_seen, coupling * direction_z)
        z = self.z_control.voltage(z_reference, z_seen, coupling * -direction_x)
        spindle = self.spindle_control.voltage(spindle_reference, reading)
        self.x_volts = nearest_level(x, p.x_dac.smallest_voltage, p.x_dac.largest_voltage, p.x_dac.bits)
        self.z_volts = nearest_level(z, p.z_dac.smallest_voltage, p.z_dac.largest_voltage, p.z_dac.bits)
        self.spindle_volts = nearest_level(spindle, p.spindle_dac.smallest_voltage, p.spindle_dac.largest_voltage, p.spindle_dac.bits)
        self.started = True

    def _takes_time(self, row: int) -> bool:
        return bool(self.path[row][KIND] <= 2.0 and self.path[row][LENGTH] > 0.0)

    def _next_row(self) -> int:
        row = self.row + 1
        while row < len(self.path) and not self._takes_time(row):
            row += 1
        return row

    def _moving(self) -> list[float]:
        row = self.row
        while row >= 0 and not self._takes_time(row):
            row -= 1
        if row < 0:
            row = next(ahead for ahead in range(len(self.path)) if self._takes_time(ahead))
        return self.path[row]  # type: ignore[no-any-return]

    def _on_path(self, segment: list[float], start: int, end: int) -> float:
        length = segment[LENGTH]
        if segment[KIND] > 2.0 or length <= 0.0 or self.travelled <= 0.0:
            return segment[start]
        if self.travelled >= length:
            return segment[end]
        return segment[start] + (segment[end] - segment[start]) * (self.travelled / length)

    def _walk(self, s: Any) -> None:
        if not self.started:
            self.at_end = not self._takes_time(0)
            return
        if self.at_end:
            self.row, self.travelled, self.samples_left, self.planned_speed = self._next_row(), 0.0, 0.0, -1.0
        now = self.path[self.row]
        wanted = self.p.interpolator.rapid_speed
        if now[KIND] != 0.0:
            wanted = now[FEED] if self.feed_command < 0.0 else self.feed_command * abs(s[4]) / TURN
        way, length = wanted * self.period, now[LENGTH]
        steady = abs(wanted - self.planned_speed) <= 1e-9 * wanted
        self.at_end = False
        if not steady or self.samples_left < 0.5:
            rest = max(1.0, math.ceil((length - self.travelled) / way - 1.0e-6))
            self.samples_left = 0.0 if self.planned_speed >= 0.0 and not steady and rest > 4.0 else rest
            self.planned_speed = wanted
        if self.samples_left > 0.5:
            way = (length - self.travelled) / self.samples_left
            self.samples_left -= 1.0
            self.at_end = self.samples_left < 0.5
        self.path_speed = way / self.period
        self.travelled = length if self.at_end else self.travelled + way
        self.done = self.at_end and self._next_row() >= len(self.path)

    def _standing_at(self, cell: int) -> float:
        return self.p.stock.stock_radius - self.removed[cell] if 0 <= cell < CELLS else 0.0

    def _take_stock(self, x: float, z: float) -> None:
        p = self.p.stock
        if not self.started:
            self.x_before, self.z_before = x, z
        width = p.stock_length / CELLS
        here, there = (z - p.face) / width, (self.z_before - p.face) / width
        inside = p.face <= z <= p.face + p.stock_length
        cell = min(math.floor(here), CELLS - 1) if inside else math.floor(here)
        first, last = max(0, math.floor(min(here, there) + 0.5)), min(CELLS - 1, math.floor(max(here, there) - 0.5))
        for i in range(first, last + 1):
            share = (i + 0.5 - there) / (here - there) if here != there else 1.0
            tip = max(self.x_before + share * (x - self.x_before), 0.0)
            if p.stock_radius - self.removed[i] > tip:
                self.removed[i] = p.stock_radius - tip
        self.uncut = self.standing = 0.0
        if inside:
            left, middle, right = self._standing_at(cell - 1), self._standing_at(cell), self._standing_at(cell + 1)
            self.standing = max(left, middle, right)
            self.uncut = (right if z > self.z_before else left if z < self.z_before else self.standing) or middle
        self.x_before, self.z_before = x, z

    def _coupling(self, deviation: float) -> float:
        p = self.p.cross_coupling
        slope = (deviation - self.coupling_before) / self.period if self.started else 0.0
        total = self.coupling_sum + deviation * self.period
        voltage = p.proportional * deviation + p.integral * total + p.derivative_gain * slope
        if abs(voltage) > p.largest_voltage and voltage * p.integral * deviation > 0.0:
            total = self.coupling_sum
            voltage = p.proportional * deviation + p.integral * total + p.derivative_gain * slope
        self.coupling_sum, self.coupling_before = total, deviation
        return max(-p.largest_voltage, min(p.largest_voltage, voltage))

    def _wear(self, speed: float, touching: bool) -> None:
        p = self.p.tool_wear
        if touching and speed >= p.slowest_cutting_speed:
            logarithm = math.log(p.taylor_constant / speed) / p.taylor_exponent
            self.used += self.period / (60.0 * math.exp(max(-60.0, min(60.0, logarithm))))
        self.wear_factor = 1.0 + p.force_growth * (p.wear_at_end_of_life * self.used)

    def _controlled_feed(self, measured: float, programmed: float) -> float:
        p = self.p.process_controller
        if self.cutting_block < 0.5:
            return -1.0
        if self.feed_command < 0.0:
            return min(max(programmed, p.smallest_feed), p.largest_feed)
        theta = p.force_gain * (p.depth_of_cut / 1.0e-3) ** p.depth_exponent * (p.cutting_speed / (1000.0 / 60.0)) ** p.speed_exponent
        control = (self.feed_command / 1.0e-3) ** p.feed_exponent + self.period * (p.reference - measured) / (p.time_constant * theta)
        if control <= 0.0:
            return p.smallest_feed
        if math.log(control) / p.feed_exponent > math.log(p.largest_feed / 1.0e-3):
            return p.largest_feed
        return min(max(1.0e-3 * control ** (1.0 / p.feed_exponent), p.smallest_feed), p.largest_feed)


def positions(work: Any, lathe: SampledLathe, advance: Callable[[list[float]], list[float]]) -> np.ndarray:
    """Return the positions of both axes at each sample (2, samples); ``advance`` carries the state over a sample."""
    state, kept = [0.0] * 6, []
    for k in range(work.samples):
        lathe.instant(k, state)
        kept.append((state[1], state[3]))
        if lathe.done:
            break
        state = advance(state)
    return np.array(kept).T
