"""Limits of whether a recording is at fault."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.diagnosis.method.limit import Limit


@dataclass(frozen=True)
class CheckLimits:
    """Limits of whether a recording is at fault."""

    change_left: Limit = Limit(
        0.2, "share of residual",
        "another explanation must leave less than this: a change at one time, a machine of its own for one recording",
    )  # fmt: skip
    change_of_delay: int = 25
    """Samples by which a channel that becomes late or early is looked for."""
    jump: Limit = Limit(10.0, "noise floors", "a jump of a sensor beside a second one, or a difference of two zeros, counts above this")
    little_off: Limit = Limit(
        0.1, "share",
        "what is off by less than this share of itself, or of what it was, is off by little: a mended fault may leave it",
    )  # fmt: skip
    clipped_run: Limit = Limit(30, "samples", "a reading that stands at a level this long may be clipped")
    clipped_beyond: Limit = Limit(
        3.0, "times the usual residual",
        "the simulation must lie beyond the level by this for the reading to be clipped",
    )  # fmt: skip
    shift_looked_for: float = 3.0
    """Samples by which a shifted channel is looked for."""
    law_of_command: Limit = Limit(0.01, "share of command", "what another law explains must be this share of the command")
    value_asked: Limit = Limit(
        0.02, "share of command",
        "a controller value is refitted where more than this of its command is unexplained",
    )  # fmt: skip
    value_left: Limit = Limit(0.25, "share of unexplained command", "another value must leave less than this")
    value_factor: float = 4.0
    """Factor up to which another value is looked for, larger or smaller."""
    machine_apart: Limit = Limit(
        4.0, "declared standard deviations",
        "two recordings whose values differ by more than this are of different machines",
    )  # fmt: skip
    machine_surely_apart: Limit = Limit(10.0, "standard errors", "the values must also differ by this")
    machine_worse: Limit = Limit(2.0, "1", "the question is asked where the validation recording is explained worse by this factor")
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
