"""The stock metrics: one small function each, Record -> number in SI.

"In contact" are the samples with ``in_contact`` over 0.5: the tool tip is inside the bounds of the raw stock in a block run at feed.
Integrals are sums over the samples times the sample period, as in J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), Table 1.

Metrics of cost: of a lathe in a design project, and of a part.

They read the channels of the parts LatheDesign and TurningEconomy, where a machine has them.
"""

from __future__ import annotations

import numpy as np

from lathesim.analysis.metric import (
    CONTACT,
    CONTOUR_ERROR,
    CUTTING_FORCE,
    NOTHING_CUT,
    SPINDLE_SPEED,
    Metric,
    NoValueError,
    find_channel,
    signal,
)
from lathesim.analysis.turned_part import wave_roughness
from lathesim.errors import RecordError
from lathesim.record import FloatArray, Record


def in_contact(record: Record) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Return for each sample whether tool and part are in contact."""
    touching: np.ndarray[tuple[int], np.dtype[np.bool_]] = signal(record, *CONTACT) > 0.5
    return touching


def while_in_contact(record: Record, *wanted: str) -> FloatArray:
    """Return a channel's samples in contact; :class:`NoValueError` where there is none."""
    values = signal(record, *wanted)
    touching = values[in_contact(record)]
    if not len(touching):
        raise NoValueError("tool and part are never in contact")
    return touching


def largest(values: FloatArray) -> float:
    """Return the largest magnitude."""
    return float(np.max(np.abs(values)))


def root_mean_square(values: FloatArray) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(values * values)))


def cycle_time(record: Record) -> float:
    """Return the time from the start until the reference reaches the end of the program, else the length of the record [s]."""
    if not len(record):
        raise RecordError("not available: the record is empty")
    name = find_channel(record, "finished")
    if name is not None:
        done = np.flatnonzero(record[name] > 0.5)
        if len(done):
            return round(float(record.time[done[0]] - record.time[0]), 9)
    return round(float(record.time[-1] - record.time[0]), 9)


def contact_time(record: Record) -> float:
    """Return how long tool and part are in contact [s]."""
    return float(np.count_nonzero(in_contact(record))) * record.sample_period


def max_contour_error(record: Record) -> float:
    """Return the largest magnitude of the contour error in contact [m]."""
    return largest(while_in_contact(record, *CONTOUR_ERROR))


def rms_contour_error(record: Record) -> float:
    """Return the root mean square of the contour error in contact [m]."""
    return root_mean_square(while_in_contact(record, *CONTOUR_ERROR))


def contour_error_squared_integral(record: Record) -> float:
    """Return sum(e_c^2) T over the samples in contact [m^2 s]."""
    error = while_in_contact(record, *CONTOUR_ERROR)
    return float(np.sum(error * error)) * record.sample_period


def max_surface_roughness(record: Record) -> float:
    """Return the largest average roughness R_a of the surface being cut [m]."""
    return float(np.max(signal(record, "roughness")))


def mean_surface_roughness(record: Record) -> float:
    """Return the mean of R_a over the time in which a surface is cut [m]."""
    roughness = signal(record, "roughness")
    cut = roughness[roughness > 0.0]
    return float(np.mean(cut)) if len(cut) else 0.0


def max_cutting_force(record: Record) -> float:
    """Return the largest magnitude of the cutting force, along the cutting speed [N]."""
    return largest(signal(record, *CUTTING_FORCE))


def mean_cutting_force(record: Record) -> float:
    """Return the mean cutting force in contact [N]."""
    return float(np.mean(while_in_contact(record, *CUTTING_FORCE)))


def max_feed(record: Record) -> float:
    """Return the largest actual feed per revolution while cutting [m]."""
    return float(np.max(signal(record, "feed_per_revolution")))


def max_feed_speed(record: Record) -> float:
    """Return the largest commanded path speed in contact [m/s]."""
    return largest(while_in_contact(record, "feed_speed"))


def max_depth_of_cut(record: Record) -> float:
    """Return the largest actual depth of cut [m]."""
    return float(np.max(signal(record, "depth_of_cut")))


