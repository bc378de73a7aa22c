"""The circular test after ISO 230-4: how round the path is that the tool took on a programmed circle."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lathesim.analysis.metric import CONTACT, CONTOUR_ERROR, Metric, find_channel, signal
from lathesim.errors import RecordError
from lathesim.record import FloatArray, Record

_FEWEST = 8
"""Samples of a part of a circle."""
_ROUNDING = 1e-9
"""Share of a turn."""
_EIGHTH = 0.25 * math.pi

_TURN = 2.0 * math.pi
_GRID = 720
"""Angles at which the directions are compared, and points that the two concentric circles are laid around."""
_NEAR = math.radians(30.0)
"""Angle from +-X and +-Z [rad] within which spikes of reversals are looked for (assumed)."""
_WHOLE = 1e-3
"""Share of a turn that may be missing from a whole one: a sample at either end."""

_CARRIED = 1e-9
"""Share of the radius that samples, steps and the comparison at even angles carry: what is smaller is no deviation and counts as 0."""


@dataclass(frozen=True)
class Circle:
    """The last whole turn that a tool went on one programmed circle.

    ``angle`` [rad], from +X towards +Z, and ``radial`` [m], the distance from the programmed centre less ``radius``; ``direction`` +1 from
    +X to +Z. ``whole`` says whether it is a whole turn; what lies before it, the run in, is dropped.
    """

    radius: float
    direction: float
    angle: FloatArray
    radial: FloatArray
    whole: bool

    @property
    def on_grid(self) -> FloatArray:
        """The radial deviation at even angles from 0 to a turn [m]."""
        order = np.argsort(np.mod(self.angle, _TURN))
        return np.interp(np.arange(_GRID) * _TURN / _GRID, np.mod(self.angle, _TURN)[order], self.radial[order], period=_TURN)


def circles(record: Record) -> list[Circle]:
    """Return the circles of a record: each stretch of samples on one programmed circle that is at least a whole turn long."""
    x, z = _position(record, "x"), _position(record, "z")
    centre_x, centre_z = signal(record, "centre_x"), signal(record, "centre_z")
    radius = signal(record, "circle_radius")
    reference_x, reference_z = signal(record, "x_reference"), signal(record, "z_reference")
    turned = np.unwrap(np.arctan2(reference_z - centre_z, reference_x - centre_x))
    breaks = np.flatnonzero(np.any(np.diff(np.stack([centre_x, centre_z, radius]), axis=1) != 0.0, axis=0)) + 1
    found = []
    for part in np.split(np.arange(len(x)), breaks):
        if len(part) < _FEWEST or radius[part[0]] <= 0.0:
            continue
        found += _one_way(part, turned, x - centre_x, z - centre_z, radius)
    return found


def _one_way(part: np.ndarray, turned: FloatArray, x: FloatArray, z: FloatArray, radius: FloatArray) -> list[Circle]:
    """Return the whole turns of a stretch on one circle, one for each sense in which it was run."""
    found = []
    sense = np.sign(np.diff(turned[part], append=turned[part[-1]]))
    for direction in (1.0, -1.0):
        moving = np.flatnonzero(sense == direction)
        if not len(moving):
            continue
        run = part[moving[0] : moving[-1] + 2]
        run = run[np.abs(turned[run] - turned[run[-1]]) <= _TURN * (1.0 + _ROUNDING)]
        if abs(turned[run[-1]] - turned[run[0]]) >= _TURN * (1.0 - _WHOLE):
            size = np.hypot(x[run], z[run])
            found.append(Circle(float(radius[run[0]]), direction, np.arctan2(z[run], x[run]), size - radius[run], True))
    return found


def _position(record: Record, axis: str) -> FloatArray:
    for name in ("contour.tool_" + axis, f"{axis}_scale.position", f"{axis}_axis.position"):
        if name in record:
            return record[name]
    return signal(record, f"{axis}_axis.position", f"{axis}_encoder.position")


def circular_deviation(circle: Circle) -> float:
    """Return G [m]: the smallest radial distance of two concentric circles that hold the path.

    min over the centre (a, b) of  max(f) - min(f),   f = radial - a cos - b sin,   a linear program in a, b and the two bounds
    """
    from scipy.optimize import linprog

    even = np.arange(_GRID) * _TURN / _GRID
    shape = np.stack([np.cos(even), np.sin(even)], axis=1)
    radial = circle.on_grid - float(np.mean(circle.on_grid))
    scale = float(np.max(np.abs(radial)))
    if _carried(scale, circle) == 0.0:
        return 0.0
    one = np.ones((_GRID, 1))
    above = np.hstack([-shape, -one, 0.0 * one])
    below = np.hstack([shape, 0.0 * one, one])
    limits = np.concatenate([-radial, radial]) / scale
    solved = linprog([0.0, 0.0, 1.0, -1.0], A_ub=np.vstack([above, below]), b_ub=limits, bounds=[(None, None)] * 4, method="highs")
    return _carried(float(solved.fun) * scale if solved.success else float(np.ptp(radial)), circle)


def _carried(deviation: float, circle: Circle) -> float:
    """Return a deviation, or 0 where the numbers do not carry it."""
    return deviation if deviation > _CARRIED * circle.radius else 0.0


def hysteresis(forward: Circle, backward: Circle) -> float:
    """Return H [m]: the largest radial difference between the two directions at one angle."""
    return _carried(float(np.max(np.abs(forward.on_grid - backward.on_grid))), forward)


@dataclass(frozen=True)
class Ellipse:
    """An ellipse in a path: ``size`` is its longest less its shortest radius [m], ``longest`` the angle of the longest [rad].

    The angle runs from +X to +Z, between -pi/2 and pi/2. Unequal gains of the axes cause an ellipse along a diagonal that changes with the
    direction. Axes that are not square cause one that stays. Scales cause one along X or Z (ISO 230-4, annex B).
    """

    size: float
    longest: float


def ellipse(circle: Circle) -> Ellipse:
    """Return the ellipse in a path, from the second harmonic of the radial deviation away from the quadrants."""
    shape = _smooth(circle)
    size = _carried(2.0 * float(np.hypot(shape[3], shape[4])), circle)
    return Ellipse(size, 0.5 * math.atan2(shape[4], shape[3]) if size > 0.0 else 0.0)


def _smooth(circle: Circle) -> FloatArray:
    """Return the least-squares coefficients [m] of 1, cos a, sin a, cos 2a, sin 2a in the radial deviation away from the quadrants."""
    even = np.arange(_GRID) * _TURN / _GRID
    away = np.abs((even + _EIGHTH) % (2.0 * _EIGHTH) - _EIGHTH) > _NEAR
    return np.asarray(np.linalg.lstsq(_harmonics(even[away]), circle.on_grid[away], rcond=None)[0])


def _harmonics(angle: FloatArray) -> FloatArray:
    return np.stack([np.ones_like(angle), np.cos(angle), np.sin(angle), np.cos(2.0 * angle), np.sin(2.0 * angle)], axis=1)


def quadrant_peaks(circle: Circle) -> tuple[float, float, float, float]:
    """Return the spread of the radial deviation within 30 degrees of +X, +Z, -X, -Z [m], where an axis turns round.

    Its mean, an offset of the centre and an ellipse are no reversals and are subtracted first.
    """
    even = np.arange(_GRID) * _TURN / _GRID
    radial = circle.on_grid - _harmonics(even) @ _smooth(circle)
    peaks = []
    for quarter in range(4):
        off = np.abs((even - 0.5 * math.pi * quarter + math.pi) % _TURN - math.pi)
        peaks.append(_carried(float(np.ptp(radial[off <= _NEAR])), circle))
    return peaks[0], peaks[1], peaks[2], peaks[3]


def _first(record: Record) -> Circle:
    found = circles(record)
    if not found:
        raise RecordError("not available: no whole turn of a circle was run")
    return found[-1]


def measured_circular_deviation(record: Record) -> float:
    """Return the circular deviation G of the last circle of a record [m]."""
    _first(record)
    return max(circular_deviation(circle) for circle in circles(record))


def measured_hysteresis(record: Record) -> float:
    """Return the hysteresis H of a record that ran a circle in both directions [m]."""
    ways = {circle.direction: circle for circle in circles(record)}
    if len(ways) < 2:
        raise RecordError("not available: the circle was run in one direction only")
    return hysteresis(ways[1.0], ways[-1.0])


def largest_radial_deviation(record: Record) -> float:
    """Return F max of a record [m]: the largest radial deviation from the programmed circle."""
    _first(record)
    return max(float(np.max(circle.radial)) for circle in circles(record))


def smallest_radial_deviation(record: Record) -> float:
    """Return F min of a record [m]: the smallest radial deviation from the programmed circle."""
    _first(record)
    return min(float(np.min(circle.radial)) for circle in circles(record))


def _whole_path(record: Record) -> FloatArray:
    if find_channel(record, *CONTACT, "engaged") is not None:
        raise RecordError("not available: the machine cuts, and the metrics of contact tell more")
    return signal(record, *CONTOUR_ERROR)


def max_path_error(record: Record) -> float:
    """Return the largest distance from the path of a run without a cut [m]."""
    return float(np.max(np.abs(_whole_path(record))))


def rms_path_error(record: Record) -> float:
    """Return the root mean square of the distance from the path of a run without a cut [m]."""
    error = _whole_path(record)
    return float(np.sqrt(np.mean(error * error)))


def rms_speed_error(record: Record) -> float:
    """Return the root mean square of a difference of squared path speeds [m^2/s^2]."""
    error = signal(record, "speed_error")
    return float(np.sqrt(np.mean(error * error)))


def quality_factor(record: Record) -> float:
    """Return nu = V_k/rms(E_k) [1/s], the speed along the path over the rms contour error.

    V_k follows from the speed error that the record holds, V_k^2 = x'^2 + z'^2 - E_vk. Source: V. Lyubich, V. Frolov, V. Beliaev, Synthesis
    of the neural coordinated control algorithm for the model of CNC machine, table 1.
    """
    return _speed_over(record, rms_path_error(record))


def smallest_quality_factor(record: Record) -> float:
    """Return nu_min = V_k/max |E_k| [1/s], see :func:`quality_factor`."""
    return _speed_over(record, max_path_error(record))


def _speed_over(record: Record, error: float) -> float:
    excess = signal(record, "speed_error")
    x, z = signal(record, "x_axis.velocity", "x_velocity"), signal(record, "z_axis.velocity", "z_velocity")
    if error == 0.0:
        raise RecordError("not available: the tool does not leave the path")
    return math.sqrt(max(float(np.mean(x * x + z * z - excess)), 0.0)) / error


CIRCLE_METRICS: tuple[Metric, ...] = (
    Metric("max_path_error", "m", "largest distance from the path, cut or not", max_path_error),
    Metric("rms_path_error", "m", "root mean square of the distance from the path", rms_path_error),
    Metric("rms_speed_error", "m^2/s^2", "root mean square of a difference of squared path speeds", rms_speed_error),
    Metric("quality_factor", "1/s", "speed along the path over the rms distance from it", quality_factor),
    Metric("smallest_quality_factor", "1/s", "speed along the path over the largest distance from it", smallest_quality_factor),
    Metric("circular_deviation", "m", "G of ISO 230-4: two concentric circles hold the path", measured_circular_deviation),
    Metric("circular_hysteresis", "m", "H of ISO 230-4: largest difference between both directions", measured_hysteresis),
    Metric("largest_radial_deviation", "m", "F max of ISO 230-4", largest_radial_deviation),
    Metric("smallest_radial_deviation", "m", "F min of ISO 230-4", smallest_radial_deviation),
)
"""The metrics of a path and of a circle."""
