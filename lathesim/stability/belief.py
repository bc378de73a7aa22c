"""What cuts say about a machine with one mode: a distribution of its parameters as particles, moved by each cut.

The parameters are the logarithms of natural frequency, damping, and of the ratio k/(Ks mu) that stiffness and cutting stiffness only show
together. A cut is stable with the probability  1/(1 + (b/b_lim)^(1/softness)),  so that a width under a stable one is stable by
construction. After each cut particles are weighted by it, drawn anew where few carry the weight, and moved by Metropolis steps.

Source: N. Chopin, Biometrika 89 (2002), sequential particle filters for static models; J. Karandikar, T. Schmitz, A. Abbas, J. Manuf. Sci.
Eng. 136 (2014), Bayesian stability of milling. Left out: more than one mode, which :mod:`lathesim.stability.learned_map` looks for.

Limits and chatter frequencies of one mode, for many machines at once.

In units of the mode, rho = w/w_n, r = n/(60 f_n) and beta = b Ks mu/k, the limit is beta = -1/(2 Re g(rho)) with g = 1/(1 - rho^2 + 2 j
zeta rho), met where  rho = r (N + eps(rho)/(2 pi)).  For each lobe N there is one such rho above 1, as eps falls from 2 pi to pi. Above the
limit the cut vibrates as exp(s t) with  s^2 + 2 zeta s + 1 + beta (1 - exp(-2 pi s/r)) = 0.

Source: Y. Altintas, Manufacturing Automation (2012), section 4.2; T. Schmitz, K. S. Smith, Machining Dynamics (2019), chapter 3.

Cuts that were tried, read from a table.
"""

from __future__ import annotations

import csv
import functools
import io
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.errors import LatheSimError, LessonError, nearest
from lathesim.record import FloatArray
from lathesim.stability.stability_thresholds import MAP
from lathesim.units import in_unit, quantity

_RPM = 9.549296585513721
_STABLE = {
    "1": True,
    "true": True,
    "yes": True,
    "stable": True,
    "y": True,
    "0": False,
    "false": False,
    "no": False,
    "chatter": False,
    "n": False,
}
_COLUMNS = ("speed", "width", "stable", "frequency", "power")


@dataclass(frozen=True)
class TriedCut:
    """A cut: speed [rpm], chip width [m], whether it was stable, the chatter frequency [Hz] and the power [W] where they were recorded."""

    speed: float
    width: float
    stable: bool
    frequency: float = math.nan
    power: float = math.nan


def read_cuts(path: Path) -> tuple[TriedCut, ...]:
    """Return the cuts of a CSV file with the columns ``speed [rpm], width [mm], stable`` and perhaps ``frequency [Hz], power [W]``.

    ``stable`` is yes or no, 1 or 0, stable or chatter. Raises :class:`LessonError` with the line where a cut cannot be.
    """
    try:
        text = path.read_text(encoding="utf-8-sig", errors="replace")
    except FileNotFoundError:
        raise LessonError(
            "there is no such file.", place=str(path), remedy="Give a table of cuts: speed [rpm],width [mm],stable."
        ) from None
    lines = io.StringIO(text.replace(";", ",").replace("\t", ","))
    try:
        rows = [row for row in csv.reader(lines) if row and any(cell.strip() for cell in row)]
    except csv.Error as error:
        raise LessonError(f"the file is no table: {error}.", place=str(path), remedy="Write one cut a line.") from None
    if not rows:
        return ()
    at, scale = _columns(rows[0], str(path))
    return tuple(_cut(row, at, scale, f"{path}:{number}") for number, row in enumerate(rows[1:], 2))


def _columns(header: list[str], path: str) -> tuple[dict[str, int], dict[str, float]]:
    """Return where each column stands and its factor to rpm, metres, hertz and watts."""
    at: dict[str, int] = {}
    scale: dict[str, float] = {}
    units = {"speed": "rpm", "width": "mm", "frequency": "Hz", "power": "W"}
    for place, cell in enumerate(header):
        match = re.fullmatch(r"\s*([\w ]+?)\s*(?:[\[(]([^\])]*)[\])])?\s*", cell)
        name = match[1].lower().replace("chatter ", "").replace("chip ", "").replace("spindle ", "") if match else cell.strip()
        name, _, suffix = name.partition("_")
        unit = (match[2] if match else None) or {"m": "m", "mm": "mm", "rpm": "rpm", "hz": "Hz", "w": "W"}.get(suffix)
        if name not in _COLUMNS:
            raise LessonError(
                f"there is no column '{cell.strip()}' of a cut.",
                place=f"{path}:1",
                remedy=nearest(name, _COLUMNS) or f"Columns: {', '.join(_COLUMNS)}.",
            )
        at[name] = place
        if name in units:
            try:
                scale[name] = quantity(f"1 {unit or units[name]}", units[name])
            except LatheSimError as error:
                raise LessonError(error.fact, place=f"{path}:1", remedy=error.remedy) from None
    missing = [name for name in _COLUMNS[:3] if name not in at]
    if missing:
        raise LessonError(f"the column '{missing[0]}' is missing.", place=f"{path}:1", remedy="Begin with: speed [rpm],width [mm],stable.")
    scale["speed"] *= _RPM
    return at, scale


