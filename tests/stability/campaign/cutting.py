"""From the hammer to the cut: limits predicted from a tap, and from coupling, against those found by cutting in the engine.

A machine is a holder in an elastic joint on a wall, and a tool in it. An artefact is measured at the tip of the holder, all four terms with
an error each; the spindle's share is found by inverse coupling. A tool of another overhang is coupled to it, modes are fitted to the tip
and limits predicted. The same tool is tapped as well. What cuts is the tool point of the machine itself.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from lathesim.stability.assembly_file import Base, Joint, ToolAssembly, base_share
from lathesim.stability.beams import Material, cylinder
from lathesim.stability.choose_modes import find_modes
from lathesim.stability.frequency_limit import limit_at, smallest_limit
from lathesim.stability.lesson_settings import tap_until_good
from lathesim.stability.lobes import rig, time_limit
from lathesim.stability.tap import TapSettings
from lathesim.stability.tool_point import FrequencyResponse, ToolPoint
from tests.stability.campaign.results import collected

FREQUENCY = np.linspace(100.0, 4000.0, 3901)
_STIFFNESS = 1.5e9
_MODES = 3
_MEASURED_WITHIN = 2e-4
"""Relative error of each term of the artefact."""
_SPEEDS = 3


def tool_point(tip: Any) -> ToolPoint:
    """Return the modes of a tip, by the fit of the program, all along the normal."""
    found = find_modes(FrequencyResponse(FREQUENCY, tip), _MODES)
    modes = [item.mode for item in found.modes if item.stiffness.value > 0.0]
    return ToolPoint(tuple(modes), (1.0,) * len(modes))


def measured(group: str, number: int) -> dict[str, Any]:
    """Return predicted limits over those found by cutting, at some speeds: from the ``tap``, and from ``coupling``."""
    chance = np.random.default_rng((33, number))
    steel = Material(200e9, 7800.0, 0.02, 0.3)
    holder = cylinder(chance.uniform(0.036, 0.05), chance.uniform(0.07, 0.12), steel)
    diameter, overhang = chance.uniform(0.016, 0.022), chance.uniform(0.05, 0.09)
    joint = Joint(chance.uniform(0.8e8, 3e8), chance.uniform(2e5, 8e5), 0.06)
    wall = Base()
    tool = cylinder(diameter, overhang, steel)
    # what cuts: the machine as it is
    real = ToolAssembly("machine", (tool, holder), (None, joint), "timoshenko", wall)
    truth = tool_point(real.tip(FREQUENCY)[:, 0, 0])
    if group == "tap":
        settings = TapSettings(rate=25600.0, length=0.5, contact=1.5e-4, double_hits=0.2)
        response = tap_until_good(truth, settings, 60_000 + number).response
        fitted = find_modes(response)
        predicted = ToolPoint(tuple(item.mode for item in fitted.modes), (1.0,) * len(fitted.modes))
    else:
        artefact = cylinder(diameter, chance.uniform(0.02, 0.04), steel)
        tip = ToolAssembly("artefact", (artefact, holder), (None, joint), "timoshenko", wall).tip(FREQUENCY)
        errors = _MEASURED_WITHIN * (chance.standard_normal(tip.shape) + 1j * chance.standard_normal(tip.shape))
        base = base_share(ToolAssembly("artefact", (artefact,), (None,), "timoshenko"), FREQUENCY, tip * (1.0 + errors))
        coupled = ToolAssembly("coupled", (tool,), (None,), "timoshenko", Base(FREQUENCY, base, "measured"))
        predicted = tool_point(coupled.tip(FREQUENCY)[:, 0, 0])
    lowest = smallest_limit(truth, _STIFFNESS)
    rows = []
    for speed in (60.0 * lowest.frequency / chance.uniform(2.0, 6.0, _SPEEDS)).tolist():
        cut, _ = time_limit(rig(truth, _STIFFNESS, speed), 0.6 * lowest.width, 40.0 * lowest.width)
        rows.append([speed, 1e3 * cut, limit_at(predicted, _STIFFNESS, speed).width / cut])
    return {"modes": [mode.frequency for mode in truth.modes], "found": [mode.frequency for mode in predicted.modes], "limits": rows}


def run(machines: int, path: Path) -> None:
    """Measure so many machines both ways and print the ratios."""
    for group, title in (("tap", "tapped, fitted, predicted"), ("couple", "artefact, inverse coupling, coupled, fitted, predicted")):
        rows = collected(path, ((group, number) for number in range(machines)), measured)
        ratios = np.array([limit[2] for row in rows for limit in row["limits"]])
        within = 100.0 * np.mean(np.abs(ratios - 1.0) <= 0.03)
        worst = 100.0 * np.abs(ratios - 1.0).max()
        print(f"{title}: {within:.0f} % of {len(ratios)} limits within 3 % of those found by cutting; largest difference {worst:.2f} %")
