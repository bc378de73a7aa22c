"""The pictures of the manual that commands draw: ``python -m tests.cli.pictures [NAME ...]`` draws them again.

Each is what a command of its chapter leaves, with fewer colours. ``tests.tui.pictures`` draws the screens of the app, and
``tests.diagnosis.real.examples`` the recordings of real machines.
"""

from __future__ import annotations

import shlex
import sys
import tempfile
from contextlib import chdir
from pathlib import Path

from PIL import Image

from lathesim.cli.main import run_command_line
from tests.cli.command import ROOT
from tests.cli.test_readme import block

PICTURES = ROOT / "lathesim" / "manual" / "pictures"
COLOURS = 48
"""Colours of a picture: enough for lines and the edges of letters, and a third of the size."""
DRAWN = {
    "lesson": (["run mine.yaml --variant soft"], "lathesim_runs/mine/mine_soft_path.png"),
    "force": (
        ["run own.yaml --no-plots", "plot lathesim_runs/own/own.h5 cutting_force --save force.png"],
        "force.png",
    ),
    "sweep": (["sweep 12_tool_life --vary interpolator.spindle_override=0.6..2.2:33"], "lathesim_runs/12_tool_life/sweep.png"),
    "program": (["program part_programs/shop_shaft_fanuc.nc --plot shaft.png"], "shaft.png"),
    "lobes": (["lobes 18_stability_lobes --save lobes.png"], "lobes.png"),
    "circle": (["circle 07_circular_test --variant friction --save circle.png"], "circle.png"),
    "frontier": (["watermark --save frontier.png"], "frontier.png"),
    "overview": (["run 01_contour_error --variant I --no-plots --out run.h5", "plot run.h5 --save overview.png"], "overview.png"),
    "compared": (
        [
            "conceal 22_what_is_wrong_with_this_machine --effect 'CoulombFriction:level=20 N@x_axis' --validate --seed 1 --out case_1",
            "compare case_1/lesson.yaml case_1/recording.csv",
        ],
        "lathesim_runs/case_1/lesson/recording_csv/recording_compared.png",
    ),
}
"""By the name of a picture, the commands that draw it and the file that they leave."""


def draw(name: str) -> None:
    """Draw one picture in a workspace that is thrown away: that of the tutorials, with their lesson and their part."""
    commands, left = DRAWN[name]
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        run_command_line(["init", "."])
        Path("mine.yaml").write_text(block("yaml", "My first lesson"), encoding="utf-8")
        Path("own.yaml").write_text(block("yaml", "A force of my own"), encoding="utf-8")
        Path("plugins/my_force.py").write_text(block("python", "class MyForce"), encoding="utf-8")
        for command in commands:
            assert run_command_line(shlex.split(command)) == 0, command
        with Image.open(left) as picture:
            fewer = picture.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
            fewer.save(PICTURES / f"{name}.png", optimize=True)


if __name__ == "__main__":
    for wanted in sys.argv[1:] or DRAWN:
        draw(wanted)
