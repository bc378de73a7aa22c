"""What a case may hide, how large it is on a rig, and which names are right: effects, physics outside the catalogue, faults and inputs."""

from __future__ import annotations

import numpy as np

from tests.diagnosis.rigs.machines import Rig
from tests.diagnosis.rigs.plant import Physics

KNOWN: dict[str, tuple[str, ...]] = {
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
NEW: dict[str, tuple[str, ...]] = {
    "asymmetric": ("AsymmetricFriction",),
    "tight_spot": ("PositionDependentFriction",),
    "warm_up": ("ViscousWarmUp",),
    "presliding": ("PreslidingFriction",),
    "slew": ("SlewLimit",),
    "sag": ("DriveGainError",),
    "coarse_converter": ("ConverterResolution",),
    "current_filter": ("SensorFilter",),
    "interpolation": ("EncoderInterpolationError",),
    "lead_error": ("CumulativePitchError", "ScaleFactorError"),
    "growth": ("ThermalScrewGrowth",),
    "wind_up": ("TorsionalWindUp",),
}
"""The same of effects that nobody hid when the method was first tuned; singles alternate between these and the others."""
RIGHT = KNOWN | NEW
BESIDE = {"stribeck": ("CoulombFriction",), "tight_spot": ("CoulombFriction",)}
"""What else has to be named: a peak at low speed and a tight spot stand on a friction."""
SAME_WITHOUT_CURRENT = ("gravity", "converter_offset")
"""Where no current is recorded, an offset of the converter moves the load as a constant force does: no channel tells them apart."""
OUTSIDE = ("pushed", "shaken", "buffer", "drag", "spring")
"""Physics outside the catalogue: a force from an instant on, a neighbour that shakes the machine, a buffer at one end of the stroke, a
force with the square of the speed, a spring of the third power."""
PAIRS = (("coulomb", "sag"), ("asymmetric", "delay"), ("coulomb", "wind_up"), ("gravity", "warm_up"), ("presliding", "gravity"),
         ("coulomb", "lead_error"), ("dead_zone", "warm_up"), ("coulomb", "slew"), ("coulomb", "cogging"), ("asymmetric", "backlash"),
         ("saturation", "coulomb"), ("coulomb", "current_filter"), ("dead_zone", "asymmetric"), ("coulomb", "gravity"),
         ("dead_zone", "coulomb"), ("gravity", "pitch_wave"), ("delay", "coulomb"), ("saturation", "gravity"),
         ("coulomb", "inductance"))  # fmt: skip
FAULTS: dict[str, str] = {
    "clock": r"clock|period|rate|fast|slow",
    "current_late": r"late|shift|behind",
    "sign": r"sign|negative|reversed|-1",
    "unit_1000": r"unit|factor|1000|mm",
    "behind_converter": r"level|converter|before|behind|x_dac|z_dac",
    "counts": r"count|factor|unit",
    "rows": r"late|shift|sample|behind|early",
    "sign_of_place": r"sign|negative|reversed|-1",
    "other_axis": r"axis|exchanged|swapped|other",
}
"""Fault -> pattern that its sentence has to match."""
INPUTS = ("pulse", "step", "sine")
"""Shapes of what is added to a command; the answer has to name the shape."""
_AT_THE_SCALE = ("backlash", "pitch_wave", "lead_error", "growth", "wind_up")
_OF_A_CURRENT = ("current_filter",)


def possible_faults(rig: Rig) -> list[str]:
    """Return the faults of a recording that show in what a rig records."""
    names = ["clock", "rows", *(() if rig.open else ("behind_converter", "counts"))]
    names += ["current_late", "sign"] if rig.current else ["sign_of_place"]
    names += ["unit_1000"] if rig.kind in ("axis", "lathe") else []
    return names + (["other_axis"] if rig.second else [])


def possible(rig: Rig) -> tuple[str, ...]:
    """Return the effects that a rig can hide in what is recorded of it."""
    left = [key for key in RIGHT if (rig.scale or key not in _AT_THE_SCALE) and (rig.current or key not in _OF_A_CURRENT)]
    if rig.kind == "spindle":
        left = [key for key in left if key not in ("stribeck", "presliding", "tight_spot", "cogging", "interpolation")]
    if rig.open:
        left.remove("coarse_converter")
    if rig.physics.tachometer == 0.0:
        left.remove("slew")  # a loop that damps by the amplifier alone does not bear it
    if rig.physics.voltage_constant == 0.0:
        left.remove("saturation")  # nor a loop on an amplifier of current that it is cut off
    if rig.physics.encoder > 1e-6 and rig.kind != "rotary":
        left = [key for key in left if key not in ("presliding", "interpolation")]
    return tuple(left)


def outside(rig: Rig) -> tuple[str, ...]:
    """Return what a rig can hide that the catalogue lacks."""
    return ("pushed", "shaken", "drag") if rig.kind == "spindle" else OUTSIDE


def right_names(rig: Rig, key: str) -> list[str]:
    """Return the names that are right for a key: those of effects which are one in all that the rig records."""
    if key in SAME_WITHOUT_CURRENT and not rig.current:
        return [name for one in SAME_WITHOUT_CURRENT for name in KNOWN[one]]
    return list(RIGHT.get(key, ()))


def hide(rig: Rig, keys: tuple[str, ...], rng: np.random.Generator, large_current: float) -> Physics:
    """Return the physics of a rig with effects of a size that its motion shows, and that does not rule it.

    ``large_current`` [A] is what 1.5 % of the samples of a sound recording exceed.
    """
    changed = rig.physics
    for key in keys:
        share = float(rng.uniform(0.6, 1.4))
        for sizes in (_frictions(rig, share), _drives(rig, share, large_current), _readings(rig, share, rng), _foreign(rig, share, rng)):
            changed = changed._replace(**sizes.get(key, {}))
    return changed


def _frictions(rig: Rig, share: float) -> dict[str, dict[str, float]]:
    p, torque = rig.physics, rig.torque
    return {
        "coulomb": {"coulomb": 0.2 * share * torque},
        "stribeck": {"coulomb": 0.12 * torque, "stribeck": 0.15 * share * torque, "stribeck_speed": 0.04 * rig.top / p.ratio},
        # the levels alone would be a friction and a constant force
        "asymmetric": {
            "coulomb": 0.2 * share * torque,
            "asymmetry": 0.3,
            "one_way_viscous": 0.15 * share * torque * p.ratio / rig.top,
        },
        "tight_spot": {"coulomb": 0.2 * share * torque, "tight": 0.12 * share * torque, "tight_period": 0.4 * rig.stroke},
        "presliding": {"bristle": 0.25 * share * torque, "bristle_travel": 0.004 * rig.stroke},
        "warm_up": {"warmed_viscous": 0.25 * share * torque * p.ratio / rig.top, "warm_time": 0.4 * rig.seconds},
        "gravity": {"offset_torque": 0.15 * share * torque},
        "cogging": {"cogging": 0.1 * share * torque, "cogging_period": rig.turn / 2.0},
    }


def _drives(rig: Rig, share: float, large_current: float) -> dict[str, dict[str, float]]:
    p, level = rig.physics, 20.0 / 2.0**rig.physics.bits
    return {
        "converter_offset": {"converter_offset": max(0.03 * share * rig.voltage, 1.5 * share * level)},
        "dead_zone": {"dead_zone": max(0.04 * share * rig.voltage, 1.5 * share * level)},
        "saturation": {"current_limit": (0.75 + 0.1 * share) * large_current},
        "slew": {"slew": 1.2 * share * rig.voltage * rig.acceleration / rig.top},
        "sag": {"sag": 0.15 * share / rig.voltage},
        "coarse_converter": {"bits": min(p.bits - 3.0, 8.0)},
        "delay": {"delay": share * max(1.5 * p.period, 0.8e-3)},
        "inductance": {"lag": share * max(2.0 * p.period, 1e-3)},
        "current_filter": {"current_filter": share * max(4.0 * p.period, 2e-3)},
    }


def _readings(rig: Rig, share: float, rng: np.random.Generator) -> dict[str, dict[str, float]]:
    p, side = rig.physics, float(rng.choice([-1.0, 1.0]))
    seen, tight = 15.0 * share * p.scale, p.velocity_gain > 0.0 or p.derivative > 1.0
    return {
        "interpolation": {"interpolation": (6.0 if tight else 14.0) * share * p.encoder, "signal_period": 400.0 * p.encoder},
        "backlash": {"backlash": seen},
        "pitch_wave": {"pitch": 0.6 * seen, "pitch_period": rig.turn},
        "lead_error": {"lead_error": side * 2.0 * seen / rig.stroke},
        "growth": {"growth": 3.0 * seen / rig.stroke, "growth_time": 0.5 * rig.seconds},
        "wind_up": {"wind_up": seen / rig.torque},
    }


def _foreign(rig: Rig, share: float, rng: np.random.Generator) -> dict[str, dict[str, float]]:
    torque = rig.torque
    return {
        "pushed": {"pushed": 0.3 * share * torque, "pushed_from": float(rng.uniform(0.3, 0.6)) * rig.seconds},
        "shaken": {"shaken": 0.2 * share * torque, "shaken_rate": float(rng.uniform(3.0, 7.0))},
        "buffer": {"buffer": share * torque / rig.stroke, "buffer_from": 0.1 * rig.stroke},
        "drag": {"drag": 0.4 * share * torque / (rig.top / rig.physics.ratio) ** 2},
        "spring": {"spring": 0.6 * share * torque / rig.stroke**3},
    }


def without(rig: Rig, changed: Physics, key: str) -> Physics:
    """Return the physics of a case less one of its effects: what it is compared with."""
    rng = np.random.default_rng(0)
    every = (_frictions(rig, 1.0), _drives(rig, 1.0, 0.0), _readings(rig, 1.0, rng), _foreign(rig, 1.0, rng))
    fields = {name for sizes in every for name in sizes.get(key, {})}
    if key in BESIDE:
        fields -= {"coulomb"}
    return changed._replace(**{name: getattr(rig.physics, name) for name in fields})


def faulty(fault: str, table: dict[str, np.ndarray], encoder: float) -> dict[str, np.ndarray]:
    """Return the columns with one fault in them; ``encoder`` is the length of one count."""
    made = dict(table)
    match fault:
        case "clock":
            made["t"] = table["t"] * 1.003
        case "current_late":
            made["i"] = np.r_[np.full(12, table["i"][0]), table["i"][:-12]]
        case "sign":
            made["i"] = -table["i"]
        case "sign_of_place":
            made["q"] = -table["q"]
        case "unit_1000":
            made["q"] = 1e3 * table["q"]
        case "behind_converter":
            made["u"] = table["held"]
        case "counts":
            made["q"] = np.round(table["q"] / encoder)
        case "rows":
            made["q"] = np.r_[table["q"][0], table["q"][:-1]]
        case "other_axis":
            made["q"], made["q_2"] = table["q_2"], table["q"]
    return made
