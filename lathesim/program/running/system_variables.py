"""The variables in which a control tells where it stands: position, tool, offsets, modes.

Source: LinuxCNC 2.9 manual, chapter Parameters (numbered and predefined named); Fanuc 0i operator's manual, custom macro, system variables.
"""

from __future__ import annotations

import math

from lathesim.program.dialects import Dialect
from lathesim.program.running.modal import Modal

_RPM = 30.0 / math.pi


def system_value(key: int | str, modal: Modal, dialect: Dialect) -> float | None:
    """Return the value of a variable of the machine in the units of the program, or None where there is none of that number or name."""
    if isinstance(key, str):
        return _named(key, modal)
    if dialect.o_words:
        return _numbered(key, modal)
    return _macro(key, modal, dialect)


def _numbered(key: int, modal: Modal) -> float | None:
    x, z = modal.here
    table = {
        5211: modal.shown(modal.shift_x), 5213: modal.shown(modal.shift_z), 5220: float(modal.offset_number), 5400: float(modal.tool or 0),
        5420: modal.shown(x), 5422: modal.shown(z),
    }  # fmt: skip
    if 5221 <= key <= 5383 and (key - 5221) % 20 in (0, 2):
        offset = modal.offsets.get((key - 5221) // 20 + 1, (0.0, 0.0))
        return modal.shown(offset[0] if (key - 5221) % 20 == 0 else offset[1])
    return table.get(key)


def _named(key: str, modal: Modal) -> float | None:
    x, z = modal.here
    feed = 0.0 if modal.feed is None else modal.shown(modal.feed * (1.0 if modal.per_revolution else 60.0))
    return {
        "_X": modal.shown(x), "_Y": 0.0, "_Z": modal.shown(z), "_METRIC": float(not modal.inch), "_IMPERIAL": float(modal.inch),
        "_ABSOLUTE": float(modal.absolute), "_INCREMENTAL": float(not modal.absolute), "_LATHE_DIAMETER_MODE": float(modal.diameter),
        "_LATHE_RADIUS_MODE": float(not modal.diameter), "_FEED": feed, "_CURRENT_TOOL": float(modal.tool or 0),
        "_SELECTED_TOOL": float(modal.tool_ready or 0), "_CSS_MODE": float(modal.surface), "_RPM_MODE": float(not modal.surface),
        "_SPINDLE_ON": float(modal.direction != 0), "_SPINDLE_CW": float(modal.direction > 0), "_COORD_SYSTEM": float(modal.offset_number),
        "_UNITS_PER_MINUTE": float(not modal.per_revolution), "_UNITS_PER_REV": float(modal.per_revolution),
        "_RPM": 0.0 if modal.surface else _RPM * (modal.speed or 0.0), "_PI": math.pi,
    }.get(key)  # fmt: skip


def _macro(key: int, modal: Modal, dialect: Dialect) -> float | None:
    x, z = modal.here
    double = 2.0 if modal.diameter else 1.0
    machine = (modal.x - dialect.machine_zero[0], modal.z - dialect.machine_zero[1])
    table = {
        5001: double * modal.shown(x), 5002: modal.shown(z), 5021: double * modal.shown(machine[0]), 5022: modal.shown(machine[1]),
        5041: double * modal.shown(x), 5042: modal.shown(z), 4120: float(modal.tool or 0),
    }  # fmt: skip
    return table.get(key)
