"""Effects hidden in the spindle and in the cut."""

from __future__ import annotations

import numpy as np

from tests.diagnosis.suite.concealed import Draw, Hidden, angle, either_sign, log_uniform

Rig = dict[str, float]


def spindle_coulomb(rng: np.random.Generator, rig: Rig) -> Hidden:
    level = rig["rated"] * log_uniform(rng, 0.03, 0.15)
    return Hidden("spindle_coulomb", {"coulomb": level}, {"level": (level, "N*m")})


def spindle_asymmetric(rng: np.random.Generator, rig: Rig) -> Hidden:
    level, share = rig["rated"] * log_uniform(rng, 0.05, 0.15), either_sign(rng) * float(rng.uniform(0.15, 0.4))
    changes = {"coulomb": level, "coulomb_asymmetry": share}
    return Hidden("spindle_asymmetric", changes, {"level": (level, "N*m"), "asymmetry": (share, "1")})


def torque_limit(rng: np.random.Generator, rig: Rig) -> Hidden:
    level = rig["peak"] * float(rng.uniform(0.6, 0.85))
    return Hidden("torque_limit", {"saturation": level}, {"level": (level, "N*m")})


def spindle_ripple(rng: np.random.Generator, rig: Rig) -> Hidden:
    """The speed the ripple makes falls with the spindle's, so it is hidden at low orders."""
    share, order = log_uniform(rng, 0.05, 0.2), float(rng.choice([1.0, 2.0]))
    changes = {"ripple_share": share, "ripple_order": order, "ripple_phase": angle(rng)}
    return Hidden("spindle_ripple", changes, {"share": (share, "1"), "period": (2.0 * np.pi / order, "rad")})


def spindle_cogging(rng: np.random.Generator, rig: Rig) -> Hidden:
    size, order = rig["rated"] * log_uniform(rng, 0.02, 0.1), float(rng.choice([1.0, 2.0, 4.0]))
    changes = {"ripple": size, "ripple_order": order, "ripple_phase": angle(rng)}
    return Hidden("spindle_cogging", changes, {"amplitude": (size, "N*m"), "period": (2.0 * np.pi / order, "rad")})


def disc_eccentricity(rng: np.random.Generator, rig: Rig) -> Hidden:
    size = log_uniform(rng, 1.5e-3, 8e-3)
    return Hidden("disc_eccentricity", {"eccentricity": size, "eccentricity_phase": angle(rng)}, {"amplitude": (size, "rad")})


def tacho_ripple(rng: np.random.Generator, rig: Rig) -> Hidden:
    size, order = log_uniform(rng, 0.01, 0.05), float(rng.choice([1.0, 2.0, 7.0]))
    changes = {"tacho_ripple": size, "tacho_order": order, "tacho_phase": angle(rng)}
    return Hidden("tacho_ripple", changes, {"ripple": (size, "1"), "order": (order, "1")})


def tacho_gain(rng: np.random.Generator, rig: Rig) -> Hidden:
    error = either_sign(rng) * log_uniform(rng, 0.01, 0.05)
    return Hidden("tacho_gain", {"tacho_gain": error}, {"gain_error": (error, "1")})


def belt_slip(rng: np.random.Generator, rig: Rig) -> Hidden:
    creep = log_uniform(rng, 0.01, 0.04) / rig["load"]
    return Hidden("belt_slip", {"creep": creep}, {"creep": (creep, "1/(N*m)")})


def speed_droop(rng: np.random.Generator, rig: Rig) -> Hidden:
    """Between motor (encoder) and spindle (tachometer) a drive that yields with a lag: the speed behind it dips in the cut."""
    droop, time = rig["top"] * log_uniform(rng, 0.01, 0.05) / rig["load"], log_uniform(rng, 0.1, 0.5)
    return Hidden("speed_droop", {"droop": droop, "droop_time": time}, {"droop": (droop, "rad/s/(N*m)"), "response": (time, "s")})


def tacho_filter(rng: np.random.Generator, rig: Rig) -> Hidden:
    time = log_uniform(rng, 5e-3, 20e-3)
    return Hidden("tacho_filter", {"filter_time": time}, {"time_constant": (time, "s")})


def windage(rng: np.random.Generator, rig: Rig) -> Hidden:
    """Outside the catalogue: a chuck that pumps air, torque with the square of the speed."""
    return Hidden("windage", {"windage": float(rig["rated"] * rng.uniform(0.1, 0.3) / rig["top"] ** 2)})


def edge_force(rng: np.random.Generator, rig: Rig) -> Hidden:
    size = log_uniform(rng, 20e3, 100e3)
    return Hidden("edge_force", {"edge": size}, {"coefficient": (size, "N/m")})


