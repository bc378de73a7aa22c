"""Effects of the catalogue as they are hidden in an axis: sizes within the catalogue's ranges, in forms of their own.

``rig`` holds numbers of the axis the sizes refer to: ``rated`` force [N] (full voltage), ``lead`` [m], ``acceleration`` [m/s2], ``mass``
[kg], ``viscous`` friction [N s/m], ``bandwidth`` [rad/s] of the velocity loop.
"""

from __future__ import annotations

import math

import numpy as np

from tests.experiments.separation.concealed import Draw, Hidden, angle, either_sign, log_uniform

Rig = dict[str, float]


def coulomb(rng: np.random.Generator, rig: Rig) -> Hidden:
    level = log_uniform(rng, 5.0, min(100.0, 0.25 * rig["rated"]))
    return Hidden("coulomb", {"coulomb": level}, {"level": (level, "N")})


def stribeck(rng: np.random.Generator, rig: Rig) -> Hidden:
    """The peak stands alone, as the boundary friction of a wet way does."""
    excess = 15.0 * rng.uniform(0.25, 1.0)
    speed, shape = log_uniform(rng, 2e-3, 20e-3), float(rng.uniform(1.0, 2.0))
    changes = {"stribeck_excess": excess, "stribeck_speed": speed, "stribeck_shape": shape}
    return Hidden("stribeck", changes, {"excess": (excess, "N"), "stribeck_velocity": (speed, "m/s")})


def bristles(rng: np.random.Generator, rig: Rig) -> Hidden:
    level, travel = log_uniform(rng, 15.0, min(80.0, 0.2 * rig["rated"])), log_uniform(rng, 3e-6, 30e-6)
    stiffness = level / travel
    damping = 0.3 * math.sqrt(stiffness * rig["mass"])
    changes = {"lugre_level": level, "lugre_stiffness": stiffness, "lugre_damping": damping}
    return Hidden("bristles", changes, {"level": (level, "N"), "distance": (travel, "m")})


def asymmetric(rng: np.random.Generator, rig: Rig) -> Hidden:
    if rng.random() < 0.4:
        slope = either_sign(rng) * rig["viscous"] * rng.uniform(0.1, 0.4)
        return Hidden("asymmetric", {"viscous_asymmetry": slope}, {"viscous_difference": (slope, "N*s/m")})
    level, share = log_uniform(rng, 10.0, 60.0), either_sign(rng) * float(rng.uniform(0.1, 0.4))
    changes = {"coulomb": level, "coulomb_asymmetry": share}
    return Hidden("asymmetric", changes, {"level": (level, "N"), "asymmetry": (share, "1")})


def gravity(rng: np.random.Generator, rig: Rig) -> Hidden:
    force = either_sign(rng) * log_uniform(rng, 4.0, 0.2 * rig["rated"])
    return Hidden("gravity", {"force_offset": force}, {"offset": (force, "N")})


def tight_spots(rng: np.random.Generator, rig: Rig) -> Hidden:
    size, period = log_uniform(rng, 4.0, 25.0), log_uniform(rng, 0.02, 0.12)
    changes = {"friction_wave": size, "friction_wave_period": period, "friction_wave_phase": angle(rng)}
    return Hidden("tight_spots", changes, {"amplitude": (size, "N"), "period": (period, "m")})


def backlash(rng: np.random.Generator, rig: Rig) -> Hidden:
    width = log_uniform(rng, 2e-6, 60e-6)
    return Hidden("backlash", {"backlash": width, "backlash_start": either_sign(rng)}, {"width": (width, "m")})


def pitch(rng: np.random.Generator, rig: Rig) -> Hidden:
    slope = either_sign(rng) * log_uniform(rng, 40e-6, 300e-6)
    return Hidden("pitch", {"pitch_slope": slope}, {"slope": (slope, "1")})


def pitch_wave(rng: np.random.Generator, rig: Rig) -> Hidden:
    size = log_uniform(rng, 1e-6, 8e-6)
    changes = {"pitch_wave": size, "pitch_phase": angle(rng), "lead": rig["lead"]}
    return Hidden("pitch_wave", changes, {"amplitude": (size, "m"), "lead": (rig["lead"], "m")})


def screw_growth(rng: np.random.Generator, rig: Rig) -> Hidden:
    strain, time = log_uniform(rng, 3e-5, 2e-4), log_uniform(rng, 8.0, 60.0)
    changes = {"growth_strain": strain, "growth_time": time, "growth_origin": float(rng.uniform(-0.3, 0.0))}
    return Hidden("screw_growth", changes, {"strain": (strain, "1"), "time_constant": (time, "s")})


