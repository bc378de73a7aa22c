"""Metrics of cost: of a lathe in a design project, and of a part.

They read the channels of the parts LatheDesign and TurningEconomy, where a machine has them.
"""

from __future__ import annotations

from lathesim.analysis.metrics.metric import Metric, signal
from lathesim.analysis.metrics.turning_metrics import cycle_time
from lathesim.record import Record

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
    return float(signal(record, "design.machine_cost", ".machine_cost")[-1])


def performance_index(record: Record) -> float:
    """Return the index of a design project, from cost and cycle time [1]."""
    return weighed(machine_cost(record), cycle_time(record))


def part_cost(record: Record) -> float:
    """Return what the part cost, tool changes and edges included [dollar]."""
    return float(signal(record, "economy.part_cost", ".part_cost")[-1])


def time_per_part(record: Record) -> float:
    """Return the time for the part with its share of tool changes [s]."""
    return float(signal(record, "economy.time_per_part", ".time_per_part")[-1])


def parts_per_edge(record: Record) -> float:
    """Return how many such parts an edge lasts [1]."""
    used = float(signal(record, "tool_wear.used_life", ".used_life")[-1])
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
