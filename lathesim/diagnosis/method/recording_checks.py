"""Limits of whether a recording is at fault."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.diagnosis.method.limit import Limit


@dataclass(frozen=True)
class CheckLimits:
    """Limits of whether a recording is at fault."""

    change_left: Limit = Limit(
        0.2, "share of residual power",
        "a change at one time must leave less than this of what the best constant leaves",
    )  # fmt: skip
    change_of_delay: Limit = Limit(25, "samples", "a channel may become late or early by this many samples")
    jump: Limit = Limit(10.0, "noise floors", "a sensor that jumps by more than this, or starts from another zero, is reported")
    jump_seen_by_others: Limit = Limit(
        100.0, "times the noise power",
        "another channel that is off by more than this saw the jump too, so the machine moved",
    )  # fmt: skip
    left_by_fault: Limit = Limit(0.1, "share", "a fault that explains what is off leaves less than this of it")
    clipped_run: Limit = Limit(30, "samples", "a reading that stands at a level this long may be clipped")
    clipped_beyond: Limit = Limit(
        3.0, "times the usual residual",
        "the simulation must lie beyond the level by this for the reading to be clipped",
    )  # fmt: skip
    shift_looked_for: Limit = Limit(3.0, "samples", "a shifted channel is looked for within this distance")
    feed_forward: Limit = Limit(0.95, "share of unexplained command", "a feed-forward must explain this")
    law_of_command: Limit = Limit(0.01, "share of command", "what another law explains must be this share of the command")
    value_asked: Limit = Limit(
        0.02, "share of command",
        "a controller value is refitted where more than this of its command is unexplained",
    )  # fmt: skip
    value_left: Limit = Limit(0.25, "share of unexplained command", "another value must leave less than this")
    value_factor: Limit = Limit(4.0, "1", "a value is looked for up to this factor larger or smaller")
    machine_apart: Limit = Limit(
        4.0, "declared standard deviations",
        "two recordings whose values differ by more than this are of different machines",
    )  # fmt: skip
    machine_surely_apart: Limit = Limit(10.0, "standard errors", "the values must also differ by this")
    machine_worse: Limit = Limit(2.0, "1", "the question is asked where the validation recording is explained worse by this factor")
    machine_explained: Limit = Limit(0.2, "share of misfit, rms", "values of its own must leave less than this of the misfit")
    plainly_off: Limit = Limit(0.1, "share of squares", "two channels that together miss the simulation by more than this may be exchanged")
    gain_high: Limit = Limit(1.6, "1", "an amplifier's gain may be the declared one times or over this")
    sign_turned: Limit = Limit(0.03, "1", "a factor this near -1 is a sign turned round")
    unit_high: Limit = Limit(2.5, "1", "a ratio of forces between this and its inverse is no mistaken unit")
    unit_near: Limit = Limit(0.06, "share of factor", "a factor this near that of a unit may be it: values of the machine are uncertain")
    clock_unexplained: Limit = Limit(
        0.001, "share of command",
        "a clock error is looked for where more than this of a command is unexplained",
        "derived",
        "a command is arithmetic and follows to its last digit; a controller's memory from before the recording leaves less than this",
    )  # fmt: skip
    unexplained_command: Limit = Limit(
        0.2, "share of command",
        "a command of which more than this does not follow from its inputs contradicts the recording",
    )  # fmt: skip
    follows: Limit = Limit(0.05, "share of command", "with the fault mended, less than this may stay unexplained")
    left_by_shift: Limit = Limit(0.35, "share", "a shift in time, or a change at one time, leaves less than this of what is off without it")
    signal_jump: Limit = Limit(
        0.25, "share of span", "a signal that nobody recorded jumps where it changes by more than this from one sample to the next",
        "derived", "half of the way between two of three equal levels: the smallest step of a staircase of two steps still counts",
    )  # fmt: skip
    signal_off: Limit = Limit(
        0.1, "share of largest", "a signal that nobody recorded is off below this; sizes that differ by less are told as one",
        "derived", "twice what may stay unexplained of a command that follows",
    )  # fmt: skip
    signal_samples: Limit = Limit(
        5, "samples", "its levels last so long on average, a period of a sine at least",
        "derived", "a sine about a constant has four values to fit: five samples are the fewest that can speak against it",
    )  # fmt: skip
    counts_high: Limit = Limit(2.0, "times the span of the command", "a column of counts spans this at most, and its inverse at least")
    turned_left: Limit = Limit(0.3, "share of column", "with its sign turned a column may leave this: values of the machine are uncertain")
