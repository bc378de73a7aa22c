"""Numbers that are the same everywhere: what is lost to rounding, what is the larger part, where a number is no number any more."""

from __future__ import annotations

ROUNDING = 1e-12
"""Share of a size that a chain of computations loses to rounding: some thousand times the machine's accuracy, 2.2e-16."""
SLOPE_ROUNDING = 1e-9
"""Share of the largest slope below which another one is rounding: slopes are differences of sizes that differ by a thousandth."""
LARGER_PART = 0.5
"""Share above which something is the larger part of it."""
BEYOND = 1e100
"""Where a run whose numbers grow beyond all bounds is cut off before it is differenced and squared [SI]."""
