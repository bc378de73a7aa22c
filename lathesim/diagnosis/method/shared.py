"""Limits of questions that several steps ask: they are answered alike everywhere."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.limit import Limit


@dataclass(frozen=True)
class SharedLimits:
    """Limits of questions that several steps ask."""

    larger_part: Limit = Limit(
        0.5, "share", "what is above this share of something is the larger part of it", "derived", "a majority is more than a half"
    )
    nearly_all: Limit = Limit(
        0.9, "share", "what is above this share of something is nearly all of it; what scores this share of the best looks like it",
        "assumed",
        "0.8 fits more candidates, and names lags of three force channels of a real turning cut in the place of a drift",
    )  # fmt: skip
    left_by_cause: Limit = Limit(
        0.25, "share of what is off",
        "what is off is put down to a cause that leaves less than this of it: a change, a shift, a sign, another value, a finer shape",
        "assumed",
        "in the place of five limits from 0.20 to 0.35",
    )  # fmt: skip
    alike: Limit = Limit(1.5, "1", "a size is clearly larger than another one above this ratio, and hardly larger below it")
    hardly_more: Limit = Limit(1.05, "1", "a size is no larger than another one, and an error no worse, below this ratio")
    plainly_off: Limit = Limit(
        8.0, "noise floors", "a channel, a jump or a zero is plainly off above this: integration steps leave less",
        "assumed",
        "in the place of 8 and 10",
    )  # fmt: skip
