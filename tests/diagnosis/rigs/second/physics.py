"""The numbers of a rig of the second set."""

from __future__ import annotations

from typing import NamedTuple

PID, PID_MEASURED, FEED_FORWARD, CASCADE, INTEGRAL_PROPORTIONAL, SPEED = 0.0, 1.0, 2.0, 3.0, 4.0, 5.0


class Physics(NamedTuple):
    """Numbers [SI] on the motor's shaft unless a name says otherwise; what is zero, or a huge limit, is absent.

    ``ratio`` is the travel of the load [m or rad] per radian of the shaft. A linear motor has a ratio of 1: its shaft is its slide.
    """

    inertia: float
    viscous: float
    ratio: float
    resistance: float
    amplifier: float
    torque_constant: float
    voltage_constant: float
    tachometer: float
    period: float
    law: float
    gain: float
    integral: float = 0.0
    derivative: float = 0.0
    velocity_gain: float = 0.0
    feed_forward: float = 0.0
    bits: float = 12.0
    encoder: float = 1e-6
    encoder_noise: float = 0.0
    scale: float = 0.0
    current_noise: float = 0.0
    current_step: float = 0.0
    weight: float = 0.0
    # hidden in some cases
    coulomb: float = 0.0
    asymmetry: float = 0.0
    one_way_viscous: float = 0.0
    stribeck: float = 0.0
    stribeck_speed: float = 1.0
    tight: float = 0.0
    tight_period: float = 1.0
    bristle: float = 0.0
    bristle_travel: float = 1.0
    offset_torque: float = 0.0
    warmed_viscous: float = 0.0
    warm_time: float = 1.0
    current_limit: float = 1e9
    slew: float = 0.0
    sag: float = 0.0
    converter_offset: float = 0.0
    dead_zone: float = 0.0
    delay: float = 0.0
    lag: float = 0.0
    current_filter: float = 0.0
    cogging: float = 0.0
    cogging_period: float = 1.0
    interpolation: float = 0.0
    signal_period: float = 1.0
    backlash: float = 0.0
    pitch: float = 0.0
    pitch_period: float = 1.0
    lead_error: float = 0.0
    growth: float = 0.0
    growth_time: float = 1.0
    wind_up: float = 0.0
    pushed: float = 0.0
    pushed_from: float = 0.0
    shaken: float = 0.0
    shaken_rate: float = 1.0
    buffer: float = 0.0
    buffer_from: float = 0.0
