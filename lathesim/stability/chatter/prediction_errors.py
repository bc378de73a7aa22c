"""What a signal could not foretell of itself: the mark that tells segments of a chip from a mode that noise shakes.

A linear system that Gaussian noise drives has Gaussian prediction errors, however narrow its band. A chip that breaks lets the force fall
at once, and each fall is a prediction error that stands out, all to one side; a resonance between tool and sensor does not hide it.
Source: R. B. Randall, Vibration-based Condition Monitoring (2011), linear prediction and kurtosis; L. H. Koopmans, The Spectral Analysis of
Time Series (1995), prediction.
"""

from __future__ import annotations

import math

import numpy as np

from lathesim.record import FloatArray

_ORDER = 60
"""Values before that foretell the next, assumed: enough for a dozen modes and the filter of a sensor."""
_PARTS = 8
"""Parts of a signal, whose median counts, so that one event is not taken for many."""
_FEWEST = 400


def prediction_errors(values: FloatArray, order: int = _ORDER) -> FloatArray:
    """Return what each value differs by from its best linear prediction by ``order`` values before, over the standard deviation."""
    from scipy.linalg import solve_toeplitz
    from scipy.signal import lfilter

    centred = values - values.mean()
    spectrum = np.fft.rfft(centred, 2 * len(centred))
    alike = np.fft.irfft(np.abs(spectrum) ** 2)[: order + 1] / len(centred)
    if not alike[0] > 0.0:
        return np.zeros(0)
    alike[0] *= 1.0 + 1e-9
    rule = solve_toeplitz(alike[:order], alike[1:])
    errors = lfilter(np.concatenate([[1.0], -rule]), [1.0], centred)[order:]
    return np.asarray(errors / max(float(errors.std()), 1e-300))


def departure_from_gaussian(values: FloatArray) -> float:
    """Return by how many standard errors skewness or kurtosis of the prediction errors are away from those of Gaussian noise.

    The standard errors are sqrt(6/n) and sqrt(24/n), and that of the median of parts is larger by sqrt(pi/2).
    """
    errors = prediction_errors(values)
    if len(errors) < _PARTS * _FEWEST:
        return 0.0
    moments = []
    for part in np.array_split(errors, _PARTS):
        z = (part - part.mean()) / max(float(part.std()), 1e-300)
        moments.append((float((z**3).mean()) / math.sqrt(6.0), (float((z**4).mean()) - 3.0) / math.sqrt(24.0)))
    skew, tails = np.abs(np.median(np.array(moments), axis=0)).tolist()
    return float(max(skew, tails)) * math.sqrt(len(errors) / (0.5 * math.pi))
