"""Guards against forged measurements: a secret motion on the reference, and the test whether a reading holds it."""

from __future__ import annotations

import math

from lathesim.component import Component, DiscreteState, Input, Noise, Output, Parameter


class Watermark(Component):
    """Gives the reference with a random number added, new every n samples:  out = in + size n_k.

    What the machine reads must then hold the answer to it; a reading that is forged does not.

    Source: B. Satchidanandan, P. R. Kumar, Dynamic Watermarking, Proc. IEEE 105 (2017), 219. Left out: shapes other than white.
    """

    group = "controllers"

    reference = Input("m", doc="commanded reference")
    size = Parameter("m", 0.0, low=0.0, doc="standard deviation of the watermark; 0: none")

    chance = Noise(doc="the secret number of this sample")
    added = DiscreteState("m", doc="watermark of this sample")

    marked = Output("m", doc="reference with the watermark")
    mark = Output("m", doc="the watermark itself, for the guard only")

    @staticmethod
    def update(chance: float, size: float) -> float:
        return size * chance

    @staticmethod
    def output_marked(reference: float, added: float) -> float:
        return reference + added

    @staticmethod
    def output_mark(added: float) -> float:
        return added


class Guard(Component):
    """Gives the innovation of an axis and the sums by which a forged reading is told.

    A Kalman filter with fixed gains follows a velocity axis, v+ = f v + (1 - f) K u, x+ = x + s v + K (T - s) u with f = exp(-T/tau) and
    s = tau (1 - f). Its innovation is nu = reading - predicted x. A copy of it that sees only the watermark's part of the command foretells
    m, what an innovation lacks while readings are replayed. Two sums are kept, each from zero on:

        correlation:  c = max(0, c - nu m/S - m^2/(2 S)),     innovation:  i = max(0, i + (|nu|/sqrt(S) - 0.798)/0.603 - slack)

    0.798 and 0.603 are mean and standard deviation of the size of a standard normal number. The alarm is 1 while one of them is above its
    threshold.

    Source: Satchidanandan and Kumar (2017), section IV; Page, Biometrika 41 (1954) (sums). Left out: adaptive variance of the watermark.
    """

    group = "controllers"

    reading = Input("m", doc="position as reported")
    command = Input("V", previous=True, doc="command to the drive")
    mark = Input("m", previous=True, doc="the watermark on the reference")

    drive_gain = Parameter("m/(s*V)", 0.01878, low=1e-9, doc="K: speed per volt")
    lag = Parameter("s", 0.0243, low=1e-6, doc="tau: time constant of the drive")
    loop_gain = Parameter("V/m", 224.5, low=0.0, doc="volts per metre of reference, by which the watermark enters the command")
    position_share = Parameter("1", 0.2, low=0.0, high=1.0, doc="gain of the filter's position")
    speed_share = Parameter("1/s", 2.0, low=0.0, doc="gain of the filter's speed")
    deviation = Parameter("m", 1e-6, low=1e-12, doc="sqrt(S): standard deviation of the innovation of honest readings")
    threshold = Parameter("1", 17.0, low=0.0, doc="correlation above which it alarms; ln of the samples between false alarms, about")
    slack = Parameter("1", 0.5, low=0.0, doc="what the innovation may be larger by before it is added up")
    innovation_threshold = Parameter("1", 40.0, low=0.0, doc="sum of innovations above which it alarms")

    place = DiscreteState("m", doc="predicted position")
    speed = DiscreteState("m/s", doc="predicted speed")
    echo = DiscreteState("m", doc="predicted part of the watermark in the position, less what the filter makes of it")
    echo_speed = DiscreteState("m/s", doc="the same of the speed")
    missed = DiscreteState("m", doc="innovation of this sample")
    correlated = DiscreteState("1", doc="c")
    summed = DiscreteState("1", doc="i")

    innovation = Output("m", doc="reading less what was predicted")
    correlation = Output("1", doc="sum of the likelihood ratio of innovation and watermark")
    size = Output("1", doc="sum of the size of the innovation")
    alarm = Output("1", doc="1 while a forged reading is reported")

    @staticmethod
    def update(
        reading: float, command: float, mark: float, drive_gain: float, lag: float, loop_gain: float, position_share: float,
        speed_share: float, deviation: float, slack: float, place: float, speed: float, echo: float, echo_speed: float, correlated: float,
        summed: float, time: float, sample_period: float,
    ) -> tuple[float, float, float, float, float, float, float]:  # fmt: skip
        if time <= 0.0:
            return reading, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        fading = math.exp(-sample_period / lag)
        way = lag * (1.0 - fading)
        place = place + way * speed + drive_gain * (sample_period - way) * command
        speed = fading * speed + (1.0 - fading) * drive_gain * command
        echo = echo + way * echo_speed + drive_gain * (sample_period - way) * loop_gain * mark
        echo_speed = fading * echo_speed + (1.0 - fading) * drive_gain * loop_gain * mark
        missed = reading - place
        variance = deviation * deviation
        correlated = correlated - missed * echo / variance - 0.5 * echo * echo / variance
        if correlated < 0.0:
            correlated = 0.0
        summed = summed + (abs(missed) / deviation - 0.7978845608) / 0.6028102749 - slack
        if summed < 0.0:
            summed = 0.0
        return (
            place + position_share * missed, speed + speed_share * missed, echo - position_share * echo, echo_speed - speed_share * echo,
            missed, correlated, summed,
        )  # fmt: skip

    @staticmethod
    def output(
        missed: float, correlated: float, summed: float, threshold: float, innovation_threshold: float
    ) -> tuple[float, float, float, float]:
        return missed, correlated, summed, 1.0 if correlated > threshold or summed > innovation_threshold else 0.0
