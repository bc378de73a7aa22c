"""Recordings of cuts by a generator of its own: another integrator (symplectic Euler with small steps) and rigs with other modes.

Shares no code with the parts of the program; forces in newtons, a recording of about two seconds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

KINDS = ("stable", "hopf", "flip", "forced", "segmentation", "mains", "entry")


@dataclass(frozen=True)
class Made:
    """A recording: force, sample rate, speed in rpm, what it is, and the natural frequency of the rig."""

    force: np.ndarray
    rate: float
    speed: float
    kind: str
    natural: float


def regenerative(
    natural: float,
    zeta: float,
    stiffness: float,
    gain: float,
    speed: float,
    rho: float,
    feed: float,
    seconds: float,
    rate: float,
    chance: np.random.Generator,
) -> np.ndarray:
    """Return the force of a cut that may leave the part, with memory of all turns; ``gain`` is b Ks."""
    steps = 6
    dt = 1.0 / (rate * steps)
    turn = round(60.0 / speed / dt)
    w = 2.0 * math.pi * natural
    surface = [0.0] * turn
    x, v = 0.0, 0.0
    count = int(seconds * rate)
    force = np.zeros(count)
    noise = (0.01 * feed * gain * chance.standard_normal(count)).tolist()
    edge = int(rho * turn)
    place = 0
    for sample in range(count):
        total = 0.0
        jolt = noise[sample]
        for _ in range(steps):
            there = place < edge
            f = 0.0
            h = feed + surface[place] - x
            if there and h > 0.0:
                f = gain * h + jolt
            left = surface[place] + feed
            surface[place] = x if x < left else left
            v += dt * w * w * (f / stiffness - x - 2.0 * zeta * v / w)
            x += dt * v
            total += f
            place += 1
            if place == turn:
                place = 0
        force[sample] = total / steps
    return force


def uninterrupted_limit(natural: float, zeta: float, stiffness: float, speed: float) -> float:
    """Return the gain b Ks at which a cut begins to chatter, by a scan of the characteristic equation."""
    f = np.linspace(natural * 1.0005, natural * 2.5, 60000)
    r = f / natural
    g = 1.0 / (stiffness * (1.0 - r * r + 2j * zeta * r))
    phase = np.mod(2.0 * np.angle(g) - np.pi, 2.0 * np.pi)
    lobe = f * 60.0 / speed - phase / (2.0 * np.pi)
    at = np.flatnonzero((np.floor(lobe[1:]) != np.floor(lobe[:-1])) & (lobe[1:] > lobe[:-1]))
    at = at[np.abs(lobe[1:][at] - lobe[:-1][at]) < 0.5]
    return float((-0.5 / g.real[at]).min())


def made(kind: str, chance: np.random.Generator, *, unseen: bool = False) -> Made:
    """Return a recording of a kind on a rig drawn by chance; rigs not seen have modes elsewhere."""
    natural = float(chance.uniform(260.0, 520.0) if unseen else chance.uniform(70.0, 220.0))
    zeta, stiffness = float(chance.uniform(0.015, 0.05)), float(chance.uniform(5e6, 2e7))
    speed = float(chance.uniform(900.0, 3500.0))
    rate, seconds, feed = 10000.0, 2.0, float(chance.uniform(0.08, 0.2)) * 1e-3
    count = int(rate * seconds)
    time = np.arange(count) / rate
    turning = speed / 60.0
    limit = uninterrupted_limit(natural, zeta, stiffness, speed)
    share = float(chance.uniform(0.3, 0.75))
    if kind == "flip":
        natural, zeta, stiffness = float(chance.uniform(70, 80)) * (3.0 if unseen else 1.0), 0.02, 8e6
        speed = float(chance.uniform(3500.0, 3720.0)) * natural / 75.0
        force = regenerative(
            natural, zeta, stiffness, float(chance.uniform(1.15, 1.4)) * 6e8 * 7.5e-3, speed, 0.5, feed, seconds, rate, chance
        )
        return Made(force + 2.0 * chance.standard_normal(count), rate, speed, kind, natural)
    if kind == "hopf":
        share = float(chance.uniform(1.15, 1.6))
    before = 0.0 if kind == "hopf" else 0.8  # others are recorded once the cut has settled
    force = regenerative(natural, zeta, stiffness, share * limit, speed, 1.0, feed, seconds + before, rate, chance)[-count:]
    mean = share * limit * feed
    force += 0.01 * mean * np.cos(2.0 * np.pi * turning * time + chance.uniform(0, 6))
    force += 0.006 * mean * chance.standard_normal(count)
    if kind == "forced":
        for order in range(1, int(chance.integers(2, 5))):
            force += mean * chance.uniform(0.08, 0.25) / order * np.cos(2.0 * np.pi * order * turning * time + chance.uniform(0, 6))
    elif kind == "mains":
        base = float(chance.choice([50.0, 60.0]))
        for multiple in (1, int(chance.integers(2, 4))):
            force += mean * chance.uniform(0.05, 0.15) * np.cos(2.0 * np.pi * base * multiple * time + chance.uniform(0, 6))
    elif kind == "segmentation":
        rough = chance.uniform(1.0, 3.0)
        drift = np.cumsum(chance.standard_normal(count)) / math.sqrt(rate)
        centre = float(chance.uniform(60.0, 600.0))
        force += mean * chance.uniform(0.1, 0.25) * np.cos(2.0 * np.pi * centre * time + rough * 4.0 * drift)
    elif kind == "entry":
        if chance.random() < 0.5:
            decay = zeta * 2.0 * math.pi * natural
            force += mean * chance.uniform(0.3, 0.8) * np.exp(-decay * time) * np.cos(2.0 * np.pi * natural * math.sqrt(1 - zeta**2) * time)
        else:
            phase = np.mod(turning * time, 1.0) / turning
            ring = max(zeta, 6.0 * turning / (2.0 * math.pi * natural))
            force += (
                mean * chance.uniform(0.3, 0.8) * np.exp(-ring * 2.0 * math.pi * natural * phase) * np.cos(2.0 * np.pi * natural * phase)
            )
    return Made(force, rate, speed, kind, natural)
