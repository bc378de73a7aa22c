"""Limits of questions that several steps ask: they are answered alike everywhere."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.diagnosis.method.limit import Limit


@dataclass(frozen=True)
class SharedLimits:
    """Limits of questions that several steps ask."""

    larger_part: Limit = Limit(
        0.5, "share", "what is above this share of something is the larger part of it", "derived", "a majority is more than a half"
    )
    nearly_all: Limit = Limit(0.9, "share", "what is above this share of something is nearly all of it")
    alike: Limit = Limit(1.5, "1", "a size is clearly larger than another one above this ratio, and hardly larger below it")
    dependence: Limit = Limit(0.1, "share of missing force", "a variable that explains less than this is none that the force depends on")
