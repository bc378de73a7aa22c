"""What a case may hide: effects, wrong values, physics outside the catalogue and faults of the recording; and which names are right."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.diagnosis.rigs.machines import Rig
from tests.diagnosis.rigs.plant import Physics

EFFECTS: dict[str, tuple[str, ...]] = {
    "coulomb": ("CoulombFriction",),
    "stribeck": ("StribeckFriction",),
    "gravity": ("ForceOffset",),
    "converter_offset": ("ConverterOffset",),
    "dead_zone": ("AmplifierDeadZone",),
    "saturation": ("CurrentLimit", "DriveSaturation"),
    "delay": ("TransportDelay",),
    "inductance": ("MotorInductance", "CurrentLoopLag"),
    "cogging": ("Cogging", "TorqueRipple"),
    "backlash": ("Backlash",),
    "pitch_wave": ("PeriodicPitchError", "EncoderEccentricity"),
}
"""Key -> names that are right; the rest of an answer's tie counts as tied."""
BESIDE: dict[str, tuple[str, ...]] = {"stribeck": ("CoulombFriction",)}
"""What else has to be named: a peak at low speed stands on a friction."""
AT_THE_SCALE = ("backlash", "pitch_wave")
OUTSIDE = ("drag", "spring")
FAULTS: dict[str, str] = {
    "clock": r"clock|period|rate|fast|slow",
    "current_late": r"late|shift|behind",
    "sign": r"sign|negative|reversed|-1",
    "unit_1000": r"unit|factor|1000|mm",
    "behind_converter": r"level|converter|before|behind|x_dac|z_dac",
    "counts": r"count|factor|unit",
    "rows": r"late|shift|sample|behind|early",
}
"""Fault -> pattern that its sentence has to match."""
INPUTS = ("pulse", "step", "sine")
"""Shapes of what is added to a command; the answer has to name the shape."""
OF_ANY_RIG = ("clock", "current_late", "sign", "rows")
"""Faults that need no controller."""


@dataclass(frozen=True)
class Hidden:
    """The physics of a case, with the keys that are hidden in it."""

    physics: Physics
    keys: tuple[str, ...] = ()


def hide(rig: Rig, keys: tuple[str, ...], rng: np.random.Generator) -> Hidden:
    """Return the rig's physics with effects of sizes that its motion shows well."""
    changed = rig.physics
    for key in keys:
        changed = changed._replace(**_values(rig, key, rng))
    return Hidden(changed, keys)


def _values(rig: Rig, key: str, rng: np.random.Generator) -> dict[str, float]:
    p, turn = rig.physics, rig.physics.ratio * 2.0 * np.pi
    share = float(rng.uniform(0.5, 1.5))
    sizes: dict[str, dict[str, float]] = {
        "coulomb": {"coulomb": 0.2 * share * rig.torque},
        "stribeck": {
            "coulomb": 0.12 * rig.torque, "stribeck": 0.15 * share * rig.torque, "stribeck_speed": 0.04 * rig.top / p.ratio,
        },
        "gravity": {"offset_torque": 0.15 * share * rig.torque},
        "converter_offset": {"converter_offset": max(0.03 * share * rig.voltage, 0.6 * share * 20.0 / 2.0**p.bits)},
        "dead_zone": {"dead_zone": max(0.04 * share * rig.voltage, share * 20.0 / 2.0**p.bits)},
        "saturation": {"current_limit": 0.75 * rig.torque / p.torque_constant},
        "delay": {"delay": 1.5 * share * p.period},
        "inductance": {"inductance_time": 2.0 * share * p.period},
        "cogging": {"cogging": 0.1 * share * rig.torque, "cogging_turn": turn / 4.0},
        "backlash": {"backlash": 15.0 * share * p.scale},
        "pitch_wave": {"pitch": 8.0 * share * p.scale, "pitch_turn": turn},
        "drag": {"drag": 0.4 * share * rig.torque / (rig.top / p.ratio) ** 2},
        "spring": {"spring": 0.6 * share * rig.torque / rig.stroke**3},
    }  # fmt: skip
    return sizes[key]


def possible(rig: Rig) -> tuple[str, ...]:
    """Return the effects that a rig can hide."""
    if rig.kind == "spindle":
        return ("coulomb", "dead_zone", "converter_offset", "gravity", "inductance", "saturation")
    return tuple(key for key in EFFECTS if rig.scale or key not in AT_THE_SCALE)