def removed_volume(record: Record) -> float:
    """Return the volume cut off the part [m^3]."""
    return float(signal(record, "removed_volume")[-1])


def max_spindle_torque(record: Record) -> float:
    """Return the largest magnitude of the cutting torque on the spindle [N m]."""
    return largest(signal(record, "cutting_torque"))


def rms_spindle_torque(record: Record) -> float:
    """Return the root mean square of the cutting torque in contact [N m]."""
    return root_mean_square(while_in_contact(record, "cutting_torque"))


def max_cutting_power(record: Record) -> float:
    """Return the largest cutting power at the spindle [W]."""
    return largest(signal(record, "cutting_power"))


def rms_cutting_power(record: Record) -> float:
    """Return the root mean square of the cutting power in contact [W]."""
    return root_mean_square(while_in_contact(record, "cutting_power"))


def cutting_energy(record: Record) -> float:
    """Return the work of cutting, sum(power) T [J]."""
    return float(np.sum(signal(record, "cutting_power"))) * record.sample_period


def while_engaged(record: Record, *wanted: str) -> FloatArray:
    """Return a channel's samples in which material is cut; :class:`NoValueError` where there is none."""
    values = signal(record, *wanted)[signal(record, "engaged") > 0.5]
    if not len(values):
        raise NoValueError(NOTHING_CUT)
    return values


def min_cutting_speed(record: Record) -> float:
    """Return the lowest cutting speed while cutting [m/s]."""
    return float(np.min(while_engaged(record, "cutting_speed")))


def mean_cutting_speed(record: Record) -> float:
    """Return the mean cutting speed while cutting [m/s]."""
    return float(np.mean(while_engaged(record, "cutting_speed")))


def max_cutting_speed(record: Record) -> float:
    """Return the highest cutting speed while cutting [m/s]."""
    return float(np.max(while_engaged(record, "cutting_speed")))


def mean_spindle_droop(record: Record) -> float:
    """Return by how much the spindle turns slower than it should, on average while cutting [rad/s]."""
    reference = np.abs(while_engaged(record, "spindle_reference"))
    return float(np.mean(reference - np.abs(while_engaged(record, *SPINDLE_SPEED))))


def voltage_unrest(record: Record, channel: str) -> float:
    """Return the root mean square of the change of a voltage from sample to sample in contact [V]."""
    change = np.diff(signal(record, channel))[in_contact(record)[1:]]
    if not len(change):
        raise NoValueError("tool and part are never in contact")
    return root_mean_square(change)


def spindle_voltage_unrest(record: Record) -> float:
    """Return the unrest of the voltage of the spindle [V], see :func:`voltage_unrest`."""
    return voltage_unrest(record, "spindle_dac.voltage")


def spindle_speed_error(record: Record) -> float:
    """Return the largest deviation of the spindle from its reference in contact [rad/s]."""
    reference = while_in_contact(record, "spindle_reference")
    return largest(reference - while_in_contact(record, *SPINDLE_SPEED))


def rapid_contact_time(record: Record) -> float:
    """Return how long the tool stood in the part in rapid blocks: more than 0 means a lagging axis cut a corner there [s]."""
    return float(np.count_nonzero(signal(record, "rapid_contact") > 0.5)) * record.sample_period


def tool_wear(record: Record) -> float:
    """Return the flank wear at the end [m]."""
    return float(signal(record, "flank_wear")[-1])


