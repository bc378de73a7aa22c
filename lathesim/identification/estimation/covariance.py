"""Standard errors of fitted values: of the noise model, and larger where parts of the recording pull at a value more than noise does.

    value_b - value = -(H - J_b^T J_b)^-1 g_b,    g_b = J_b^T r_b,    H = J^T J + P
    covariance = (B - 1) / B sum_b (value_b - value)(value_b - value)^T + H^-1 P H^-1

J and r are the whitened slopes and residual, P what was known beforehand; value_b is fitted without block b. A model whose form is a
little wrong leaves pulls that cancel at the optimum, one frequency against another: the noise model has them as noise and knows nothing of
their sign. A block that tells nearly all of a value is fitted exactly and pulls no more: without it the value shows how sure it was. Where
few blocks tell, so few pulls are known that a 95 % interval is t / 1.96 wider; the degrees of freedom are 1 / sum_b w_b^2, w_b the
block's share of what is known of the value. Source: White, Maximum likelihood estimation of misspecified models, Econometrica 50 (1982);
MacKinnon, White, Some heteroskedasticity-consistent covariance matrix estimators with improved finite sample properties, Journal of
Econometrics 29 (1985) (jackknife); Bell, McCaffrey, Bias reduction in standard errors for linear regression with multi-stage samples,
Survey Methodology 28 (2002) (degrees of freedom); blocks: Liang, Zeger, Biometrika 73 (1986).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import stdtrit

from lathesim.engine.assembly import FloatArray
from lathesim.identification.signal import BEYOND, ROUNDING

SIGNIFICANT = 3.0
"""Standard errors by which a size differs from nothing, or two differ: a normal deviate exceeds them with 0.27 %."""
BLOCKS = 30
"""Blocks of a recording, each with an error of its own, over which a covariance is taken."""
LARGEST_INFLATION = 20.0
"""Factor by which a standard error is at most made larger: from there on it says little more than that the form is wrong."""
_FEWEST = 5.0
"""Factor by which an interval is at most wider because few blocks tell."""


def covariance_of(information: FloatArray) -> FloatArray:
    """Return the covariance of an information matrix: large for a mixture that nothing tells, none for a value that nothing shows."""
    covariance = np.zeros_like(information)
    shown = np.flatnonzero(np.diag(information) > np.finfo(float).tiny)
    if len(shown):
        there = np.ix_(shown, shown)
        size = np.sqrt(np.diag(information)[shown])
        values, vectors = np.linalg.eigh(information[there] / np.outer(size, size))
        values = np.maximum(values, ROUNDING * float(values[-1]))
        covariance[there] = (vectors / values) @ vectors.T / np.outer(size, size)
    return covariance


def covariance_and_misfit(
    slopes: FloatArray, residual: FloatArray, known: FloatArray, lengths: Sequence[int]
) -> tuple[FloatArray, FloatArray]:
    """Return the covariance of fitted values by the noise model, (values, values), and by what factor, at least one, each standard error is
    larger by the pulls of 30 blocks of frequencies with about as much information each, (values,).

    ``slopes`` (numbers, values) and ``residual`` (numbers,) are whitened, channel after channel of ``lengths`` numbers, real parts and then
    imaginary ones; ``known`` (values,) is what was known beforehand, one over its variance.
    """
    slopes = np.where(np.abs(slopes) < BEYOND, slopes, 0.0)
    information = slopes.T @ slopes + np.diag(known)
    covariance = covariance_of(information)
    if not len(information):
        return covariance, np.ones(0)
    size = np.sqrt(np.maximum(np.diag(information), 1e-300))
    labels = blocks_of(np.sum(np.square(slopes / size), axis=1), lengths)
    order = np.argsort(labels, kind="stable")
    ends = np.flatnonzero(np.diff(labels[order])) + 1
    moves, told = [], []
    for rows, left in zip(np.split(slopes[order], ends), np.split(residual[order], ends), strict=True):
        of_block = rows.T @ rows
        moves.append(covariance_of(information - of_block) @ (rows.T @ left))
        told.append(np.maximum(np.einsum("ij,jk,ki->i", covariance, of_block, covariance), 0.0))
    apart = np.array(moves)
    variance = (len(apart) - 1) / len(apart) * np.sum(apart * apart, axis=0) + np.square(covariance) @ known
    own = np.maximum(np.diag(covariance), 1e-300)
    wider = np.sqrt(np.maximum(variance / own - 1.0, 0.0)) * _wider_by_few(np.array(told))
    return covariance, np.minimum(np.sqrt(1.0 + np.square(wider)), LARGEST_INFLATION)


def _wider_by_few(told: FloatArray) -> FloatArray:
    """Return by what factor a 95 % interval is wider for the few blocks that tell of each value; ``told`` (blocks, values)."""
    shares = told / np.maximum(told.sum(axis=0), 1e-300)
    freedom = 1.0 / np.maximum(np.sum(shares * shares, axis=0), 1e-12)
    return np.asarray(np.minimum(stdtrit(np.maximum(freedom, 1.0), 0.975) / stdtrit(np.inf, 0.975), _FEWEST))


def blocks_of(information: FloatArray, lengths: Sequence[int]) -> np.ndarray:
    """Return the block of every number: neighbouring frequencies of one channel with a share of the information."""
    total = max(float(information.sum()), 1e-300)
    labels, begin, first = [], 0, 0
    for length in lengths:
        half = length // 2
        both = information[begin : begin + half] + information[begin + half : begin + length]
        label = first + np.minimum((np.cumsum(both) / total * BLOCKS).astype(np.int64), BLOCKS)
        labels += [label, label]
        begin, first = begin + length, int(label.max(initial=first)) + 1
    return np.concatenate(labels)
