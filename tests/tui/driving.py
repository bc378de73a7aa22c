"""The app driven as a person drives it: in a folder of its own, at the size of a terminal."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

from textual.app import App
from textual.pilot import Pilot
from textual.widgets import Input, OptionList, Static

from lathesim.cli.open_app import make_app
from lathesim.tui.app import LathesimApp
from lathesim.tui.model.machine_tree import Setup

PATIENCE = 30.0


@asynccontextmanager
async def opened(
    lesson_or_record: str | None = None, *, size: tuple[int, int] = (120, 36)
) -> AsyncIterator[tuple[LathesimApp, Pilot[None]]]:
    """Open the app; leaves it at the end, whatever happened."""
    app = make_app(lesson_or_record)
    app.animation_level = "none"
    async with app.run_test(size=size) as pilot:
        await until(pilot, lambda: app.workbench.setup is not None or bool(app.workbench.runs), "the lesson")
        yield app, pilot
        app.stop_run()


async def until(pilot: Pilot[None], holds: Callable[[], bool], what: str) -> None:
    """Wait until something holds; fails after ``PATIENCE`` seconds of the processor, of which a busy machine gives little."""
    end = time.process_time() + PATIENCE
    while not holds():
        assert time.process_time() < end, f"{what} did not come"
        await asyncio.sleep(0.05)
    await pilot.pause()


async def run_to_end(app: LathesimApp, pilot: Pilot[None]) -> None:
    """Press F5 and wait until the run has ended and its result is shown."""
    before = len(app.workbench.runs)
    await pilot.press("f5")

    def is_over() -> bool:
        return len(app.workbench.runs) > before and app.workbench.live is None and app._watched is None

    await until(pilot, is_over, "the end of the run")
    await pilot.pause()


async def press(pilot: Pilot[None], *keys: str) -> None:
    """Press keys and wait until the screen has settled."""
    await pilot.press(*keys)
    await pilot.pause()


async def fill(app: LathesimApp, pilot: Pilot[None], field: str, text: str) -> None:
    """Write a text into a field of the screen in front."""
    app.screen.query_one(field, Input).value = text
    await pilot.pause()


async def answer(app: LathesimApp, pilot: Pilot[None], text: str) -> None:
    """Write an answer into the field of the dialog or the pane that is open."""
    await fill(app, pilot, "#answer, #value, #path", text)
    await press(pilot, "enter")


async def show(app: LathesimApp, pilot: Pilot[None], name: str) -> None:
    """Show a parameter on Configure."""
    await app.show_parameter(name)
    await pilot.pause()


async def edit(app: LathesimApp, pilot: Pilot[None], name: str, text: str) -> None:
    """Go to a parameter, write another value and press Enter."""
    await show(app, pilot, name)
    await press(pilot, "enter")
    await answer(app, pilot, text)


def choose(app: LathesimApp, name: str) -> list[str]:
    """Put the cursor of the list of a dialog on a name; return all its names."""
    listed = app.screen.query_one(OptionList)
    names = [str(listed.get_option_at_index(place).prompt).strip("> ") for place in range(listed.option_count)]
    listed.highlighted = names.index(name)
    return names


def content(app: App[Any], place: str) -> str:
    """Return what a label of the screen in front says."""
    return str(app.screen.query_one(place, Static).content)


def setup_of(app: LathesimApp) -> Setup:
    """Return the setup on the bench."""
    assert app.workbench.setup is not None
    return app.workbench.setup


def told(app: LathesimApp) -> str:
    """Return what the app told so far."""
    return "\n".join(str(notice.message) for notice in app._notifications)
