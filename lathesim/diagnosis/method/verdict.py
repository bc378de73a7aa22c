"""Limits of tests of what is left, and the decision."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.diagnosis.method.limit import Limit


@dataclass(frozen=True)
class VerdictLimits:
    """Limits of tests of what is left, and the decision."""

    replicates: Limit = Limit(
        50.0, "simulations",
        "so many replicates of the fitted model are simulated where a test of what is left fails",
        "derived",
        "the smallest probability that n replicates can show is 1/(n + 1): 50 show one below false_alarms",
    )  # fmt: skip
    false_alarms: Limit = Limit(
        0.02, "probability",
        "a narrow band, or coherence with the command, is a doubt where the fitted model shows as much less often than this",
        "derived",
        "the declared rate for all tests together, by the maximum over tests (Westfall, Young 1993, section 2.3)",
    )  # fmt: skip
    undetermined_size: Limit = Limit(
        0.05, "share of size",
        "an interval that comes this near the neutral value leaves the size undetermined",
    )  # fmt: skip
    values_moved: Limit = Limit(0.05, "share of error", "a refit of the baseline must explain this share for its values to be called off")
    sensors_apart: Limit = Limit(20.0, "resolutions", "redundant sensors may differ by this without a reason, as by their interpolation")
    limit_cycle: Limit = Limit(
        1.5, "times the limit cycle",
        "a channel off by less deviates by no more than the limit cycle of its quantised loop",
    )  # fmt: skip
    hardly_any_error: Limit = Limit(1.5, "noise floors", "a channel up to this has hardly any error")
    no_error: Limit = Limit(0.03, "share of channel error", "a share below this is nothing")
    named_share: Limit = Limit(0.5, "share of error", "effects must explain this to be named")
    adequate: Limit = Limit(
        0.025, "share of acting force",
        "a model is inadequate where the operating conditions explain a larger missing force on the validation recording",
    )  # fmt: skip
    other_form: Limit = Limit(
        0.11, "share of missing force",
        "above this what is left has a form of its own, so the named effect is not the whole cause",
        "calibrated",
        "concealed cases: effects in their own form left up to 0.10, others 0.114 and more (a brake of eddy currents for a dry "
        "friction); counts not recorded",
    )  # fmt: skip
    half: Limit = Limit(
        0.5, "share of missing force",
        "an effect that leaves more than this explains less than half of what was missing at its place",
    )  # fmt: skip
    explains_most: Limit = Limit(0.9, "share of error", "effects that explain this are not asked about what they leave")
    leaves_much: Limit = Limit(
        0.37, "share of missing force",
        "effects that leave more where they do most are not the cause",
        "calibrated",
        "concealed cases: own forms left up to 0.35, names of something else 0.39 and more; counts not recorded",
    )  # fmt: skip
    channel_worse: Limit = Limit(
        1.5, "times the residual",
        "a channel of the closed-loop simulation that gets worse by more than this is degraded",
    )  # fmt: skip
    every_channel_worse: Limit = Limit(
        1.05, "times the residual",
        "a model that makes every channel worse by more than this is rejected",
        "calibrated",
        "concealed cases: right names improved some channel, to 0.9 of its residual at the most",
    )  # fmt: skip
    small_load: Limit = Limit(
        0.15, "share of acting force",
        "a missing force above this is no noise and no small load", "calibrated", "concealed cases: sound machines left up to a tenth",
    )  # fmt: skip
    load_shows: Limit = Limit(5.0, "noise floors", "it must move the closed-loop simulation by this")
    follows_motion: Limit = Limit(
        0.01, "share of acting force",
        "a missing force that mostly follows the motion counts above this",
        "derived",
        "five times what the integration steps leave (0.2 %)",
    )  # fmt: skip
    same_at_load: Limit = Limit(0.8, "1", "what is missing at small and at large load is the same above this ratio")
    followed: Limit = Limit(0.1, "share of missing force", "a missing force followed the motion above this")
    follows_no_more: Limit = Limit(0.01, "share of missing force", "and follows it no more below this")
    values_gain: Limit = Limit(10.0, "nats", "other values of the baseline must gain this for the given ones to be called off")
