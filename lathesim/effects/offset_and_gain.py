"""Constants: what is added to a force, a voltage or a reading, or multiplies it, all of the time."""

from __future__ import annotations

import math

from lathesim.component import Input, Output, Parameter
from lathesim.effects.effect import Effect, Identification, OnCommand
from lathesim.elementary import sin


class ForceOffset(Effect):
    """A constant force against the positive direction: weight on a slant bed, an unequal counterweight.

    F_out = F_in + offset          (gravity: offset = m g sin(slant))
    """

    catalogue, family, site = 5, "constants", "effort"
    neutral = {"offset": 0.0}
    identification = Identification(typical={"offset": (-500.0, 500.0)}, typical_rotary={"offset": (-1.0, 1.0)})
    fingerprint = "The missing force holds a constant that is there at rest and in both directions."
    confused_with = ("ConverterOffset, the same thing without a current channel", "AsymmetricFriction")
    experiment = (
        "Hold still with the drive on; change the moving mass, or the drive gain: weight follows the mass, a voltage offset the gain."
    )
    source = "Janot, Gautier, Brunot, Data Set and Reference Models of EMPS, 2019, eq. 3 (offset of -3.2 N). Range assumed."

    incoming = Input("{signal}", doc="disturbance before the offset")
    outgoing = Output("{signal}", doc="disturbance with the offset")
    offset = Parameter("{signal}", 0.0, doc="constant force against positive motion")

    @staticmethod
    def output(incoming: float, offset: float) -> float:
        return incoming if offset == 0.0 else incoming + offset


class GravityTorque(Effect):
    """The weight of an arm or of a part clamped off centre, which pulls it to where it hangs at rest.

    T_out = T_in + torque sin(q - lowest)          (torque = m g r)
    """

    catalogue, family, site = 51, "constants", "effort"
    neutral = {"torque": 0.0}
    identification = Identification(
        carried=("N*m",),
        typical={"torque": (0.05, 50.0), "lowest": (-math.pi, math.pi)},
        starts={"torque": (1.0, 1.0, 1.0), "lowest": (0.0, 2.0 * math.pi / 3.0, -2.0 * math.pi / 3.0)},
        nuisance=("lowest",),
        phases=("lowest",),
    )
    fingerprint = "The missing torque is a sine of the angle with one wave a turn, the same both ways, at rest and with the drive off."
    confused_with = ("Cogging once per turn", "ForceOffset, over a small angle", "AxialResonance, as a pendulum swings too")
    experiment = "Let the arm hang, then hold it level with the drive on: the torque is largest there. Half the load halves it."
    source = (
        "Siciliano, Sciavicco, Villani, Oriolo, Robotics: Modelling, Planning and Control, 2009, section 7.3 (pendulum under gravity). "
        "Range assumed."
    )

    incoming = Input("{signal}", doc="disturbance before the weight")
    displacement = Input("{displacement}", doc="angle of the host")
    outgoing = Output("{signal}", doc="disturbance with the weight")
    torque = Parameter("{signal}", 0.0, low=0.0, doc="weight times the distance of its centre from the shaft")
    lowest = Parameter("rad", 0.0, doc="angle at which it hangs at rest")

    @staticmethod
    def output(incoming: float, displacement: float, torque: float, lowest: float) -> float:
        return incoming if torque == 0.0 else incoming + torque * sin(displacement - lowest)


class ConverterOffset(Effect):
    """An offset of a digital-to-analogue converter or its amplifier.

    u_out = u_in + offset
    """

    catalogue, family, site = 23, "constants", "drive"
    neutral = {"offset": 0.0}
    identification = Identification(of_any_reading=True, typical={"offset": (-0.2, 0.2)})
    fingerprint = "A constant between commanded and acting voltage."
    confused_with = ("ForceOffset, the same thing without a current channel",)
    experiment = (
        "Command zero and measure the current; scan the command slowly through its range. In volts the offset scales with the gain."
    )
    source = (
        "Kester (ed.), The Data Conversion Handbook, Newnes 2005, ch. 2 and 5; 8 to 12 bit on +-10 V: 5 to 80 mV. Offset range assumed."
    )

    incoming = Input("{signal}", doc="command before the converter's fault")
    outgoing = Output("{signal}", doc="command that acts")
    offset = Parameter("{signal}", 0.0, doc="constant added to the command")

    @staticmethod
    def output(incoming: float, offset: float) -> float:
        return incoming + offset if offset != 0.0 else incoming


