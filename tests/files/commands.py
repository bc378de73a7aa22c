"""Every command that writes, as it is called in the campaign, with the inputs it needs."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from tests.cli.command import ROOT, environment

ONE_AXIS = """\
lesson: One axis
machine: machine
duration: 2 s
"""
MACHINE = """\
machine: One axis at a voltage
sample_period: 5 ms
step: 0.5 ms
parts:
  axis: {component: EmpiricalAxis, set: {gain: 18 mm/(s*V), time_constant: 20 ms}}
wires:
  axis.voltage: 1 V
"""
AXIS = "{velocity: 100 mm/s, acceleration: 1 m/s^2, jerk: 20 m/s^3}"
LIMITS = f"axes:\n  x: {AXIS}\n  y: {AXIS}\n"
COMMANDS: dict[str, tuple[str, ...]] = {
    "run": ("run", "{in}/one.yaml", "--out", "run.h5", "--no-plots"),
    "run with plots": ("run", "01_contour_error", "--variant", "I"),
    "sweep": ("sweep", "{in}/one.yaml", "--vary", "axis.gain=10..20 mm/(s*V):4", "--metric", "contact_time", "--out", "sweep.csv"),
    "export csv": ("export", "{in}/run.h5", "run.csv"),
    "export mat": ("export", "{in}/run.h5", "run.mat"),
    "plot": ("plot", "{in}/run.h5", "--save", "plot.png"),
    "program": ("program", "{in}/turn.nc", "--write", "turn.ngc", "--plot", "turn.svg"),
    "new-program": (
        "new-program",
        "straight",
        "--diameter",
        "30mm",
        "--length",
        "40mm",
        "--feed",
        "0.1mm/rev",
        "--speed",
        "1000rpm",
        "--out",
        "new.nc",
    ),
    "init": ("init", "work"),
    "compare": ("compare", "{in}/case/lesson.yaml", "{in}/case/recording.csv", "--out", "."),
    "conceal": ("conceal", "22_what_is_wrong_with_this_machine", "--effect", "none", "--seed", "1", "--validate", "--out", "case"),
    "diagnose": ("diagnose", "{in}/case/lesson.yaml", "{in}/case/recording.csv", "--at-most", "5 s", "--out", "d", "--json", "d.json"),
    "fit": ("fit", "{in}/case/lesson.yaml", "{in}/case/recording.csv", "--free", "x_axis.viscous", "--starts", "1", "--out", "f.yaml"),
    "learn": ("learn", "09_learning", "--laps", "1", "--out", "learned"),
    "circle": ("circle", "07_circular_test", "--no-contributions", "--save", "circle.png"),
    "watermark": ("watermark", "--save", "frontier.png"),
    "lobes": ("lobes", "18_stability_lobes", "--speed", "1000..3000:20", "--save", "lobes.png"),
    "tap": ("tap", "20_tap_and_predict", "--out", "tap.csv", "--save", "tap.png"),
    "modes": ("modes", "{in}/tap.csv", "--count", "1", "--save", "modes.png"),
    "retime": ("retime", "{in}/line.csv", "--limits", "{in}/limits.yaml", "--out", "s.h5"),
    "twin": ("twin", "22_what_is_wrong_with_this_machine", "{in}/loop.h5", "--fast", "--plain", "--out", "twin.h5"),
    "warm": ("warm", "{in}/one.yaml"),
}


def arguments(name: str, inputs: Path) -> list[str]:
    """Return the command line of a command of the campaign."""
    return [sys.executable, "-m", "lathesim", *(item.replace("{in}", str(inputs)) for item in COMMANDS[name])]


def make_inputs(folder: Path, cache: Path) -> None:
    """Write what the commands read."""
    folder.mkdir(parents=True)
    texts = {"one.yaml": ONE_AXIS, "machine.yaml": MACHINE, "limits.yaml": LIMITS}
    texts["line.csv"] = "x [mm],y [mm]\n" + "".join(f"{step},{0.5 * step}\n" for step in range(0, 101, 5))
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "turn.nc").write_bytes((ROOT / "part_programs" / "straight_turning.nc").read_bytes())
    here = {**environment(), "LATHESIM_CACHE": str(cache)}
    for call in (
        ("run", "one.yaml", "--out", "run.h5", "--no-plots"),
        ("conceal", "22_what_is_wrong_with_this_machine", "--effect", "none", "--seed", "1", "--out", "case"),
        ("run", "case/lesson.yaml", "--out", "loop.h5", "--no-plots"),
        ("tap", "20_tap_and_predict", "--out", "tap.csv"),
    ):
        subprocess.run([sys.executable, "-m", "lathesim", *call], cwd=folder, env=here, check=True, capture_output=True)
