"""The lathe view at three moments of Example 1 (case I) of Liu and Landers (2004), as text."""

from __future__ import annotations

from pathlib import Path

from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare, run_prepared
from lathesim.plugins import load_registry
from lathesim.tui.drawing.lathe_picture import ToolMotion, View, draw, scene_of_case

GOLDENS = Path(__file__).parent / "goldens"
MOMENTS = {"first_cut": (8.0, View()), "taper": (13.0, View(gain=10.0)), "return": (18.0, View(zoom=0.02))}
"""Name -> simulated time [s], and how it is looked at."""
SIZE = (80, 20)


def pictures() -> dict[str, str]:
    """Return the picture of each moment."""
    case = prepare(load_lesson("01_contour_error"), load_registry(), "I")
    record = run_prepared(case)
    motion = ToolMotion.of(record)
    found = {}
    for name, (time, view) in MOMENTS.items():
        until = int(record.time.searchsorted(time))
        found[name] = draw(scene_of_case(case), motion, until, *SIZE, view).as_text() + "\n"
    return found
