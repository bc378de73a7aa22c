"""THE mapping to the program under test: names of templates, parts, columns and effects. Nothing else of the suite knows them."""

from __future__ import annotations

from dataclasses import dataclass

from tests.diagnosis.suite.recorded import Told

PLACES = {
    "cascade_axis": {
        "mass": ("x_axis.mass", "kg"), "viscous": ("x_axis.viscous", "N*s/m"), "effort_constant": ("x_drive.effort_constant", "N/A"),
        "conductance": ("x_drive.conductance", "A/V"), "back_emf": ("x_drive.back_emf", "V*s/m"),
        "position_gain": ("x_controller.position_gain", "1/s"), "velocity_gain": ("x_controller.velocity_gain", "V*s/m"),
        "integral_rate": ("x_controller.integral_rate", "1/s"), "mean_share": ("x_controller.mean_share", "1"),
        "proportional": ("x_controller.proportional", "V/m"), "integral": ("x_controller.integral", "V/(m*s)"),
        "derivative_gain": ("x_controller.derivative_gain", "V*s/m"), "converter_bits": ("x_dac.bits", "1"),
        "encoder_resolution": ("x_encoder.resolution", "m"), "scale_resolution": ("x_scale.resolution", "m"),
        "coulomb": ("x_axis_coulomb_friction.level", "N"),
    },
    "torque_spindle": {
        "inertia": ("spindle.inertia", "kg*m^2"), "viscous": ("spindle.viscous", "N*m*s/rad"), "gain": ("tachometer.gain", "V*s/rad"),
        "encoder_resolution": ("spindle_encoder.resolution", "rad"),
    },
    "cutting_process": {
        "specific_force": ("cutting.specific_force", "N/m^2"), "thrust_ratio": ("cutting.thrust_ratio", "1"),
        "feed_ratio": ("cutting.feed_ratio", "1"), "radius": ("cutting.radius", "m"),
    },
}  # fmt: skip
"""Template -> this suite's name of a value -> (part.parameter, unit)."""

DRIVE = {
    "cascade_axis": {"x_controller.reference": ("reference", "m")},
    "torque_spindle": {"spindle.torque": ("torque", "N*m"), "spindle.disturbance": ("load", "N*m")},
    "cutting_process": {"cutting.feed": ("feed", "mm"), "cutting.depth": ("depth", "mm"), "cutting.speed": ("speed", "m/min")},
}
"""Template -> input -> (column, unit)."""

COMPARE = {
    "cascade_axis": {
        "command": ("x_controller.voltage", "V"), "encoder": ("x_encoder.position", "m"), "scale": ("x_scale.position", "m"),
        "current": ("x_drive.current", "A"),
    },
    "torque_spindle": {"encoder": ("spindle_encoder.angle", "rad"), "tachometer": ("tachometer.voltage", "V")},
    "cutting_process": {"main": ("dynamometer.main", "N"), "thrust": ("dynamometer.thrust", "N"), "feed_force": ("dynamometer.feed", "N")},
}  # fmt: skip
"""Template -> column -> (output, unit)."""


def outputs(template: str) -> dict[str, str]:
    """Return what the program calls each column: the output it is held against, or the input it drives."""
    driven = {column: target for target, (column, _) in DRIVE[template].items()}
    return driven | {column: target for column, (target, _) in COMPARE[template].items()}


_PID_ONLY = ("proportional", "integral", "derivative_gain")
_CASCADE_ONLY = ("position_gain", "velocity_gain", "integral_rate", "mean_share")
STEP = {"cascade_axis": "0.25 ms", "torque_spindle": "0.5 ms", "cutting_process": "1 ms"}


@dataclass(frozen=True)
class Name:
    """What the program calls a hidden effect: ``effect`` first choice, ``accept`` all names that count as right.

    ``mean`` is what the true machine has besides, unless the lesson has it: a friction that is uneven around a mean rubs with that mean.
    """

    catalogue: int
    effect: str
    family: str
    at: str
    accept: tuple[str, ...] = ()
    ties: tuple[str, ...] = ()
    mean: str = ""

    @property
    def right(self) -> tuple[str, ...]:
        """Every name that counts as right."""
        return (self.effect, *self.accept)


