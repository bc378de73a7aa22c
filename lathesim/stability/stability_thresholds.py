"""The numbers that decide what a vibration is, each with its unit, its meaning and what it rests on.

The sides of a calibration were tried on the tuning half of the rigs: ``python -m tests.house.margins stability``. A number that may be half
and twice as large is a plain constant.
"""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.limit import Limit, calibrated, derived

ASSUMED = "chosen on simulated cuts of the tuning half of the rigs; the margin was not recorded"


def _assumed(value: float, unit: str, meaning: str, evidence: str = ASSUMED) -> Limit:
    return Limit(value, unit, meaning, "assumed", evidence)


@dataclass(frozen=True)
class LineLimits:
    """What counts as a line of a spectrum."""

    out_of_noise: Limit = _assumed(14.0, "power of the noise around", "a narrow line has at least this power")
    hump_out_of_noise: Limit = _assumed(3.0, "power around", "a broad hump has at least this power")
    widest_hump: Limit = calibrated(
        0.5, "share of its frequency", "what is wider is noise of the cut and no hump", "no case is lost from 0.375 to 0.75, some at 0"
    )
    least_share: Limit = _assumed(5e-4, "share of the power", "a line below this is left out")
    wide: float = 0.002
    """Share of its frequency: a wider line is none of a steady vibration."""
    samples: float = 8.0
    """Samples a turn: with fewer no line of a turn shows."""
    below: float = 0.6
    """Of its lower edge: from here to a band lies noise."""
    above: float = 1.6
    """Of its upper edge: and from a band to here."""
    hump_edge: float = 0.25
    """Share of the top: a hump reaches as far as it has more."""
    reach: int = 60
    """Lines of the spectrum to which one line reaches to either side at most."""
    mean_counts: float = 0.2
    """Standard deviations: a smaller mean is that of no force: it tells nothing of contact."""


@dataclass(frozen=True)
class OrderLimits:
    """What the order of a line is, and whether it moves with the speed."""

    lowest_order: Limit = _assumed(0.45, "orders", "below this the feed and the shape of the part show, and nothing is looked at")
    whole: Limit = _assumed(0.035, "orders", "an order is a whole or half number within this at most, plus the resolution of the spectrum")
    whole_at_zero: Limit = _assumed(0.012, "orders", "the same for low orders")
    whole_each: Limit = _assumed(0.0008, "orders for each order", "by this it widens: a speed is known by its share")
    not_whole: Limit = _assumed(0.06, "orders", "an order further from a whole number is said to be none")
    fewest_turns: Limit = calibrated(6.0, "turns", "a recording with fewer shows no orders", "no case is lost from 6 to 12, some at 4.8")
    mains_near: Limit = _assumed(
        0.004, "share of its frequency", "hum is this near a multiple of the mains frequency", "grids keep to 0.4 %"
    )
    speed_reach: Limit = _assumed(0.004, "share of the speed", "a speed that was told is right within this: under load it falls by less")
    speed_sure: Limit = derived(
        8.0, "nats", "another speed has to gain this", "the power of chance in the mean of turns, each one observation, gains 1 or 2"
    )
    moved: Limit = _assumed(0.012, "share of its frequency", "a line moved with the speed, or stayed, within this")
    stayed: float = 4.0
    """Times how far a line moves: a line that has moved with the speed leaves nothing within this."""
    something: float = 1e-3
    """Share of the power: what is left where a line was counts from here on."""


@dataclass(frozen=True)
class RepeatLimits:
    """What repeats itself from turn to turn, and what is steady."""

    keeps: Limit = calibrated(
        0.955, "coherence", "a band that keeps more over two turns repeats itself", "chatter keeps 0.98 and more, shaken modes at most 0.94"
    )
    order_keeps: Limit = calibrated(
        0.75, "coherence", "lines at whole or half orders keep at least this", "those of a flip in sound keep 0.8, chance less"
    )
    steady: Limit = derived(
        0.33, "variation of the envelope", "an amplitude that varies less is steady", "between chatter, at most 0.25, and 0.52 by Rayleigh"
    )
    errors: Limit = derived(3.0, "standard errors", "an amplitude that varies by so much less than noise is steady", "one in a thousand")
    impulsive: Limit = derived(
        5.0, "standard errors", "prediction errors further from Gaussian ones come of breaks or knocks", "one in a million by chance"
    )
    least_damping: Limit = calibrated(
        0.00135,
        "damping ratio",
        "a stable cut leaves a mode at least this",
        "it is 0.003 and more, and chatter looks like 0.0005 to 0.0013",
    )
    by_chance: Limit = derived(1e-4, "probability", "a growth less likely than this is none of noise", "F distribution of two powers")
    one_turn: float = 1.5
    """Shares of one turn: half orders that repeat hold more than chance gives one turn of all."""
    repeated: Limit = _assumed(0.005, "share of the power", "half orders that repeat with alternating sign hold more")


