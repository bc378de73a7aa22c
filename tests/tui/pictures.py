"""The picture of the app in the README: ``python -m tests.tui.pictures`` draws it again, in a folder that is thrown away."""

from __future__ import annotations

import asyncio
import os
import tempfile
from pathlib import Path

from tests.cli.command import ROOT
from tests.tui.driving import opened, run_to_end

PICTURES = ROOT / "lathesim" / "manual" / "pictures"
SIZE = (110, 34)


async def bench() -> str:
    """Return the bench after the first lesson, as SVG."""
    async with opened(size=SIZE) as (app, pilot):
        await run_to_end(app, pilot)
        return app.export_screenshot(title="lathesim")


def main() -> None:
    """Draw the pictures."""
    here = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            text = asyncio.run(bench())
        finally:
            os.chdir(here)
    PICTURES.mkdir(exist_ok=True)
    (PICTURES / "bench.svg").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
