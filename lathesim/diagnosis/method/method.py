"""The method as one value: every number that decides an answer, passed down from ``diagnose``."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from lathesim.limit import Limit

MOST_EFFECTS = 4
"""Effects of an explanation at most."""
SEARCH_TIME = 0.65
"""Share of the time until a deadline that a search may take: the rest is for what describes its answer."""
HOPELESS = 0.1
"""Share of the best screening gain below which a candidate is not fitted."""
RIVAL = 0.4
"""Share of the best screening gain from which on a candidate is fitted in the first batch."""
NEAR = 0.6
"""Share of the best gain from which on a trial is fitted until nothing moves."""
FIRSTS = 3
"""First ones of two effects that are tried, the best first."""
OTHER_VALUE = 4.0
"""Factor up to which another value of the lesson, or of a controller, is looked for, larger or smaller."""
MOST_SHIFTED = 3
"""Samples by which a shifted channel is looked for."""


@dataclass(frozen=True)
class SizeLimits:
    """Which sizes and instants an effect may have."""

    largest: float = Limit(
        30.0, "times the typical value", "an effect whose size, or whose shape, is further off than this is not that effect", "calibrated",
        "sizes up to 23 times the typical one are judged by their gain on the same recordings, with right answers; the nearest that are "
        "refused, 31, 32 and 39 times, belong to wrong names: bristles, an offset of a converter and Stribeck's law",
    )  # fmt: skip
    least_lag: float = Limit(
        0.05, "samples", "a lag below this is how a simulation steps", "calibrated",
        "on the recordings of others a lag by chance is 0.007 samples; the shortest one that is there, of an encoder beside a scale "
        "in the exercise of lesson 22, is 0.093",
    )  # fmt: skip
    standstill: float = Limit(
        0.02, "share of top speed", "a part slower than this stands still", "calibrated",
        "spindles that turn one way show 0.14 % back at most by the noise of their sensors, on six recordings of the suite, seeds 4421 "
        "and 4422; the slowest way back of 25 recordings with both directions is 44 %",
    )  # fmt: skip


@dataclass(frozen=True)
class RecordingLimits:
    """Whether a recording is at fault."""

    unit_high: float = Limit(
        2.5, "1", "a ratio of forces between this and its inverse is no mistaken unit", "derived",
        "the geometric mean of 2, which a machine may have, and of pi, the smallest factor of a unit of forces and motions",
    )  # fmt: skip
    command_floor: float = Limit(
        0.001, "share of command", "a fault of a command is looked for where more than this is unexplained", "derived",
        "a command is arithmetic and follows to its last digit; a controller's memory from before the recording leaves less than this",
    )  # fmt: skip
    signal_jump: float = Limit(
        0.25, "share of span", "a signal that nobody recorded jumps where it changes by more than this from one sample to the next",
        "derived", "half of the way between two of three equal levels: the smallest step of a staircase of two steps still counts",
    )  # fmt: skip
    signal_samples: float = Limit(
        5, "samples", "its levels last so long on average, a period of a sine at least", "derived",
        "a sine about a constant has four values to fit: five samples are the fewest that can speak against it",
    )  # fmt: skip


@dataclass(frozen=True)
class Method:
    """Every number that decides a diagnosis. A test, an ablation or a study of the limits passes another one."""

    # when one explanation is better than another one
    errors: float = Limit(
        3.0, "standard errors", "an explanation is better, a value is there, and a reading is off where it is above this", "derived",
        "a normal deviate exceeds 3 with a probability of 0.13 %: of fifty candidates, one in fifteen recordings",
    )  # fmt: skip
    tie_errors: float = Limit(
        2.0, "standard errors", "two explanations whose difference is below this cannot be told apart", "derived",
        "95 % of a normal deviate",
    )  # fmt: skip
    margin: float = Limit(
        10.0, "nats", "an accepted effect gains this beyond its parameters' due", "calibrated",
        "Kass and Raftery (1995) call 5 very strong evidence; of ten sound rigs of seed 4423 the best effect gains 13.8 where 19 are due, "
        "of eight with an effect and of six recordings of others the weakest that is kept 109",
    )  # fmt: skip
    per_parameter: float = Limit(
        3.0, "nats", "each fitted parameter must gain this", "derived",
        "half the 0.986 quantile of chi-squared with one degree of freedom (Wilks 1938): 1.4 % of useless parameters would pass",
    )  # fmt: skip

    # which share of something counts
    material: float = Limit(
        0.03, "share",
        "what explains less of an error, or differs by less of a gain, tells nothing: a model is never quite right",
        "calibrated",
        "on the same recordings a wrong effect that gains clearly explains 2.5 %, the least of a right one 4.6 %; the gains of effects "
        "that are the same there differ by 2.2 %, those of others by 5.8 %",
    )  # fmt: skip
    share_of_rest: float = Limit(
        0.15, "share", "a finer form that takes the place of an effect, and a line over time that counts, explain this of what is left",
        "calibrated", "of seven stored answers two have a finer form of a dry friction that is significant: it explains 0.74 and 0.96",
    )  # fmt: skip
    larger_part: float = Limit(0.5, "share", "what is above it is the larger part", "derived", "a majority is more than a half")
    little: float = Limit(
        0.1, "share", "what is below it is little; where no more than that is left, it is nearly all", "calibrated",
        "of 46 recordings of the rigs of seed 5501, each with a fault or a signal added to a command, a mended fault leaves 4.6 % at most "
        "of what was off, and a cause that is not the right one 20 % at least",
    )  # fmt: skip

    # what errors of laws and the noise of sensors make
    within_laws: float = Limit(
        0.01, "share",
        "a force that goes with the motion, or a part of a command, that is smaller than this may be an error of the lesson's laws",
        "derived", "two standard deviations of 0.5 %, the declared error of a law; five times what integration leaves",
    )  # fmt: skip

    alike: float = Limit(
        math.sqrt(2.0), "1", "a size is clearly larger than another one above this ratio, and hardly larger below it", "derived",
        "the geometric mean of 1 and 2: a count, a unit or an error that is twice as large is another one",
    )  # fmt: skip

    sizes: SizeLimits = SizeLimits()
    recordings: RecordingLimits = RecordingLimits()

    @property
    def nearly_all(self) -> float:
        """The share above which something is nearly all: it leaves little."""
        return 1.0 - self.little

    def judged_by_itself(self, samples: int) -> Method:
        """Return the limits of one recording that judges what was fitted to it: each value is due half the logarithm of the samples.

        Source: G. Schwarz, Estimating the dimension of a model, Annals of Statistics 6 (1978).
        """
        return replace(self, per_parameter=max(self.per_parameter, 0.5 * math.log(samples)))


STANDARD = Method()
"""The limits that every command uses."""