@dataclass(frozen=True)
class ShortLimits:
    """What is too short to tell: nothing is said of it."""

    ringing: int = 16
    """Blocks of a recording in which a ringing is looked for."""
    turns: int = 4
    """Turns whose mean is worth anything."""
    of_a_turn: int = 24
    """Samples of a turn in which a ringing is looked for."""
    band: int = 4
    """Lines of a band."""
    bins: int = 5
    """Bins among which one is a hump."""
    beyond: int = 8
    """Values of a band beyond the turns that are compared."""
    first_poles: int = 64
    """Frequencies of a response from which single lines can be left out to judge on."""
    hits: int = 3
    """Hits from which each can be left out in turn to judge on."""
    samples: int = 64
    """Samples of a recording of hits, and of each hit in it."""
    quiet_lines: int = 8
    """Lines from which the noise of the response is known."""


@dataclass(frozen=True)
class RecordedCutLimits:
    """When a recording of a cut begins, ends and turns."""

    pulses: int = 4
    """Rises of a tachometer from which its period is known, less one."""
    shorter: float = 0.6
    """Of the correlation: a shorter period that is as much alike is that of a pulse."""
    same_pulse: float = 0.3
    """Turns: a rise so soon after another one is the same pulse."""
    even: float = 0.06
    """Share of a turn: turns differ by less; other gaps are lost pulses."""
    windows: int = 8
    """Windows that a recording, and the cut in it, hold at least."""
    stands_out: Limit = _assumed(3.0, "standard deviations", "a force rises by more where the cut begins")
    idle: float = 0.3
    """Share of the force: before the cut there is less."""
    settles: int = 20
    """Windows within which a cut settles."""


@dataclass(frozen=True)
class TapLimits:
    """What is odd about a hit, and where its pulse lies."""

    bandwidth: float = 0.4
    """Of the sample rate: a mode above it cannot be seen: the filter of a logger takes it."""
    noise: Limit = calibrated(6.0, "noise levels", "a pulse is louder", "no case is lost from 4.8 to 12, some at 3")
    ring: float = 1e-5
    """Share of the peak: the ringing of a filter is followed to this."""
    near: float = 0.02
    """Share of the record: a pulse lies within this of its top."""
    least_near: int = 64
    """Samples around its top in which a pulse lies in any case."""
    quiet: int = 16
    """Samples before a hit from which its zero and noise are known."""
    values: float = 4e6
    """Samples of a record that are simulated at most."""
    shortest: float = 0.05
    """S: no response of a machine dies out sooner."""
    uneven: float = 1.5
    """Usual steps: times with a longer step have a gap."""
    hit: float = 0.25
    """Share of the largest: a hit is stronger."""
    by_force: float = 0.3
    """Share of the scatter: the noise of the response shows where that of the force makes less."""
    apart: float = 0.015
    """Share of the frequency: two starting points of modes lie further apart."""


@dataclass(frozen=True)
class MapLimits:
    """When a point of a stability map is taken for what."""

    same_speed: float = 0.01
    """Share of the speed: two cuts that differ by less were made at one speed."""
    few_left: float = 0.6
    """Of the particles: with more that count none is drawn anew."""
    lowest: float = 0.5
    """Natural frequencies: roots of a regenerative cut lie above."""
    highest: float = 6.0
    """Natural frequencies: and below: higher ones are damped more."""
    widest: float = 3.0
    """Of the value: a lesson may call a value uncertain by less."""
    counts: Limit = _assumed(0.05, "of the lowest limit", "a mode whose limit is this far above does not decide")
    flip: Limit = _assumed(1e-3, "of the multiplier", "one as near the negative real axis is a flip")
    steady: Limit = _assumed(3.0, "standard errors", "a response that ends higher does not fall at its end")
    snapshots: int = 6
    """Turns from which a growth is known."""


ROUNDING_OF_A_FILE = Limit(1e-12, "share of the largest value", "a smaller part is rounding", "derived", "doubles have 16 digits")
ROUNDING = Limit(1e-9, "share", "two numbers that differ by less are equal", "derived", "sums here lose six of 16 digits")


