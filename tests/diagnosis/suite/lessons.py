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
    """What the program calls a hidden effect at its place: ``effect`` first choice, ``accept`` other names that count as right.

    ``mean`` is what the true machine has besides, unless the lesson has it: a friction that is uneven around a mean rubs with that mean.
    """

    effect: str
    at: str
    accept: tuple[str, ...] = ()
    mean: str = ""

    @property
    def right(self) -> tuple[str, ...]:
        """Every name that counts as right."""
        return (self.effect, *self.accept)


NAMES: dict[str, Name] = {
    "coulomb": Name("CoulombFriction", "x_axis"),
    "stribeck": Name("StribeckFriction", "x_axis"),
    "bristles": Name("PreslidingFriction", "x_axis"),
    "asymmetric": Name("AsymmetricFriction", "x_axis"),
    "gravity": Name("ForceOffset", "x_axis"),
    "tight_spots": Name("PositionDependentFriction", "x_axis", mean="CoulombFriction"),
    "backlash": Name("Backlash", "x_scale"),
    "pitch": Name("CumulativePitchError", "x_scale", ("ScaleFactorError",)),
    "pitch_wave": Name("PeriodicPitchError", "x_scale", ("EncoderEccentricity",)),
    "screw_growth": Name("ThermalScrewGrowth", "x_scale"),
    "resonance": Name("AxialResonance", "x_axis"),
    "wind_up": Name("TorsionalWindUp", "x_scale"),
    "inductance": Name("MotorInductance", "x_drive"),
    "current_loop": Name("CurrentLoopLag", "x_drive"),
    "dead_zone": Name("AmplifierDeadZone", "x_drive"),
    "saturation": Name("DriveSaturation", "x_drive"),
    "ripple": Name("TorqueRipple", "x_axis"),
    "cogging": Name("Cogging", "x_axis", ("TorqueRipple",)),
    "converter_offset": Name("ConverterOffset", "x_drive"),
    "converter_step": Name("ConverterResolution", "x_drive", ("Quantisation", "ConverterOffset")),
    "delay": Name("TransportDelay", "x_drive"),
    "clock_skew": Name("ClockSkew", "x_scale"),
    "channel_shift": Name("ChannelTimeShift", "x_scale", ("TransportDelay",)),
    "eccentricity": Name("EncoderEccentricity", "x_encoder"),
    "interpolation": Name("EncoderInterpolationError", "x_encoder"),
    "lost_counts": Name("LostCounts", "x_encoder"),
    "coarse_encoder": Name("Quantisation", "x_encoder"),
    "scale_factor": Name("ScaleFactorError", "x_scale", ("CumulativePitchError",)),
    "lugre_for_coulomb": Name("CoulombFriction", "x_axis", ("PreslidingFriction",)),
    "lugre_for_stribeck": Name("StribeckFriction", "x_axis", ("PreslidingFriction", "CoulombFriction")),
    "friction_table": Name("StribeckFriction", "x_axis", ("CoulombFriction", "AsymmetricFriction", "PreslidingFriction")),
    "three_harmonics": Name("Cogging", "x_axis", ("TorqueRipple",)),
    "pitch_harmonics": Name("PeriodicPitchError", "x_scale", ("EncoderEccentricity",)),
    "soft_backlash": Name("Backlash", "x_scale"),
    "spindle_coulomb": Name("CoulombFriction", "spindle"),
    "spindle_asymmetric": Name("AsymmetricFriction", "spindle"),
    "torque_limit": Name("DriveSaturation", "spindle"),
    "spindle_ripple": Name("TorqueRipple", "spindle"),
    "spindle_cogging": Name("Cogging", "spindle", ("TorqueRipple",)),
    "disc_eccentricity": Name("EncoderEccentricity", "spindle_encoder"),
    "tacho_ripple": Name("TachometerRipple", "tachometer"),
    "tacho_gain": Name("TachometerRipple", "tachometer", ("ScaleFactorError",)),
    "belt_slip": Name("BeltSlip", "spindle"),
    "speed_droop": Name("SpeedDroop", "spindle"),
    "tacho_filter": Name("SensorFilter", "tachometer"),
    "edge_force": Name("EdgeForce", "cutting"),
    "size_effect": Name("ChipThicknessExponent", "cutting"),
    "speed_effect": Name("SpeedDependence", "cutting"),
    "softening": Name("TemperatureSoftening", "cutting"),
    "wear": Name("WearForceGrowth", "cutting"),
    "slot": Name("InterruptedCut", "cutting"),
    "hard_spot": Name("HardSpot", "cutting"),
    "runout": Name("Runout", "cutting"),
    "charge_leak": Name("DynamometerDrift", "dynamometer"),
}
"""This suite's key -> what the program calls it. Keys that are not here lie outside the catalogue."""

THE_DATA = ("clock_skew", "channel_shift", "scale_factor")
"""Hidden effects that are as rightly called a fault of the recording, with the channel named."""


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