def resonance(rng: np.random.Generator, rig: Rig) -> Hidden:
    share, damping = float(rng.uniform(0.25, 0.6)), log_uniform(rng, 0.02, 0.1)
    frequency = log_uniform(rng, max(40.0, rig["bandwidth"] / 2.5), 200.0)
    changes = {"table_share": share, "table_frequency": frequency, "table_damping": damping}
    return Hidden("resonance", changes, {"frequency": (frequency, "Hz"), "table_share": (share, "1"), "damping": (damping, "1")})


def wind_up(rng: np.random.Generator, rig: Rig) -> Hidden:
    compliance = log_uniform(rng, 0.5e-6, 5e-6) / (rig["mass"] * rig["acceleration"])
    return Hidden("wind_up", {"wind_up": compliance}, {"compliance": (compliance, "m/N")})


def inductance(rng: np.random.Generator, rig: Rig) -> Hidden:
    time = log_uniform(rng, 1e-3, min(8e-3, 0.8 / rig["bandwidth"]))
    return Hidden("inductance", {"inductance_time": time}, {"time_constant": (time, "s")})


def current_loop(rng: np.random.Generator, rig: Rig) -> Hidden:
    frequency = log_uniform(rng, max(30.0, 4.0 * rig["bandwidth"] / (2 * math.pi)), 250.0)
    time, damping = 1.0 / (2.0 * math.pi * frequency), float(rng.uniform(0.5, 1.0))
    changes = {"current_loop_frequency": frequency, "current_loop_damping": damping}
    return Hidden("current_loop", changes, {"time_constant": (time, "s"), "damping": (damping, "1")})


def dead_zone(rng: np.random.Generator, rig: Rig) -> Hidden:
    half = log_uniform(rng, 0.05, 0.3)
    return Hidden("dead_zone", {"dead_zone": half}, {"half_width": (half, "V")})


def ripple(rng: np.random.Generator, rig: Rig) -> Hidden:
    """Ripple in proportion to the torque, as a skewed motor has it."""
    share, period = log_uniform(rng, 0.02, 0.1), rig["lead"] / float(rng.choice([1.0, 2.0, 6.0]))
    changes = {"ripple_share": share, "ripple_period": period, "ripple_phase": angle(rng)}
    return Hidden("ripple", changes, {"share": (share, "1"), "period": (period, "m")})


def cogging(rng: np.random.Generator, rig: Rig) -> Hidden:
    size, period = rig["rated"] * log_uniform(rng, 0.01, 0.03), rig["lead"] / float(rng.choice([2.0, 4.0, 6.0]))
    changes = {"ripple": size, "ripple_period": period, "ripple_phase": angle(rng)}
    return Hidden("cogging", changes, {"amplitude": (size, "N"), "period": (period, "m")})


def converter_offset(rng: np.random.Generator, rig: Rig) -> Hidden:
    if rng.random() < 0.3:
        step = 20.0 / 255.0
        return Hidden("converter_step", {"coarse_step": step}, {"resolution": (step, "V")})
    offset = either_sign(rng) * log_uniform(rng, 0.02, 0.3)
    return Hidden("converter_offset", {"converter_offset": offset}, {"offset": (offset, "V")})


def delay(rng: np.random.Generator, rig: Rig) -> Hidden:
    time = log_uniform(rng, 0.6e-3, min(5e-3, 0.45 / rig["bandwidth"]))
    return Hidden("delay", {"delay": time}, {"delay": (time, "s")})


def clock_skew(rng: np.random.Generator, rig: Rig) -> Hidden:
    """The scale is logged by another device whose clock runs off."""
    skew = either_sign(rng) * log_uniform(rng, 40e-6, 400e-6)
    return Hidden("clock_skew", {"@skew_scale": skew}, {"skew": (skew, "1")})


def eccentricity(rng: np.random.Generator, rig: Rig) -> Hidden:
    size = log_uniform(rng, 1.5e-6, 10e-6)
    changes = {"eccentricity": size, "eccentricity_turn": rig["lead"], "eccentricity_phase": angle(rng)}
    return Hidden("eccentricity", changes, {"amplitude": (size, "m"), "turn": (rig["lead"], "m")})


AXIS_EFFECTS: dict[str, Draw] = {
    draw.__name__: draw
    for draw in (
        coulomb, stribeck, bristles, asymmetric, gravity, tight_spots, backlash, pitch, pitch_wave, screw_growth, resonance, wind_up,
        inductance, current_loop, dead_zone, ripple, cogging, converter_offset, delay, clock_skew, eccentricity,
    )
}  # fmt: skip
