"""Curves of records and the lines of a plot: scaled, thinned, named, and what stands along them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from lathesim.analysis.display_unit import display_unit, plain_name, pretty_quantities, pretty_unit, read_as, shown_with_unit
from lathesim.analysis.metric import find_channel
from lathesim.component import ON
from lathesim.errors import LatheSimError, RecordError
from lathesim.record import FloatArray, Record
from lathesim.units import from_si, in_unit

MILLIMETRES, MICROMETRES = from_si(1.0, "mm"), from_si(1.0, "um")
"""Of a metre."""


def envelope(time: FloatArray, values: FloatArray, columns: int) -> tuple[FloatArray, FloatArray]:
    """Return time and values with at most two points a column, in order of time; both (points,), a short curve as it is."""
    count = len(time)
    if count <= 2 * columns or columns < 1:
        return time, values
    size = -(-count // columns)
    blocks = np.pad(values, (0, columns * size - count), mode="edge").reshape(columns, size)
    begin = np.arange(columns) * size
    index = np.concatenate([[0], begin + np.argmin(blocks, axis=1), begin + np.argmax(blocks, axis=1), [count - 1]])
    index = np.unique(np.minimum(index, count - 1))
    return time[index], values[index]


BoolArray = npt.NDArray[np.bool_]
_MOST_POINTS = 4000
"""Largest number of points drawn of a line (assumed)."""
_FEWEST_SAMPLES = 8
"""Samples below which there is no spectrum (assumed)."""


@dataclass(frozen=True)
class Curve:
    """A channel of a record, with the words for the legend; ``until`` bounds the samples shown."""

    record: Record
    channel: str
    title: str = ""
    until: int | None = None
    run: str = ""
    """Name of the run if several runs are shown."""
    only: FloatArray | None = None
    """Values (samples,); only samples with a value above 0.5 are drawn."""


@dataclass(frozen=True)
class PlotLine:
    """Points of any two quantities, both in the units of their axes; ``title`` names the line."""

    x: FloatArray
    y: FloatArray
    title: str

    def within(self, low: float, high: float) -> PlotLine:
        """Return the part from the first to the last point that lies between two ends of the axis along, and a point on either side."""
        inside = np.flatnonzero((self.x >= low) & (self.x <= high))
        if not len(inside):
            return self
        part = slice(max(0, inside[0] - 1), inside[-1] + 2)
        return replace(self, x=self.x[part], y=self.y[part])

    def points(self, columns: int) -> tuple[FloatArray, FloatArray]:
        """Return the points to draw; peaks are kept if x never decreases."""
        usable = np.isfinite(self.x) & np.isfinite(self.y)
        x, y = self.x[usable], self.y[usable]
        if len(x) and bool((np.diff(x) >= 0.0).all()):
            return envelope(x, y, columns)
        stride = max(1, len(x) // _MOST_POINTS)
        return x[::stride], y[::stride]


def said_once(labels: Sequence[tuple[str, str]]) -> tuple[str, list[str]]:
    """Return the common label and the name of each curve: curves of one quantity share the label and are named by their run."""
    if len(labels) > 1 and len({label for label, _ in labels}) == 1 and all(run for _, run in labels):
        return labels[0][0], [run for _, run in labels]
    return "", [f"{label} {run}".rstrip() for label, run in labels]


def power_beside(largest: float, own: float, units: set[str]) -> float:
    """Return the power of ten by which a curve in another unit is scaled to the size of the others."""
    return 1.0 if len(units) < 2 or largest <= 0.0 or own <= 0.0 else float(10.0 ** math.floor(math.log10(largest / own)))


def range_of(values: Sequence[FloatArray]) -> tuple[float, float] | None:
    """Return the smallest and the largest value of several arrays; None where none is finite."""
    finite = [item[np.isfinite(item)] for item in values]
    lows, highs = [float(item.min()) for item in finite if len(item)], [float(item.max()) for item in finite if len(item)]
    return (min(lows), max(highs)) if lows else None


@dataclass(frozen=True)
class Scaled:
    """A curve over time [s]: ``values`` [SI] over ``scale``; ``low`` and ``high`` [``unit``] bound the visible part."""

    time: FloatArray
    values: FloatArray
    scale: float
    unit: str
    low: float
    high: float

    def times(self, power: float) -> Scaled:
        """Return the curve drawn ``power`` times as high."""
        return replace(self, scale=self.scale / power, low=self.low * power, high=self.high * power)

    def within(self, low: float, high: float) -> Scaled:
        """Return the samples between two times [s], and one on either side."""
        part = slice(max(0, int(np.searchsorted(self.time, low)) - 1), int(np.searchsorted(self.time, high, side="right")) + 1)
        return replace(self, time=self.time[part], values=self.values[part])

    def points(self, columns: int) -> tuple[FloatArray, FloatArray]:
        """Return time and values for drawing, thinned to ``columns``."""
        time, values = envelope(self.time, self.values, columns)
        return time, values / self.scale


def scaled(curves: Sequence[Curve], *, fit_to_feed: bool) -> list[tuple[Curve, Scaled]]:
    """Return curves in their display units; those of one channel share a unit, and those without a finite value are left out."""
    found = []
    for curve in (curve for curve in curves if curve.channel in curve.record):
        values, time = curve.record[curve.channel][: curve.until], curve.record.time[: curve.until]
        if curve.only is not None:
            values = np.where(curve.only[: curve.until] > ON, values, np.nan)
        finite = np.isfinite(values)
        seen = values[_to_be_seen(curve, finite, fit_to_feed)]
        if len(seen):
            if curve.only is not None:
                time, values = time[finite], values[finite]
            found.append((curve, Scaled(time, values, 1.0, curve.record.unit(curve.channel), float(seen.min()), float(seen.max()))))
    largest: dict[str, float] = {}
    for curve, item in found:
        largest[curve.channel] = max(largest.get(curve.channel, 0.0), abs(item.low), abs(item.high))
    return [(curve, _in_unit(item, *display_unit(read_as(curve.channel, item.unit), largest[curve.channel]))) for curve, item in found]


def _in_unit(item: Scaled, factor: float, unit: str) -> Scaled:
    return Scaled(item.time, item.values, factor, unit, item.low / factor, item.high / factor)


def _to_be_seen(curve: Curve, finite: BoolArray, fit_to_feed: bool) -> BoolArray:
    """Return the samples that bound the axis: those in the cut, or else those in blocks at feed, if they are recorded."""
    for sign in ("engaged", "cutting_block") if fit_to_feed else ():
        name = find_channel(curve.record, sign)
        there = finite & (curve.record[name][: curve.until] > ON) if name is not None else finite
        if name is not None and there.any():
            return there
    return finite


@dataclass(frozen=True)
class Look:
    """``dash``: dots set and dots left out in turn; ``mark``: the same in three characters; the colours on a dark and a light ground."""

    dash: tuple[int, int]
    mark: str
    on_dark: str
    on_light: str

    def colour(self, is_dark: bool) -> str:
        """Return the colour for the ground."""
        return self.on_dark if is_dark else self.on_light


_WHOLE, _DASHED, _DOTTED = ((1, 0), "⠒⠒⠒"), ((5, 4), "⠒⠂⠐"), ((1, 2), "⠂⠐⠂")
LOOKS = (
    Look(*_WHOLE, "#4ade80", "#15803d"),
    Look(*_DASHED, "#fbbf24", "#b45309"),
    Look(*_DOTTED, "#22d3ee", "#0e7490"),
    Look(*_WHOLE, "#e879f9", "#a21caf"),
    Look(*_DASHED, "#f87171", "#b91c1c"),
    Look(*_DOTTED, "#93c5fd", "#1d4ed8"),
)
"""Looks of the first six curves; later ones begin again."""


def look_of(place: int) -> Look:
    """Return the look of a curve by its place among those drawn."""
    return LOOKS[place % len(LOOKS)]


def figure_title(runs: Sequence[tuple[str, Record]]) -> str:
    """Return lesson and case of one run, or of several runs with their numbers: ``Servo control: 002 case II, 001 case I``."""
    from lathesim.lessons.grading import lesson_title

    lessons = {title: lesson_title(record) or title for title, record in runs}
    cases = {title: _case(record) for title, record in runs}
    if len(runs) == 1:
        return ", ".join(word for title in lessons for word in (lessons[title], cases[title]) if word)
    if len(set(lessons.values())) == 1:
        return f"{next(iter(lessons.values()))}: " + ", ".join(f"{title} {cases[title]}".rstrip() for title in lessons)
    return "; ".join(f"{title} {lessons[title]}, {cases[title]}".removesuffix(", ") for title in lessons)


def _case(record: Record) -> str:
    """Return the variant of a run and what was set beside it."""
    variant, changes = str(record.meta.get("variant", "")), str(record.meta.get("overrides", ""))
    return " ".join(word for word in (f"case {variant}" if variant else "", f"({changes})" if changes else "") if word)


def path_lines(runs: list[tuple[str, Record]]) -> list[PlotLine]:
    """Return the reference path and the path of the tool tip of each run: Z and X as a radius [mm]."""
    from lathesim.tui.drawing.lathe_picture import ToolMotion

    lines: list[PlotLine] = []
    for title, record in runs:
        motion = ToolMotion.of(record)
        if motion is None:
            continue
        if not lines:
            lines.append(PlotLine(motion.z_reference * MILLIMETRES, motion.x_reference * MILLIMETRES, "reference"))
        lines.append(PlotLine(motion.z * MILLIMETRES, motion.x * MILLIMETRES, title))
    return lines


def wave_lines(runs: list[tuple[str, Record]]) -> list[PlotLine]:
    """Return the waves that the last turn of each run left around the part: angle [deg] and height [um]."""
    from lathesim.analysis.turned_part import waves_on_part

    lines = []
    for title, record in runs:
        try:
            waves = waves_on_part(record, turns=1)
        except LatheSimError:
            continue
        name = f"{title}, R_a {pretty_quantities(in_unit(waves.roughness, 'um', '.3g'))}"
        lines.append(PlotLine(np.degrees(waves.angle), MICROMETRES * waves.height[-1], name))
    return lines


def surface_lines(runs: list[tuple[str, Record]]) -> list[PlotLine]:
    """Return the roughness along the part of each run: Z [mm] and R_a [um]."""
    from lathesim.analysis.turned_part import roughness_along

    lines = []
    for title, record in runs:
        try:
            surface = roughness_along(record)
        except LatheSimError:
            continue
        if len(surface.z):
            lines.append(PlotLine(np.asarray(surface.z) * MILLIMETRES, np.asarray(surface.roughness) * MICROMETRES, title))
    return lines


def spectrum_lines(curves: Sequence[Curve], span: tuple[float, float] | None) -> list[PlotLine]:
    """Return the amplitudes of curves over the frequency [Hz], of the samples within ``span`` [s]; the title names the unit.

    The mean is taken off, and a Hann window holds the ends down: a sine of amplitude 1 has a peak of 1.
    """
    lines = []
    for curve in curves:
        if curve.channel not in curve.record:
            continue
        record = curve.record.between(*span) if span is not None else curve.record
        values = record[curve.channel]
        values = values[np.isfinite(values)]
        if len(values) < _FEWEST_SAMPLES:
            continue
        window = np.hanning(len(values))
        amplitude = 2.0 * np.abs(np.fft.rfft((values - values.mean()) * window)) / window.sum()
        frequency = np.asarray(np.fft.rfftfreq(len(values), record.sample_period), dtype=np.float64)
        factor, name = display_unit(read_as(curve.channel, record.unit(curve.channel)), float(amplitude[1:].max()))
        title = f"{curve.title or plain_name(curve.channel)} [{pretty_unit(name) or '1'}] {curve.run}".rstrip()
        lines.append(PlotLine(frequency[1:], amplitude[1:] / factor, title))
    return lines


def peak_words(line: PlotLine) -> str:
    """Return where a line is highest, over a frequency [Hz]."""
    peak = int(np.argmax(line.y))
    return f"{line.title}: largest {line.y[peak]:.3g} at {line.x[peak]:.4g} Hz"


def overlaid(runs: Sequence[tuple[str, Record]], channels: Sequence[str]) -> Record:
    """Return one record with the channels of all runs, ``(title, record)``; a single run keeps its names.

    With several, a channel is called ``channel (title)`` and the values of the later runs are interpolated to the instants of the longest.
    Raises :class:`RecordError` where no run has any of the channels.
    """
    if not runs or not any(name in record for _, record in runs for name in channels):
        raise RecordError("there is nothing to draw.", remedy="Choose a run and a channel it has.")
    if len(runs) == 1:
        _, record = runs[0]
        return Record(record.time, {name: record.channel(name) for name in channels if name in record}, dict(record.meta))
    longest = max((record for _, record in runs), key=lambda record: record.time[-1] if len(record) else 0.0)
    found = Record(longest.time, {}, dict(longest.meta))
    for title, record in runs:
        for name in channels:
            if name in record:
                values = np.interp(longest.time, record.time, record[name], right=np.nan)
                found = found.with_channel(f"{name} ({title})", record.unit(name), values, record.channel(name).description)
    return found


def contact(record: Record) -> FloatArray | None:
    """Return where tool and part touch in a block run at feed (1 or 0, (samples,)); None where the record does not tell."""
    name = find_channel(record, "engaged", "in_contact")
    return record[name] if name is not None else None


def value_at(record: Record, channel: str, time: float) -> float:
    """Return the value of a channel at the sample nearest to ``time`` [s]; NaN beyond the record."""
    if channel not in record or not len(record) or not record.time[0] <= time <= record.time[-1] + record.sample_period:
        return float("nan")
    place = int(np.searchsorted(record.time, time))
    place = min(place, len(record) - 1)
    if place > 0 and time - record.time[place - 1] < record.time[place] - time:
        place -= 1
    return float(record[channel][place])


@dataclass(frozen=True)
class Cursors:
    """The cursor that moves and the one that stays, both times [s]; None where there is none."""

    place: float | None = None
    mark: float | None = None

    def at(self, place: float) -> Cursors:
        """Return the cursors with the first one at another place."""
        return replace(self, place=place)

    def marked(self) -> Cursors:
        """Return the cursors with the second one where the first is, or without it."""
        return replace(self, mark=self.place if self.mark is None else None)

    @property
    def span(self) -> tuple[float, float] | None:
        """The time between the cursors [s]; None where there are not two, or both at one place."""
        if self.place is None or self.mark is None or self.place == self.mark:
            return None
        return min(self.place, self.mark), max(self.place, self.mark)

    @property
    def words(self) -> str:
        """Where the cursors stand, or how to move them."""
        if self.place is None:
            return "Cursor: , and . or a click; m sets a second one. Zoom: + and -, pan: arrows."
        if self.mark is None:
            return f"t = {self.place:.4g} s"
        apart = self.place - self.mark
        rate = f" ({1.0 / abs(apart):.4g} Hz)" if apart else ""
        return f"t = {self.place:.4g} s, Δt = {pretty_quantities(shown_with_unit(apart, 's'))}{rate} from {self.mark:.4g} s"

    def value_words(self, record: Record, channel: str) -> str:
        """Return the value of a channel at the first cursor, and by how much it differs from that at the second; empty without a value."""
        value, before = (value_at(record, channel, place) if place is not None else math.nan for place in (self.place, self.mark))
        unit = read_as(channel, record.unit(channel))
        texts = [pretty_quantities(shown_with_unit(item, unit)) for item in (value, value - before)]
        return "" if not math.isfinite(value) else f": {texts[0]}" + (f", Δ {texts[1]}" if math.isfinite(before) else "")
