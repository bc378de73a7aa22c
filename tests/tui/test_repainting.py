"""What a screen shows once a batch of updates ends; lessons chosen in a real terminal on a busy machine."""

from __future__ import annotations

import asyncio
import shutil
from pathlib import Path
from typing import Any

import pytest
from textual.app import App
from textual.screen import Screen

from tests.tui.driving import PATIENCE, opened, until
from tests.tui.lesson_choices import MOST, choices


async def test_a_screen_that_turned_idle_in_a_batch_is_painted_when_the_batch_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    """Markdown and the footer hold a batch open over many turns of the event loop, also those of a screen that was left."""
    painted: set[Screen[Any]] = set()
    is_new = asyncio.Event()
    display = App._display

    def watched(app: App[Any], screen: Screen[Any], renderable: Any) -> None:
        if renderable is not None and not app._batch_count:
            painted.add(screen)
            is_new.set()
        display(app, screen, renderable)

    async with opened() as (app, pilot):
        await pilot.press("f6")
        await until(pilot, lambda: app.current_mode == "lessons" and not app._batch_count, "the lessons")
        monkeypatch.setattr(App, "_display", watched)
        with app.batch_update():
            await app.switch_mode("bench")
            await until(pilot, lambda: app._batch_count == 1, "the end of the pause that a change of screens makes")
            assert not painted
        await asyncio.wait_for(is_new.wait(), PATIENCE)  # a pilot that waits would wake the screen
        assert painted == {app.screen}


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("tmux") is None or not Path("/proc").is_dir(), reason="needs tmux and /proc")
@pytest.mark.timeout(420)
def test_a_lesson_that_is_chosen_on_a_busy_machine_is_drawn(tmp_path: Path) -> None:
    found = list(choices(tmp_path, 10, 6))
    assert [choice.lesson for choice in found if not choice.is_drawn or choice.processor > MOST] == []
