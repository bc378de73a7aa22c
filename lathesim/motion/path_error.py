"""How far the tool tip is from its path between samples, when the axes move along their own splines."""

from __future__ import annotations

import numpy as np

from lathesim.motion.curve import Curve
from lathesim.motion.joint_path import FloatArray
from lathesim.motion.kinematics import Chain, forward

_SHARES = (0.25, 0.5, 0.75)


def path_error(chain: Chain, curve: Curve) -> FloatArray:
    """Return the distance [m] of the tip from the straight line between the tips of neighbouring samples, the largest of each span."""
    tips = forward(chain, curve.at(curve.knots)).points
    ways = np.diff(tips, axis=0)
    lengths = np.maximum(np.sum(ways * ways, axis=1), 1e-300)
    spans = np.arange(len(ways))
    worst = np.zeros(len(ways))
    for share in _SHARES:
        joints = curve.derivative(0, spans, share * np.diff(curve.knots))
        away = forward(chain, joints).points - tips[:-1]
        along = np.clip(np.sum(away * ways, axis=1) / lengths, 0.0, 1.0)
        worst = np.maximum(worst, np.linalg.norm(away - along[:, None] * ways, axis=1))
    return worst
