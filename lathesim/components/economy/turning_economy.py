"""What a turned part costs in time and money, tool changes included."""

from __future__ import annotations

from lathesim.component import Component, Input, Output, Parameter


class TurningEconomy(Component):
    """Gives the time and the cost of one part, with its share of tool changes and edges:

        time_per_part = t + t_handling + u t_change
        part_cost     = m time_per_part + u c_edge

    t is the time since the start, u the share of the edge's life that was used up on the part (1/u parts a tool change), m the cost of
    machine and operator per time. The values at the end of a run are those of the part.
    Source: W. W. Gilbert, Economics of Machining, in Machining Theory and Practice, ASM (1950); G. Boothroyd, W. A. Knight, Fundamentals
    of Machining and Machine Tools (1989), chapter on the economics of machining. The default values are assumed.
    Left out: scrap, set-up of the batch, regrinding.
    """

    group = "tool and part"

    used_life = Input("1", doc="used-up share of the edge's life, since the start")

    machine_rate = Parameter("dollar/s", 60.0 / 3600.0, low=0.0, doc="cost of machine and operator per time")
    handling_time = Parameter("s", 0.0, low=0.0, doc="time to load and unload a part")
    tool_change_time = Parameter("s", 60.0, low=0.0, doc="time to change the edge")
    edge_cost = Parameter("dollar", 2.0, low=0.0, doc="cost of an edge")

    time_per_part = Output("s", doc="time for the part so far, with its share of tool changes")
    part_cost = Output("dollar", doc="cost of the part so far, with its share of edges")

    @staticmethod
    def output(
        time: float, used_life: float, machine_rate: float, handling_time: float, tool_change_time: float, edge_cost: float
    ) -> tuple[float, float]:
        """Time and money up to now."""
        spent = time + handling_time + used_life * tool_change_time
        return spent, machine_rate * spent + used_life * edge_cost
