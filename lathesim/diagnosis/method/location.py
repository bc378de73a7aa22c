"""Limits of where something is missing and what it depends on."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.limit import Limit


@dataclass(frozen=True)
class LocationLimits:
    """Limits of where something is missing and what it depends on."""

    integration_error: Limit = Limit(
        0.002, "share of acting force",
        "a missing force below this share is the error of the integration steps",
        "calibrated",
        "a simulation that steps leaves 0.2 % on the project's own axes",
    )  # fmt: skip
    standstill: Limit = Limit(0.02, "share of top speed", "a part slower than this stands still")
    commanded_standstill: Limit = Limit(0.001, "share of top speed", "a motion without sensor noise stands still below this")
