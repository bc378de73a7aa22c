"""Recordings of an axis driven by a voltage, worked out in closed form and not by the program; and the lesson that maps them."""

import math
from pathlib import Path

import numpy as np

MASS, VISCOUS, GAIN, PERIOD = 80.0, 350.0, 35.0, 2e-3

LESSON = f"""\
lesson: An axis driven by a voltage
machine: voltage_axis
sample_period: 2 ms
step: 0.5 ms
duration: 1 s
set: {{x_drive.effort_constant: {GAIN} N/A, x_drive.back_emf: 0 V*s/m, x_axis.mass: 95 kg, x_axis.viscous: 300 N*s/m}}
recordings:
  time: {{column: t, unit: s}}
  drive: {{x_dac.command: {{column: u, unit: V}}}}
  compare: {{x_encoder.position: {{column: q, unit: m, resolution: 1 um}}}}
"""


def write_recording(folder: Path, *, noise: float = 0.5e-6, count: int = 3000, seed: int = 4) -> tuple[Path, Path]:
    """Write a recording (time, voltage, position) and its lesson, and give both files (lesson first).

    m dv/dt = K u - b v with u held over each sample:  v' = a v + (1 - a) K u/b,  a = exp(-b T/m).
    """
    rng = np.random.default_rng(seed)
    voltage = np.repeat(rng.uniform(-6.0, 6.0, count // 50 + 1), 50)[:count]
    fading, gain = math.exp(-VISCOUS * PERIOD / MASS), GAIN / VISCOUS
    place, speed = np.zeros(count), np.zeros(count)
    for now in range(count - 1):
        final = gain * voltage[now]
        speed[now + 1] = final + fading * (speed[now] - final)
        place[now + 1] = place[now] + final * PERIOD + (speed[now] - final) * (1.0 - fading) * MASS / VISCOUS
    measured = np.round((place + noise * rng.standard_normal(count)) / 1e-6) * 1e-6
    rows = np.column_stack([np.arange(count) * PERIOD, voltage, measured])
    np.savetxt(folder / "run.csv", rows, delimiter=",", header="t [s],u [V],q [m]", comments="", fmt="%.12g")
    (folder / "axis.yaml").write_text(LESSON, encoding="utf-8")
    return folder / "axis.yaml", folder / "run.csv"