def _axis_metrics(axis: str) -> list[Metric]:
    load, error, drive = f"{axis}_disturbance", (f"contour.{axis}_error", f"{axis}_error"), f"{axis}_axis"

    def max_force(record: Record) -> float:
        return largest(signal(record, load))

    def rms_force(record: Record) -> float:
        return root_mean_square(while_in_contact(record, load))

    def max_following_error(record: Record) -> float:
        return largest(signal(record, *error))

    def max_voltage(record: Record) -> float:
        return largest(signal(record, f"{axis}_dac.voltage"))

    def unrest(record: Record) -> float:
        return voltage_unrest(record, f"{axis}_dac.voltage")

    def max_current(record: Record) -> float:
        return largest(signal(record, f"{drive}.current"))

    def rms_current(record: Record) -> float:
        return root_mean_square(signal(record, f"{drive}.current"))

    def max_speed(record: Record) -> float:
        return largest(signal(record, f"{drive}.velocity"))

    return [
        Metric(f"max_{axis}_force", "N", f"largest cutting force on the {axis} axis", max_force, of_cutting=True),
        Metric(
            f"rms_{axis}_force", "N", f"root mean square of the cutting force on the {axis} axis in contact", rms_force, of_cutting=True
        ),
        Metric(f"max_{axis}_following_error", "m", f"largest distance of the {axis} axis from its reference", max_following_error),
        Metric(f"max_{axis}_voltage", "V", f"largest command voltage of the {axis} axis", max_voltage),
        Metric(f"{axis}_voltage_unrest", "V", f"rms change of the {axis} voltage from sample to sample in contact", unrest),
        Metric(f"max_{axis}_current", "A", f"largest motor current of the {axis} axis", max_current),
        Metric(f"rms_{axis}_current", "A", f"root mean square of the motor current of the {axis} axis", rms_current),
        Metric(f"max_{axis}_speed", "m/s", f"largest speed of the {axis} axis", max_speed),
    ]


METRICS: tuple[Metric, ...] = (
    Metric("cycle_time", "s", "time until the reference reaches the end of the program", cycle_time),
    Metric("contact_time", "s", "time in which tool and part are in contact", contact_time),
    Metric("max_contour_error", "m", "largest contour error in contact", max_contour_error),
    Metric("rms_contour_error", "m", "root mean square of the contour error in contact", rms_contour_error),
    Metric("contour_error_squared_integral", "m^2*s", "integral of the squared contour error in contact", contour_error_squared_integral),
    Metric("max_surface_roughness", "m", "largest average roughness R_a of what is cut", max_surface_roughness, of_cutting=True),
    Metric("mean_surface_roughness", "m", "mean of the average roughness R_a over what is cut", mean_surface_roughness, of_cutting=True),
    Metric("max_cutting_force", "N", "largest cutting force", max_cutting_force, of_cutting=True),
    Metric("mean_cutting_force", "N", "mean cutting force in contact", mean_cutting_force, of_cutting=True),
    Metric("max_feed", "m", "largest actual feed per revolution while cutting", max_feed, of_cutting=True),
    Metric("max_feed_speed", "m/s", "largest commanded path speed in contact", max_feed_speed),
    Metric("max_depth_of_cut", "m", "largest actual depth of cut", max_depth_of_cut, of_cutting=True),
    Metric("removed_volume", "m^3", "volume cut off the part", removed_volume, of_cutting=True),
    Metric("max_spindle_torque", "N*m", "largest cutting torque on the spindle", max_spindle_torque, of_cutting=True),
    Metric("rms_spindle_torque", "N*m", "root mean square of the cutting torque in contact", rms_spindle_torque, of_cutting=True),
    Metric("max_cutting_power", "W", "largest cutting power at the spindle", max_cutting_power, of_cutting=True),
    Metric("rms_cutting_power", "W", "root mean square of the cutting power in contact", rms_cutting_power, of_cutting=True),
    Metric("cutting_energy", "J", "work of cutting", cutting_energy, of_cutting=True),
    Metric("spindle_speed_error", "rad/s", "largest deviation of the spindle from its reference in contact", spindle_speed_error),
    Metric(
        "mean_spindle_droop", "rad/s", "how much too slow the spindle turns, on average while cutting", mean_spindle_droop, of_cutting=True
    ),
    Metric("spindle_voltage_unrest", "V", "rms change of the spindle voltage from sample to sample in contact", spindle_voltage_unrest),
    Metric("min_cutting_speed", "m/s", "lowest cutting speed while cutting", min_cutting_speed, of_cutting=True),
    Metric("mean_cutting_speed", "m/s", "mean cutting speed while cutting", mean_cutting_speed, of_cutting=True),
    Metric("max_cutting_speed", "m/s", "highest cutting speed while cutting", max_cutting_speed, of_cutting=True),
    Metric("rapid_contact_time", "s", "time in which the tool stood in the part in rapid blocks", rapid_contact_time),
    Metric("tool_wear", "m", "flank wear at the end", tool_wear, of_cutting=True),
    *_axis_metrics("x"),
    *_axis_metrics("z"),
)


