"""Tool wear by Taylor's law, summed over changing speeds."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path

from lathesim.component import ON, Component, DiscreteState, Input, Output, Parameter
from lathesim.elementary import within

_LARGEST = 60.0
"""Logarithm of a life [min] beyond which an edge lasts for ever, or not at all."""

METRE_PER_MINUTE = 1.0 / 60.0
MINUTE = 60.0


class TaylorWear(Component):
    """Gives flank wear and used-up life of the edge:  V t^n = C,  d(used)/dt = 1/t(V) while cutting,  VB = VB_end used.

    V counts in m/min and t in min, as tables of C and n do. At changing speeds the used shares of life add up (Miner's rule), which for a
    constant speed is Taylor's law itself. Past the end of life the wear goes on at the same rate. ``force_factor`` = 1 + growth VB tells
    a force model what wear does; with ``force_growth`` 0 (default) nothing.
    Source: G. Boothroyd, W. A. Knight, Fundamentals of Machining and Machine Tools (1989); J. Liu, R. G. Landers (2004), equation (34).
    Materials: ``tool_materials``. End of life at 0.3 mm: ISO 3685. Left out: running-in, feed and depth, crater wear, breakage.
    """

    group = "tool and part"

    cutting_speed = Input("m/s", doc="actual cutting speed")
    in_contact = Input("1", doc="1 while the tool cuts")

    taylor_constant = Parameter("m/s", 700.0 / 60.0, low=1e-3, doc="C: the cutting speed with a life of one minute")
    taylor_exponent = Parameter("1", 0.25, low=0.02, high=2.0, doc="n: how life falls with speed")
    wear_at_end_of_life = Parameter("m", 0.3e-3, low=0.0, doc="flank wear at the end of life")
    force_growth = Parameter("1/m", 0.0, low=0.0, doc="share by which forces grow per flank wear; 0: wear leaves them alone")
    slowest_cutting_speed = Parameter("m/s", 1e-3, low=1e-6, doc="cutting speed below which nothing wears")

    used = DiscreteState("1", doc="used-up share of the edge's life")
    held_life = DiscreteState("s", doc="life of a new edge at the present speed; 0 out of the cut")

    used_life = Output("1", doc="used-up share of the edge's life, 1 at its end")
    flank_wear = Output("m", doc="flank wear of the edge")
    life = Output("s", doc="life of a new edge at the present speed; 0 out of the cut")
    force_factor = Output("1", doc="factor by which wear raises the cutting forces")

    @staticmethod
    def update(
        cutting_speed: float, in_contact: float, taylor_constant: float, taylor_exponent: float, slowest_cutting_speed: float, used: float,
        sample_period: float,
    ) -> tuple[float, float]:  # fmt: skip
        """Equation (34), one sample of it."""
        if in_contact < ON or cutting_speed < slowest_cutting_speed:
            return used, 0.0
        logarithm = within(math.log(taylor_constant / cutting_speed) / taylor_exponent, -_LARGEST, _LARGEST)
        life = MINUTE * math.exp(logarithm)
        return used + sample_period / life, life

    @staticmethod
    def output(used: float, held_life: float, wear_at_end_of_life: float, force_growth: float) -> tuple[float, float, float, float]:
        wear = wear_at_end_of_life * used
        return used, wear, held_life, 1.0 + force_growth * wear


@dataclass(frozen=True)
class ToolMaterial:
    """Taylor's constants of a pair of work and tool material: C [m/s] and n, with their source and whether it was checked against."""

    work: str
    tool: str
    taylor_constant: float
    taylor_exponent: float
    source: str
    checked: bool


def tool_materials() -> list[ToolMaterial]:
    """Return the table of work and tool materials; C in the file is in m/min."""
    with Path(__file__).with_name("taylor_materials.csv").open(newline="", encoding="utf-8") as file:
        return [
            ToolMaterial(
                row["work"],
                row["tool"],
                float(row["C [m/min]"]) * METRE_PER_MINUTE,
                float(row["n"]),
                row["source"],
                row["checked"] == "yes",
            )
            for row in csv.DictReader(file)
        ]
