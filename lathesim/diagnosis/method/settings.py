"""Settings of the search: where it begins, the grids that it walks, and what it may spend. They decide no answer, but by what is found."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class CandidateSettings:
    """Which starting points of candidates are tried."""

    strongest_lines: int = 1
    """Strongest lines of a periodogram that become starting points."""
    prominent_lines: int = 2
    """Lines that stand out most that become starting points."""
    least_turns: float = 2.0
    """How often the longest wave of a geometry that is looked for repeats within the recording."""
    least_turns_of_force: float = 5.0
    """The same of a force, as other slow forces are there too."""
    other_geometry: float = 10.0
    """Factor by which the wavelength of a geometry may be longer or shorter than typical."""
    beyond_typical: float = 1.3
    """Factor by which a wavelength may lie outside the typical range."""
    slow_steps: float = 0.25
    """Quantile of the ways from one sample to the next that stands for slow motion."""
    most_bins: int = 1 << 18
    """Bins of a periodogram along a place at most."""
    line_spread: int = 8
    """Places of a padded periodogram on each side that belong to one line."""
    shortest_stretch: int = 64
    """Places of the shortest stretch over which the surroundings of a line are taken; they grow with the wave number."""
    stretches: int = 40
    """Such stretches."""
    waves_along_all: tuple[float, ...] = (1.0, 1.5, 2.0, 3.0)
    """Waves in the whole way that are tried besides: so few are no line of a periodogram, and its trend takes a part of them."""
    resonances: int = 10
    """Frequencies of a resonance that are tried within the usual range; as many an octave below it."""
    least_swings: float = 4.0
    """Swings of the slowest resonance that is looked for within a recording."""
    usual_quantiles: tuple[float, ...] = (0.3, 0.85)
    """Quantiles of the usual values of a resonance that are tried: a small one and a large one."""
    limits_reached: tuple[float, ...] = (0.995, 0.98, 0.95, 0.85)
    """Shares of the samples in which a command is below where a limit is looked for ..."""
    limits_of_largest: tuple[float, ...] = (0.9, 0.75, 0.6, 0.45)
    """... and shares of its largest value: a command in steps is at its largest for long."""
    least_driving: float = 0.01
    """Share of the largest voltage beside the back EMF from which on limits of it are tried."""
    limits_tried: int = 12
    """Limits of that voltage, and of the rate of a command, that are tried."""
    null_draws: int = 20
    """Draws of noise from which the null maximum is taken."""
    fastest_resonance: float = 0.2
    """Frequency up to which a resonance is looked for [cycles a sample]."""
    latest_reading: float = 0.1
    """Delay up to which a late reading is looked for [s]."""


@dataclass(frozen=True)
class ExplainingSettings:
    """How many candidates are fitted, from how many beginnings, and how far."""

    fitted_at_once: int = 5
    """Candidates that are fitted at once."""
    batches: int = 3
    """Batches of them, until one predicts better."""
    hopeless: float = 0.1
    """Share of the best screening gain below which a candidate is not fitted."""
    rival: float = 0.4
    """Share of the best screening gain from which on a candidate is fitted in the first batch."""
    near: float = 0.6
    """Share of the best gain from which on a trial is fitted until nothing moves."""
    starts: int = 2
    """Fits of a candidate that are begun."""
    sizes: tuple[float, ...] = (1.0, 0.3)
    """Shares of the size that screening gives an effect, from which a fit may begin."""
    points: int = 6
    """Usual values from which a fit may begin."""
    starts_of_simulation: int = 6
    """The same two where the error of the simulation is fitted."""
    points_of_simulation: int = 40
    steps: int = 6
    """Steps of a first fit."""
    steps_of_simulation: int = 25
    moved: float = 1.0
    """Declared deviations from which on values of the lesson may have been drawn away by what an effect explains."""
    clearly: float = 0.7
    """Share of the power that the next start leaves below which a start is the only one."""
    apart: float = 0.3
    """Relative difference of a value by which two starts are different ones."""
    whole_order: float = 0.002
    """Standard deviation of a fitted order about its whole number [orders]."""
    fine: float = 1e-5
    """Share of the cost below which a step of a fit ends it."""
    settled: float = 1.0
    """Gain below which a further round of a fit is not made [nats]."""
    value_wider: float = 10.0
    """Times its declared deviation that a value is released."""


@dataclass(frozen=True)
class DiscoverySettings:
    """Which formulas are tried for what no effect explains."""

    smoothed_reversal: float = 0.02
    """Share of the top speed over which a step at a reversal is smoothed."""
    most_columns: int = 8
    """Columns of a formula at most."""
    waves: int = 400
    """Waves among which the strongest one is looked for."""
    most_points: int = 4000
    """Samples of a signal that are looked at for that."""
    most_groups: int = 3
    """Groups of columns in a formula at most."""
    ends: float = 0.06
    """Share of the recording that is left out at either end, where the missing force is tapered."""


@dataclass(frozen=True)
class CheckSettings:
    """Which faults of a recording are tried."""

    change_blocks: int = 16
    """Blocks of a recording between which a step is looked for ..."""
    change_edge: int = 2
    """... but for so many at either end."""
    scale_step: float = 0.001
    """Share by which scales that are tried differ ..."""
    scale_steps: int = 200
    """... and how many of them on each side of one."""
    law_lags: tuple[int, ...] = (0, 1, 2, 3, 5, 8, 12, 18, 26, 36, 50, 70)
    """Samples back to which another law of a controller may look."""
    change_of_delay: int = 25
    """Samples by which a channel that becomes late or early is looked for."""
    shift_looked_for: float = 3.0
    """Samples by which a shifted channel is looked for."""
    value_factor: float = 4.0
    """Factor up to which another value is looked for, larger or smaller."""
    clock_factors: tuple[float, ...] = (0.5, 2.0, 0.8, 1.25, 0.1, 10.0, 1e-3, 1e3)
    """Factors between the true period and the recorded one that are tried: clocks of other devices, and seconds for milliseconds."""


@dataclass(frozen=True)
class IsolationSettings:
    """Which sizes of effects are tried, to say from which on a recording shows them, and which rivals are fitted to each."""

    shapes: int = 3
    """Shapes of each effect: periods, speeds and frequencies over their usual range."""
    smallest_size: float = 1e4
    """Times smaller than usual that the smallest size is."""
    lowest_limit: float = 30.0
    """Times lower than the largest command that the lowest limit is."""
    steps: int = 5
    """Sizes that are tried at most ..."""
    precision: float = 0.1
    """... until two differ by less than this share."""
    far_below: float = 0.01
    """Ratio to what shows an effect below which its size grows as if it were that."""
    rounds: int = 3
    """How often the noise of a model that lacks an effect is taken anew: as often as where a diagnosis fits the lesson alone."""
    at_once: int = 48
    """Runs whose channels are held in memory by one worker."""
    beyond: float = 10.0
    """Times its smallest visible size at which an effect is held against its rivals."""
    rivals: int = 6
    """Rivals of an effect that are fitted to it, those that promise most ..."""
    promise: float = 0.7
    """... and by their shape at least this share of what it does. Of 129 rivals with 0.4 and more 14 were tied, the least with 0.84."""