_LEAST_WAY = 1e-7
"""Way [m] that a reference must go back before that counts as turning round; assumed: less is rounding."""


def reversals(reference: FloatArray) -> int:
    """Return how often a reference [m] (samples,) turns round."""
    turns, direction, furthest = 0, 0.0, float(reference[0])
    for place in reference.tolist():
        way = place - furthest
        if direction * way > 0.0:
            furthest = place
        elif abs(way) >= _LEAST_WAY:
            # the axis is set moving the first time, which is no reversal
            turns += direction != 0.0
            direction, furthest = (1.0 if way > 0.0 else -1.0), place
    return turns


def _of_axis(axis: str) -> Metric:
    def counted(record: Record) -> float:
        return float(reversals(signal(record, f"{axis}_reference")))

    return Metric(f"{axis}_reversals", "1", f"how often the reference of the {axis} axis turns round", counted)


MOTION_METRICS: tuple[Metric, ...] = (_of_axis("x"), _of_axis("z"))


_LAST = 0.25
"""Share of a run that counts as settled."""


def _settled(values: FloatArray) -> FloatArray:
    return values[len(values) - max(1, int(_LAST * len(values))) :]


def chatter_swing(record: Record) -> float:
    """Return the vibration of the tool at the end of the run, peak to peak [m]."""
    return float(np.ptp(_settled(signal(record, "vibration", ".displacement"))))


def settled_removal_rate(record: Record) -> float:
    """Return the volume cut per time at the end of the run [m^3/s]."""
    return float(np.mean(_settled(signal(record, "removal_rate"))))


CHATTER_METRICS: tuple[Metric, ...] = (
    Metric("chatter_swing", "m", "vibration of the tool in the last quarter of the run, peak to peak", chatter_swing),
    Metric("wave_roughness", "m", "average roughness R_a of the waves around the part, in the last turn", wave_roughness),
    Metric("settled_removal_rate", "m^3/s", "volume cut per time in the last quarter of the run", settled_removal_rate, of_cutting=True),
)


COST_SCALE = 50000.0
"""Dollars that count as much as ``TIME_SCALE`` seconds."""
TIME_SCALE = 5.0


def weighed(cost: float, time: float) -> float:
    """Return the performance index of a lathe of this cost [dollar] and cycle time [s]:  PI = C/50000 + T/5.

    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), equation (39). The smaller the better.
    """
    return cost / COST_SCALE + time / TIME_SCALE


def machine_cost(record: Record) -> float:
    """Return what the lathe costs [dollar]."""
    return float(signal(record, "machine_cost")[-1])


def performance_index(record: Record) -> float:
    """Return the index of a design project, from cost and cycle time [1]."""
    return weighed(machine_cost(record), cycle_time(record))


def part_cost(record: Record) -> float:
    """Return what the part cost, tool changes and edges included [dollar]."""
    return float(signal(record, "part_cost")[-1])


def time_per_part(record: Record) -> float:
    """Return the time for the part with its share of tool changes [s]."""
    return float(signal(record, "time_per_part")[-1])


def parts_per_edge(record: Record) -> float:
    """Return how many such parts an edge lasts [1]."""
    used = float(signal(record, "used_life")[-1])
    return 1.0 / used if used > 0.0 else float("inf")


COST_METRICS: tuple[Metric, ...] = (
    Metric("machine_cost", "dollar", "what the lathe costs", machine_cost),
    Metric(
        "performance_index", "1", "cost/50000 + cycle time/5 s: the index of a design project, the smaller the better", performance_index
    ),
    Metric("part_cost", "dollar", "what the part cost, with its share of tool changes and edges", part_cost, of_cutting=True),
    Metric("time_per_part", "s", "time for the part with its share of tool changes", time_per_part, of_cutting=True),
    Metric("parts_per_edge", "1", "how many such parts an edge lasts", parts_per_edge, of_cutting=True),
)
