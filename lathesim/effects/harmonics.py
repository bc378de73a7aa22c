"""What a wave has beside its first harmonic: nothing that turns in a machine is off by a pure sine."""

from __future__ import annotations

import math

from lathesim.component import Parameter

SHAPE = ("second_sine", "second_cosine", "third_sine", "third_cosine")
"""Parameters of an effect that repeats: its second and third harmonics, as shares of the first."""
SHAPE_RANGES = dict.fromkeys(SHAPE, (-0.5, 0.5))
"""Their usual ranges. Assumed."""


def harmonic_parameters() -> tuple[Parameter, Parameter, Parameter, Parameter]:
    """Declare the parameters of :data:`SHAPE`: ``second_sine, second_cosine, third_sine, third_cosine = harmonic_parameters()``."""

    def share(text: str) -> Parameter:
        return Parameter("1", 0.0, low=-2.0, high=2.0, doc=text)

    return (
        share("second harmonic over the first, in step with it"),
        share("second harmonic over the first, a quarter of its own period ahead"),
        share("third harmonic over the first, in step with it"),
        share("third harmonic over the first, a quarter of its own period ahead"),
    )


def harmonics(angle: float, second_sine: float, second_cosine: float, third_sine: float, third_cosine: float) -> float:
    """Return the second and the third harmonic [of the first] at an angle of the first one [rad]."""
    second = second_sine * math.sin(2.0 * angle) + second_cosine * math.cos(2.0 * angle)
    return second + third_sine * math.sin(3.0 * angle) + third_cosine * math.cos(3.0 * angle)
