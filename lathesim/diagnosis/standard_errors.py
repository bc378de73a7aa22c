"""Standard errors of fitted values: of the noise model, and larger where parts of the recording pull at a value more than noise does.

    covariance = H^-1 (sum over blocks of g g^T + P) H^-1,    g = sum over the block of J^T r,    H = J^T J + P

J and r are the whitened slopes and residual, P what was known beforehand. A model whose form is a little wrong leaves pulls that cancel at
the optimum, one frequency against another: the noise model has them as noise and knows nothing of their sign. Source: White, Maximum
likelihood estimation of misspecified models, Econometrica 50 (1982), eq. 3.3; blocks: Liang, Zeger, Biometrika 73 (1986).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lathesim.engine.assembly import FloatArray

_BLOCKS = 30
_NOTHING_KNOWN = 1e-12
"""Share of the information in the best known direction, values scaled alike, below which rounding is all there is."""
_NO_INFORMATION = 1e-200
_LARGEST = 10.0
"""Factor by which a standard error is at most made larger: from there on it says little more than that the form is wrong."""
_LOST = 1e100
"""Slopes from which on a run was lost."""


def covariance_of(information: FloatArray) -> FloatArray:
    """Give the covariance of an information matrix: a mixture of which nothing is known has a large variance; a value that nothing shows
    has none."""
    covariance = np.zeros_like(information)
    shown = np.flatnonzero(np.diag(information) > _NO_INFORMATION)
    if len(shown):
        there = np.ix_(shown, shown)
        size = np.sqrt(np.diag(information)[shown])
        values, vectors = np.linalg.eigh(information[there] / np.outer(size, size))
        values = np.maximum(values, _NOTHING_KNOWN * float(values[-1]))
        covariance[there] = (vectors / values) @ vectors.T / np.outer(size, size)
    return covariance


def covariance_and_misfit(
    slopes: FloatArray, residual: FloatArray, known: FloatArray, lengths: Sequence[int]
) -> tuple[FloatArray, FloatArray]:
    """Give the covariance of fitted values by the noise model, (values, values), and by what factor, at least one, each standard error is
    larger by the pulls of 30 blocks of frequencies with about as much information each, (values,).

    ``slopes`` (numbers, values) and ``residual`` (numbers,) are whitened, channel after channel of ``lengths`` numbers, real parts and then
    imaginary ones; ``known`` (values,) is what was known beforehand, one over its variance.
    """
    slopes = np.where(np.abs(slopes) < _LOST, slopes, 0.0)
    information = slopes.T @ slopes + np.diag(known)
    covariance = covariance_of(information)
    count = len(information)
    if not count:
        return covariance, np.ones(0)
    size = np.sqrt(np.maximum(np.diag(information), 1e-300))
    labels = _blocks(np.sum(np.square(slopes / size), axis=1), lengths)
    number = int(labels.max()) + 1
    pulls = np.stack([np.bincount(labels, weights=column * residual, minlength=number) for column in slopes.T], axis=1)
    pulls *= np.sqrt(number / max(number - count, 1))
    robust = covariance @ (pulls.T @ pulls + np.diag(known)) @ covariance
    own = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    return covariance, np.clip(np.sqrt(np.maximum(np.diag(robust), 0.0)) / own, 1.0, _LARGEST)


def _blocks(information: FloatArray, lengths: Sequence[int]) -> np.ndarray:
    """Give the block of every number: neighbouring frequencies of one channel with a share of the information."""
    total = max(float(information.sum()), 1e-300)
    labels, begin, first = [], 0, 0
    for length in lengths:
        half = length // 2
        both = information[begin : begin + half] + information[begin + half : begin + length]
        label = first + np.minimum((np.cumsum(both) / total * _BLOCKS).astype(np.int64), _BLOCKS)
        labels += [label, label]
        begin, first = begin + length, int(label.max(initial=first)) + 1
    return np.concatenate(labels)
