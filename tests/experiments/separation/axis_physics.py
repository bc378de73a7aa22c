"""Everything a feed-drive axis may carry, as one flat record of SI numbers; zero (or a huge limit) means absent."""

from __future__ import annotations

from typing import NamedTuple


class AxisPhysics(NamedTuple):
    """Numbers of the axis of the truth [SI]. Floats only, so that the compiled loop takes it as it is."""

    # plant and drive
    mass: float = 95.0
    viscous: float = 200.0
    conductance: float = 1.0
    back_emf: float = 0.0
    effort_constant: float = 35.0
    # controller: cascade (pid = 0) or PID (pid = 1)
    position_gain: float = 40.0
    velocity_gain: float = 300.0
    integral_rate: float = 0.0
    mean_share: float = 0.5
    # converter and sensors
    converter_bits: float = 12.0
    encoder_resolution: float = 1e-7
    scale_resolution: float = 1e-7
    encoder_noise: float = 5e-8
    scale_noise: float = 5e-8
    current_noise: float = 0.01
    current_resolution: float = 0.005
    # friction: Coulomb and Stribeck by implicit stick, LuGre bristles, a table, or none
    coulomb: float = 0.0
    coulomb_asymmetry: float = 0.0
    viscous_asymmetry: float = 0.0
    stribeck_excess: float = 0.0
    stribeck_speed: float = 0.005
    stribeck_shape: float = 1.0
    lugre_level: float = 0.0
    lugre_stiffness: float = 0.0
    lugre_damping: float = 0.0
    friction_wave: float = 0.0
    friction_wave_period: float = 0.1
    friction_wave_phase: float = 0.0
    # forces
    force_offset: float = 0.0
    ripple: float = 0.0
    ripple_share: float = 0.0
    ripple_period: float = 0.005
    ripple_phase: float = 0.0
    # geometry seen by the scale
    backlash: float = 0.0
    backlash_start: float = 0.0
    pitch_slope: float = 0.0
    pitch_wave: float = 0.0
    lead: float = 0.005
    pitch_phase: float = 0.0
    growth_strain: float = 0.0
    growth_time: float = 60.0
    growth_origin: float = 0.0
    wind_up: float = 0.0
    # structure
    table_share: float = 0.0
    table_frequency: float = 100.0
    table_damping: float = 0.05
    # drive
    inductance_time: float = 0.0
    current_loop_frequency: float = 0.0
    current_loop_damping: float = 0.7
    dead_zone: float = 0.0
    converter_offset: float = 0.0
    coarse_step: float = 0.0
    delay: float = 0.0
    # encoder
    eccentricity: float = 0.0
    eccentricity_turn: float = 0.005
    eccentricity_phase: float = 0.0
    # outside the catalogue
