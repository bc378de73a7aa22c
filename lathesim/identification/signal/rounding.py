"""What is lost to rounding, and where a number is no number any more: the same everywhere."""

from __future__ import annotations

ROUNDING = 1e-12
"""Share of a size that a chain of computations loses to rounding: some thousand times the machine's accuracy, 2.2e-16."""
SLOPE_ROUNDING = 1e-9
"""Share of the largest slope below which another one is rounding: slopes are differences of sizes that differ by a thousandth."""
BEYOND = 1e100
"""Where a run whose numbers grow beyond all bounds is cut off before it is differenced and squared [SI]."""