NAMES: dict[str, Name] = {
    "coulomb": Name(1, "CoulombFriction", "reversal", "x_axis", (), ("PreslidingFriction",)),
    "stribeck": Name(2, "StribeckFriction", "reversal", "x_axis", (), ("PreslidingFriction",)),
    "bristles": Name(3, "PreslidingFriction", "reversal", "x_axis"),
    "asymmetric": Name(4, "AsymmetricFriction", "reversal", "x_axis", (), ("CoulombFriction", "ForceOffset")),
    "gravity": Name(5, "ForceOffset", "constants", "x_axis"),
    "tight_spots": Name(6, "PositionDependentFriction", "once per turn", "x_axis", mean="CoulombFriction"),
    "backlash": Name(8, "Backlash", "reversal", "x_scale"),
    "pitch": Name(9, "CumulativePitchError", "geometry", "x_scale", ("ScaleFactorError",)),
    "pitch_wave": Name(10, "PeriodicPitchError", "once per turn", "x_scale", ("EncoderEccentricity",)),
    "screw_growth": Name(11, "ThermalScrewGrowth", "slow", "x_scale"),
    "resonance": Name(13, "AxialResonance", "lag", "x_axis"),
    "wind_up": Name(14, "TorsionalWindUp", "lag", "x_scale"),
    "inductance": Name(16, "MotorInductance", "lag", "x_drive"),
    "current_loop": Name(17, "CurrentLoopLag", "lag", "x_drive"),
    "dead_zone": Name(18, "AmplifierDeadZone", "drive range", "x_drive"),
    "saturation": Name(20, "DriveSaturation", "drive range", "x_drive"),
    "ripple": Name(21, "TorqueRipple", "once per turn", "x_axis"),
    "cogging": Name(22, "Cogging", "once per turn", "x_axis", ("TorqueRipple",)),
    "converter_offset": Name(23, "ConverterOffset", "constants", "x_drive"),
    "converter_step": Name(23, "ConverterResolution", "drive range", "x_drive", ("Quantisation", "ConverterOffset")),
    "delay": Name(24, "TransportDelay", "lag", "x_drive"),
    "clock_skew": Name(26, "ClockSkew", "slow", "x_scale"),
    "channel_shift": Name(27, "ChannelTimeShift", "recording", "x_scale", ("TransportDelay",)),
    "eccentricity": Name(28, "EncoderEccentricity", "once per turn", "x_encoder"),
    "interpolation": Name(29, "EncoderInterpolationError", "encoder", "x_encoder"),
    "lost_counts": Name(30, "LostCounts", "encoder", "x_encoder"),
    "coarse_encoder": Name(30, "Quantisation", "encoder", "x_encoder"),
    "scale_factor": Name(33, "ScaleFactorError", "constants", "x_scale", ("CumulativePitchError",)),
    "lugre_for_coulomb": Name(1, "CoulombFriction", "reversal", "x_axis", ("PreslidingFriction",)),
    "lugre_for_stribeck": Name(2, "StribeckFriction", "reversal", "x_axis", ("PreslidingFriction", "CoulombFriction")),
    "friction_table": Name(2, "StribeckFriction", "reversal", "x_axis", ("CoulombFriction", "AsymmetricFriction", "PreslidingFriction")),
    "three_harmonics": Name(22, "Cogging", "once per turn", "x_axis", ("TorqueRipple",)),
    "pitch_harmonics": Name(10, "PeriodicPitchError", "once per turn", "x_scale", ("EncoderEccentricity",)),
    "soft_backlash": Name(8, "Backlash", "reversal", "x_scale"),
    "spindle_coulomb": Name(1, "CoulombFriction", "reversal", "spindle"),
    "spindle_asymmetric": Name(4, "AsymmetricFriction", "reversal", "spindle", (), ("CoulombFriction", "ForceOffset")),
    "torque_limit": Name(20, "DriveSaturation", "drive range", "spindle"),
    "spindle_ripple": Name(21, "TorqueRipple", "once per turn", "spindle"),
    "spindle_cogging": Name(22, "Cogging", "once per turn", "spindle", ("TorqueRipple",)),
    "disc_eccentricity": Name(28, "EncoderEccentricity", "once per turn", "spindle_encoder"),
    "tacho_ripple": Name(31, "TachometerRipple", "once per turn", "tachometer"),
    "tacho_gain": Name(31, "TachometerRipple", "once per turn", "tachometer", ("ScaleFactorError",)),
    "belt_slip": Name(35, "BeltSlip", "spindle speed", "spindle"),
    "speed_droop": Name(36, "SpeedDroop", "spindle speed", "spindle", (), ("BeltSlip",)),
    "tacho_filter": Name(32, "SensorFilter", "lag", "tachometer"),
    "edge_force": Name(38, "EdgeForce", "force law", "cutting", (), ("ChipThicknessExponent",)),
    "size_effect": Name(39, "ChipThicknessExponent", "force law", "cutting", (), ("EdgeForce",)),
    "speed_effect": Name(40, "SpeedDependence", "force law", "cutting"),
    "softening": Name(41, "TemperatureSoftening", "slow", "cutting"),
    "wear": Name(42, "WearForceGrowth", "slow", "cutting"),
    "slot": Name(47, "InterruptedCut", "spindle-synchronous", "cutting"),
    "hard_spot": Name(47, "HardSpot", "spindle-synchronous", "cutting"),
    "runout": Name(34, "Runout", "spindle-synchronous", "cutting"),
    "charge_leak": Name(50, "DynamometerDrift", "slow", "dynamometer"),
}
"""This suite's key -> what the program calls it. Keys that are not here lie outside the catalogue."""