def _cut(row: list[str], at: dict[str, int], scale: dict[str, float], place: str) -> TriedCut:
    def number(name: str, *, needed: bool) -> float:
        text = row[at[name]].strip() if name in at and at[name] < len(row) else ""
        if not text and not needed:
            return math.nan
        try:
            return float(text) * scale[name]
        except ValueError:
            raise LessonError(f"the {name} is '{text}'.", place=place, remedy="Give a number.") from None

    word = row[at["stable"]].strip().lower() if at["stable"] < len(row) else ""
    if word not in _STABLE:
        raise LessonError(f"'{word}' does not say whether the cut was stable.", place=place, remedy="Write yes or no.")
    cut = TriedCut(
        number("speed", needed=True),
        number("width", needed=True),
        _STABLE[word],
        number("frequency", needed=False),
        number("power", needed=False),
    )
    if not (cut.speed > 0.0 and math.isfinite(cut.speed)):
        raise LessonError(f"the speed is {cut.speed:g} rpm.", place=place, remedy="Give one above 0.")
    if not (cut.width > 0.0 and math.isfinite(cut.width)):
        raise LessonError(f"the width is {in_unit(cut.width, 'mm', 'g')}.", place=place, remedy="Give one above 0.")
    return cut


_LOBES = 5
"""Lobes looked at, from the first that reaches above the natural frequency; higher ones lie above."""
_HALVINGS = 44
_RATES = (0.012, 8.0, 2400)
_DAMPINGS = (0.002, 0.6, 60)


def lobes_of(rate: FloatArray, damping: FloatArray, halvings: int = _HALVINGS) -> tuple[FloatArray, FloatArray]:
    """Return the limits beta and the frequencies rho of the lobes around, both (lobes, ...), for r and zeta of one shape."""
    first = np.maximum(np.ceil(1.0 / rate - 1.0 + 1e-12), 0.0)
    limits, places = [], []
    for lobe in range(_LOBES):
        number = first + lobe
        low, high = np.maximum(1.0, rate * (number + 0.5)), rate * (number + 1.0)
        for _ in range(halvings):
            middle = 0.5 * (low + high)
            turn = np.arctan2(2.0 * damping * middle, middle * middle - 1.0) / np.pi
            # arg g = -(pi - that angle); eps/(2 pi) = 1/2 + angle/pi
            above = middle - rate * (number + 0.5 + turn) > 0.0
            low, high = np.where(above, low, middle), np.where(above, middle, high)
        rho = 0.5 * (low + high)
        real = (1.0 - rho**2) / ((1.0 - rho**2) ** 2 + (2.0 * damping * rho) ** 2)
        limits.append(np.where(real < 0.0, -0.5 / np.minimum(real, -1e-300), np.inf))
        places.append(rho)
    return np.stack(limits), np.stack(places)


@functools.cache
def _table() -> tuple[FloatArray, float, float, float, float]:
    """Return the logarithm of the limit over the logarithms of r and zeta, and the grid's beginnings and steps."""
    low, high, count = _RATES
    rates = np.linspace(math.log(low), math.log(high), count)
    least, most, lines = _DAMPINGS
    dampings = np.linspace(math.log(least), math.log(most), lines)
    r, z = np.meshgrid(np.exp(rates), np.exp(dampings), indexing="ij")
    limits = lobes_of(r, z, 24)[0].min(axis=0)
    return np.log(limits), float(rates[0]), float(rates[1] - rates[0]), float(dampings[0]), float(dampings[1] - dampings[0])


