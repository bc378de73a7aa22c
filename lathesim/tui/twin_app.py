"""The twin in the terminal: the machine beside its simulation while it runs, with the difference magnified."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal
from textual.widgets import Footer, Label, ProgressBar, Static

from lathesim.analysis.display_unit import display_unit, pretty_quantities, pretty_unit, shown_with_unit
from lathesim.errors import LatheSimError
from lathesim.live.twin import Twin, TwinLine, TwinStretch
from lathesim.record import FloatArray
from lathesim.tui.drawing.curves import PlotLine
from lathesim.tui.textual_corrections import RepaintingApp
from lathesim.tui.widgets.time_plot import TimePlot

SHOWN = 20.0
"""Seconds of the path that are drawn."""
_POINTS = 2000
"""Points that are kept of them."""
PLACES = 200
"""Places of the way at which the surface is kept."""


@dataclass(frozen=True, eq=False)
class Ways:
    """Where the axes were asked to go, went, and would have gone in the simulation: (axes, points) [SI], with the ``time`` (points,)."""

    time: FloatArray
    reference: FloatArray
    executed: FloatArray
    simulated: FloatArray


class TwinPicture:
    """Keeps what was shown last. ``pairs`` holds for each driven axis the row of the compared channel that measures it."""

    def __init__(self) -> None:
        self.pairs: list[tuple[int, int]] = []
        self._apart: FloatArray | None = None
        self._points = np.zeros((1, 0))
        self._every = 0.0
        self._axes = 0
        self._surface: dict[tuple[int, int], tuple[float, float, float]] = {}
        self._span = [np.inf, -np.inf]

    def take(self, stretch: TwinStretch) -> None:
        """Take what the twin has just done."""
        self._pair(stretch)
        if not self.pairs:
            return
        axes = min(2, len(self.pairs))
        self._axes = axes
        self._every = max(self._every, SHOWN / _POINTS)
        rows = [stretch.reference[driven] for driven, _ in self.pairs[:axes]]
        rows += [stretch.executed[channel] for _, channel in self.pairs[:axes]]
        rows += [stretch.simulated[channel] for _, channel in self.pairs[:axes]]
        table = np.vstack([stretch.time, *rows])
        step = max(1, round(self._every / max(float(np.median(np.diff(stretch.time))), 1e-9))) if len(stretch.time) > 1 else 1
        kept = table[:, ::step]
        joined = kept if self._points.shape[0] != len(kept) else np.concatenate([self._points, kept], axis=1)
        self._points = joined[:, joined[0] > stretch.time[-1] - SHOWN][:, -_POINTS:]
        self._mark(table)

    def _pair(self, stretch: TwinStretch) -> None:
        """Find for each driven axis the channel of its unit whose simulation follows it most closely, in all that came so far."""
        apart = np.array([[np.sum((row - wanted) ** 2) for row in stretch.simulated] for wanted in stretch.reference])
        self._apart = apart if self._apart is None else self._apart + apart
        pairs = []
        for driven, unit in enumerate(stretch.units[0]):
            same = [row for row, other in enumerate(stretch.units[1]) if other == unit]
            if same:
                least = min(float(self._apart[driven, row]) for row in same)
                # of an encoder and a scale that agree the last is nearer to the tool
                pairs.append((driven, [row for row in same if self._apart[driven, row] <= 2.0 * least][-1]))
        if pairs != self.pairs:
            self.pairs = pairs
            self._points, self._surface = self._points[:, :0], {}

    def _mark(self, table: FloatArray) -> None:
        """Keep what each place of the way looks like now: the difference there, or of two axes the innermost radius."""
        axes = self._axes
        along = table[axes]  # the last driven axis: Z on a lathe, the only one otherwise
        self._span = [min(self._span[0], float(along.min())), max(self._span[1], float(along.max()))]
        width = self._span[1] - self._span[0]
        if width <= 0.0 or table.shape[1] < 2:
            return
        executed, simulated = table[1 + axes], table[1 + 2 * axes]
        places = np.round(along / max(width / PLACES, 1e-9)).astype(np.int64)
        if len(self._surface) > 4 * PLACES:
            self._surface = {}
        steps = np.diff(table[axes])
        forth = np.concatenate([steps[:1], steps]) >= 0.0
        for place in np.unique(places):
            for way in (0, 1):
                here = (places == place) & (forth == bool(way))
                if not here.any():
                    continue
                where = float(along[here].mean())
                if axes > 1:
                    self._surface[int(place), 0] = (where, float(executed[here].min()), float(simulated[here].min()))
                else:
                    self._surface[int(place), way] = (where, float(np.mean((executed - simulated)[here])), 0.0)

    @property
    def ways(self) -> Ways | None:
        """Return the newest part of the path; None before there is one."""
        axes = self._axes
        if not axes or self._points.shape[1] < 2:
            return None
        p = self._points
        return Ways(p[0], p[1 : 1 + axes], p[1 + axes : 1 + 2 * axes], p[1 + 2 * axes : 1 + 3 * axes])

    @property
    def surface(self) -> FloatArray:
        """Return place, innermost radius executed and simulated of two axes, (3, places), in the order of the way."""
        rows = np.array(sorted(value for (_, way), value in self._surface.items() if way == 0))
        return np.asarray(rows.T if len(rows) else np.zeros((3, 0)))

    @property
    def differences(self) -> tuple[FloatArray, FloatArray]:
        """Return places and the difference there of one axis, (2, places), going back and forth."""
        found = []
        for way in (0, 1):
            rows = np.array(sorted(value[:2] for (_, other), value in self._surface.items() if other == way))
            found.append(rows.T if len(rows) else np.zeros((2, 0)))
        return found[0], found[1]


def magnified(executed: FloatArray, simulated: FloatArray, times: float) -> FloatArray:
    """Return what was executed, its difference from the simulation magnified."""
    return simulated + times * (executed - simulated)


def nice_magnification(ways: Ways) -> float:
    """Return a round number that makes the largest difference a tenth of the way."""
    error = float(np.abs(ways.executed - ways.simulated).max())
    way = float(np.ptp(ways.reference, axis=1).max())
    if error <= 0.0 or way <= 0.0:
        return 1.0
    exact = max(1.0, 0.1 * way / error)
    power = 10.0 ** np.floor(np.log10(exact))
    return float(power * max(step for step in (1.0, 2.0, 5.0) if step * power <= exact))


_DRAWN = 0.25
"""Seconds between two pictures."""
Fill = Callable[[], tuple[float, float] | None]


class TwinApp(RepaintingApp[str]):
    """Shows a twin until its source ends or a person leaves; ``fill`` returns what waits in the buffer and its room."""

    TITLE = "lathesim twin"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("plus,equals_sign", "magnify(2)", "Magnify", key_display="+", priority=True),
        Binding("minus", "magnify(0.5)", "Less", key_display="-", priority=True),
        Binding("0", "magnify(0)", "By itself"),
        Binding("space", "hold", "Hold the picture"),
        Binding("q,ctrl+c,ctrl+q", "leave", "Quit", priority=True),
    ]
    DEFAULT_CSS = """
    TwinApp #where { height: 1; background: $panel; padding: 0 1; }
    TwinApp #path { height: 3fr; }
    TwinApp #surface { height: 2fr; }
    TwinApp #buffer { height: 1; padding: 0 1; }
    TwinApp #fill { width: 1fr; }
    TwinApp #fill Bar { width: 1fr; }
    TwinApp #said { height: auto; max-height: 3; padding: 0 1; }
    """

    def __init__(self, twin: Twin, title: str, fill: Fill) -> None:
        super().__init__()
        self._twin, self._name, self._fill = twin, title, fill
        self.picture = TwinPicture()
        self._stop = asyncio.Event()
        self._line: TwinLine | None = None
        self._given: float | None = None
        self._held = False
        self.fault: LatheSimError | None = None
        self.status = ""

    def compose(self) -> ComposeResult:
        """Return both pictures, the buffer, and the numbers."""
        yield Label(f"{self._name}: waiting for samples", id="where", markup=False)
        yield TimePlot(id="path")
        yield TimePlot(id="surface")
        with Horizontal(id="buffer"):
            yield Label("", id="waiting", markup=False)
            yield ProgressBar(total=100, id="fill", show_eta=False, show_percentage=False)
        yield Static("", id="said", markup=False)
        yield Footer()

    def on_mount(self) -> None:
        """Begin to follow the machine."""
        self.run_worker(self._follow(), exclusive=True)
        self.set_interval(_DRAWN, self.draw)

    async def _follow(self) -> None:
        try:
            self.status = await self._twin.run(self._stop, self._keep, self.picture.take)
        except LatheSimError as error:
            self.fault = error
            self.exit("failed")
            return
        if self._stop.is_set():
            self.exit(self.status)
        else:
            self.draw()
            self.query_one("#where", Label).update(f"{self._name}: the source has ended; q leaves.")

    def _keep(self, line: TwinLine) -> None:
        self._line = line

    def action_magnify(self, by: float) -> None:
        """Magnify the difference more or less; by 0 as the picture needs it."""
        ways = self.picture.ways
        now = self._given if self._given is not None else (nice_magnification(ways) if ways is not None else 1.0)
        self._given = max(1.0, now * by) if by else None
        self.draw()

    def action_hold(self) -> None:
        """Hold the picture, or go on; the machine is followed meanwhile."""
        self._held = not self._held

    def action_leave(self) -> None:
        """End the twin; what was recorded is kept."""
        self._stop.set()
        if self.status or self.fault is not None:
            self.exit(self.status)

    def draw(self) -> None:
        """Draw what is known now."""
        ways = self.picture.ways
        if ways is None or self._held:
            return
        times = self._given if self._given is not None else nice_magnification(ways)
        factor, unit = _shown_unit(float(abs(ways.reference).max()))
        executed = magnified(ways.executed, ways.simulated, times)
        names = ("reference", f"executed, difference x{times:g}", "simulated")
        in_plane = len(ways.reference) > 1
        rows = (ways.reference, executed, ways.simulated)
        lines = [PlotLine(row[1] / factor if in_plane else ways.time, row[0] / factor, name) for row, name in zip(rows, names, strict=True)]
        labels = (f"z / {unit}", f"x / {unit}") if in_plane else ("t / s", f"way / {unit}")
        self.query_one("#path", TimePlot).show_lines(lines, *labels)
        self._draw_surface(len(ways.reference), times)
        self._say()

    def _draw_surface(self, axes: int, times: float) -> None:
        if axes > 1:
            place, executed, simulated = self.picture.surface
            named = [(place, magnified(executed, simulated, times), f"surface cut, difference x{times:g}"), (place, simulated, "simulated")]
        else:
            back, forth = self.picture.differences
            named = [(forth[0], forth[1], "executed less simulated, forth"), (back[0], back[1], "back")]
        named = [line for line in named if len(line[0]) > 1]
        if not named:
            return
        along, name = _shown_unit(max(float(abs(line[0]).max()) for line in named))
        up, unit = _shown_unit(max(float(abs(line[1]).max()) for line in named))
        lines = [PlotLine(place / along, values / up, title) for place, values, title in named]
        self.query_one("#surface", TimePlot).show_lines(lines, f"place / {name}", f"{'radius' if axes > 1 else 'error'} / {unit}")

    def _say(self) -> None:
        line = self._line
        if line is None:
            return
        units = {name: unit for name, unit, *_ in line.axes}
        lost = f", {line.lost} samples lost" if line.lost else ""
        if not self.status:
            self.query_one("#where", Label).update(f"{self._name}: t = {line.time:.1f} s, {self._twin.samples} samples{lost}")
        worst = ", ".join(f"{name} {pretty_quantities(shown_with_unit(value, units[name], 3))}" for name, value in line.largest.items())
        self.query_one("#said", Static).update(f"Largest difference: {worst}")
        fill = self._fill()
        bar = self.query_one("#fill", ProgressBar)
        if fill is None:
            self.query_one("#waiting", Label).update("Buffer: this source tells of none ")
            bar.display = False
        else:
            bar.display = True
            self.query_one("#waiting", Label).update(f"Buffer: {fill[0]:.0f} of {fill[1]:.0f} set-points ")
            bar.update(total=max(1.0, fill[1]), progress=fill[0])


def _shown_unit(largest: float) -> tuple[float, str]:
    """Return the display unit of a length [m], and its name with proper signs."""
    factor, name = display_unit("m", largest)
    return factor, pretty_unit(name)
