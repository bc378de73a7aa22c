"""The remedies in the units of common controls: play, pitch points, friction pulse, feedforward, to be typed in."""

from __future__ import annotations

import math
from pathlib import Path

from lathesim.compensation.remedying.bench import Line
from lathesim.compensation.remedying.remedy import Answer
from lathesim.whole_file import write_text

TABLE_FILE = "control_table.txt"
_MOST_ROWS = 400


def write_control_table(answer: Answer, folder: Path) -> Path:
    """Write what is to be typed into a control; return the file."""
    lines = ["Compensation of axes, in mm, um, mm/min, V and ms. Signs: positive towards the positive direction of the axis.", ""]
    if answer.nothing:
        lines.append(answer.nothing)
    for line in answer.lines:
        axis = next((item.loop.axis for item in answer.axes if item.loop.controller == line.at), line.at)
        lines += [f"{axis}: against {', '.join(line.answers)}", *_of(line, answer), ""]
    lines += [f"{item.effect} at {item.at}: {item.why}." for item in answer.not_mended]
    file = folder / TABLE_FILE
    write_text(file, "\n".join(lines) + "\n")
    return file


def _of(line: Line, answer: Answer) -> list[str]:
    value = {name: number * line.share if name in line.one_sided else number for name, number in line.values.items()}
    if line.remedy == "BacklashShift":
        return [f"  play                    {1e6 * value['width']:10.3f} um", f"  taken up within         {1e3 * value['spread']:10.3f} ms"]
    if line.remedy == "FrictionFeedforward":
        rows = [
            f"  friction pulse          {1e3 * value.get('level', 0.0):10.3f} mV",
            f"  lead                    {1e3 * value.get('lead', 0.0):10.3f} ms",
        ]
        return rows + _over_acceleration(line, value, answer)
    if line.remedy in ("PitchTable", "AcrossTable"):
        columns, points = next(iter(line.tables.values()))
        step = max(1, len(points) // _MOST_ROWS)
        head = "  " + "".join(f"{name + (' [mm]' if place == 0 else ' [um]'):>16}" for place, name in enumerate(columns))
        return [head, *["  " + f"{1e3 * row[0]:16.4f}" + "".join(f"{-1e6 * error:16.4f}" for error in row[1:]) for row in points[::step]]]
    return [f"  {name:<24}{number:.8g} {answer.bench.units(line.name)[name] if answer.bench else ''}" for name, number in value.items()]


def _over_acceleration(line: Line, value: dict[str, float], answer: Answer) -> list[str]:
    """Return the size of the friction pulse over the acceleration at reversal, as quadrant compensation asks for it."""
    rows = ["  acceleration at reversal [mm/s^2]      pulse [mV]"]
    lag = value.get("inner", 0.0)
    for acceleration in (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0):
        speed = 1e-3 * acceleration * max(lag, 1e-4)
        size = value.get("level", 0.0)
        if value.get("excess"):
            size += value["excess"] * math.exp(-((speed / value["stribeck_velocity"]) ** value.get("shape", 1.0)))
        rows.append(f"  {acceleration:30.0f}{1e3 * size:18.3f}")
    return rows