def log_limit(log_rate: FloatArray, log_damping: FloatArray) -> FloatArray:
    """Return the logarithm of the limit beta at logarithms of r and zeta, linear in a table; beyond its ends the end counts."""
    table, first, step, begin, width = _table()
    x = np.clip((log_rate - first) / step, 0.0, table.shape[0] - 1.001)
    y = np.clip((log_damping - begin) / width, 0.0, table.shape[1] - 1.001)
    i, j = x.astype(np.int64), y.astype(np.int64)
    u, v = x - i, y - j
    return np.asarray((1 - u) * ((1 - v) * table[i, j] + v * table[i, j + 1]) + u * ((1 - v) * table[i + 1, j] + v * table[i + 1, j + 1]))


def chatter_places(rate: FloatArray, damping: FloatArray, beta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return rho of the limit and of the fastest growing vibration at a width beta, both as ``rate``; both are equal where it is stable."""
    limits, places = lobes_of(rate, damping)
    lowest = np.take_along_axis(places, limits.argmin(axis=0)[None], axis=0)[0]
    best_growth, best = np.full(rate.shape, -np.inf), lowest.copy()
    delay = 2.0 * np.pi / rate
    for limit, place in zip(limits, places, strict=True):
        unstable = limit < beta
        if not unstable.any():
            continue
        s = 1j * place
        for part in (0.25, 0.5, 0.75, 1.0):
            now = np.where(unstable, limit * np.exp(part * np.log(np.where(unstable, beta / limit, 1.0))), 1.0)
            for _ in range(4):
                s = s - _newton(s, damping, now, delay)
        growth = np.where(unstable & np.isfinite(s.real) & (s.imag > MAP.lowest) & (s.imag < MAP.highest), s.real, -np.inf)
        better = growth > best_growth
        best, best_growth = np.where(better, s.imag, best), np.where(better, growth, best_growth)
    return lowest, best


def _newton(s: Any, damping: FloatArray, beta: FloatArray, delay: FloatArray) -> Any:
    wave = np.exp(np.clip(-(s * delay).real, -50.0, 50.0) - 1j * (s * delay).imag)
    value = s * s + 2.0 * damping * s + 1.0 + beta * (1.0 - wave)
    slope = 2.0 * s + 2.0 * damping + beta * delay * wave
    step = value / slope
    return step * np.minimum(1.0, 0.1 / np.maximum(np.abs(step), 1e-300))


PARTICLES = 4000
SOFTNESS = 0.012
"""How sharp a limit is, relative: cuts within it are stable or not by chance."""
MISLABELLED = 0.002
"""Share of cuts that were judged wrongly, assumed."""
FREQUENCY_NOISE = 1.0
"""Standard deviation of a chatter frequency [Hz]."""
_FREQUENCY_MODEL = 0.003
"""And what the linear model may be off, relative."""
_MOVES = 4


@dataclass(frozen=True)
class Prior:
    """Means and standard deviations of the logarithms of natural frequency [Hz], damping and k/(Ks mu) [m], each (3,)."""

    mean: FloatArray
    deviation: FloatArray


@dataclass(frozen=True, eq=False)
class Belief:
    """Particles (count, 3), the logarithms of their weights (count,), the prior and the cuts behind them."""

    prior: Prior
    particles: FloatArray
    log_weights: FloatArray
    cuts: tuple[TriedCut, ...]
    seed: int
    surprise: tuple[float, ...] = ()

    @property
    def weights(self) -> FloatArray:
        """The weights, which add up to 1."""
        w = np.exp(self.log_weights - self.log_weights.max())
        return np.asarray(w / w.sum())

    def log_limits(self, speeds: FloatArray) -> FloatArray:
        """Return the logarithm of the limit [m] of each particle at each speed [rpm], (particles, speeds)."""
        return log_limits(self.particles, speeds)

    def stable_probability(self, speeds: FloatArray, widths: FloatArray) -> FloatArray:
        """Return the probability that each cut is stable; speeds [rpm] and widths [m] of one shape (cuts,)."""
        return np.asarray(self.weights @ stable_chance(self.log_limits(speeds) - np.log(widths)))


def log_limits(particles: FloatArray, speeds: FloatArray) -> FloatArray:
    """Return the logarithm of the limit [m] of each particle at each speed [rpm], (particles, speeds)."""
    rate = np.log(np.asarray(speeds) / 60.0)[None, :] - particles[:, :1]
    return np.asarray(particles[:, 2:3] + log_limit(rate, np.broadcast_to(particles[:, 1:2], rate.shape)))


def stable_chance(excess: FloatArray) -> FloatArray:
    """Return the probability of being stable where the limit is exp(excess) times the width."""
    soft = 1.0 / (1.0 + np.exp(np.clip(-excess / SOFTNESS, -60.0, 60.0)))
    return np.asarray(MISLABELLED + (1.0 - 2.0 * MISLABELLED) * soft)


def begin(prior: Prior, seed: int = 1, count: int = PARTICLES) -> Belief:
    """Return the belief before any cut."""
    chance = np.random.Generator(np.random.Philox(seed))
    return Belief(prior, prior.mean + prior.deviation * chance.standard_normal((count, 3)), np.zeros(count), (), seed)


def learn(belief: Belief, cut: TriedCut) -> Belief:
    """Return the belief after a further cut; ``surprise`` gains minus the logarithm of the probability that it had before."""
    gained = log_likelihood(belief.particles, cut)
    weights = belief.weights
    highest = float(gained.max())
    surprise = -(math.log(float(weights @ np.exp(gained - highest)) + 1e-300) + highest)
    cuts = (*belief.cuts, cut)
    log_weights = belief.log_weights + gained
    found = replace(belief, log_weights=log_weights - log_weights.max(), cuts=cuts, surprise=(*belief.surprise, surprise))
    weights = found.weights
    if 1.0 / float((weights**2).sum()) > MAP.few_left * len(weights):
        return found
    return _moved(found, np.random.Generator(np.random.Philox(key=belief.seed + 7919 * len(cuts))))


def learn_all(prior: Prior, cuts: Sequence[TriedCut], seed: int = 1) -> Belief:
    """Return the belief after all cuts."""
    belief = begin(prior, seed)
    for cut in cuts:
        belief = learn(belief, cut)
    return belief


def _moved(belief: Belief, chance: np.random.Generator) -> Belief:
    """Return a belief with particles drawn anew by weight, in steps where the weights are too uneven, and moved by Metropolis steps."""
    count = len(belief.particles)
    positions = (np.arange(count) + chance.random()) / count
    particles = belief.particles[np.searchsorted(np.cumsum(belief.weights), positions).clip(0, count - 1)]
    density = _log_posterior(belief, particles)
    for turn in range(_MOVES):
        spread = np.cov(particles.T) + np.diag((1e-6 * belief.prior.deviation) ** 2 + 1e-18)
        step = np.linalg.cholesky(spread) * (1.4 if turn % 2 == 0 else 0.35)
        trial = particles + chance.standard_normal((count, 3)) @ step.T
        there = _log_posterior(belief, trial)
        taken = np.log(chance.random(count)) < there - density
        particles, density = np.where(taken[:, None], trial, particles), np.where(taken, there, density)
    return replace(belief, particles=particles, log_weights=np.zeros(count))


def _log_posterior(belief: Belief, particles: FloatArray) -> FloatArray:
    z = (particles - belief.prior.mean) / np.maximum(belief.prior.deviation, 1e-9)
    total = -0.5 * (z * z).sum(axis=1)
    for cut in belief.cuts:
        total += log_likelihood(particles, cut)
    return np.asarray(total)


def log_likelihood(particles: FloatArray, cut: TriedCut) -> FloatArray:
    """Return the logarithm of the likelihood of a cut for each particle: stable or not, and the chatter frequency where it is known."""
    stable = stable_chance(log_limits(particles, np.array([cut.speed]))[:, 0] - math.log(cut.width))
    found = np.log(stable if cut.stable else 1.0 - stable)
    if not cut.stable and math.isfinite(cut.frequency):
        found = found + np.log(_frequency_density(particles, cut))
    return np.asarray(found)


def _frequency_density(particles: FloatArray, cut: TriedCut) -> FloatArray:
    """Return the density of a chatter frequency: it is that of the limit or that of the fastest growth, whichever the machine shows."""
    natural, damping = np.exp(particles[:, 0]), np.exp(np.clip(particles[:, 1], -8.0, -0.3))
    at_limit, fastest = chatter_places(cut.speed / 60.0 / natural, damping, cut.width / np.exp(particles[:, 2]))
    noise = math.hypot(FREQUENCY_NOISE, _FREQUENCY_MODEL * cut.frequency)
    total = np.zeros(len(particles))
    for place in (at_limit, fastest):
        z = (cut.frequency - natural * place) / noise
        total += 0.5 * np.exp(-0.5 * z * z) / noise
    return np.asarray(total + 1e-7)
