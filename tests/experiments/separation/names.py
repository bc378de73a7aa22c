"""What the program calls each hidden effect. Nothing else of the truths knows it."""

from __future__ import annotations

from dataclasses import dataclass


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
    "ripple": Name("TorqueRipple", "x_axis"),
    "cogging": Name("Cogging", "x_axis", ("TorqueRipple",)),
    "converter_offset": Name("ConverterOffset", "x_drive"),
    "delay": Name("TransportDelay", "x_drive"),
    "clock_skew": Name("ClockSkew", "x_scale"),
    "eccentricity": Name("EncoderEccentricity", "x_encoder"),
    "spindle_coulomb": Name("CoulombFriction", "spindle"),
    "spindle_asymmetric": Name("AsymmetricFriction", "spindle"),
    "spindle_ripple": Name("TorqueRipple", "spindle"),
    "spindle_cogging": Name("Cogging", "spindle", ("TorqueRipple",)),
    "tacho_ripple": Name("TachometerRipple", "tachometer"),
    "edge_force": Name("EdgeForce", "cutting"),
    "size_effect": Name("ChipThicknessExponent", "cutting"),
    "speed_effect": Name("SpeedDependence", "cutting"),
    "softening": Name("TemperatureSoftening", "cutting"),
    "slot": Name("InterruptedCut", "cutting"),
    "hard_spot": Name("HardSpot", "cutting"),
    "runout": Name("Runout", "cutting"),
}
"""Key of an effect -> what the program calls it."""
