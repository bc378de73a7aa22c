"""The numbers that decide what a watch tells, each with its unit, its meaning and what it rests on."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.limit import Limit, derived

ASSUMED = "chosen on streams of the project's own campaign; the margin was not recorded"


def _assumed(value: float, unit: str, meaning: str, evidence: str = ASSUMED) -> Limit:
    return Limit(value, unit, meaning, "assumed", evidence)


@dataclass(frozen=True)
class ModelErrors:
    """What the lesson's machine may be wrong by without a change of the real one."""

    linear: Limit = _assumed(
        0.1, "share of what a value does",
        "a sensitivity may be wrong by this, as the machine is not linear; as large a share of what is left out may come and go",
    )  # fmt: skip
    least_floor: Limit = _assumed(
        0.02, "standard deviations of an uncertain value", "the floor of a channel is at least what so much of it does there"
    )
    drift: Limit = _assumed(
        1.0 / 60.0, "standard deviations a second", "an uncertain value may drift so: a machine warms up within minutes"
    )
    furthest: Limit = _assumed(4.0, "standard deviations", "the simulation goes on with values no further from the lesson's")
    seen: Limit = _assumed(0.02, "share of its usual information", "a block with less tells nothing about a direction")


@dataclass(frozen=True)
class NoiseLimits:
    """When the noise of a channel has changed (CUSUM; Page 1954)."""

    shift: Limit = derived(0.5, "standard deviations", "k of the CUSUM", "half of the smallest shift that is worth telling (Page 1954)")
    least: Limit = derived(15.0, "standard deviations", "h of the CUSUM at least", "with k = 0.5 a false alarm in 1e7 independent blocks")
    largest: Limit = _assumed(5.0, "standard deviations", "one block counts no more: no single block makes an alarm")
    least_left: Limit = _assumed(
        0.1, "share of the floor", "so much is added to the slow noise of a block: the model's error is no constant"
    )
    least_deviation: Limit = _assumed(
        0.3, "of the logarithm", "the noise of a block varies by at least this: quantised signals coincide now more, now less"
    )


@dataclass(frozen=True)
class ChangeLimits:
    """When a change is told, and whether it is a step or a drift."""

    least_ratio: Limit = derived(
        40.0, "2 log-likelihood", "the limit of the likelihood ratio at least",
        "with 30 directions and 100 times of change a false alarm in 1e6 blocks by Bonferroni's bound",
    )  # fmt: skip
    over_learnt: Limit = _assumed(2.5, "times", "a limit over the largest value while learning, where blocks depend on one another")
    least_blocks: int = 3
    """Blocks that a change must have been seen in."""
    alone: Limit = _assumed(0.5, "share of the statistic", "left without the block that counts most: no single block makes an alarm")
    longer: Limit = _assumed(4.0, "times", "a ramp must raise the statistic so much more than a step: it has the freedom to begin before")
    slow: Limit = _assumed(15.0, "s", "a change that takes longer from its beginning to the alarm is a drift")
    quiet: Limit = _assumed(0.5, "share of the limit", "below this the uncertain values that explain the newest blocks are followed")
    linked: Limit = _assumed(20.0, "s", "a step of the uncertain values and what follows it within this have one cause")


@dataclass(frozen=True)
class FollowingLimits:
    """When the simulation goes on with other values, and what of a followed size is told."""

    believed: int = 10
    """Blocks after which a step of the uncertain values is believed."""
    far: Limit = _assumed(
        0.3, "standard deviations", "from the simulation's values on it goes on with others: sensitivities hold nearby only"
    )
    power: Limit = _assumed(
        10.0, "power of the noise", "what other values do must have more: an error of a tenth then adds a tenth to the noise"
    )
    telling: Limit = _assumed(2.0, "standard deviations", "a followed size differs by more before the simulation goes on with it")
    worth: Limit = _assumed(0.1, "share of its size", "a size has moved by more before that is told: less says nothing about what it does")
    flat: Limit = derived(
        0.05, "probability", "a rise that chance makes with more is none, and nothing is forecast", "95 %, as all intervals"
    )
    step: Limit = derived(4.0, "standard deviations", "a step of a size measures more", "by chance one of 16 000 looks at noise")
    bend: Limit = _assumed(
        0.35, "share of the rate", "the rate of a drift changes by this over as long as it was seen, one standard deviation",
        "of lines whose rate wanders by 0.3, 83 to 99 % of the times to a tolerance lie in their intervals (40 to 6 points; 145 each)",
    )  # fmt: skip
    range: Limit = derived(1.96, "standard deviations", "a value lies within this", "95 % of a normal distribution")


ERRORS, NOISE, CHANGE, FOLLOWING = ModelErrors(), NoiseLimits(), ChangeLimits(), FollowingLimits()
