"""Cases on a cutting process: several entries with steps of feed, depth and speed, read by a dynamometer."""

from __future__ import annotations

import numpy as np

from tests.diagnosis.suite.concealed import Draw, log_uniform
from tests.diagnosis.suite.cutting_rig import PERIOD, CuttingPhysics, simulate_cutting
from tests.diagnosis.suite.recorded import MadeCase, Recording, Sizes, Told, rms, sizes_of
from tests.diagnosis.suite.references import coloured_noise

FEEDS = np.array([0.05, 0.08, 0.12, 0.16, 0.2, 0.28, 0.36]) * 1e-3
DEPTHS = np.array([0.4, 0.7, 1.0, 1.4, 1.8]) * 1e-3


def _course(rng: np.random.Generator, poor: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Feed [m], depth [m] and cutting speed [m/s]; the spindle turns on between the cuts. ``one_speed``: nothing but one setting."""
    speed = float(rng.uniform(0.7, 2.5))
    parts = [np.tile([[0.0], [0.0], [speed]], (1, 400))]
    kept = (float(FEEDS[3]), float(DEPTHS[2]), speed)
    while sum(part.shape[1] for part in parts) < 21000:
        steps = int(rng.integers(2, 5))
        for _ in range(steps):
            feed, depth, pace = float(rng.choice(FEEDS)), float(rng.choice(DEPTHS)), float(rng.uniform(0.6, 3.0))
            if poor:
                feed, depth, pace = kept
            speed = pace
            parts.append(np.tile([[feed], [depth], [pace]], (1, int(rng.uniform(0.6, 1.6) / PERIOD))))
        parts.append(np.tile([[0.0], [0.0], [speed]], (1, int(rng.uniform(0.4, 1.5) / PERIOD))))
    course = np.hstack(parts)
    return course[0], course[1], course[2]


def make_cutting_case(rng: np.random.Generator, draws: list[Draw], category: str, poor: str = "") -> MadeCase:
    """Make one case."""
    base = CuttingPhysics(
        specific_force=log_uniform(rng, 0.8e9, 2.4e9), thrust_ratio=float(rng.uniform(0.3, 0.5)), feed_ratio=float(rng.uniform(0.3, 0.6)),
        radius=float(rng.uniform(0.015, 0.03)),
    )  # fmt: skip
    hidden = tuple(draw(rng, {}) for draw in draws)
    changes: dict[str, float] = {}
    for one in hidden:
        changes |= one.changes
    sigma = {"specific_force": float(rng.uniform(0.03, 0.08)), "thrust_ratio": 0.05, "feed_ratio": 0.05}
    errors = {name: float(np.clip(rng.standard_normal(), -1.8, 1.8)) * (0.15 if category == "control" else 1.0) for name in sigma}
    if category == "parameters":
        errors = {name: float(rng.choice([-1.0, 1.0]) * rng.uniform(0.7, 1.8)) for name in sigma}
    given = {name: getattr(base, name) * (1.0 + errors[name] * share) for name, share in sigma.items()}
    all_three = rng.random() < 0.5 or any("thrust" in one.needs for one in hidden)
    channels = ("main", "thrust", "feed_force") if all_three else ("main",)
    told = Told("cutting_process", given, sigma, channels, {"radius": base.radius})
    white, slow = float(rng.uniform(1.0, 4.0)), float(rng.uniform(0.3, 2.0))
    full_physics = base._replace(**changes)
    recordings, floors = {}, {}
    sizes: dict[str, dict[str, Sizes]] = {one.key: {} for one in hidden}
    for name in ("fit", "validate", *(("resolve", "resolve_validate") if poor else ())):
        course = _course(rng, "" if name.startswith("resolve") else poor)

        def run(physics: CuttingPhysics, course: tuple[np.ndarray, np.ndarray, np.ndarray] = course) -> dict[str, np.ndarray]:
            forces = simulate_cutting(physics, *course)
            return {c: forces[("main", "thrust", "feed_force").index(c)] for c in channels}

        full = run(full_physics)
        samples = len(course[0])
        noisy = {c: full[c] + white * rng.standard_normal(samples) + coloured_noise(rng, samples, slow, 3.0) for c in channels}
        noisy = {c: np.round(values / 0.064) * 0.064 for c, values in noisy.items()}
        floors[name] = {c: rms(noisy[c] - full[c]) for c in channels}
        if name in ("fit", "resolve"):
            for one in hidden:
                rest = base._replace(**{k: v for other in hidden if other is not one for k, v in other.changes.items()})
                without = run(rest)
                moved = [run(rest._replace(**{key: getattr(rest, key) * (1.0 + share)})) for key, share in sigma.items()]
                slopes = [{c: one_moved[c] - without[c] for c in channels} for one_moved in moved]
                sizes[one.key][name] = sizes_of(full, without, slopes, floors[name])
        columns = {
            "time": ("s", np.arange(samples) * PERIOD), "feed": ("mm", course[0] * 1e3), "depth": ("mm", course[1] * 1e3),
            "speed": ("m/min", course[2] * 60.0), **{c: ("N", noisy[c]) for c in channels},
        }  # fmt: skip
        recordings[name] = Recording(columns)
    return MadeCase(told, recordings, hidden, {key: float(getattr(base, key)) for key in sigma}, sizes, floors)
