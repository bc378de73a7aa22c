"""The Butcher tableaux of the explicit integrators that a fused machine can step with.

Every stage has the rate k_i = f(t + r h, x + r h k_(i-1)) with the reach r of the previous stage, and a step ends with

    x <- x + h / total * (w_1 k_1 + ... + w_n k_n).

Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, section II.1. Left out: tableaux whose stages use more than
the previous stage.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Tableau:
    """An explicit integrator: ``stages`` are pairs of a weight w and the reach r [steps] of the next stage, ``total`` the sum of the w."""

    stages: tuple[tuple[float, float], ...]
    total: float

    def lines(self) -> list[str]:
        """Return the lines that define ``stages`` (weight, reach [s]) and ``share`` [s], the factor of the weighted sum of rates."""
        pairs = ", ".join(f"({weight!r}, {reach!r} * step)" for weight, reach in self.stages)
        return [f"stages = ({pairs})", f"share = step / {self.total!r}"]


RK4 = Tableau(((1.0, 0.5), (2.0, 0.5), (2.0, 1.0), (1.0, 0.5)), 6.0)
"""The classical Runge-Kutta method, of fourth order; the reach of its last stage is not used."""
HEUN = Tableau(((1.0, 1.0), (1.0, 1.0)), 2.0)
"""Heun's method, of second order."""
