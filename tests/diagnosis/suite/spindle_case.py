"""Cases on a spindle: speed steps up and down with cuts loading it, the drive's torque logged and played back by the lesson."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.diagnosis.suite.concealed import Draw, Hidden, log_uniform
from tests.diagnosis.suite.recorded import MadeCase, Recording, Sizes, Told, rms, sizes_of, with_fast_part
from tests.diagnosis.suite.references import coloured_noise
from tests.diagnosis.suite.spindle_rig import PERIOD, SpindlePhysics, simulate_spindle

NOTHING = np.zeros(0)


@dataclass(frozen=True)
class _Run:
    """A course of speeds and loads with one drawing of the noise."""

    wanted: np.ndarray
    load: np.ndarray
    disturbance: np.ndarray
    noise: np.ndarray
    gain: float

    def log_torque(self, physics: SpindlePhysics) -> np.ndarray:
        """Torque the drive's speed loop asks for, as logged."""
        return simulate_spindle(physics, self.wanted, self.load, self.disturbance, self.noise, NOTHING)[0]

    def play(self, physics: SpindlePhysics, torque: np.ndarray, noisy: bool, coarse: bool = False) -> dict[str, np.ndarray]:
        """Channels when that torque is played."""
        if not noisy:
            physics = physics._replace(tachometer_noise=0.0, encoder_resolution=physics.encoder_resolution if coarse else 0.0)
        disturbance = self.disturbance if noisy else np.zeros_like(self.disturbance)
        _, encoder, volts = simulate_spindle(physics, self.wanted, self.load, disturbance, self.noise, torque)
        return with_fast_part({"encoder": encoder, "tachometer": volts}, self.gain)


def _course(rng: np.random.Generator, top: float, load: float, both_ways: bool, deviation: float, gain: float) -> _Run:
    wanted: list[np.ndarray] = [np.zeros(300)]
    torque: list[np.ndarray] = [np.zeros(300)]
    direction = 1.0
    while sum(map(len, wanted)) < 22000:
        speed = direction * top * float(rng.uniform(0.15, 1.0))
        seconds = float(rng.uniform(1.2, 2.4))
        count = int(seconds / PERIOD)
        wanted.append(np.full(count, speed))
        cut = np.zeros(count)
        if rng.random() < 0.6:
            begin = int(rng.uniform(0.4, 0.6) * count)
            cut[begin : begin + int(rng.uniform(0.2, 0.4) * count)] = direction * load * rng.uniform(0.3, 1.0)
        torque.append(cut)
        if both_ways and rng.random() < 0.5:
            direction = -direction
    course, cuts = np.concatenate(wanted), np.concatenate(torque)
    ramp = np.ones(200) / 200.0
    samples = len(course)
    course = np.convolve(np.r_[np.full(200, course[0]), course], ramp, mode="full")[200 : 200 + samples]
    disturbance = coloured_noise(rng, samples, deviation, log_uniform(rng, 2.0, 10.0))
    return _Run(course, cuts, disturbance, rng.standard_normal((2, samples)), gain)


def make_spindle_case(rng: np.random.Generator, draws: list[Draw], category: str, poor: str = "") -> MadeCase:
    """Make one case."""
    inertia, top = log_uniform(rng, 0.005, 0.05), float(rng.uniform(150.0, 350.0))
    time = float(rng.uniform(1.5, 4.0))
    viscous = inertia / time
    rated = viscous * top + inertia * top / 0.8
    load = rated * float(rng.uniform(0.15, 0.3))
    base = SpindlePhysics(
        inertia=inertia, viscous=viscous, gain=10.0 / (1.2 * top), tachometer_noise=float(rng.uniform(1e-3, 4e-3)), torque_limit=rated,
        loop_gain=inertia * 25.0, loop_rate=float(rng.uniform(2.0, 5.0)),
    )  # fmt: skip
    both = rng.random() < 0.6
    names = ("fit", "validate", *(("resolve", "resolve_validate") if poor else ()))
    runs = {}
    for name in names:
        ways = (both if not poor else False) or name.startswith("resolve")
        runs[name] = _course(rng, top, load, ways, rated * log_uniform(rng, 5e-4, 3e-3), base.gain)
    peak = float(np.max(np.abs(runs["fit"].log_torque(base))))
    rig = {"rated": rated, "peak": peak, "load": load, "top": top}
    hidden = tuple(draw(rng, rig) for draw in draws)
    changes: dict[str, float] = {}
    for one in hidden:
        changes |= one.changes
    told = _told(rng, base, category, hidden)
    recordings, floors = {}, {}
    sizes: dict[str, dict[str, Sizes]] = {one.key: {} for one in hidden}
    full_physics = base._replace(**changes)
    for name, run in runs.items():
        torque = np.round(run.log_torque(full_physics) / (rated / 4096.0)) * (rated / 4096.0)
        noisy = run.play(full_physics, torque, True)
        full = run.play(full_physics, torque, False)
        floors[name] = {c: max(rms(noisy[c] - full[c]), 1e-12) for c in full}
        if name in ("fit", "resolve"):
            for one in hidden:
                rest = {k: v for other in hidden if other is not one for k, v in other.changes.items()}
                without = run.play(base._replace(**rest), torque, False)
                sizes[one.key][name] = sizes_of(full, without, _slopes(told, run, base._replace(**rest), torque, without), floors[name])
        columns = {
            "time": ("s", np.arange(len(torque)) * PERIOD), "torque": ("N*m", torque), "load": ("N*m", run.load),
            "encoder": ("rad", noisy["encoder"]), "tachometer": ("V", noisy["tachometer"]),
        }  # fmt: skip
        recordings[name] = Recording(columns)
    return MadeCase(told, recordings, hidden, {key: float(getattr(base, key)) for key in told.sigma}, sizes, floors)


def _slopes(told: Told, run: _Run, base: SpindlePhysics, torque: np.ndarray, at: dict[str, np.ndarray]) -> list[dict[str, np.ndarray]]:
    slopes = []
    for name, share in told.sigma.items():
        moved = run.play(base._replace(**{name: getattr(base, name) * (1.0 + 0.2 * share)}), torque, False)
        slopes.append({channel: 5.0 * (moved[channel] - at[channel]) for channel in at})
    return slopes


def _told(rng: np.random.Generator, base: SpindlePhysics, category: str, hidden: tuple[Hidden, ...]) -> Told:
    sigma = {"inertia": float(rng.uniform(0.02, 0.06)), "viscous": float(rng.uniform(0.1, 0.2)), "gain": float(rng.uniform(0.002, 0.005))}
    spread = 0.15 if category == "control" else 1.0
    errors = {name: float(np.clip(rng.standard_normal(), -1.8, 1.8)) * spread for name in sigma}
    if category == "parameters":
        errors = {name: float(rng.choice([-1.0, 1.0]) * rng.uniform(0.7, 1.8)) for name in sigma}
    given = {name: getattr(base, name) * (1.0 + errors[name] * share) for name, share in sigma.items()}
    return Told("torque_spindle", given, sigma, ("encoder", "tachometer"), {"encoder_resolution": base.encoder_resolution})
