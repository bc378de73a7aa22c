"""Limits of tests of what is left, and the decision."""

from __future__ import annotations

from dataclasses import dataclass

from scipy.stats import norm

from lathesim.limit import Limit


@dataclass(frozen=True)
class VerdictLimits:
    """Limits of tests of what is left, and the decision."""

    @property
    def within_laws(self) -> Limit:
        """What errors of the lesson's laws leave of a force that goes with the motion, but for a share ``false_alarms`` of machines."""
        return self.law_error.times(float(norm.isf(self.false_alarms)))

    false_alarms: Limit = Limit(
        0.02, "probability",
        "a narrow band, coherence with the command, what goes with the motion, or a difference of two sensors is a doubt where the fitted "
        "model shows as much less often than this",
        "derived",
        "the declared rate for all tests together, by the maximum over tests (Westfall, Young 1993, section 2.3)",
    )  # fmt: skip
    law_error: Limit = Limit(
        0.005, "share of a law",
        "a law of the lesson may be wrong by this, one standard deviation: each value that is uncertain is drawn so in a replicate",
        "derived",
        "declared: with it a missing force that goes with the motion is a doubt above 1 % of what acts, five times what integration leaves",
    )  # fmt: skip
    form_error: Limit = Limit(
        0.05, "share of an effect",
        "an effect of the catalogue may be of another form by this, one standard deviation: each of its sizes is drawn so in a replicate",
        "calibrated",
        "concealed cases: effects in their own form left up to 0.10 of what was missing, others 0.114 and more; counts not recorded",
    )  # fmt: skip
