"""Faults of a recording: what a column or a clock looks like that was logged or mapped wrongly."""

from __future__ import annotations

from pathlib import Path

import numpy as np


def faulty(fault: str, table: dict[str, np.ndarray], encoder: float) -> dict[str, np.ndarray]:
    """Return the columns with one fault in them; ``encoder`` is the length of one count."""
    made = dict(table)
    match fault:
        case "clock":
            made["t"] = table["t"] * 1.003
        case "current_late":
            made["i"] = np.r_[np.full(12, table["i"][0]), table["i"][:-12]]
        case "sign":
            made["i"] = -table["i"]
        case "sign_of_place":
            made["q"] = -table["q"]
        case "unit_1000":
            made["q"] = 1e3 * table["q"]
        case "behind_converter":
            made["u"] = table["held"]
        case "counts":
            made["q"] = np.round(table["q"] / encoder)
        case "rows":
            made["q"] = np.r_[table["q"][0], table["q"][:-1]]
        case "other_axis":
            made["q"], made["q_2"] = table["q_2"], table["q"]
    return made


def write_table(path: Path, table: dict[str, np.ndarray]) -> None:
    """Write a recording; what stands behind the converter is no column of it."""
    columns = {name: values for name, values in table.items() if name != "held"}
    np.savetxt(path, np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments="", fmt="%.9g")
