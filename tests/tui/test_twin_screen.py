"""The twin in the terminal: path, surface and buffer are drawn while the machine runs, and what was recorded stays."""

from __future__ import annotations

import asyncio
from pathlib import Path

import numpy as np
from textual.widgets import Label, ProgressBar

from lathesim.live.twin import Twin
from lathesim.record import load
from lathesim.tui.drawing.curves import PlotLine
from lathesim.tui.twin_app import TwinApp, TwinPicture
from lathesim.tui.widgets.time_plot import TimePlot
from tests.live.campaign.cases import prepared, signals
from tests.live.campaign.machines import MACHINES, PERIOD
from tests.live.streams import Streamed
from tests.tui.driving import content


def twin_app(machine: str, seconds: float, out: Path | None = None, pause: float = 0.0) -> TwinApp:
    """Return the app over a machine with play that rubs."""
    count = round(seconds / PERIOD)
    values = MACHINES[machine](seconds, 1, {"friction": np.full(count, 30.0), "play": np.full(count, 20e-6)})
    ready = prepared(machine)
    return TwinApp(
        Twin(ready, Streamed(values, signals(machine), 100, pause), out, every=0.1), f"{ready.name} at stream", lambda: (37.0, 200.0)
    )


async def test_an_axis_is_drawn_with_its_error_magnified_and_its_buffer() -> None:
    app = twin_app("axis", 6.0)
    async with app.run_test(size=(120, 36)) as pilot:
        for _ in range(100):
            await pilot.pause(0.05)
            if app.status:
                break
        app.draw()
        names = [name for _, name, _ in app.query_one("#path", TimePlot).named]
        assert names[0] == "reference"
        assert names[1].startswith("executed, difference x")
        assert "6000 samples" in content(app, "#where") or "has ended" in content(app, "#where")
        assert "x_scale.position" in content(app, "#said")
        assert "37 of 200 set-points" in str(app.query_one("#waiting", Label).content)
        assert app.query_one("#fill", ProgressBar).percentage == 37.0 / 200.0
        before = names[1]
        await pilot.press("plus")
        assert [name for _, name, _ in app.query_one("#path", TimePlot).named][1] != before


async def test_leaving_keeps_what_was_recorded(tmp_path: Path) -> None:
    app = twin_app("axis", 30.0, tmp_path / "twin.h5", pause=0.05)
    async with app.run_test(size=(80, 24)) as pilot:
        while app.picture.ways is None:
            await pilot.pause(0.05)
        await pilot.press("q")
        for _ in range(100):
            await pilot.pause(0.02)
            if app.status:
                break
    assert app.status == "stopped"
    assert 0 < len(load(tmp_path / "twin.h5")) < 30_000


async def test_a_lathe_is_drawn_in_its_plane_with_the_surface_it_leaves() -> None:
    picture = TwinPicture()
    app = twin_app("lathe", 10.0)
    await app._twin.run(asyncio.Event(), lambda line: None, picture.take)
    ways = picture.ways
    assert ways is not None
    assert ways.reference.shape[0] == 2
    assert len(ways.time) <= 2000
    place, executed, simulated = picture.surface
    assert np.all(np.diff(place) >= 0.0)
    assert len(place) <= 900
    assert np.abs(executed - simulated).max() > 5e-6  # half the play


async def test_a_plot_that_does_not_stand_yet_is_left_alone() -> None:
    plot = TimePlot()
    plot._is_mounted = True  # Textual says so before what it holds is there; a busy machine then draws too early
    plot.show_lines([PlotLine(np.arange(2.0), np.arange(2.0), "way")], "t / s", "way / mm")
    assert plot.named == []
