"""Cases on a feed-drive axis: an axis is drawn, physics hidden in it, and two recordings made along different courses."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tests.diagnosis.suite.axis_physics import AxisPhysics
from tests.diagnosis.suite.axis_rig import NO_TABLE, AxisSignals, simulate_axis
from tests.diagnosis.suite.concealed import Draw, Hidden, log_uniform
from tests.diagnosis.suite.recorded import MadeCase, Recording, Sizes, Told, rms, sizes_of, with_differences
from tests.diagnosis.suite.references import PERIOD, Course, coloured_noise, poor_course, rich_course

FRICTION = {"coulomb", "bristles", "lugre_for_coulomb", "lugre_for_stribeck", "friction_table", "asymmetric"}


@dataclass(frozen=True)
class Axis:
    """A drawn axis: true baseline, course limits and disturbance."""

    physics: AxisPhysics
    stroke: float
    top: float
    acceleration: float
    lead: float
    load_deviation: float
    load_corner: float
    bandwidth: float


def draw_axis(rng: np.random.Generator) -> Axis:
    """Draw an axis of a small lathe with a controller that suits it."""
    mass = log_uniform(rng, 25.0, 150.0)
    gain = mass * float(rng.uniform(0.45, 0.9))
    conductance = float(rng.uniform(0.6, 2.0))
    viscous = mass * float(rng.uniform(1.5, 5.0))
    bandwidth = float(rng.uniform(80.0, 150.0))
    back_emf = float(rng.choice([0.0, rng.uniform(1.0, 4.0)]))
    resolution = float(rng.choice([5e-8, 1e-7, 2e-7, 5e-7]))
    pid = rng.random() < 0.3
    physics = AxisPhysics(
        mass=mass, viscous=viscous, conductance=conductance, back_emf=back_emf, effort_constant=gain / conductance, pid=float(pid),
        encoder_resolution=resolution, scale_resolution=float(rng.choice([5e-8, 1e-7, 2e-7])), encoder_noise=0.4 * resolution,
        scale_noise=float(rng.uniform(3e-8, 1e-7)), current_noise=float(rng.uniform(0.003, 0.012)), converter_bits=12.0,
    )  # fmt: skip
    if pid:
        swing = 0.55 * bandwidth
        physics = physics._replace(
            proportional=mass * swing * swing / gain, derivative_gain=1.4 * mass * swing / gain, integral=0.12 * mass * swing**3 / gain
        )
        physics = physics._replace(encoder_resolution=min(resolution, 1e-7), encoder_noise=0.4 * min(resolution, 1e-7))
    else:
        physics = physics._replace(
            velocity_gain=bandwidth * mass / gain, position_gain=bandwidth * float(rng.uniform(0.2, 0.3)),
            mean_share=float(rng.choice([0.0, 0.5])), integral_rate=float(rng.choice([0.0, rng.uniform(3.0, 10.0)])),
        )  # fmt: skip
    return Axis(
        physics, float(rng.uniform(0.08, 0.2)), float(rng.uniform(0.08, 0.18)), float(rng.uniform(1.2, 2.5)),
        float(rng.choice([0.005, 0.01])), 10.0 * gain * log_uniform(rng, 2e-4, 2e-3), log_uniform(rng, 1.0, 10.0), bandwidth,
    )  # fmt: skip


def _table(changes: dict[str, float]) -> np.ndarray:
    """A measured friction curve [m/s, N], 24 points a direction, falling then flat, 8 % stronger backward."""
    if "@table_level" not in changes:
        return NO_TABLE
    speed = np.geomspace(2e-4, 0.4, 24)
    level = changes["@table_level"] + changes["@table_excess"] * np.exp(-speed / changes["@table_speed"])
    return np.column_stack([np.r_[-speed[::-1], speed], np.r_[-1.08 * level[::-1], level]])


def _physics(base: AxisPhysics, changes: dict[str, float]) -> AxisPhysics:
    return base._replace(**{name: value for name, value in changes.items() if not name.startswith("@")})


def _noise_free(physics: AxisPhysics, changes: dict[str, float]) -> AxisPhysics:
    fine = physics._replace(encoder_noise=0.0, scale_noise=0.0, current_noise=0.0, current_resolution=0.0, scale_resolution=0.0)
    if "encoder_resolution" not in changes:
        fine = fine._replace(encoder_resolution=0.0)
    return fine if "coarse_step" in changes else fine._replace(converter_bits=32.0)


@dataclass(frozen=True)
class _Bench:
    """An axis on its course with one drawing of the noise."""

    axis: Axis
    course: Course
    noise: np.ndarray
    load: np.ndarray

    def run(self, base: AxisPhysics, changes: dict[str, float], noisy: bool) -> AxisSignals:
        physics = _physics(base, changes)
        if not noisy:
            physics = _noise_free(physics, changes)
        load = self.load if noisy else np.zeros_like(self.load)
        signals = simulate_axis(physics, self.course.position, self.noise, load, _table(changes))
        return _relogged(signals, changes)


def _relogged(signals: AxisSignals, changes: dict[str, float]) -> AxisSignals:
    skew, shift = changes.get("@skew_scale", 0.0), changes.get("@shift_scale", 0.0)
    if skew == 0.0 and shift == 0.0:
        return signals
    time = np.arange(len(signals.scale)) * PERIOD
    return replace(signals, scale=np.interp(time - skew * time - shift, time, signals.scale))


def _bench(rng: np.random.Generator, axis: Axis, poor: str) -> _Bench:
    if poor:
        course = poor_course(rng, poor, axis.stroke, axis.top, axis.acceleration)
    else:
        course = rich_course(rng, axis.stroke, axis.top, axis.acceleration)
    samples = len(course.position)
    load = coloured_noise(rng, samples, axis.load_deviation, axis.load_corner)
    return _Bench(axis, course, rng.standard_normal((3, samples)), load)


def make_axis_case(rng: np.random.Generator, draws: list[Draw], category: str, poor: str = "") -> MadeCase:
    """Make one case; an axis that would not stay stable with what is hidden in it is drawn anew."""
    for _ in range(20):
        made = _attempt(rng, draws, category, poor)
        if made is not None:
            return made
    raise RuntimeError("no stable axis within 20 drawings")


def _attempt(rng: np.random.Generator, draws: list[Draw], category: str, poor: str) -> MadeCase | None:
    axis = draw_axis(rng)
    names = {draw.__name__ for draw in draws}
    wants_voltage_motor = "inductance" in names
    if wants_voltage_motor and axis.physics.back_emf == 0.0:
        axis = replace(axis, physics=axis.physics._replace(back_emf=float(rng.uniform(1.0, 4.0))))
    if "current_loop" in names:
        axis = replace(axis, physics=axis.physics._replace(back_emf=0.0))
    rated = 10.0 * axis.physics.conductance * axis.physics.effort_constant
    wants_friction = names & {"stribeck"} and not names & FRICTION
    known = float(rng.uniform(0.02, 0.06)) * rated if not names & FRICTION and (wants_friction or rng.random() < 0.4) else 0.0
    base = axis.physics._replace(coulomb=known)
    benches = {name: _bench(rng, axis, poor) for name in ("fit", "validate")}
    if poor:
        benches |= {name: _bench(rng, axis, "") for name in ("resolve", "resolve_validate")}
    plain = {name: bench.run(base, {}, False) for name, bench in benches.items()}
    if not all(signals.sound for signals in plain.values()):
        return None
    rig = {
        "rated": rated, "lead": axis.lead, "top": axis.top, "acceleration": axis.acceleration, "mass": base.mass, "viscous": base.viscous,
        "bandwidth": axis.bandwidth, "known": known, "resolution": base.encoder_resolution, "stroke": axis.stroke,
        "peak": float(np.max(np.abs(plain["fit"].command))),
    }  # fmt: skip
    hidden = tuple(draw(rng, rig) for draw in draws)
    if known > 0.0 and any("coulomb" in one.changes for one in hidden):
        return None
    changes = _merged(hidden)
    told = _told(rng, axis, base, known, hidden, category)
    noisy = {name: bench.run(base, changes, True) for name, bench in benches.items()}
    if not all(signals.sound and _works(signals, benches[name], axis) for name, signals in noisy.items()):
        return None
    return _measured(told, benches, base, hidden, changes, noisy)


def _merged(hidden: tuple[Hidden, ...]) -> dict[str, float]:
    merged: dict[str, float] = {}
    for one in hidden:
        merged |= one.changes
    return merged


def _works(signals: AxisSignals, bench: _Bench, axis: Axis) -> bool:
    """Whether the loop still follows its course: no limit cycle over the whole range of the converter."""
    error = signals.position - bench.course.position
    ringing = rms(np.diff(signals.command))
    return (
        rms(error) < 0.08 * axis.stroke
        and rms(signals.command) < 7.0
        and ringing < 0.9
        and float(np.mean(np.abs(signals.command) > 9.99)) < 0.01
    )


def _told(rng: np.random.Generator, axis: Axis, base: AxisPhysics, known: float, hidden: tuple[Hidden, ...], category: str) -> Told:
    sigma = {
        "mass": float(rng.uniform(0.03, 0.08)), "viscous": float(rng.uniform(0.1, 0.25)), "effort_constant": float(rng.uniform(0.02, 0.08)),
        "conductance": float(rng.uniform(0.02, 0.04)),
    }  # fmt: skip
    if known > 0.0:
        sigma["coulomb"] = 0.1
    spread = 0.15 if category == "control" else 1.0
    if category == "parameters":
        errors = {name: float(rng.choice([-1.0, 1.0]) * rng.uniform(0.7, 1.8)) for name in sigma}
    else:
        errors = {name: float(np.clip(rng.standard_normal(), -1.8, 1.8)) * spread for name in sigma}
    given = {name: getattr(base, name) * (1.0 + errors[name] * share) for name, share in sigma.items()}
    needed = {channel for one in hidden for channel in one.needs}
    scale = "scale" in needed or rng.random() < 0.5
    current = "current" in needed or rng.random() < 0.5
    channels = ("command", "encoder", *(("scale",) if scale else ()), *(("current",) if current else ()))
    settings = {
        name: getattr(base, name)
        for name in ("position_gain", "velocity_gain", "integral_rate", "mean_share", "proportional", "integral", "derivative_gain",
                     "encoder_resolution", "scale_resolution", "converter_bits", "back_emf")
    }  # fmt: skip
    return Told("cascade_axis", given, sigma, channels, settings, given.get("coulomb", 0.0), base.pid > 0.5)


def _measured(
    told: Told, benches: dict[str, _Bench], base: AxisPhysics, hidden: tuple[Hidden, ...], changes: dict[str, float],
    noisy: dict[str, AxisSignals],
) -> MadeCase:  # fmt: skip
    recordings, floors = {}, {}
    sizes: dict[str, dict[str, Sizes]] = {one.key: {} for one in hidden}
    for name, bench in benches.items():
        full = _channels(bench.run(base, changes, False), told)
        plain = _channels(bench.run(base, {}, False), told) if hidden else full
        if "encoder_resolution" in changes:
            noise = _difference(_channels(bench.run(base, {}, True), told), plain)
        else:
            noise = _difference(_channels(noisy[name], told), full)
        floors[name] = {channel: max(rms(values), 1e-12) for channel, values in noise.items()}
        if name in ("fit", "resolve"):
            for one in hidden:
                rest = _merged(tuple(other for other in hidden if other is not one))
                without = _channels(bench.run(base, rest, False), told)
                sizes[one.key][name] = sizes_of(full, without, _slopes(told, bench, base, rest, without), floors[name])
        recordings[name] = _recording(bench, noisy[name], told)
    true_values = {key: float(getattr(base, key)) for key in told.sigma}
    return MadeCase(told, recordings, hidden, true_values, sizes, floors)


def _channels(signals: AxisSignals, told: Told) -> dict[str, np.ndarray]:
    seen = {channel: values for channel, values in signals.channels().items() if channel in told.channels}
    return with_differences(seen, told.given["conductance"])


def _difference(first: dict[str, np.ndarray], second: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {channel: first[channel] - second[channel] for channel in first}


def _slopes(
    told: Told, bench: _Bench, base: AxisPhysics, changes: dict[str, float], at: dict[str, np.ndarray]
) -> list[dict[str, np.ndarray]]:
    """Change of the noise-free channels for one declared standard deviation of each uncertain value, by a difference of a fifth of it."""
    slopes = []
    for name, share in told.sigma.items():
        moved = base._replace(**{name: getattr(base, name) * (1.0 + 0.2 * share)})
        run = _channels(bench.run(moved, {k: v for k, v in changes.items() if k != name}, False), told)
        slopes.append({channel: 5.0 * values for channel, values in _difference(run, at).items()})
    return slopes


def _recording(bench: _Bench, signals: AxisSignals, told: Told) -> Recording:
    units = {"command": "V", "encoder": "m", "scale": "m", "current": "A"}
    columns = {"time": ("s", np.arange(len(bench.course.position)) * PERIOD), "reference": ("m", bench.course.position)}
    return Recording(columns | {channel: (units[channel], signals.channels()[channel]) for channel in told.channels})
