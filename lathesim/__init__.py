"""lathesim: an educational, modular machine-tool simulator that says what physics a simulation left out.

In Python, ``import lathesim as ls``:

    record = ls.lesson("01").run(variant="I")       a record: channels as numpy arrays, with units
    ls.measure(record)                              its metrics, such as the largest contour error
    ls.compare(lesson, recording)                   how far simulation and recording are apart, and where
    ls.diagnose(lesson, recording)                  the physics that the lesson left out
    ls.sweep(lesson, {"part.name": "0.1..0.8:8"})   a lesson over ranges of its parameters
    ls.Machine(lesson, {"x": "part.input"})         a machine that set-points move, step by step
    ls.load(file), ls.save(record, file)            records in files

``help(ls.diagnose)`` explains one of them. The commands ``lathesim run``, ``compare`` ... call the same functions.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lathesim.scripting import Lesson, Machine, Record, Swept, compare, diagnose, lesson, load, measure, save, sweep

__version__ = "0.1.0"
__all__ = ["Lesson", "Machine", "Record", "Swept", "compare", "diagnose", "lesson", "load", "measure", "save", "sweep"]


def __getattr__(name: str) -> Any:
    """Return a public name, imported when it is first used: ``import lathesim`` alone costs nothing."""
    if name not in __all__:
        raise AttributeError(f"module 'lathesim' has no attribute '{name}'")
    found = globals()[name] = getattr(importlib.import_module("lathesim.scripting"), name)
    return found


def __dir__() -> list[str]:
    """Return the names of the module, those that are not yet imported too."""
    return sorted({*globals(), *__all__})
