"""The stock metrics: one small function each, Record -> number in SI.

"In contact" are the samples with ``in_contact`` over 0.5: the tool tip is inside the bounds of the raw stock in a block run at feed.
Integrals are sums over the samples times the sample period, as in J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), Table 1.

Metrics of cost: of a lathe in a design project, and of a part.

They read the channels of the parts LatheDesign and TurningEconomy, where a machine has them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import SupportsFloat

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
from lathesim.component import ON
from lathesim.errors import RecordError
from lathesim.record import FloatArray, Record


def in_contact(record: Record) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Return for each sample whether tool and part are in contact."""
    touching: np.ndarray[tuple[int], np.dtype[np.bool_]] = signal(record, *CONTACT) > ON
    return touching


NEVER_IN_CONTACT = "tool and part are never in contact"


def _any_of(values: FloatArray, without: str) -> FloatArray:
    """Return some samples of a channel; :class:`NoValueError` with the sentence where there are none."""
    if not len(values):
        raise NoValueError(without)
    return values


def while_in_contact(record: Record, *wanted: str) -> FloatArray:
    """Return a channel's samples in contact."""
    return _any_of(signal(record, *wanted)[in_contact(record)], NEVER_IN_CONTACT)


def changes_in_contact(record: Record, channel: str) -> FloatArray:
    """Return the changes of a channel from sample to sample in contact."""
    return _any_of(np.diff(signal(record, channel))[in_contact(record)[1:]], NEVER_IN_CONTACT)


def while_engaged(record: Record, *wanted: str) -> FloatArray:
    """Return a channel's samples in which material is cut."""
    return _any_of(signal(record, *wanted)[signal(record, "engaged") > ON], NOTHING_CUT)


def largest(values: FloatArray) -> float:
    """Return the largest magnitude."""
    return float(np.max(np.abs(values)))


def rms(values: FloatArray) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(values * values)))


def cycle_time(record: Record) -> float:
    """Return the time from the start until the reference reaches the end of the program, else the length of the record [s]."""
    if not len(record):
        raise RecordError("not available: the record is empty")
    name = find_channel(record, "finished")
    if name is not None:
        done = np.flatnonzero(record[name] > ON)
        if len(done):
            return round(float(record.time[done[0]] - record.time[0]), 9)
    return round(float(record.time[-1] - record.time[0]), 9)


def contour_error_squared_integral(record: Record) -> float:
    """Return sum(e_c^2) T over the samples in contact [m^2 s]."""
    error = while_in_contact(record, *CONTOUR_ERROR)
    return float(np.sum(error * error)) * record.sample_period


def mean_surface_roughness(record: Record) -> float:
    """Return the mean of R_a over the time in which a surface is cut [m]."""
    roughness = signal(record, "roughness")
    cut = roughness[roughness > 0.0]
    return float(np.mean(cut)) if len(cut) else 0.0


def mean_spindle_droop(record: Record) -> float:
    """Return by how much the spindle turns slower than it should, on average while cutting [rad/s]."""
    return float(np.mean(np.abs(while_engaged(record, "spindle_reference")) - np.abs(while_engaged(record, *SPINDLE_SPEED))))


def spindle_speed_error(record: Record) -> float:
    """Return the largest deviation of the spindle from its reference in contact [rad/s]."""
    return largest(while_in_contact(record, "spindle_reference") - while_in_contact(record, *SPINDLE_SPEED))


def _lasting(values: FloatArray) -> float:
    return float(np.count_nonzero(values > ON))


def _last(values: FloatArray) -> float:
    return float(values[-1])


Read = Callable[..., FloatArray]
Reduce = Callable[..., SupportsFloat]
"""From a channel (samples,) to a number."""


def _of(name: str, unit: str, doc: str, reduce: Reduce, read: Read, *wanted: str, cutting: bool = False) -> Metric:
    """Return the metric that reduces a channel, read as a whole or in part, to a number."""
    return Metric(name, unit, doc, lambda record: float(reduce(read(record, *wanted))), of_cutting=cutting)