def size_effect(rng: np.random.Generator, rig: Rig) -> Hidden:
    exponent = float(rng.uniform(0.12, 0.3))
    return Hidden("size_effect", {"exponent": exponent}, {"exponent": (exponent, "1")})


def speed_effect(rng: np.random.Generator, rig: Rig) -> Hidden:
    if rng.random() < 0.3:
        hump, place = float(rng.uniform(0.15, 0.4)), float(rng.uniform(0.6, 1.1))
        return Hidden("speed_effect", {"hump": hump, "hump_speed": place}, {"hump": (hump, "1"), "hump_speed": (place, "m/s")}, note="hump")
    exponent = -float(rng.uniform(0.1, 0.3))
    return Hidden("speed_effect", {"speed_exponent": exponent}, {"exponent": (exponent, "1")}, note="power")


def softening(rng: np.random.Generator, rig: Rig) -> Hidden:
    share, time = float(rng.uniform(0.08, 0.25)), log_uniform(rng, 0.5, 4.0)
    return Hidden("softening", {"softening": share, "softening_time": time}, {"softening": (share, "1"), "time_constant": (time, "s")})


def wear(rng: np.random.Generator, rig: Rig) -> Hidden:
    """An insert that wears fast in a hard steel; only growth times rate can be told from forces."""
    growth, rate = float(rng.uniform(1000.0, 2500.0)), log_uniform(rng, 2e-6, 1e-5)
    changes = {"wear_growth": growth, "wear_rate": rate, "wear_break_in": float(rng.uniform(1e-5, 4e-5)), "wear_break_in_time": 6.0}
    return Hidden("wear", changes, {"growth*rate": (growth * rate, "1/s")})


def slot(rng: np.random.Generator, rig: Rig) -> Hidden:
    width, missing = float(rng.uniform(0.05, 0.3)), float(rng.uniform(0.5, 1.0))
    changes = {"slot": missing, "slot_width": width, "slot_middle": angle(rng)}
    return Hidden("slot", changes, {"width": (width, "1"), "missing": (missing, "1")})


def hard_spot(rng: np.random.Generator, rig: Rig) -> Hidden:
    width, rise = float(rng.uniform(0.04, 0.12)), float(rng.uniform(0.1, 0.5))
    changes = {"spot": rise, "spot_width": width, "spot_middle": angle(rng)}
    return Hidden("hard_spot", changes, {"rise": (rise, "1"), "width": (width / np.sqrt(2.0), "1")})


def runout(rng: np.random.Generator, rig: Rig) -> Hidden:
    size, order = log_uniform(rng, 10e-6, 80e-6), float(rng.choice([1.0, 1.0, 2.0, 3.0]))
    changes = {"runout": size, "runout_order": order, "runout_phase": angle(rng)}
    return Hidden("runout", changes, {"eccentricity": (size, "m"), "order": (order, "1")})


def charge_leak(rng: np.random.Generator, rig: Rig) -> Hidden:
    if rng.random() < 0.5:
        drift = either_sign(rng) * log_uniform(rng, 0.5, 4.0)
        return Hidden("charge_leak", {"drift": drift}, {"drift": (drift, "N/s")}, note="drift")
    leak = 1.0 / log_uniform(rng, 10.0, 60.0)
    return Hidden("charge_leak", {"leak": leak}, {"leak": (leak, "1/s")}, note="leak")


def depth_power(rng: np.random.Generator, rig: Rig) -> Hidden:
    """Outside the catalogue: force that is not proportional to the depth."""
    return Hidden("depth_power", {"depth_power": float(rng.choice([-0.3, 0.25, 0.35]))})


def feed_memory(rng: np.random.Generator, rig: Rig) -> Hidden:
    """Outside the catalogue: the force remembers the feed of the last second (a hardened layer)."""
    return Hidden("feed_memory", {"feed_memory": float(either_sign(rng) * rng.uniform(0.15, 0.3))})


def wander(rng: np.random.Generator, rig: Rig) -> Hidden:
    """Outside the catalogue: force that beats at a frequency that wanders with the time in the cut."""
    return Hidden("wander", {"wander": float(rng.uniform(0.08, 0.2))})


SPINDLE_EFFECTS: dict[str, Draw] = {
    d.__name__: d
    for d in (
        spindle_coulomb, spindle_asymmetric, torque_limit, spindle_ripple, spindle_cogging, disc_eccentricity, tacho_ripple, tacho_gain,
        belt_slip, speed_droop, tacho_filter,
    )
}  # fmt: skip
SPINDLE_OUTSIDE: dict[str, Draw] = {"windage": windage}
CUTTING_EFFECTS: dict[str, Draw] = {
    d.__name__: d for d in (edge_force, size_effect, speed_effect, softening, wear, slot, hard_spot, runout, charge_leak)
}
CUTTING_OUTSIDE: dict[str, Draw] = {d.__name__: d for d in (depth_power, feed_memory, wander)}
