"""``lathesim retime JOINTS.csv``: the quickest timing of a path within the limits of the axes, sampled for the servos."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lathesim.cli.options import OutputPath, grouped, json_option, option
from lathesim.cli.writing import CommandResult, Heading, table, write

if TYPE_CHECKING:
    from lathesim.motion.axis_limits import AxisLimits
    from lathesim.motion.kinematics import Chain
    from lathesim.motion.time_law import Timing


_AXES = (
    Heading("axis", -10), Heading("largest speed", 18), Heading("of its limit", 14), Heading("acceleration", 18),
    Heading("of its limit", 14),
)  # fmt: skip


@dataclass(frozen=True)
class RetimeOptions:
    """How a path is timed: the file of limits, whether the samples are poses, and the steps along it.

    ``keep_free`` is the share of the accelerations that the timing does not use, ``retraction`` the turn [deg] at which the axes stop.
    """

    limits: Path
    poses: bool
    jerk: bool
    grid: int = option("Steps along the path at least.", type=click.IntRange(8, 10_000_000), default=1000)
    retraction: float = option("Turn [deg] where axes stop.", type=click.FloatRange(1.0, 180.0), default=150.0)
    keep_free: float = option(
        "Of the accelerations, as 'machine --elastic' needs.",
        type=click.FloatRange(0.0, 0.9),
        default=0.0,
        metavar="SHARE",
        show_default=False,
    )


@click.command()
@click.argument("joints", type=click.Path(path_type=Path), metavar="JOINTS.csv")
@click.option("--limits", type=click.Path(path_type=Path), required=True, metavar="LIMITS.yaml", help="Limits of each axis, and the feed.")
@click.option("--poses", is_flag=True, help="The columns are poses x, y, z, i, j, k of the tool; LIMITS.yaml names the kinematics.")
@click.option("--jerk", is_flag=True, help="Keep the limits of jerk as well: the acceleration is 0 at both ends.")
@click.option("--tolerance", metavar="10um", help="Go slower where the simulated contour error of --lesson exceeds this.")
@click.option("--lesson", metavar="LESSON", help="The machine whose contour error is simulated.")
@click.option("--period", default="1 ms", show_default=True, metavar="TIME", help="Period of the servos.")
@grouped(way=RetimeOptions)
@click.option("--out", type=OutputPath(), metavar="S.h5", help="Where the set-points go [default: JOINTS_set_points.h5].")
@json_option("lathesim-retime/1")
def retime(
    joints: Path, way: RetimeOptions, as_json: bool, out: Path | None, period: str, tolerance: str | None, lesson: str | None
) -> int:
    """Time the path of JOINTS.csv as quickly as the limits of the axes allow, and write a set-point for each servo period.

    JOINTS.csv has the header 'x [mm],y [mm],a [deg]' and one row a sample, without times. LIMITS.yaml has
    'axes: {x: {velocity: 40 mm/s, acceleration: 200 mm/s^2, jerk: 4 m/s^3}}', and may have 'feed: 30 mm/s' at the tool and
    'kinematics: trunnion'. The axes begin and end at rest and stand at every retraction.
    """
    from lathesim.errors import LatheSimError
    from lathesim.motion.joint_path import read_joint_path
    from lathesim.motion.retime import elastic_rate
    from lathesim.motion.time_law import save_set_points
    from lathesim.units import quantity

    seconds = quantity(period, "s")
    if not 0.0 < seconds <= 1.0:
        raise LatheSimError(f"the period is {period}.", remedy="Give a period above 0 s and up to 1 s.")
    if (tolerance is None) != (lesson is None):
        raise click.UsageError("--tolerance and --lesson belong together: the error is that of the lesson's machine.")
    timing, limits, chain, note = timed(read_joint_path(joints), way)
    cost = None
    if tolerance is not None and lesson is not None:
        from lathesim.live.tolerance import within_tolerance

        timing, cost = within_tolerance(
            timing, limits.scaled(1.0 - way.keep_free), lesson, quantity(tolerance, "m"), seconds, way.jerk, chain
        )
    place = out or joints.with_name(f"{joints.stem}_set_points.h5")
    count = save_set_points(timing, seconds, place, {"path": joints.name})
    result = _result(timing, limits, chain, place, count)
    if way.keep_free > 0.0:
        result["elastic_rho"] = elastic_rate(timing, limits, way.keep_free, seconds)
    if cost is not None:
        result["tolerance"] = cost
    if note and not as_json:
        click.echo(note, err=True)
    return write(CommandResult("lathesim-retime/1", result, _lines(result)), as_json)


def timed(given: Any, way: RetimeOptions) -> tuple[Timing, AxisLimits, Chain | None, str]:
    """Return the timing of a path with the limits and the kinematics of a file, and what to say about singularities."""
    from lathesim.lessons.yaml_source import read_source
    from lathesim.motion.axis_limits import limits_from
    from lathesim.motion.joint_path import MotionError
    from lathesim.motion.kinematics import chain_from, joints_of, tool_speed_of
    from lathesim.motion.retime import retime as retimed

    data = read_source(way.limits, what="file of limits").data
    chain = chain_from(data["kinematics"], f"{way.limits}: kinematics") if "kinematics" in data else None
    note = ""
    path = given
    if way.poses:
        if chain is None:
            raise MotionError("the file of limits names no kinematics.", place=str(way.limits), remedy="Add 'kinematics: trunnion'.")
        path, note = joints_of(given, chain)
    allowed = limits_from(data, path.names, path.units, str(way.limits))
    if way.jerk and not all(map(math.isfinite, allowed.jerk)):
        raise MotionError("not every axis has a limit of jerk.", place=str(way.limits), remedy="Add jerk: 4 m/s^3 to each axis.")
    tool = tool_speed_of(path, chain) if chain is not None or math.isfinite(allowed.feed) else None
    timing = retimed(
        path, allowed.scaled(1.0 - way.keep_free), jerk=way.jerk, grid=way.grid, tool_speed=tool, retraction=math.radians(way.retraction)
    )
    return timing, allowed, chain, note


def _result(timing: Timing, limits: AxisLimits, chain: Chain | None, place: Path, count: int) -> dict[str, Any]:
    import numpy as np

    from lathesim.motion.kinematics import path_error

    steps = np.diff(timing.law.time)
    time = np.concatenate([timing.law.time[:-1] + share * steps for share in (1e-9, 0.5, 1 - 1e-9)]) if len(steps) else np.zeros(1)
    _, v, a, j = (np.max(np.abs(column), axis=0) for column in timing.at(time))
    axes = {}
    for at, (name, unit) in enumerate(zip(timing.path.names, timing.path.units, strict=True)):
        axes[name] = {
            "unit": unit,
            "velocity": float(v[at]),
            "acceleration": float(a[at]),
            "jerk": float(j[at]),
            "velocity_share": float(v[at] / limits.velocity[at]),
            "acceleration_share": float(a[at] / limits.acceleration[at]),
            "jerk_share": float(j[at] / limits.jerk[at]),
        }
    error = path_error(chain, timing.curve) if chain is not None and len(timing.curve.knots) > 1 else None
    return {
        "duration_s": timing.duration,
        "set_points": count,
        "samples": len(timing.path.positions),
        "retractions": max(0, len(timing.curve.stops) - 2),
        "axes": axes,
        "path_error_m": None if error is None else float(error.max()),
        "out": str(place),
    }


def _lines(result: dict[str, Any]) -> Iterator[str]:
    from lathesim.units import in_unit

    stops = result["retractions"]
    told = f", with {stops} stop{'s' if stops != 1 else ''} at retractions" if stops else ""
    yield f"{result['samples']} samples take {result['duration_s']:.6g} s{told}.\n"
    rows = []
    for name, axis in result["axes"].items():
        speed, force = f"{axis['velocity']:.4g} {axis['unit']}/s", f"{axis['acceleration']:.4g} {axis['unit']}/s^2"
        shares = [in_unit(axis[f"{what}_share"], "%", ".1f") for what in ("velocity", "acceleration")]
        rows.append((name, speed, shares[0], force, shares[1]))
    yield from table(_AXES, rows)
    if result["path_error_m"] is not None:
        yield f"\nBetween samples the tip leaves the straight line by {in_unit(result['path_error_m'], 'um', '.3g')} at most."
    if "elastic_rho" in result:
        yield f"\nWith 'machine --elastic' up to {result['elastic_rho']:.3g} the axes keep their limits while the playback slows down."
    if "tolerance" in result:
        row = result["tolerance"]
        yield (
            f"\nThe contour error is {in_unit(row['before_m'], 'um')} at full speed and {in_unit(row['after_m'], 'um')} now; "
            f"{row['slower_share']:.0%} of the path is slower, and {row['duration_before_s']:.4g} s became {result['duration_s']:.4g} s."
        )
        if row["after_m"] > row["tolerance_m"]:
            yield "That is above the tolerance: what is left does not come from the speed alone."
    yield f"\n{result['set_points']} set-points are in {result['out']}. Draw them with: lathesim plot {result['out']}"
