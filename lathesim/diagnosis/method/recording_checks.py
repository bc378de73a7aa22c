"""Limits of whether a recording is at fault."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.limit import Limit


@dataclass(frozen=True)
class CheckLimits:
    """Limits of whether a recording is at fault."""

    least_scale: Limit = Limit(
        0.003, "share", "a scale that steps by less is the same scale",
        "derived", "three steps of the grid of scales that are tried",
    )  # fmt: skip
    change_blocks: int = 16
    """Blocks of a recording between which a step is looked for ..."""
    change_edge: int = 2
    """... but for so many at either end."""
    law_lags: tuple[int, ...] = (0, 1, 2, 3, 5, 8, 12, 18, 26, 36, 50, 70)
    """Samples back to which another law of a controller may look."""
    change_of_delay: int = 25
    """Samples by which a channel that becomes late or early is looked for."""
    little_off: Limit = Limit(
        0.1, "share",
        "what is off by less than this share of itself, or of what it was, is off by little: a mended fault may leave it, a signal is off",
    )  # fmt: skip
    clipped_run: Limit = Limit(30, "samples", "a reading that stands at a level this long may be clipped")
    shift_looked_for: float = 3.0
    """Samples by which a shifted channel is looked for."""
    worth_of_command: Limit = Limit(
        0.01, "share of command",
        "another law must explain this of a command, and another value is looked for where more than this is unexplained",
    )  # fmt: skip
    value_factor: float = 4.0
    """Factor up to which another value is looked for, larger or smaller."""
    machine_apart: Limit = Limit(
        4.0, "declared standard deviations",
        "two recordings whose values differ by more than this are of different machines",
    )  # fmt: skip
    machine_surely_apart: Limit = Limit(10.0, "standard errors", "the values must also differ by this")
    unit_high: Limit = Limit(
        2.5, "1", "a ratio of forces between this and its inverse is no mistaken unit",
        "derived", "the geometric mean of 2, which a machine may have, and of pi, the smallest factor of a unit of forces and motions",
    )  # fmt: skip
    unit_near: Limit = Limit(
        0.06, "share of factor",
        "a factor this near that of a unit, or -1, may be it: values of the machine are uncertain",
    )  # fmt: skip
    clock_unexplained: Limit = Limit(
        0.001, "share of command",
        "a clock error is looked for where more than this of a command is unexplained",
        "derived",
        "a command is arithmetic and follows to its last digit; a controller's memory from before the recording leaves less than this",
    )  # fmt: skip
    clock_factors: tuple[float, ...] = (0.5, 2.0, 0.8, 1.25, 0.1, 10.0, 1e-3, 1e3)
    """Factors between the true period and the recorded one that are tried: clocks of other devices, and seconds for milliseconds."""
    unexplained_command: Limit = Limit(
        0.2, "share of command",
        "a command of which more than this does not follow from its inputs contradicts the recording",
    )  # fmt: skip
    follows: Limit = Limit(0.05, "share of command", "with the fault mended, less than this may stay unexplained")
    signal_jump: Limit = Limit(
        0.25, "share of span", "a signal that nobody recorded jumps where it changes by more than this from one sample to the next",
        "derived", "half of the way between two of three equal levels: the smallest step of a staircase of two steps still counts",
    )  # fmt: skip
    signal_samples: Limit = Limit(
        5, "samples", "its levels last so long on average, a period of a sine at least",
        "derived", "a sine about a constant has four values to fit: five samples are the fewest that can speak against it",
    )  # fmt: skip
