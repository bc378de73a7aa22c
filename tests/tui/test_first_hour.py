"""The tutorial of the first hour: its keys do what its text says, and its numbers are those on the screen."""

from textual.pilot import Pilot
from textual.widgets import Input, Tree

from lathesim.manual.chapters import chapter
from lathesim.tui.app import LathesimApp
from tests.tui.driving import opened, press, run_to_end
from tests.tui.screen_words import words_of


async def change(app: LathesimApp, pilot: Pilot[None], part: str, text: str) -> None:
    """Choose a part in the tree with the arrow keys, press Enter twice and type its first value."""
    tree = app.screen.query_one(Tree)
    await pilot.press("home")
    while tree.cursor_node is None or not str(tree.cursor_node.label).endswith(part):
        await pilot.press("down")
    await pilot.press("enter", "enter")
    app.screen.query_one("#value", Input).clear()
    await pilot.press(*("space" if sign == " " else sign for sign in text), "enter")
    await pilot.press("shift+tab", "shift+tab")


async def test_the_first_hour_can_be_walked_with_the_keys_alone() -> None:
    text = chapter("first_hour").text
    assert "at most 0.2 mm" in text
    async with opened(size=(110, 34)) as (app, pilot):
        await run_to_end(app, pilot)
        assert "0.6851 mm" in words_of(app.export_screenshot())
        assert "0.6851 mm" in text
        await press(pilot, "f4")
        for part in ("X controller", "Z controller"):
            await change(app, pilot, part, "0.449 V/mm")
        await pilot.press("f2")
        await run_to_end(app, pilot)
        assert "✗ largest contour error at most 0.2 mm" in words_of(app.export_screenshot())
        await press(pilot, "f3", "down", "space", "e")
        shown = words_of(app.export_screenshot())
        assert "002" in shown
        assert "0.3379 mm" in shown
        assert "0.6851 mm" in shown
        assert "0.338 mm" in text
