"""Limits of tests of what is left, and the decision."""

from __future__ import annotations

import math
from dataclasses import dataclass

from scipy.stats import norm

from lathesim.limit import Limit


@dataclass(frozen=True)
class VerdictLimits:
    """Limits of tests of what is left, and the decision."""

    @property
    def replicates(self) -> int:
        """Replicates of the fitted model that are simulated where a test of what is left fails: n of them show a probability of 1/(n + 1)
        at the least, which has to be below ``false_alarms``."""
        return math.ceil(1.0 / self.false_alarms)

    @property
    def within_laws(self) -> Limit:
        """What errors of the lesson's laws leave of a force that goes with the motion, but for a share ``false_alarms`` of machines."""
        return self.law_error.times(float(norm.isf(self.false_alarms)))

    @property
    def within_form(self) -> Limit:
        """What the error of its form leaves of what an effect explains, but for a share ``false_alarms`` of machines."""
        return self.form_error.times(float(norm.isf(self.false_alarms)))

    finer_steps: Limit = Limit(
        4.0, "1", "so many steps of a replicate make one of the lesson's: a real machine makes none, and its residual shows the lesson's",
        "derived", "the error of a step of fourth order falls to 1/256",
    )  # fmt: skip
    false_alarms: Limit = Limit(
        0.02, "probability",
        "a narrow band, coherence with the command, what goes with the motion, or a difference of two sensors is a doubt where the fitted "
        "model shows as much less often than this",
        "derived",
        "the declared rate for all tests together, by the maximum over tests (Westfall, Young 1993, section 2.3)",
    )  # fmt: skip
    undetermined_size: Limit = Limit(
        0.05, "share of size",
        "an interval that comes this near the neutral value leaves the size undetermined",
    )  # fmt: skip
    sensors_apart: Limit = Limit(20.0, "resolutions", "redundant sensors may differ by this without a reason, as by their interpolation")
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
    leaves_much: Limit = Limit(
        0.37, "share of missing force",
        "effects that leave more where they do most are not the cause",
        "calibrated",
        "concealed cases: own forms left up to 0.35, names of something else 0.39 and more; counts not recorded",
    )  # fmt: skip
    small_load: Limit = Limit(
        0.15, "share of acting force",
        "a missing force above this is no noise and no small load", "calibrated", "concealed cases: sound machines left up to a tenth",
    )  # fmt: skip
    load_shows: Limit = Limit(5.0, "noise floors", "it must move the closed-loop simulation by this")
