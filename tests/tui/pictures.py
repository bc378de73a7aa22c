"""The pictures of the app in the manual and the goldens of the tests: ``python -m tests.tui.pictures`` draws them again."""

from __future__ import annotations

import asyncio
import tempfile
from collections.abc import Awaitable, Callable
from contextlib import chdir
from dataclasses import replace

from textual.pilot import Pilot
from textual.widgets import Input, SelectionList

from lathesim.tui.app import LathesimApp
from lathesim.tui.widgets.controls import Slider
from lathesim.tui.widgets.time_plot import TimePlot
from tests.cli.command import ROOT
from tests.tui.driving import opened, run_to_end, until
from tests.tui.lathe_moments import GOLDENS, pictures
from tests.tui.screen_words import words_of

PICTURES = ROOT / "lathesim" / "manual" / "pictures"
SIZE = (110, 34)


async def bench(app: LathesimApp, pilot: Pilot[None]) -> None:
    """Show the bench in the taper of the first lesson."""
    await run_to_end(app, pilot)
    slider = app.screen.query_one(Slider)
    slider.focus()
    for _ in range(3):
        await pilot.press("shift+left")


async def configure(app: LathesimApp, pilot: Pilot[None]) -> None:
    """Show the gain of an axis, changed."""
    assert app.workbench.setup is not None
    app.workbench.change(app.workbench.setup.with_value("x_controller.proportional", "0.449 V/mm"))
    await app.show_parameter("x_controller.proportional")


async def results(app: LathesimApp, pilot: Pilot[None]) -> None:
    """Show two cases laid over each other."""
    await run_to_end(app, pilot)
    assert app.workbench.setup is not None
    app.workbench.change(replace(app.workbench.setup, variant="II"))
    await run_to_end(app, pilot)
    await pilot.press("f3")
    await pilot.pause()
    app.screen.query_one("#runs", SelectionList).select_all()
    app.screen.query_one("#wanted", Input).value = "contour"
    app.screen.query_one(TimePlot).focus()
    await pilot.press("e")


async def lessons(app: LathesimApp, pilot: Pilot[None]) -> None:
    """Show the first lesson."""
    await pilot.press("f6")


async def detective(app: LathesimApp, pilot: Pilot[None]) -> None:
    """Show how a case begins."""
    await pilot.press("f7")


SCREENS: dict[str, Callable[[LathesimApp, Pilot[None]], Awaitable[None]]] = {
    "bench": bench,
    "configure": configure,
    "results": results,
    "lessons": lessons,
    "detective": detective,
}
SNAPSHOTS = ("configure", "detective")
"""Screens whose words are kept as goldens."""


async def shown(name: str) -> str:
    """Return a screen as SVG, driven in a folder that is thrown away."""
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        async with opened(size=SIZE) as (app, pilot):
            await SCREENS[name](app, pilot)
            await pilot.pause(0.5)
            await until(pilot, lambda: bool(app.screen.query("FooterKey")), "the keys")
            return app.export_screenshot(title="lathesim")


def main() -> None:
    """Draw all."""
    PICTURES.mkdir(exist_ok=True)
    GOLDENS.mkdir(exist_ok=True)
    for name in SCREENS:
        svg = asyncio.run(shown(name))
        (PICTURES / f"{name}.svg").write_text(svg, encoding="utf-8")
        if name in SNAPSHOTS:
            (GOLDENS / f"{name}.txt").write_text(words_of(svg), encoding="utf-8")
    for name, text in pictures().items():
        (GOLDENS / f"{name}.txt").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
