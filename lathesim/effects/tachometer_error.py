"""What a tachometer gets wrong by itself."""

from __future__ import annotations

import math

from lathesim.component import DiscreteState, Input, Noise, Output, Parameter
from lathesim.effects.effect import Effect
from lathesim.effects.harmonics import SHAPE, SHAPE_RANGES, harmonic_parameters, harmonics
from lathesim.effects.identification import Identification


class TachometerRipple(Effect):
    """Commutator ripple, brush noise and a gain error of a tachometer.

    y_out = y_in (1 + gain_error + ripple (sin a + second and third harmonic) + brush_noise n),   a = order angle + phase

    n is standard normal, new at each sample. A harmonic is sine sin(n a) + cosine cos(n a), both given as shares of the ripple.
    """

    catalogue, family, site = 31, "once per turn", "measured"
    neutral = {"ripple": 0.0, "gain_error": 0.0, "brush_noise": 0.0}
    identification = Identification(
        carried=("rad/s",),
        typical={
            "ripple": (0.001, 0.05),
            "gain_error": (-0.05, 0.05),
            "brush_noise": (0.0, 0.02),
            "order": (1.0, 48.0),
            "phase": (-math.pi, math.pi),
            **SHAPE_RANGES,
        },
        nuisance=("phase",),
        extended=SHAPE,
    )
    fingerprint = "A line of the tachometer at a multiple of the speed, which the encoder does not show."
    confused_with = ("Runout", "TorqueRipple", "EncoderEccentricity")
    experiment = "Compare with the derivative of the encoder."
    source = "Kuo, Tal (eds.), Incremental Motion Control I, SRL 1978, ch. 5 (DC tachometers). Range assumed."

    incoming = Input("{signal}", doc="true speed")
    displacement = Input("rad", doc="angle of the shaft")
    outgoing = Output("{signal}", doc="speed the tachometer shows")
    brush = DiscreteState("1", doc="brush noise of this sample")
    chance = Noise(doc="brush noise of this sample")
    ripple = Parameter("1", 0.0, low=0.0, high=1.0, doc="half of the peak-to-peak ripple over the speed")
    gain_error = Parameter("1", 0.0, low=-0.9, high=9.0, doc="share by which the tachometer shows too much")
    brush_noise = Parameter("1", 0.0, low=0.0, high=1.0, doc="standard deviation of the brush noise over the speed")
    order = Parameter("1", 2.0, low=0.0, doc="ripples per turn")
    phase = Parameter("rad", 0.0, doc="phase at angle zero")
    second_sine, second_cosine, third_sine, third_cosine = harmonic_parameters()

    @staticmethod
    def update(chance: float, brush_noise: float) -> float:
        return brush_noise * chance

    @staticmethod
    def output(
        incoming: float,
        displacement: float,
        brush: float,
        ripple: float,
        gain_error: float,
        order: float,
        phase: float,
        second_sine: float,
        second_cosine: float,
        third_sine: float,
        third_cosine: float,
    ) -> float:
        if ripple == 0.0 and gain_error == 0.0:
            return incoming * (1.0 + brush)
        angle = order * displacement + phase
        wave = math.sin(angle) + harmonics(angle, second_sine, second_cosine, third_sine, third_cosine)
        return incoming * (1.0 + gain_error + ripple * wave + brush)