@dataclass(frozen=True)
class ShareLimits:
    """How large something must be to decide."""

    forced: Limit = calibrated(
        0.35,
        "share of the power",
        "more at whole orders is forced, where no mean tells how much of the cut it is",
        "no case is lost from 0.175 to 0.438, some at 0.7",
    )
    forced_force: Limit = calibrated(
        0.06, "share of the mean force", "whole orders of this amplitude are forced: a run-out of 6 % of the feed",
        "0.04 is the most of stable cuts, 0.08 the least of forced ones",
    )  # fmt: skip
    small_force: Limit = calibrated(
        0.03, "share of the mean force", "what varies less and does not grow is the noise of a cut",
        "at most 0.017 in stable cuts, at least 0.05 where chips break in segments",
    )  # fmt: skip
    dominant: Limit = _assumed(0.25, "share of the power", "a line with more decides")
    rest: Limit = _assumed(0.3, "share of the power", "what it is held against is at least this; a ringing hides no growing line with more")
    not_far_below: Limit = _assumed(0.25, "share of the strongest", "a line with more may be the one of the chip")
    flip: Limit = _assumed(0.03, "share of the power", "two half orders with more are a flip")
    flip_lines: int = 3
    """So many half orders are a flip, whatever their share: nothing else makes several that repeat."""
    least_orders: Limit = _assumed(0.01, "share of the power", "a flip has more at whole orders: only an interrupted cut flips")
    least_grown: Limit = _assumed(0.04, "share of the power", "a line that outgrew needs more to stand for what comes")
    leaves_the_cut: Limit = _assumed(0.45, "share of the mean force", "a force that varies more touches 0 in each vibration, about")


@dataclass(frozen=True)
class GrowthLimits:
    """How a vibration begins, grows and dies."""

    grew: Limit = calibrated(
        2.0,
        "times",
        "an amplitude that rises so much from the beginning to the end grew; one over it decayed",
        "no case is lost from 1.6 to 4, some at 1",
    )
    outgrew: Limit = calibrated(4.0, "times", "one that rises so much stands for what comes", "no case is lost from 3.2 to 8, some at 2")
    died: Limit = _assumed(0.12, "share of the first amplitude", "a ringing has less at the end")
    rung_at_first: Limit = calibrated(
        3.5, "times", "the first block of a ringing is so much larger than the later half", "no case is lost from 3.18 to 7, some at 2.8"
    )
    rung_in_a_turn: Limit = _assumed(4.0, "times", "a ringing within a turn falls by so much before the next entry")
    rings_on: Limit = _assumed(0.15, "share of the largest", "it does not rise by more before it has fallen")
    high_order: int = 5
    """Orders from which a turn may ring: run-out, unbalance and the jaws of a chuck make those below."""
    below_a_mode: Limit = _assumed(-0.04, "share of the natural frequency", "chatter lies above this side of its mode")
    above_a_mode: Limit = _assumed(0.45, "share of the natural frequency", "and below this side")


@dataclass(frozen=True)
class FirstSignLimits:
    """When the difference of two turns tells of chatter."""

    alike: Limit = derived(
        0.95, "coherence", "differences that follow each other keep this", "noise keeps a vibration alive that dies out by 5 % a turn"
    )
    growth: Limit = derived(
        1.1, "power a turn", "and grow by this", "5 % of the amplitude, as the coherence asks for; what is steady does not"
    )
    narrow: Limit = _assumed(
        0.5, "share of the power", "a difference has more in the band of a Hopf bifurcation, or in the lines of a flip"
    )
    stands_out: Limit = _assumed(6.0, "median power", "a line of a flip has more")
    fewest_lines: int = 3
    """So many lines carry a flip at least: one alone is always alike."""
    off_order: Limit = _assumed(0.05, "turns", "a multiplier turned by less is a change at whole orders")
    of_force: Limit = _assumed(0.05, "share of the mean force", "a difference of more is no noise of a cut")
    independent: Limit = _assumed(6.0, "values", "a band needs more that are independent: one alone is always coherent")
    checks: int = 3
    """Checks in a row that agree, where no mean tells how large a vibration is."""


LINES, ORDERS, REPEATS, SHARES, GROWTH, SIGN = LineLimits(), OrderLimits(), RepeatLimits(), ShareLimits(), GrowthLimits(), FirstSignLimits()
SHORT, RECORDED, TAP, MAP = ShortLimits(), RecordedCutLimits(), TapLimits(), MapLimits()