class ConverterResolution(Effect):
    """A converter whose steps are coarser than they are said to be.

    u_out = (round(u_in / resolution - origin) + origin) resolution

    A converter of N bits over +-V has a level at 0 where its codes are signed (origin 0, step 2 V / 2^N); counted from -V to V none is at 0
    (origin 1/2, step 2 V / (2^N - 1)).
    Left out: steps that differ in size (integral non-linearity).
    """

    catalogue, family, site = 23, "drive range", "drive"
    neutral = {"resolution": 0.0}
    identification = Identification(
        typical={"resolution": (5e-3, 0.1), "origin": (0.0, 0.5)},
        starts={
            "resolution": (*(20.0 / 2.0**bits for bits in range(12, 5, -1)), *(20.0 / (2.0**bits - 1.0) for bits in range(12, 5, -1))),
            "origin": (*(0.0,) * 7, *(0.5,) * 7),
        },
        spacing="resolution",
    )
    fingerprint = "A staircase over the command: what acts stays while the command moves by less than a step."
    confused_with = ("AmplifierDeadZone, which is flat only around zero",)
    experiment = "Scan the command slowly through its range and measure the current: steps of one height show everywhere."
    source = "Kester (ed.), The Data Conversion Handbook, Newnes 2005, ch. 2; 8 to 12 bit on +-10 V: 5 to 80 mV."

    incoming = Input("{signal}", doc="command before the converter")
    outgoing = Output("{signal}", doc="command that acts")
    resolution = Parameter("{signal}", 0.0, low=0.0, doc="smallest step; 0 for none")
    origin = Parameter("1", 0.0, low=0.0, high=1.0, doc="level nearest above 0, in steps")

    @staticmethod
    def output(incoming: float, resolution: float, origin: float) -> float:
        return (math.floor(incoming / resolution - origin + 0.5) + origin) * resolution if resolution > 0.0 else incoming


class DriveGainError(OnCommand, Effect):
    """A drive gain that is not what it is said to be, and may sag with the load of the power supply.

    u_out = u_in (1 + error - sag |u_in|)
    """

    catalogue, family, site = 19, "constants", "drive"
    neutral = {"error": 0.0, "sag": 0.0}
    identification = Identification(typical={"error": (-0.1, 0.1), "sag": (0.0, 0.02)})
    fingerprint = "Everything the drive does is too large or too small in proportion to the command."
    confused_with = ("mass and friction scaled together, which cannot be told apart from command and position alone", "ScaleFactorError")
    experiment = "Add a known mass, or measure the current."
    source = "Ljung, System Identification, 2nd ed. 1999, sec. 4.5 (only the product is identifiable). Range assumed."

    error = Parameter("1", 0.0, low=-0.9, high=10.0, doc="share by which the gain is too large")
    sag = Parameter("1/({signal})", 0.0, low=0.0, doc="share lost per unit of command")

    @staticmethod
    def output(incoming: float, error: float, sag: float) -> float:
        return incoming if error == 0.0 and sag == 0.0 else incoming * (1.0 + error - sag * abs(incoming))


class ScaleFactorError(Effect):
    """A sensor or a channel that is off by a factor: a wrong unit, gear, lead or drive constant.

    y_out = factor y_in
    """

    catalogue, family, site = 33, "constants", "measured"
    proportional = True
    neutral = {"factor": 1.0}
    identification = Identification(between_sensors=True, of_any_reading=True, typical={"factor": (0.5, 2.0)})
    fingerprint = "One channel is proportionally wrong everywhere, by a number near 2, 10, 25.4, 2 pi, the lead or a drive constant."
    confused_with = ("DriveGainError", "CumulativePitchError")
    experiment = "Measure one known distance, speed or load."
    source = "Catalogue of faults of recordings; the factor is a constant of the rig. Range assumed."

    incoming = Input("{signal}", doc="true value")
    outgoing = Output("{signal}", doc="value off by the factor")
    factor = Parameter("1", 1.0, low=-1e6, high=1e6, doc="read value over true value")

    @staticmethod
    def output(incoming: float, factor: float) -> float:
        return incoming * factor
