"""What has no remedy in software, and what to repair instead."""

from __future__ import annotations

REPAIRS = {
    "LostCounts": "counts are lost at random: repair the encoder's cable, plug or supply, or take a slower edge",
    "Quantisation": "a reading cannot be finer than its steps: take a finer encoder",
    "ConverterResolution": "a voltage cannot be finer than its levels: take a converter of more bits",
    "SampleJitter": "the instants are random: mend the clock of the control",
    "BeltSlip": "the belt slips at random: tension or replace it",
    "ChannelTimeShift": "a recorded channel is late, the machine is not: correct it in the recording",
    "ClockSkew": "the recorder's clock is off, the machine's is not: correct it in the recording",
    "DriveSaturation": "a drive gives no more than it can: lower feed or acceleration, or take a larger drive",
    "CurrentLimit": "a motor gets no more current than its amplifier gives: accelerate less, or take a larger amplifier",
    "SlewLimit": "a drive changes no faster than it can: lower the jerk, or take a faster amplifier",
    "RegenerativeChatter": "cut at another speed: 'lathesim lobes' shows where the cut is stable, or vary the speed",
    "WorkpieceDeflection": "support the part, take less depth, or write the remedy as a program, which mirrors what bends into its path",
    "ToolCompliance": "take a stiffer tool or less depth, or write the remedy as a program, which mirrors what bends into its path",
    "SpeedDroop": "give the spindle's controller an integral part, or program as much more speed as the load takes",
    "ViscousWarmUp": "run the machine warm before it works, or give the loop an integral part",
    "Unbalance": "balance the spindle",
    "Runout": "true the part or turn it round in the chuck",
    "SensorFilter": "take a faster sensor, or lower the gain that its lag allows",
    "TachometerRipple": "take a better tachometer, or the difference of the encoder's readings",
    "DynamometerDrift": "reset the force sensor; the machine is not at fault",
    "DynamometerCrosstalk": "calibrate the force sensor; the machine is not at fault",
    "DynamometerResonance": "filter the force sensor; the machine is not at fault",
}
"""Effect -> what to do. A remedy in software would hide it or make it worse."""
OF_THE_CUT = "it is of the cut: change tool, feed or speed"


def repair_of(effect: str, family: str) -> str:
    """Return what to repair where no remedy answers to an effect."""
    if effect in REPAIRS:
        return REPAIRS[effect]
    if family in ("force law", "force", "force over time", "process"):
        return OF_THE_CUT
    return "no remedy of a control answers to it: see what 'lathesim effects' says of its cause"
