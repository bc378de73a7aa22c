"""The numbers that decide what is wrong with a recording, each with its unit, its meaning and what it rests on.

How far each may move before a test of the recordings fails: ``python -m tests.house.margins recordings``. One that may be half and twice as
large is a plain constant.
"""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.limit import Limit, calibrated

ROUNDING = Limit(1e-12, "share of the largest value", "a smaller change is the rounding of a number", "derived", "doubles have 16 digits")
EQUAL = Limit(1e-9, "share", "two numbers of a file, or two units, that differ by less are one", "derived", "files have 9 digits at most")


@dataclass(frozen=True)
class MotionLimits:
    """When a channel moves, when two show one motion, and when one of them has a wrong scale or stands in the wrong column."""

    moves: float = 0.05
    """Share of the span: a channel that moves does so by more."""
    moves_noise: float = 6.0
    """Noise levels: and by more than so many of these."""
    alike: Limit = calibrated(
        0.9, "correlation", "two channels that should show one motion and are as alike do", "no test is lost from 0.8 to 0.92, some at 0.95"
    )
    exact: float = 0.999
    """Correlation: as alike, a factor that no unit explains is one of scale too."""
    loosely: float = 0.5
    """Correlation: below this two channels have nothing to do with each other."""
    smaller: Limit = calibrated(
        0.6,
        "factor",
        "a channel that shows this share of another is at least off by a diameter or a gear",
        "no test is lost from 0.5 to 0.8, some at 0.2",
    )
    larger: Limit = calibrated(
        1.6,
        "factor",
        "a channel that shows this many times another is at least off by a diameter or a gear",
        "no test is lost from 1.28 to 3.2, some at 0.8",
    )
    rougher: float = 5.0
    """Times the noise: a reference with more noise than its sensor is a sensor."""
    coarse_feed: float = 2.0
    """Depths of cut: a feed above this, which is large too, is the depth of cut."""
    least_cut: int = 20
    """Samples of a cut from which its forces are looked at."""
    same_jump: Limit = calibrated(
        0.5, "share", "two channels jump by the same way within this factor, up and down", "no test is lost from 0.375 to 0.75, some at 0"
    )


@dataclass(frozen=True)
class FrozenLimits:
    """When values that repeat are those of a lost source, and when those of a machine at rest."""

    longer: float = 8.0
    """Usual runs: a run of equal values is looked at from this length on."""
    runs: int = 10
    """Runs from which on one is usual, the longest five left out."""
    comes_again: Limit = calibrated(
        1.5,
        "lengths of the run",
        "an extreme value that comes so often is an end of the way",
        "no test is lost from 1.2 to 3, some at 0.75",
    )
    gone: float = 0.003
    """Share of the span: a partner that goes on by more shows that a channel stands."""
    after: int = 20
    """Samples beside a run that are looked at."""
    leap: float = 8.0
    """Steps after: a channel that catches up by so large a step was frozen."""
    noise: float = 10.0
    """Noise levels: a step that is no noise is larger."""
    resting: float = 0.2
    """Share of the samples: a channel that moves repeats its value in fewer."""
    jump: float = 5.0
    """Usual steps: a step that a motion does not make is larger."""
    alive: Limit = calibrated(
        0.3,
        "share of the samples",
        "a noisy channel repeats its value in fewer, and turns round in more",
        "no test is lost from 0.15 to 0.375, some at 0.6",
    )
    least_noise: int = 100
    """Samples around a run from which its noise is known."""


@dataclass(frozen=True)
class ClippedLimits:
    """When a channel was cut off at a level beyond which its partner goes on."""

    inner: int = 50
    """Samples between both ends from which a channel may be clipped."""
    beyond: float = 0.01
    """Share of the span: the partner of a clipped channel goes on by more."""
    spread: float = 2.0
    """Differences of the two: and by more than so many of these."""


@dataclass(frozen=True)
class JumpLimits:
    """When a step of all channels is a loss of rows, a fall of a counter, or the seam of a copy."""

    noise: float = 6.0
    """Noise levels: a jump is larger than its surroundings by so many."""
    beside: float = 1.5
    """Steps beside: a jump is larger than the step before and after it."""
    usual: float = 0.2
    """Usual steps: a jump is larger."""
    sudden: float = 5.0
    """Usual changes of a step: a jump is more sudden."""
    fall: float = 0.6
    """Share of the span: a counter that runs over falls by more, and lost rows by less."""
    falls: float = 0.05
    """Share of the steps: what falls more often is no counter."""
    evenly: float = 3.0
    """Times: a counter moves on after a fall as before, within this factor."""
    half: Limit = calibrated(
        0.25,
        "share of the span",
        "the middle half of a counter's range, about its centre",
        "no test is lost from 0.2 to 0.5, some at 0.125",
    )
    passes: Limit = calibrated(
        0.2,
        "share of the samples",
        "a counter spends more in the middle half; what only swings does not",
        "no test is lost from 0.1 to 0.25, some at 0.4",
    )
    copy: float = 0.9
    """Share of the distance: a block that is written twice is as whole."""
    least_copy: int = 20
    """Rows of a block that is written twice at least."""
    listed: int = 5
    """Places of jumps that a sentence names."""


@dataclass(frozen=True)
class ClockLimits:
    """When the times of rows start anew, are rounded, or run at another speed, or rows were written twice."""

    skew: float = 10.0
    """Scatter of the shifts: a shift that grows by more is the skew of a clock."""
    back: float = 10.0
    """Usual steps: a clock that goes back by more starts anew; by less the rows are out of order."""
    restarts: int = 20
    """Restarts up to which the longest stretch is kept."""
    share: float = 1e-3
    """Share of the rows: of a long file as many may be restarts."""
    shared: float = 0.8
    """Share of the rows: times with fewer values are rounded, and rows share them."""
    fewest: int = 3
    """Values of rounded times from which a period is known."""
    rounded: Limit = Limit(1.01, "quanta", "rounded times lie this near an even clock", "derived", "rounding moves a time by one quantum")


@dataclass(frozen=True)
class SpikeLimits:
    """When single samples far away are slips of a logger."""

    least: int = 100
    """Samples from which spikes are looked for."""
    apart: float = 0.2
    """Share of how far away: the samples on both sides of a spike agree within this."""
    regular: float = 0.1
    """Share of the distance: spikes that come as evenly belong to the machine."""
    most: int = 3
    """Spikes up to which nothing is said of their order, and that any file may have."""
    share: float = 1e-3
    """Share of the samples: of a long file as many may be spikes."""


@dataclass(frozen=True)
class ReadingLimits:
    """How a file of unknown form is read."""

    numeric: Limit = calibrated(
        0.3, "share of the cells", "a table of numbers has more of them", "no test is lost from 0.15 to 0.375, some at 0.6"
    )
    column: float = 0.5
    """Share of the lines: a single column of numbers has more of them."""
    matrix: int = 64
    """Columns of a matrix that each get a name."""
    depth: int = 12
    """Groups within groups that are looked through."""
    controls: int = 3
    """Control characters that a text may have; a binary file has more."""
    unit: int = 20
    """Letters of a unit at most."""
    named: int = 8
    """Names that a sentence lists."""


MOTION, FROZEN, CLIPPED, JUMPS = MotionLimits(), FrozenLimits(), ClippedLimits(), JumpLimits()
CLOCK, SPIKES, READING = ClockLimits(), SpikeLimits(), ReadingLimits()
