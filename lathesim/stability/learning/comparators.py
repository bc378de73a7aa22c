"""Learners without physics, to hold the map against: a network of two hidden layers of six, and a Gaussian process.

Both take speed and width of cuts and say how probably a cut is stable. Source: T. Schmitz, H. Cherukuri, Towards self-aware manufacturing
(slides): network of 6 and 6 neurons on 2001 cuts; scikit-learn.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from lathesim.errors import LatheSimError
from lathesim.record import FloatArray
from lathesim.stability.learning.tried_cuts import TriedCut

RESTARTS = 6


def network(speeds: FloatArray, widths: FloatArray, stable: Any, restarts: int = RESTARTS, seed: int = 0) -> Any:
    """Return the best of some networks of six and six neurons, trained on cuts; it has ``predict_proba`` of scaled (speed, width)."""
    _need("sklearn")
    import warnings

    from sklearn.neural_network import MLPClassifier
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    table = np.stack([speeds, 1e3 * np.asarray(widths)], axis=1)
    best, best_loss = None, np.inf
    for turn in range(restarts):
        learner = MLPClassifier(
            (6, 6), activation="tanh", solver="lbfgs", max_iter=3000, max_fun=60000, random_state=seed + turn, alpha=1e-5
        )
        model = make_pipeline(StandardScaler(), learner)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # an optimiser that used all its steps is judged by its loss like the others
            model.fit(table, stable)
        loss = float(learner.loss_)
        if loss < best_loss:
            best, best_loss = model, loss
    return best


def gaussian_process(cuts: Sequence[TriedCut]) -> Any:
    """Return a Gaussian process classifier trained on cuts; none where all cuts went alike."""
    _need("sklearn")
    import warnings

    from sklearn.gaussian_process import GaussianProcessClassifier
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    if len({cut.stable for cut in cuts}) < 2:
        return None
    table = np.array([[cut.speed, 1e3 * cut.width] for cut in cuts])
    kernel = ConstantKernel(10.0, (0.1, 1e4)) * RBF((1.0, 1.0), (0.05, 20.0))
    model = make_pipeline(StandardScaler(), GaussianProcessClassifier(kernel, random_state=0))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a length at its bound is an answer here
        model.fit(table, [cut.stable for cut in cuts])
    return model


def stable_by(model: Any, speeds: FloatArray, widths: FloatArray) -> FloatArray:
    """Return the probability of being stable by a comparator, for speeds [rpm] and widths [m] of one shape (cuts,)."""
    return np.asarray(model.predict_proba(np.stack([speeds, 1e3 * np.asarray(widths)], axis=1))[:, 1])


def _need(package: str) -> None:
    import importlib.util

    if importlib.util.find_spec(package) is None:
        raise LatheSimError("scikit-learn is not installed.", remedy="Install lathesim with its extra: pip install 'lathesim[stability]'.")
