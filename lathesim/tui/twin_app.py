"""The twin in the terminal: the machine beside its simulation while it runs, with the difference magnified."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal
from textual.widgets import Footer, Label, ProgressBar, Static

from lathesim.analysis.display_unit import display_unit, shown_with_unit
from lathesim.errors import LatheSimError
from lathesim.live.twin import Twin, TwinLine
from lathesim.tui.drawing.curves import Line
from lathesim.tui.model.twin_picture import TwinPicture, magnified, nice_magnification
from lathesim.tui.repainting import RepaintingApp
from lathesim.tui.widgets.time_plot import TimePlot

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
        largest = float(abs(ways.reference).max())
        factor, unit = display_unit("m", largest)
        executed = magnified(ways.executed, ways.simulated, times)
        names = ("reference", f"executed, difference x{times:g}", "simulated")
        path = self.query_one("#path", TimePlot)
        if len(ways.reference) > 1:
            rows = (ways.reference, executed, ways.simulated)
            path.show_lines(
                [Line(row[1] / factor, row[0] / factor, name) for row, name in zip(rows, names, strict=True)], f"z / {unit}", f"x / {unit}"
            )
        else:
            rows = (ways.reference, executed, ways.simulated)
            path.show_lines(
                [Line(ways.time, row[0] / factor, name) for row, name in zip(rows, names, strict=True)], "t / s", f"way / {unit}"
            )
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
        along, name = display_unit("m", max(float(abs(line[0]).max()) for line in named))
        up, unit = display_unit("m", max(float(abs(line[1]).max()) for line in named))
        lines = [Line(place / along, values / up, title) for place, values, title in named]
        label = f"{'radius' if axes > 1 else 'error'} / {unit}"
        self.query_one("#surface", TimePlot).show_lines(lines, f"place / {name}", label)

    def _say(self) -> None:
        line = self._line
        if line is None:
            return
        units = {name: unit for name, unit, *_ in line.axes}
        lost = f", {line.lost} samples lost" if line.lost else ""
        if not self.status:
            self.query_one("#where", Label).update(f"{self._name}: t = {line.time:.1f} s, {self._twin.samples} samples{lost}")
        worst = ", ".join(f"{name} {shown_with_unit(value, units[name], 3)}" for name, value in line.largest.items())
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
