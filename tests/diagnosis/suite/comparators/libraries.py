"""The libraries of the sparse regression: residuals of the three rigs and the terms that stand for effects, all filtered alike.

Every term is formed at the full rate and then filtered as the residual is, so that a term that is fast stays comparable.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numba import njit
from scipy.signal import lfilter

from tests.diagnosis.suite.comparators.cutting_model import CHANNELS, Cut
from tests.diagnosis.suite.comparators.equation_error import filtered, held, since_reversal, strongest_periods
from tests.diagnosis.suite.comparators.read_case import PERIOD, Case
from tests.diagnosis.suite.comparators.sindy import Residual

FREE = np.inf
SMALLEST = 0.01
"""Share of what acts (force, current, cutting force) below which nothing is made of a term."""
_SMALL_SPEED, _SMALL_LENGTH = 2e-3, 1.5e-7
"""The same for a tachometer, whose values are surer, and for a scale against an encoder [m]."""
_LAGS = ("inductance", "current_loop", "delay")
SMEARED = 2
"""Thinned samples on either side of a rest that the filter smears into one another."""
_STILL, _STILL_SPINDLE = 4e-4, 0.5
"""Speeds below which an axis [m/s] and a spindle [rad/s] count as at rest."""


def residuals_of(case: Case) -> list[Residual]:
    """Return the residuals of a case with their libraries."""
    return {"cascade_axis": _axis, "torque_spindle": _spindle, "cutting_process": _cutting}[case.template](case, case.fitted)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _moving(residual: Residual, moving: np.ndarray) -> Residual:
    """Return a force residual without the samples at rest and what the filter smears of it, where dry friction is whatever holds."""
    moving = np.convolve(~moving, np.ones(2 * SMEARED + 1), mode="same") < 0.5
    if np.sum(moving) < 500:
        return residual
    baseline = [(column[moving], deviation) for column, deviation in residual.baseline]
    terms = {name: term[moving] for name, term in residual.terms.items()}
    return Residual(residual.values[moving], baseline, terms, residual.smallest, residual.ties)


def _thin(columns: Iterable[np.ndarray]) -> np.ndarray:
    return np.column_stack([filtered(column) for column in columns])


def _lagged(values: np.ndarray, time: float) -> np.ndarray:
    """Return a signal behind a first-order lag."""
    keep = float(np.exp(-PERIOD / time))
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], values - values[0])) + values[0]


def _late(values: np.ndarray, time: float) -> np.ndarray:
    """Return a signal later by a time."""
    grid = np.arange(len(values)) * PERIOD
    return np.asarray(np.interp(grid - time, grid, values))


@njit(cache=True)
def _second_order(values: np.ndarray, time: float) -> np.ndarray:
    """Return a signal behind a second-order loop of damping 0.7 (semi-implicit steps)."""
    h, out = PERIOD / time, np.zeros(len(values))
    place, rate = values[0], 0.0
    for k in range(len(values)):
        out[k] = place
        for _ in range(4):
            rate += 0.25 * h * (values[k] - place - 1.4 * rate)
            place += 0.25 * h * rate
    return out


@njit(cache=True)
def _play(values: np.ndarray, width: float) -> np.ndarray:
    """Return how far what follows with play is from what leads."""
    out, behind, half = np.zeros(len(values)), values[0], 0.5 * width
    for k in range(len(values)):
        behind = min(max(behind, values[k] - half), values[k] + half)
        out[k] = behind - values[k]
    return out


def _drive_terms(command: np.ndarray, scale: float) -> dict[str, np.ndarray]:
    """Terms of an amplifier and what is before it, for a residual that is ``scale`` times a voltage."""
    u, peak = held(command), float(np.max(np.abs(command)))
    terms = {"dead_zone": _thin([scale * np.clip(u / 0.15, -1.0, 1.0)])}
    for share in (0.55, 0.7, 0.8, 0.9):
        terms[f"saturation:{share}"] = _thin([scale * np.sign(u) * np.maximum(np.abs(u) - share * peak, 0.0)])
    terms["converter_step"] = _thin([scale * (np.round(u * 255.0 / 20.0) * 20.0 / 255.0 - u)])
    for time in (1e-3, 2e-3, 4e-3):
        terms[f"delay:{time}"] = _thin([scale * (_late(u, time) - u)])
        terms[f"inductance:{time}"] = _thin([scale * (_lagged(u, 1.5 * time) - u)])
        terms[f"current_loop:{time}"] = _thin([scale * (_second_order(u, time) - u)])
    return terms


def _axis(case: Case, columns: dict[str, np.ndarray]) -> list[Residual]:
    given, sigma = case.given, case.sigma
    raw = columns["encoder"]
    place = np.convolve(np.pad(raw, 5, mode="edge"), np.ones(11) / 11.0, mode="valid")
    v = np.gradient(place, PERIOD)
    x, speed, a = (filtered(raw, derivatives=order) for order in range(3))
    u, back = held(columns["command"]), given.get("back_emf", 0.0)
    planned = given["conductance"] * (u - back * v)
    has_current = "current" in columns
    current = held(columns["current"]) if has_current else planned
    applied = given["effort_constant"] * current
    travelled = since_reversal(raw)
    sign = np.clip(travelled / 2e-6, -1.0, 1.0) * (np.abs(v) > 2e-5)
    force = filtered(applied) - given["mass"] * a - given["viscous"] * speed - given.get("coulomb", 0.0) * filtered(sign)
    baseline = [(a, sigma["mass"]), (speed, sigma["viscous"]), (filtered(current), sigma["effort_constant"])]
    if not has_current:
        baseline.append((filtered(applied) / given["conductance"], sigma["conductance"]))
    if "coulomb" in sigma:
        baseline.append((filtered(sign), sigma["coulomb"]))
    beside = np.column_stack([column for column, _ in baseline] + [filtered(sign)])
    thin_sign = filtered(sign)
    terms = {
        "coulomb": _thin([sign]), "gravity": np.ones((len(x), 1)), "asymmetric": _thin([np.abs(v)]),
        "resonance": np.column_stack([np.gradient(np.gradient(a, 5.0 * PERIOD), 5.0 * PERIOD)]),
        # a dry friction of two levels is, without the samples at rest, one of one level and a constant; so it has no term of its own
        # terms of a usual library that stand for nothing in the catalogue; they keep others from taking their place
        "other:square": _thin([v * np.abs(v)]), "other:cube": _thin([v**3]), "other:place": _thin([place - place.mean()]),
    }  # fmt: skip
    for fall in (2e-3, 5e-3, 15e-3):
        terms[f"stribeck:{fall}"] = _thin([sign * np.exp(-np.abs(v) / fall)])
    for travel in (5e-6, 15e-6, 40e-6):
        terms[f"bristles:{travel}"] = _thin([np.sign(travelled) * np.exp(-np.abs(travelled) / travel)])
    for length in strongest_periods(x, force, 0.6e-3, 0.012, 2, beside):
        waves = [np.sin(2.0 * np.pi * place / length), np.cos(2.0 * np.pi * place / length)]
        terms[f"cogging:{length}"] = _thin(waves)
        terms[f"ripple:{length}"] = _thin([applied * wave for wave in waves])
    for length in strongest_periods(x, force * thin_sign, 0.015, 0.15, 1, beside * thin_sign[:, None]):
        terms["tight_spots"] = _thin([sign * np.sin(2.0 * np.pi * place / length), sign * np.cos(2.0 * np.pi * place / length)])
    ties: dict[str, tuple[str, ...]] = {"cogging": ("ripple",), "ripple": ("cogging",)}
    found = []
    if has_current:
        drive = _drive_terms(columns["command"], given["conductance"])
        drive["converter_offset"] = np.ones((len(x), 1))
        driven = filtered(planned)
        base = [(driven / given["conductance"], sigma["conductance"])]
        found.append(Residual(filtered(current - planned), base, drive, SMALLEST * _rms(driven)))
    else:
        terms |= _drive_terms(columns["command"], given["conductance"] * given["effort_constant"])
        ties |= {"gravity": ("converter_offset",), **{one: tuple(other for other in _LAGS if other != one) for one in _LAGS}}
    if "coulomb" in sigma:
        # it is in the baseline already
        del terms["coulomb"]
    found.append(_moving(Residual(force, baseline, terms, SMALLEST * _rms(filtered(applied)), ties), np.abs(speed) > _STILL))
    if "scale" in columns:
        found.append(_screw(columns, place, v, applied, x))
    return found


def _screw(columns: dict[str, np.ndarray], place: np.ndarray, v: np.ndarray, applied: np.ndarray, x: np.ndarray) -> Residual:
    raw, time = columns["encoder"], np.arange(len(place)) * PERIOD
    screw = columns["scale"] - raw
    residual = filtered(screw)
    fine = 2.0 * np.pi * raw / 20e-6
    jump = np.abs(np.convolve(screw, np.r_[np.ones(200), -np.ones(200)] / 200.0, mode="same"))
    terms = {
        "pitch": _thin([place]), "wind_up": _thin([applied]), "resonance": filtered(place, derivatives=2)[:, None],
        "interpolation": _thin([np.sin(fine), np.cos(fine)]), "channel_shift": _thin([v]), "clock_skew": _thin([time * v]),
        "lost_counts": _thin([(time >= time[int(np.argmax(jump[200:-200])) + 200]).astype(float)]),
    }  # fmt: skip
    for width in (3e-6, 8e-6, 20e-6, 50e-6):
        terms[f"backlash:{width}"] = _thin([_play(raw, width)])
    for growth in (10.0, 40.0):
        terms[f"screw_growth:{growth}"] = _thin([(1.0 - np.exp(-time / growth)) * place, 1.0 - np.exp(-time / growth)])
    for length in strongest_periods(x, residual, 3e-3, 0.015, 1, np.column_stack([filtered(v), filtered(applied)])):
        terms["pitch_wave"] = _thin([np.sin(2.0 * np.pi * place / length), np.cos(2.0 * np.pi * place / length)])
    ties = {"pitch_wave": ("eccentricity",), "pitch": ("scale_factor",)}
    return Residual(residual, [(np.ones(len(x)), FREE)], terms, _SMALL_LENGTH, ties)


def _spindle(case: Case, columns: dict[str, np.ndarray]) -> list[Residual]:
    given, sigma = case.given, case.sigma
    angle, torque, load = columns["encoder"], held(columns["torque"]), held(columns["load"])
    _, speed, rate = (filtered(angle, derivatives=order) for order in range(3))
    place = np.convolve(np.pad(angle, 5, mode="edge"), np.ones(11) / 11.0, mode="valid")
    v = np.gradient(place, PERIOD)
    force = filtered(torque - load) - given["inertia"] * rate - given["viscous"] * speed
    sign, peak = np.tanh(v / 0.3), float(np.max(np.abs(torque)))
    terms = {"spindle_coulomb": _thin([sign]), "spindle_asymmetric": _thin([np.abs(sign)]), "other:square": _thin([v * np.abs(v)])}
    for share in (0.6, 0.7, 0.8, 0.9):
        terms[f"torque_limit:{share}"] = _thin([np.sign(torque) * np.maximum(np.abs(torque) - share * peak, 0.0)])
    for order in (1.0, 2.0, 4.0):
        waves = [np.sin(order * place), np.cos(order * place)]
        terms[f"spindle_cogging:{order}"] = _thin(waves)
        terms[f"spindle_ripple:{order}"] = _thin([torque * wave for wave in waves])
    terms["disc_eccentricity"] = np.column_stack([filtered(wave(place), derivatives=2) for wave in (np.sin, np.cos)])
    ties = {"spindle_cogging": ("spindle_ripple",), "spindle_ripple": ("spindle_cogging",)}
    moving = np.abs(speed) > _STILL_SPINDLE
    balance = Residual(force, [(rate, sigma["inertia"]), (speed, sigma["viscous"])], terms, SMALLEST * _rms(filtered(torque)), ties)
    shown = filtered(columns["tachometer"]) / given["gain"]
    seen = {"tacho_gain": speed[:, None], "belt_slip": _thin([np.abs(load) * v])}
    for response in (0.12, 0.25, 0.5):
        seen[f"speed_droop:{response}"] = _thin([_lagged(load, response)])
    for time in (5e-3, 10e-3, 20e-3):
        seen[f"tacho_filter:{time}"] = _thin([_lagged(v, time) - v])
    for order in range(1, 9):
        seen[f"tacho_ripple:{order}"] = _thin([v * np.sin(order * place), v * np.cos(order * place)])
    return [_moving(balance, moving), Residual(shown - speed, [(speed, sigma["gain"] / given["gain"])], seen, _SMALL_SPEED * _rms(speed))]


def _cutting(case: Case, columns: dict[str, np.ndarray]) -> list[Residual]:
    given, cut = case.given, Cut(columns["feed"], columns["depth"], columns["speed"], case.given["radius"])
    force = given["specific_force"] * cut.area
    shares = {"main": 1.0, "thrust": given["thrust_ratio"], "feed_force": given["feed_ratio"]}
    found = []
    for channel in CHANNELS:
        if channel not in columns:
            continue
        residual, whole = columns[channel] - shares[channel] * force, shares[channel] * force
        deviation = np.hypot(case.sigma["specific_force"] / given["specific_force"], 0.0 if channel == "main" else 0.05)
        terms = {
            "edge_force": cut.depth * cut.cuts, "size_effect": whole * np.log(cut.feed / 1e-3),
            "speed_effect:power": whole * np.log(cut.speed / 2.0), "wear": np.column_stack([whole * cut.cut_time]),
            "other:depth": whole * np.log(cut.depth / 1e-3),
        }  # fmt: skip
        for place in (0.6, 0.85, 1.1):
            terms[f"speed_effect:{place}"] = whole * np.exp(-(((cut.speed - place) / 0.3) ** 2))
        for time in (0.7, 2.5):
            terms[f"softening:{time}"] = whole * cut.warmth(time)
        for order in (1, 2, 3):
            terms[f"runout:{order}"] = np.column_stack([whole / cut.depth * wave(order * cut.angle) for wave in (np.sin, np.cos)])
        terms |= _over_the_turn(cut, whole, residual)
        if channel == "main":
            terms |= {"charge_leak:drift": cut.time, "charge_leak:leak": np.cumsum(force) * PERIOD}
        found.append(Residual(residual, [(whole, float(deviation))], terms, SMALLEST * _rms(whole)))
    return found


def _over_the_turn(cut: Cut, whole: np.ndarray, residual: np.ndarray) -> dict[str, np.ndarray]:
    """A gap and a hard spot, each where the mean over the angle of what is left is lowest and highest."""
    bins = 48
    place = np.floor(np.mod(cut.angle, 2.0 * np.pi) / (2.0 * np.pi) * bins).astype(int) % bins
    mean = np.bincount(place, residual * whole, bins) / np.maximum(np.bincount(place, whole * whole, bins), 1e-300)
    found = {}
    for key, width, low in (("slot:narrow", 0.1, True), ("slot:wide", 0.25, True), ("hard_spot", 0.08, False)):
        reach = max(int(width * bins), 1)
        smooth = np.convolve(np.r_[mean, mean, mean], np.ones(reach) / reach, mode="same")[bins : 2 * bins]
        middle = (float(np.argmin(smooth) if low else np.argmax(smooth)) + 0.5) / bins * 2.0 * np.pi
        away = np.abs(np.mod(cut.angle - middle + np.pi, 2.0 * np.pi) - np.pi)
        found[key] = whole * ((away < np.pi * width) if low else np.exp(-0.5 * (away / (np.pi * width)) ** 2))
    return found