def _over_time(name: str, unit: str, doc: str, reduce: Reduce, *wanted: str, cutting: bool = False) -> Metric:
    """Return the metric that adds up a channel over time [s]."""
    return Metric(name, unit, doc, lambda record: float(reduce(signal(record, *wanted))) * record.sample_period, of_cutting=cutting)


def _axis_metrics(axis: str) -> list[Metric]:
    load, error, drive, dac = f"{axis}_disturbance", (f"contour.{axis}_error", f"{axis}_error"), f"{axis}_axis", f"{axis}_dac.voltage"
    force, in_contact = f"cutting force on the {axis} axis", while_in_contact
    current, unrest = f"motor current of the {axis} axis", f"rms change of the {axis} voltage from sample to sample in contact"
    following = f"largest distance of the {axis} axis from its reference"
    return [
        _of(f"max_{axis}_force", "N", f"largest {force}", largest, signal, load, cutting=True),
        _of(f"rms_{axis}_force", "N", f"root mean square of the {force} in contact", rms, in_contact, load, cutting=True),
        _of(f"max_{axis}_following_error", "m", following, largest, signal, *error),
        _of(f"max_{axis}_voltage", "V", f"largest command voltage of the {axis} axis", largest, signal, dac),
        _of(f"{axis}_voltage_unrest", "V", unrest, rms, changes_in_contact, dac),
        _of(f"max_{axis}_current", "A", f"largest {current}", largest, signal, f"{drive}.current"),
        _of(f"rms_{axis}_current", "A", f"root mean square of the {current}", rms, signal, f"{drive}.current"),
        _of(f"max_{axis}_speed", "m/s", f"largest speed of the {axis} axis", largest, signal, f"{drive}.velocity"),
    ]


