"""Goals as a person reads them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from lathesim.analysis.display_unit import plain_number

if TYPE_CHECKING:
    from lathesim.lessons.grading import GoalResult


def goal_text(goal: GoalResult) -> str:
    """Return one goal with what was reached: ``✗ max_contour_error at most 0.4 mm: 0.685 mm``; the sign says whether it is met."""
    reached = f"{plain_number(goal.value, 4)} {goal.unit}" if math.isfinite(goal.value) else goal.reason or "not measured"
    return f"{'✓' if goal.met else '✗'} {goal.metric} {goal.sense} {goal.limit}: {reached}"
