"""The plots of Results: paths, surfaces and waves of runs, the title of a figure, and runs laid over each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lathesim.analysis.metric import find_channel
from lathesim.errors import LatheSimError, RecordError
from lathesim.record import FloatArray, Record
from lathesim.tui.drawing.curves import PlotLine
from lathesim.units import in_unit


def figure_title(runs: Sequence[tuple[str, Record]]) -> str:
    """Return lesson and case of one run, or of several runs with their numbers: ``Servo control: 002 case II, 001 case I``."""
    from lathesim.lessons.grading import lesson_title

    lessons = {title: lesson_title(record) or title for title, record in runs}
    cases = {title: _case(record) for title, record in runs}
    if len(runs) == 1:
        return ", ".join(word for title in lessons for word in (lessons[title], cases[title]) if word)
    if len(set(lessons.values())) == 1:
        return f"{next(iter(lessons.values()))}: " + ", ".join(f"{title} {cases[title]}".rstrip() for title in lessons)
    return "; ".join(f"{title} {lessons[title]}, {cases[title]}".removesuffix(", ") for title in lessons)


def _case(record: Record) -> str:
    """Return the variant of a run and what was set beside it."""
    variant, changes = str(record.meta.get("variant", "")), str(record.meta.get("overrides", ""))
    return " ".join(word for word in (f"case {variant}" if variant else "", f"({changes})" if changes else "") if word)


def path_lines(runs: list[tuple[str, Record]]) -> list[PlotLine]:
    """Return the reference path and the path of the tool tip of each run: Z and X as a radius [mm]."""
    from lathesim.tui.drawing.lathe_picture import ToolMotion

    lines: list[PlotLine] = []
    for title, record in runs:
        motion = ToolMotion.of(record)
        if motion is None:
            continue
        if not lines:
            lines.append(PlotLine(motion.z_reference * 1e3, motion.x_reference * 1e3, "reference"))
        lines.append(PlotLine(motion.z * 1e3, motion.x * 1e3, title))
    return lines


def wave_lines(runs: list[tuple[str, Record]]) -> list[PlotLine]:
    """Return the waves that the last turn of each run left around the part: angle [deg] and height [um]."""
    from lathesim.analysis.turned_part import waves_on_part

    lines = []
    for title, record in runs:
        try:
            waves = waves_on_part(record, turns=1)
        except LatheSimError:
            continue
        lines.append(PlotLine(np.degrees(waves.angle), 1e6 * waves.height[-1], f"{title}, R_a {in_unit(waves.roughness, 'um', '.3g')}"))
    return lines


def surface_lines(runs: list[tuple[str, Record]]) -> list[PlotLine]:
    """Return the roughness along the part of each run: Z [mm] and R_a [um]."""
    from lathesim.analysis.turned_part import roughness_along

    lines = []
    for title, record in runs:
        try:
            surface = roughness_along(record)
        except LatheSimError:
            continue
        if len(surface.z):
            lines.append(PlotLine(np.asarray(surface.z) * 1e3, np.asarray(surface.roughness) * 1e6, title))
    return lines


def overlaid(runs: Sequence[tuple[str, Record]], channels: Sequence[str]) -> Record:
    """Return one record with the channels of all runs, ``(title, record)``; a single run keeps its names.

    With several, a channel is called ``channel (title)`` and the values of the later runs are interpolated to the instants of the longest.
    Raises :class:`RecordError` where no run has any of the channels.
    """
    if not runs or not any(name in record for _, record in runs for name in channels):
        raise RecordError("there is nothing to draw.", remedy="Choose a run and a channel it has.")
    if len(runs) == 1:
        _, record = runs[0]
        return Record(record.time, {name: record.channel(name) for name in channels if name in record}, dict(record.meta))
    longest = max((record for _, record in runs), key=lambda record: record.time[-1] if len(record) else 0.0)
    found = Record(longest.time, {}, dict(longest.meta))
    for title, record in runs:
        for name in channels:
            if name in record:
                values = np.interp(longest.time, record.time, record[name], right=np.nan)
                found = found.with_channel(f"{name} ({title})", record.unit(name), values, record.channel(name).description)
    return found


def contact(record: Record) -> FloatArray | None:
    """Return where tool and part touch in a block run at feed (1 or 0, (samples,)); None where the record does not tell."""
    name = find_channel(record, "engaged", "in_contact")
    return record[name] if name is not None else None


def value_at(record: Record, channel: str, time: float) -> float:
    """Return the value of a channel at the sample nearest to ``time`` [s]; NaN beyond the record."""
    if channel not in record or not len(record) or not record.time[0] <= time <= record.time[-1] + record.sample_period:
        return float("nan")
    place = int(np.searchsorted(record.time, time))
    place = min(place, len(record) - 1)
    if place > 0 and time - record.time[place - 1] < record.time[place] - time:
        place -= 1
    return float(record[channel][place])
