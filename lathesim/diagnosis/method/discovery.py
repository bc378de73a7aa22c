"""Limits of formulas for what no effect explains."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.diagnosis.method.limit import Limit


@dataclass(frozen=True)
class DiscoveryLimits:
    """Limits of formulas for what no effect explains."""

    smoothed_reversal: Limit = Limit(0.02, "share of top speed", "a step at a reversal is smoothed over this share of the fastest motion")
    worth: Limit = Limit(0.05, "share of missing force", "a further group of columns must explain this on the validation recording")
    most_groups: Limit = Limit(3, "groups", "a formula has at most so many groups of columns")
    ends: Limit = Limit(0.06, "share of recording", "either end of a recording is left out, as the missing force is tapered there")
    absorbed: Limit = Limit(0.9, "share of a column", "a column of which the uncertain values explain more than this belongs to them")
    sure: Limit = Limit(3.0, "standard errors", "the coefficient of an addend must differ from zero by this")
