"""Physics no catalogue lists, and catalogue effects in another form than the catalogue's, for the axis."""

from __future__ import annotations

import math

import numpy as np

from tests.diagnosis.suite.concealed import Draw, Hidden, angle, either_sign, log_uniform

Rig = dict[str, float]


def drag(rng: np.random.Generator, rig: Rig) -> Hidden:
    """A way cover full of coolant: force with the square of the speed."""
    size = rig["rated"] * rng.uniform(0.1, 0.2) / rig["top"] ** 2
    return Hidden("drag", {"drag": float(size)})


def cubic_by_place(rng: np.random.Generator, rig: Rig) -> Hidden:
    """Cubic friction that grows along the travel."""
    size = rig["rated"] * rng.uniform(0.08, 0.15) / rig["top"] ** 3
    return Hidden("cubic_by_place", {"cubic": float(size), "cubic_length": 0.6 * rig["stroke"]})


def chain(rng: np.random.Generator, rig: Rig) -> Hidden:
    """A cable chain that pulls back like a spring."""
    stiffness = rig["rated"] * rng.uniform(0.06, 0.15) / rig["stroke"]
    return Hidden("chain", {"chain_stiffness": float(stiffness), "chain_rest": 0.5 * rig["stroke"]})


def cover(rng: np.random.Generator, rig: Rig) -> Hidden:
    """A telescopic cover whose second plate is pushed from some place on, in either direction of motion."""
    place = rig["stroke"] * rng.uniform(0.3, 0.6)
    force = either_sign(rng) * rng.uniform(12.0, 30.0)
    return Hidden("cover", {"cover_force": float(force), "cover_place": float(place), "cover_width": 0.002})


def squeal(rng: np.random.Generator, rig: Rig) -> Hidden:
    """Self-excited squeal within a band of speed, at a frequency fixed in Hz."""
    changes = {"squeal": rng.uniform(20.0, 50.0), "squeal_frequency": rng.uniform(40.0, 90.0)}
    return Hidden("squeal", {**{k: float(v) for k, v in changes.items()}, "squeal_low": 0.15 * rig["top"], "squeal_high": 0.5 * rig["top"]})


def magnet(rng: np.random.Generator, rig: Rig) -> Hidden:
    """Magnetic hysteresis of the motor: force lags the current's turning points by a play that is rounded (Bouc-Wen)."""
    return Hidden("magnet", {"hysteresis": float(rng.uniform(10.0, 25.0)), "hysteresis_current": float(rng.uniform(0.3, 0.8))})


def way_cover(rng: np.random.Generator, rig: Rig) -> Hidden:
    """A bellows that gives way over centimetres after each reversal: hysteresis in position, far longer than presliding."""
    return Hidden("way_cover", {"way_cover": float(rng.uniform(12.0, 35.0)), "way_cover_travel": float(rng.uniform(0.008, 0.02))})


def lugre_for_coulomb(rng: np.random.Generator, rig: Rig) -> Hidden:
    level, travel = float(rng.uniform(15.0, 50.0)), log_uniform(rng, 0.3e-6, 2e-6)
    stiffness = level / travel
    changes = {"lugre_level": level, "lugre_stiffness": stiffness, "lugre_damping": 0.3 * math.sqrt(stiffness * rig["mass"])}
    return Hidden("lugre_for_coulomb", changes, {"level": (level, "N")})


def lugre_for_stribeck(rng: np.random.Generator, rig: Rig) -> Hidden:
    made = lugre_for_coulomb(rng, rig)
    excess, speed = made.changes["lugre_level"] * float(rng.uniform(0.3, 0.8)), log_uniform(rng, 3e-3, 15e-3)
    return Hidden("lugre_for_stribeck", {**made.changes, "lugre_excess": excess, "lugre_speed": speed}, {"excess": (excess, "N")})


def friction_table(rng: np.random.Generator, rig: Rig) -> Hidden:
    """A measured friction curve, falling then rising, a little different in the two directions; ``@table`` holds its numbers."""
    level = float(rng.uniform(15.0, 50.0))
    changes = {"friction_table": 1.0, "@table_level": level, "@table_excess": level * float(rng.uniform(0.2, 0.6))}
    return Hidden("friction_table", {**changes, "@table_speed": log_uniform(rng, 3e-3, 15e-3)})


def three_harmonics(rng: np.random.Generator, rig: Rig) -> Hidden:
    size, period = rig["rated"] * log_uniform(rng, 0.015, 0.03), rig["lead"] / float(rng.choice([1.0, 2.0]))
    changes = {"ripple": size, "ripple_period": period, "ripple_phase": angle(rng), "ripple_second": 0.5, "ripple_third": 0.3}
    return Hidden("three_harmonics", changes, {"amplitude": (size, "N"), "period": (period, "m")})


def pitch_harmonics(rng: np.random.Generator, rig: Rig) -> Hidden:
    size = log_uniform(rng, 2e-6, 8e-6)
    changes = {"pitch_wave": size, "pitch_second": 0.4 * size, "pitch_third": 0.25 * size, "pitch_phase": angle(rng), "lead": rig["lead"]}
    return Hidden("pitch_harmonics", changes, {"amplitude": (size, "m"), "lead": (rig["lead"], "m")}, ("scale",))


def soft_backlash(rng: np.random.Generator, rig: Rig) -> Hidden:
    width = log_uniform(rng, 10e-6, 60e-6)
    return Hidden(
        "soft_backlash", {"backlash": width, "backlash_start": 1.0, "backlash_softness": 1.0}, {"width": (width, "m")}, ("scale",)
    )


OUTSIDE: dict[str, Draw] = {d.__name__: d for d in (drag, cubic_by_place, chain, cover, squeal, magnet, way_cover)}
OTHER_FORM: dict[str, Draw] = {
    d.__name__: d for d in (lugre_for_coulomb, lugre_for_stribeck, friction_table, three_harmonics, pitch_harmonics, soft_backlash)
}
