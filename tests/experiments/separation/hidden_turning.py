"""Effects hidden in the spindle and in the cut."""

from __future__ import annotations

import numpy as np

from tests.experiments.separation.concealed import Draw, Hidden, angle, either_sign, log_uniform

Rig = dict[str, float]


def spindle_coulomb(rng: np.random.Generator, rig: Rig) -> Hidden:
    level = rig["rated"] * log_uniform(rng, 0.03, 0.15)
    return Hidden("spindle_coulomb", {"coulomb": level}, {"level": (level, "N*m")})


def spindle_asymmetric(rng: np.random.Generator, rig: Rig) -> Hidden:
    level, share = rig["rated"] * log_uniform(rng, 0.05, 0.15), either_sign(rng) * float(rng.uniform(0.15, 0.4))
    changes = {"coulomb": level, "coulomb_asymmetry": share}
    return Hidden("spindle_asymmetric", changes, {"level": (level, "N*m"), "asymmetry": (share, "1")})


def spindle_ripple(rng: np.random.Generator, rig: Rig) -> Hidden:
    """The speed the ripple makes falls with the spindle's, so it is hidden at low orders."""
    share, order = log_uniform(rng, 0.05, 0.2), float(rng.choice([1.0, 2.0]))
    changes = {"ripple_share": share, "ripple_order": order, "ripple_phase": angle(rng)}
    return Hidden("spindle_ripple", changes, {"share": (share, "1"), "period": (2.0 * np.pi / order, "rad")})


def spindle_cogging(rng: np.random.Generator, rig: Rig) -> Hidden:
    size, order = rig["rated"] * log_uniform(rng, 0.02, 0.1), float(rng.choice([1.0, 2.0, 4.0]))
    changes = {"ripple": size, "ripple_order": order, "ripple_phase": angle(rng)}
    return Hidden("spindle_cogging", changes, {"amplitude": (size, "N*m"), "period": (2.0 * np.pi / order, "rad")})


def tacho_ripple(rng: np.random.Generator, rig: Rig) -> Hidden:
    size, order = log_uniform(rng, 0.01, 0.05), float(rng.choice([1.0, 2.0, 7.0]))
    changes = {"tacho_ripple": size, "tacho_order": order, "tacho_phase": angle(rng)}
    return Hidden("tacho_ripple", changes, {"ripple": (size, "1"), "order": (order, "1")})


def edge_force(rng: np.random.Generator, rig: Rig) -> Hidden:
    size = log_uniform(rng, 20e3, 100e3)
    return Hidden("edge_force", {"edge": size}, {"coefficient": (size, "N/m")})


def size_effect(rng: np.random.Generator, rig: Rig) -> Hidden:
    exponent = float(rng.uniform(0.12, 0.3))
    return Hidden("size_effect", {"exponent": exponent}, {"exponent": (exponent, "1")})


def speed_effect(rng: np.random.Generator, rig: Rig) -> Hidden:
    if rng.random() < 0.3:
        hump, place = float(rng.uniform(0.15, 0.4)), float(rng.uniform(0.6, 1.1))
        return Hidden("speed_effect", {"hump": hump, "hump_speed": place}, {"hump": (hump, "1"), "hump_speed": (place, "m/s")})
    exponent = -float(rng.uniform(0.1, 0.3))
    return Hidden("speed_effect", {"speed_exponent": exponent}, {"exponent": (exponent, "1")})


def softening(rng: np.random.Generator, rig: Rig) -> Hidden:
    share, time = float(rng.uniform(0.08, 0.25)), log_uniform(rng, 0.5, 4.0)
    return Hidden("softening", {"softening": share, "softening_time": time}, {"softening": (share, "1"), "time_constant": (time, "s")})


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


SPINDLE_EFFECTS: dict[str, Draw] = {
    d.__name__: d for d in (spindle_coulomb, spindle_asymmetric, spindle_ripple, spindle_cogging, tacho_ripple)
}
CUTTING_EFFECTS: dict[str, Draw] = {d.__name__: d for d in (edge_force, size_effect, speed_effect, softening, slot, hard_spot, runout)}
