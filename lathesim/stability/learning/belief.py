"""What cuts say about a machine with one mode: a distribution of its parameters as particles, moved by each cut.

The parameters are the logarithms of natural frequency, damping, and of the ratio k/(Ks mu) that stiffness and cutting stiffness only show
together. A cut is stable with the probability  1/(1 + (b/b_lim)^(1/softness)),  so that a width under a stable one is stable by
construction. After each cut particles are weighted by it, drawn anew where few carry the weight, and moved by Metropolis steps.

Source: N. Chopin, Biometrika 89 (2002), sequential particle filters for static models; J. Karandikar, T. Schmitz, A. Abbas, J. Manuf. Sci.
Eng. 136 (2014), Bayesian stability of milling. Left out: more than one mode, which :mod:`lathesim.stability.learning.adequacy` looks for.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from lathesim.record import FloatArray
from lathesim.stability.learning.one_mode import chatter_places, log_limit
from lathesim.stability.learning.tried_cuts import TriedCut

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
        limits = self.log_limits(speeds)
        return np.asarray(self.weights @ stable_chance(limits - np.log(widths)))


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
    if 1.0 / float((weights**2).sum()) > 0.6 * len(weights):
        return found
    return _moved(found, np.random.Generator(np.random.Philox(key=belief.seed + 7919 * len(cuts))))


def learn_all(prior: Prior, cuts: Sequence[TriedCut], seed: int = 1, count: int = PARTICLES) -> Belief:
    """Return the belief after all cuts."""
    belief = begin(prior, seed, count)
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
    excess = log_limits(particles, np.array([cut.speed]))[:, 0] - math.log(cut.width)
    stable = stable_chance(excess)
    found = np.log(stable if cut.stable else 1.0 - stable)
    if not cut.stable and math.isfinite(cut.frequency):
        found = found + np.log(_frequency_density(particles, cut))
    return np.asarray(found)


def _frequency_density(particles: FloatArray, cut: TriedCut) -> FloatArray:
    """Return the density of a chatter frequency: it is that of the limit or that of the fastest growth, whichever the machine shows."""
    natural, damping = np.exp(particles[:, 0]), np.exp(np.clip(particles[:, 1], -8.0, -0.3))
    rate = cut.speed / 60.0 / natural
    at_limit, fastest = chatter_places(rate, damping, cut.width / np.exp(particles[:, 2]))
    noise = math.hypot(FREQUENCY_NOISE, _FREQUENCY_MODEL * cut.frequency)
    total = np.zeros(len(particles))
    for place in (at_limit, fastest):
        z = (cut.frequency - natural * place) / noise
        total += 0.5 * np.exp(-0.5 * z * z) / noise
    return np.asarray(total + 1e-7)
