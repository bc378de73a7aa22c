"""GNU Octave with one function a part, as in the 2004 paper (where each is a file); fixed-step RK4 between the sample instants."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

NAME = "Octave, one function a part"
SLOW = True
FOLDER = Path(__file__).parent
SCRIPT = """\
addpath('{folder}');
{parameters}
path = load('path.txt');
noise = load('noise.txt');
begun = cputime();
record = lathe(p, path, noise(:, 1), noise(:, 2), {samples}, {period:.17g}, {step:.17g}, {steps});
seconds = cputime() - begun;
dlmwrite('seconds.txt', seconds, 'precision', '%.17g');
dlmwrite('record.txt', record, 'delimiter', ' ', 'precision', '%.17g');
"""


def absent() -> str:
    return "" if shutil.which("octave-cli") else "octave-cli is not installed"


def times_and_positions(work: Any, repeats: int) -> tuple[list[float], np.ndarray]:
    """Run it a few times; give the CPU seconds of each run and the positions of the last."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        parameters = "\n".join(f"p.{full} = {value:.17g};" for full, value in work.parameters.items())
        np.savetxt(folder / "path.txt", work.path, fmt="%.17g")
        noise = [work.noise["tachometer.chance"], work.noise["dynamometer.chance"]]
        np.savetxt(folder / "noise.txt", np.stack(noise, axis=1), fmt="%.17g")
        text = SCRIPT.format(
            folder=FOLDER, parameters=parameters, samples=work.samples, period=work.period, step=work.step, steps=work.steps
        )
        (folder / "bench.m").write_text(text)
        seconds = []
        for _ in range(repeats):
            subprocess.run(["octave-cli", "--norc", "--quiet", "bench.m"], check=True, cwd=folder, capture_output=True)
            seconds.append(float((folder / "seconds.txt").read_text()))
        record = np.loadtxt(folder / "record.txt")
    return seconds, record[:, [work.channels.index("x_axis.position"), work.channels.index("z_axis.position")]].T
