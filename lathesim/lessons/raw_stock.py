"""The raw stock of a wired machine, which its records take along."""

from __future__ import annotations

from lathesim.analysis.failed_run import RawStock
from lathesim.component import Input, Parameter
from lathesim.engine.wiring import Plan

_MEASURES = ("stock_radius", "stock_length", "face")
_FURTHER = ("free_end", "edge_length")
_PLACES = ("x_position", "z_position")


def raw_stock(plan: Plan) -> RawStock | None:
    """Return the first part that has the measures of a stock and sees where the tool is; none where there is no such part."""
    for name, part in plan.parts.items():
        declared = part.component.declarations
        is_stock = all(isinstance(declared.get(item), Parameter) for item in _MEASURES)
        if is_stock and all(isinstance(declared.get(item), Input) for item in _PLACES):
            fed = {item: plan.feeds.get(f"{name}.{item}", ("parameter", f"{name}.{item}")) for item in (*_MEASURES, *_PLACES)}
            if all(fed[item][0] == "parameter" for item in _MEASURES) and all(fed[item][0] == "output" for item in _PLACES):
                values = {item: plan.parameter_values[plan.parameters[fed[item][1]]] for item in _MEASURES}
                known = [item for item in _FURTHER if f"{name}.{item}" in plan.parameters]
                values |= {item: plan.parameter_values[plan.parameters[f"{name}.{item}"]] for item in known}
                return RawStock(name, **values, x=fed["x_position"][1], z=fed["z_position"][1])
    return None
