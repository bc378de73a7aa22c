"""Limits of what the report mentions."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.diagnosis.method.limit import Limit


@dataclass(frozen=True)
class ReportingLimits:
    """Limits of what the report mentions."""

    comparable_part: Limit = Limit(0.2, "share of the largest", "a part that misses at least this share is suspected beside the first one")
    clearly_more: Limit = Limit(0.02, "share of missing force", "a less simple variable is named where it explains this much more")
    most_variables: Limit = Limit(4, "variables", "at most so many variables are named")
    near_floor: Limit = Limit(3.0, "noise floors", "a channel up to this is at its noise floor")
    left_out_worse: Limit = Limit(
        1.02, "times the residual",
        "a parameter that is not determined is left out where no channel gets worse by more than this",
    )  # fmt: skip
    remark_share: Limit = Limit(0.0005, "share of acting force", "a missing share below this is not mentioned")
    remark_unexplained: Limit = Limit(0.05, "share of acting force", "above this the report says that nothing explains what is missing")
    hardly_shown: Limit = Limit(
        0.01, "noise floors",
        "a value that moves its channel by less is not shown by the recording",
        "derived",
        "some ten thousand samples average noise down to a hundredth of a floor",
    )  # fmt: skip