METRICS: tuple[Metric, ...] = (
    Metric("cycle_time", "s", "time until the reference reaches the end of the program", cycle_time),
    _over_time("contact_time", "s", "time in which tool and part are in contact", _lasting, *CONTACT),
    _of("max_contour_error", "m", "largest contour error in contact", largest, while_in_contact, *CONTOUR_ERROR),
    _of("rms_contour_error", "m", "root mean square of the contour error in contact", rms, while_in_contact, *CONTOUR_ERROR),
    Metric("contour_error_squared_integral", "m^2*s", "integral of the squared contour error in contact", contour_error_squared_integral),
    _of("max_surface_roughness", "m", "largest average roughness R_a of what is cut", np.max, signal, "roughness", cutting=True),
    Metric("mean_surface_roughness", "m", "mean of the average roughness R_a over what is cut", mean_surface_roughness, of_cutting=True),
    _of("max_cutting_force", "N", "largest cutting force", largest, signal, *CUTTING_FORCE, cutting=True),
    _of("mean_cutting_force", "N", "mean cutting force in contact", np.mean, while_in_contact, *CUTTING_FORCE, cutting=True),
    _of("max_feed", "m", "largest actual feed per revolution while cutting", np.max, signal, "feed_per_revolution", cutting=True),
    _of("max_feed_speed", "m/s", "largest commanded path speed in contact", largest, while_in_contact, "feed_speed"),
    _of("max_depth_of_cut", "m", "largest actual depth of cut", np.max, signal, "depth_of_cut", cutting=True),
    _of("removed_volume", "m^3", "volume cut off the part", _last, signal, "removed_volume", cutting=True),
    _of("max_spindle_torque", "N*m", "largest cutting torque on the spindle", largest, signal, "cutting_torque", cutting=True),
    _of(
        "rms_spindle_torque",
        "N*m",
        "root mean square of the cutting torque in contact",
        rms,
        while_in_contact,
        "cutting_torque",
        cutting=True,
    ),
    _of("max_cutting_power", "W", "largest cutting power at the spindle", largest, signal, "cutting_power", cutting=True),
    _of("rms_cutting_power", "W", "root mean square of the cutting power in contact", rms, while_in_contact, "cutting_power", cutting=True),
    _over_time("cutting_energy", "J", "work of cutting", np.sum, "cutting_power", cutting=True),
    Metric("spindle_speed_error", "rad/s", "largest deviation of the spindle from its reference in contact", spindle_speed_error),
    Metric(
        "mean_spindle_droop", "rad/s", "how much too slow the spindle turns, on average while cutting", mean_spindle_droop, of_cutting=True
    ),
    _of(
        "spindle_voltage_unrest",
        "V",
        "rms change of the spindle voltage from sample to sample in contact",
        rms,
        changes_in_contact,
        "spindle_dac.voltage",
    ),
    _of("min_cutting_speed", "m/s", "lowest cutting speed while cutting", np.min, while_engaged, "cutting_speed", cutting=True),
    _of("mean_cutting_speed", "m/s", "mean cutting speed while cutting", np.mean, while_engaged, "cutting_speed", cutting=True),
    _of("max_cutting_speed", "m/s", "highest cutting speed while cutting", np.max, while_engaged, "cutting_speed", cutting=True),
    _over_time("rapid_contact_time", "s", "time in which the tool stood in the part in rapid blocks", _lasting, "rapid_contact"),
    _of("tool_wear", "m", "flank wear at the end", _last, signal, "flank_wear", cutting=True),
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


def alarm_time(record: Record) -> float:
    """Return when a guard first alarms [s]; :class:`NoValueError` where it never does."""
    alarmed = np.flatnonzero(signal(record, ".alarm") > ON)
    if not len(alarmed):
        raise NoValueError("the guard never alarms")
    return float(record.time[alarmed[0]])


MOTION_METRICS: tuple[Metric, ...] = (
    *(
        _of(f"{axis}_reversals", "1", f"how often the reference of the {axis} axis turns round", reversals, signal, f"{axis}_reference")
        for axis in "xz"
    ),
    Metric("alarm_time", "s", "when the guard of a sensor first alarms", alarm_time),
)


_LAST = 0.25
"""Share of a run that counts as settled."""


def _settled(record: Record, *wanted: str) -> FloatArray:
    values = signal(record, *wanted)
    return values[len(values) - max(1, int(_LAST * len(values))) :]


CHATTER_METRICS: tuple[Metric, ...] = (
    _of(
        "chatter_swing",
        "m",
        "vibration of the tool in the last quarter of the run, peak to peak",
        np.ptp,
        _settled,
        "vibration",
        ".displacement",
    ),
    Metric("wave_roughness", "m", "average roughness R_a of the waves around the part, in the last turn", wave_roughness),
    _of(
        "settled_removal_rate",
        "m^3/s",
        "volume cut per time in the last quarter of the run",
        np.mean,
        _settled,
        "removal_rate",
        cutting=True,
    ),
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


def parts_per_edge(record: Record) -> float:
    """Return how many such parts an edge lasts [1]."""
    used = float(signal(record, "used_life")[-1])
    return 1.0 / used if used > 0.0 else float("inf")


COST_METRICS: tuple[Metric, ...] = (
    Metric("machine_cost", "dollar", "what the lathe costs", machine_cost),
    Metric(
        "performance_index", "1", "cost/50000 + cycle time/5 s: the index of a design project, the smaller the better", performance_index
    ),
    _of("part_cost", "dollar", "what the part cost, with its share of tool changes and edges", _last, signal, "part_cost", cutting=True),
    _of("time_per_part", "s", "time for the part with its share of tool changes", _last, signal, "time_per_part", cutting=True),
    Metric("parts_per_edge", "1", "how many such parts an edge lasts", parts_per_edge, of_cutting=True),
)
