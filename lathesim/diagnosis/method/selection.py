"""Limits of the search and acceptance of effects."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.diagnosis.method.limit import Limit


@dataclass(frozen=True)
class SelectionLimits:
    """Limits of the search and acceptance of effects."""

    equal: Limit = Limit(
        1.0, "nats",
        "two candidates that differ by less are equivalent; the one first in the catalogue wins",
        "derived",
        "Kass and Raftery (1995): below 1 'not worth more than a bare mention'",
    )  # fmt: skip
    equal_share: Limit = Limit(0.01, "share of gain", "the same as a share of the gain, as the fit of a trial is coarse")
    simple_leaves: Limit = Limit(0.02, "share of error", "an effect with at least two parameters fewer may leave this")
    simple_leaves_more: Limit = Limit(1.5, "1", "it may leave this many times what the other one leaves")
    simple_gains: Limit = Limit(0.75, "share of gain", "it must gain this share of what the other one gains")
    least_lag: Limit = Limit(0.2, "samples", "a lag below this is how a simulation steps")
    event_start: Limit = Limit(0.01, "share of recording", "a change earlier than this is a sensor offset, not an event")
    tie_share: Limit = Limit(
        0.03, "share of gain",
        "two candidates that differ by less cannot be distinguished, as a model is never quite right",
    )  # fmt: skip
    alike_score: Limit = Limit(0.1, "share of screening score", "candidates whose scores differ by less may be the same to the channels")
    most_rivals: Limit = Limit(3, "candidates", "so many rivals are fitted at most")
    shape_before_effect: Limit = Limit(
        0.8, "share of best score",
        "an extended shape that scores this share of the best candidate is tried first",
    )  # fmt: skip
    relative_score: Limit = Limit(0.5, "share of screening score", "a relative with no more parameters is fitted too above this")
    relative_score_if_implausible: Limit = Limit(0.1, "share of screening score", "the same while parameter values are implausible")
    refined_first: Limit = Limit(0.95, "share of error", "a generalised effect is tried before simple ones where it scores this")
    simple_far: Limit = Limit(0.8, "share of error", "and where no simple one scores this")
    further_score: Limit = Limit(0.5, "share of error", "further candidates are fitted where they score this")
    further_candidates: Limit = Limit(4, "candidates", "so many further candidates are fitted at most")
    further_gain: Limit = Limit(0.2, "share of error", "they must score this much more than the first ones explained")
    kept_of_score: Limit = Limit(0.5, "share of screening score", "an effect that keeps less is fitted again with the simulated motion")
    recordings_agree: Limit = Limit(
        0.6, "share of gain",
        "a friction that gains less on the other recording is fitted again with the simulated motion",
    )  # fmt: skip
    simulated_motion_gain: Limit = Limit(1.1, "times the gain", "the simulated motion must gain this much more to be used")
    degrades: Limit = Limit(
        1.05, "times the residual",
        "an effect that makes the closed-loop simulation worse than this is compared with others",
    )  # fmt: skip
    without_degradation: Limit = Limit(
        0.9, "share of explained error",
        "another effect that degrades nothing is preferred where it explains this share",
    )  # fmt: skip
    near_all: Limit = Limit(0.98, "share of residual", "above this share explained only close rivals are fitted")
    near_all_rival: Limit = Limit(0.85, "share of residual", "a close rival scores this share of the best score")
    near_most: Limit = Limit(0.95, "share of residual", "above this share explained only near rivals are fitted")
    near_most_rival: Limit = Limit(0.6, "share of residual", "a near rival scores this share of the best score")
    implausible_penalty: Limit = Limit(16.0, "penalty", "above this the lesson's values, taken together, are implausible")
    unexplained_power: Limit = Limit(40.0, "whitened power", "above this a channel still has an unexplained residual")
    increase_elsewhere: Limit = Limit(0.1, "share of decrease", "largest increase allowed in other channels")
    simulated_motion_left: Limit = Limit(0.15, "share of error", "frictions sense the simulated motion where it leaves less than this")
    coarse_fit_decides: Limit = Limit(2.0, "1", "a coarse fit decides where it clears that limit by this factor")
    must_gain_too: Limit = Limit(
        0.5, "share of residual",
        "a trial that explains more than this must raise the likelihood too; else it is fitted again with its own noise",
    )  # fmt: skip
    score_reached: Limit = Limit(0.98, "share of screening score", "a start that explains this share ends the search over starts")
    whole_order: Limit = Limit(0.002, "orders", "standard deviation of a fitted order about its whole number")
    lag_rival: Limit = Limit(0.9, "share of gain", "a rival that gained this share of a late effect is compared with it")
    tie: Limit = Limit(
        4.0, "nats",
        "two candidates that differ by less cannot be distinguished with this recording",
        "calibrated",
        "Kass and Raftery (1995) call 3 to 5 strong evidence; 4 kept the ties of the suite's concealed cases, margin not recorded",
    )  # fmt: skip
    shape_score: Limit = Limit(0.5, "share of margin", "an extended shape must score this share of what accepts it")
    shape_of_all: Limit = Limit(0.01, "share of error", "an extended shape must explain this of all the error")
    shape_of_first: Limit = Limit(0.2, "share of gain", "an extended shape must gain this share of what the plain one gained")
    surely_there: Limit = Limit(3.0, "standard errors", "a parameter of an extended shape is there above this")
    parameter_worth: Limit = Limit(
        3.0, "nats",
        "a parameter must be worth this on either recording",
        "derived",
        "half the 0.986 quantile of chi-squared with one degree of freedom (Wilks 1938)",
    )  # fmt: skip
    wave_surely_there: Limit = Limit(10.0, "margins", "a periodic effect that scores this is fitted whatever its share of the residual")
    restores_values: Limit = Limit(
        0.5, "share of closed-loop error",
        "a generalisation that restores plausible values must leave less than this in the worst channel",
    )  # fmt: skip
    value_at_bound: Limit = Limit(
        1e-3, "share of its range",
        "a value this near a bound would go further, and explains nothing",
        "derived",
        "a bounded fit ends within its tolerance, 1e-8 of the range, of an active bound",
    )  # fmt: skip
    value_wider: Limit = Limit(10.0, "times the declared deviation", "one value is released this far")
    value_better: Limit = Limit(0.03, "share of gain", "one explanation must be better than another by this")
    value_gain: Limit = Limit(10.0, "nats", "a released value must gain this")
    value_hopeless: Limit = Limit(0.3, "share of gain", "a value that reaches less in a coarse fit is given up")
    most_restarts: Limit = Limit(2, "restarts", "so many restarts are tried at most")
    restart_explains: Limit = Limit(0.5, "share of residual", "a restart begins with a candidate that explains this alone")
    rival_gain: Limit = Limit(0.8, "share of gain", "a rival that gained this is tried again")
    most_retried: Limit = Limit(4, "candidates", "so many rivals are tried again at most")
    simpler_score: Limit = Limit(0.5, "share of error", "a simpler relative must score this")
    most_simpler: Limit = Limit(3, "candidates", "so many simpler relatives are fitted at most")
    one_for_two_share: Limit = Limit(0.02, "share of gain", "one effect may be behind two by this share of what the second one gains")
    one_for_two_score: Limit = Limit(0.2, "share of gain", "one effect for two must score this share of what the second one gains")
    much_of_all: Limit = Limit(0.3, "share of error", "a periodic effect above this is much of what was missing")
    small_effect: Limit = Limit(0.01, "share of error", "an effect below this beside others is compared with what acts at its place")
    most_refused: Limit = Limit(2, "refusals", "after so many rejections the model is not extended")
    restores_clearly: Limit = Limit(4.0, "1", "an effect restores plausible values where their penalty is this much below the limit")
    moved_far: Limit = Limit(3.0, "standard errors", "slopes are taken anew where a value moved by more than this")