_SAME_KIND = {"geometry": ("constants",), "constants": ("geometry",), "recording": ("lag",), "lag": ("structure",)}
"""Families whose members have the same equation at another place (a pitch error and a scale factor), which count for one another."""
THE_DATA = ("clock_skew", "channel_shift", "scale_factor")
"""Hidden effects that are as rightly called a fault of the recording, with the channel named."""


def families(key: str) -> tuple[str, ...]:
    """Return the families an answer may give for a hidden effect: its own, those of the other right names, and of the same equation."""
    name = NAMES[key]
    own = [other.family for accepted in name.right for other in NAMES.values() if other.effect == accepted]
    return tuple(dict.fromkeys([name.family, *own, *_SAME_KIND.get(name.family, ())]))


def indistinguishable(key: str, channels: tuple[str, ...]) -> tuple[str, ...]:
    """Return what cannot be told from a hidden effect with the channels there are; naming one of them in a tie is then the best answer."""
    same: list[str] = list(NAMES[key].ties) if key in NAMES else []
    if "current" not in channels:
        if key in ("gravity", "converter_offset"):
            same += ["ForceOffset", "ConverterOffset"]
        if key in ("inductance", "current_loop", "delay"):
            same += ["MotorInductance", "CurrentLoopLag", "TransportDelay", "SensorFilter"]
    if key in ("ripple", "cogging", "spindle_ripple", "spindle_cogging", "three_harmonics"):
        same += ["TorqueRipple", "Cogging"]
    if key in ("eccentricity", "pitch_wave", "pitch_harmonics"):
        same += ["EncoderEccentricity", "PeriodicPitchError"]
    if key == "resonance" and "scale" not in channels:
        same += ["CurrentLoopLag", "TransportDelay"]
    return tuple(dict.fromkeys(name for name in same if key not in NAMES or name != NAMES[key].effect))


def lesson_text(told: Told, recording: str = "fit.csv") -> str:
    """Return the lesson of a case as YAML."""
    places = PLACES[told.template]
    settings = {**told.settings, **{k: v for k, v in told.given.items() if k != "coulomb"}}
    if told.template == "cascade_axis":
        dropped = _CASCADE_ONLY if told.pid else _PID_ONLY
        settings = {name: value for name, value in settings.items() if name not in dropped}
    lines = [
        "lesson: A machine that may hide something",
        f"machine: {told.template}",
        "sample_period: 1 ms",
        f"step: {STEP[told.template]}",
    ]
    if told.pid:
        lines.append("replace: {x_controller: PositionController}")
    lines.append("set:")
    lines += [f"  {places[name][0]}: {_quantity(value, places[name][1])}" for name, value in settings.items()]
    if told.known_coulomb > 0.0:
        lines.append(f"insert: [{{effect: CoulombFriction, at: x_axis, level: {_quantity(told.known_coulomb, 'N')}}}]")
    lines += ["recordings:", f"  file: {recording}", "  time: {column: time, unit: s}", "  drive:"]
    for target, (column, unit) in DRIVE[told.template].items():
        held = ", held: true" if unit == "N*m" else ""  # the truth steps with a torque and a load that stay for a sample
        lines.append(f"    {target}: {{column: {column}, unit: {unit}{held}}}")
    lines.append("  compare:")
    compare = COMPARE[told.template]
    lines += [f"    {compare[name][0]}: {{column: {name}, unit: {compare[name][1]}}}" for name in told.channels]
    lines.append("uncertain:")
    lines += [f"  {places[name][0]}: {100.0 * share:.3g} %" for name, share in told.sigma.items()]
    return "\n".join(lines) + "\n"


def _quantity(value: float, unit: str) -> str:
    return f"{value:.8g}" if unit == "1" else f"{value:.8g} {unit}"
