"""The other plots of Results: paths, surfaces and waves of runs, and the title of a figure."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lathesim.errors import LatheSimError
from lathesim.record import Record
from lathesim.tui.drawing.curves import Line


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


def path_lines(runs: list[tuple[str, Record]]) -> list[Line]:
    """Return the reference path and the path of the tool tip of each run: Z and X as a radius [mm]."""
    from lathesim.tui.drawing.lathe_scene import Motion

    lines: list[Line] = []
    for title, record in runs:
        motion = Motion.of(record)
        if motion is None:
            continue
        if not lines:
            lines.append(Line(motion.z_reference * 1e3, motion.x_reference * 1e3, "reference"))
        lines.append(Line(motion.z * 1e3, motion.x * 1e3, title))
    return lines


def wave_lines(runs: list[tuple[str, Record]]) -> list[Line]:
    """Return the waves that the last turn of each run left around the part: angle [deg] and height [um]."""
    from lathesim.analysis.part.waves import waves_on_part

    lines = []
    for title, record in runs:
        try:
            waves = waves_on_part(record, turns=1)
        except LatheSimError:
            continue
        lines.append(Line(np.degrees(waves.angle), 1e6 * waves.height[-1], f"{title}, R_a {1e6 * waves.roughness:.3g} um"))
    return lines


def surface_lines(runs: list[tuple[str, Record]]) -> list[Line]:
    """Return the roughness along the part of each run: Z [mm] and R_a [um]."""
    from lathesim.analysis.part.surface import roughness_along

    lines = []
    for title, record in runs:
        try:
            surface = roughness_along(record)
        except LatheSimError:
            continue
        if len(surface.z):
            lines.append(Line(np.asarray(surface.z) * 1e3, np.asarray(surface.roughness) * 1e6, title))
    return lines
