"""The recordings in ``../shared/data/real`` and ``../shared/data/suite_a``, with what their README files say of the machine of each."""

from __future__ import annotations

from tests.diagnosis.real.cases import Case, Deciding, Hidden, Size


def cases(*, every_lesson: bool = False) -> list[Case]:
    """Return the real recordings, and those of suite A in its first description or in both."""
    return [*real(), *suite_a(on_motor=False), *(suite_a(on_motor=True) if every_lesson else [])]


def _dry(at: str, *sizes: Size) -> Hidden:
    return Hidden(("CoulombFriction",), (at,), sizes, near=("AsymmetricFriction", "PreslidingFriction", "StribeckFriction"))


def real() -> list[Case]:
    """Return the seven cases of ``real``; sizes are those of a grey box fitted by hand, but for the play that was put in."""
    late = Hidden(("ChannelTimeShift",), ("spindle", "spindle_encoder")), Hidden(("SensorFilter",), ("spindle",))
    teeth = Hidden(("Cogging", "TorqueRipple"), ("spindle",), (Size("amplitude", 4.65e-3, "N*m"), Size("period", 0.0872665, "rad")))
    kuka = Hidden(("ChannelTimeShift",), ("second_encoder",), (Size("shift", 3.07e-3, "s"),)), _dry("spindle", Size("level", 506.0, "N*m"))
    stroke = Hidden(
        ("ChannelTimeShift", "TransportDelay", "SensorFilter"), ("x_axis",),
        (Size("shift", 5.7e-3, "s"), Size("delay", 5.7e-3, "s"), Size("time_constant", 5.7e-3, "s")),
    )  # fmt: skip
    return [
        Case(
            "laas_fast", "real/laas_bldc", "acc.yaml", "acc_a.csv", "acc_b.csv", "dry friction 2.05 mN m; speed 1.8 ms late",
            (_dry("spindle", Size("level", 2.05e-3, "N*m")),), late, Deciding("fit", "spindle.speed", "rad/s", 4.168),
        ),
        Case(
            "laas_slow", "real/laas_bldc", "slow.yaml", "slow_off_a.csv", "slow_off_b.csv", "cogging 72 a turn, 4.65 mN m; dry friction",
            (teeth, _dry("spindle")), late, Deciding("missing", "spindle.disturbance", "N*m", 1.64e-3),
        ),
        Case(
            "kuka", "real/kuka_axis1", "kuka.yaml", "axis1_A.csv", "axis1_C.csv", "second encoder 3.07 ms late; dry friction 506 N m",
            kuka, (), Deciding("missing", "spindle.disturbance", "share", 0.33),
        ),
        Case(
            "rack", "real/rack_pinion", "rack.yaml", "merged.csv", "", "dry friction 15.3 N; speed 5.7 ms late",
            (_dry("x_axis", Size("level", 15.3, "N")),), (stroke,), Deciding("fit", "x_axis.velocity", "m/s", 2.5e-3),
        ),
        Case(
            "flexible", "real/flexible_link", "slfr_cad.yaml", "swept1-0-10hz.txt", "swept2-0-10hz.txt", "two masses, 2.53 Hz",
            (Hidden(("AxialResonance",), ("spindle",), (Size("frequency", 2.53, "Hz"),)),), (),
            Deciding("fit", "spindle_encoder.angle", "rad", 0.069),
        ),
        Case(
            "lift", "real/odrive_lift", "lift.yaml", "lift1.csv", "lift25.csv", "weight 3.97 A, dry friction 1.05 A",
            (Hidden(("ForceOffset",), ("x_axis",), (Size("offset", -3.97, "N"),)), _dry("x_axis", Size("level", 1.05, "N"))), (),
            Deciding("fit", "x_axis.current", "A", 1.27),
        ),
        Case(
            "half_backlash", "real/half_backlash", "kuka.yaml", "axis1_A_play.csv", "axis1_C_play.csv", "play of 3.00 mrad",
            (Hidden(("Backlash",), ("second_encoder",), (Size("width", 3e-3, "rad", known=True),)),), kuka,
            Deciding("missing", "second_encoder.angle", "rad", 0.41e-3),
        ),
    ]  # fmt: skip


LEAD = 0.795774715459e-3
"""Travel of the table of suite A [m] for a radian of its motor."""
ON_TABLE = {"mass": ("x_axis.mass", 6316.547, "kg"), "viscous": ("x_axis.viscous", 4737.41, "N*s/m")}
ON_MOTOR = {"mass": ("x_axis.motor_inertia", 0.004, "kg*m^2"), "viscous": ("x_axis.motor_viscous", 0.003, "N*m*s/rad")}


def suite_a(*, on_motor: bool) -> list[Case]:
    """Return the eight cases of suite A, described from the table's or from the motor's side; all sizes are true ones."""
    scale, encoder = Deciding("missing", "x_scale.position", "m", 0.53e-6), Deciding("fit", "x_encoder.position", "m", None)
    with_truth = Deciding("fit", "x_encoder.position", "m", 1.32e-6)  # what the lesson leaves with the true effects in it
    made = [
        ("a000", "pitch error 2.47 um every 5 mm", (_pitch_error(2.47e-6, 5e-3),), (), scale),
        ("a005", "sound", (), (), None),
        ("a012", "dry friction 250 N; dead zone 0.12 V", (_friction(250.0, on_motor=on_motor)[0], _dead_zone(0.12)), (), with_truth),
        ("a015", "thermal growth 29.9 um at 300 mm, 14.6 s", (_growth(29.9e-6 / 0.3, 14.6),), (), scale),
        ("a024", "sound", (), (), None),
        ("a045", "values: inertia +17 %, viscous -27 %", (), _off(mass=0.17, viscous=-0.27, on_motor=on_motor), None),
        # the README says that the friction falls from 308 to 203 N, and from 250 to 200 N; in the recordings the first number comes on top
        # of the second one, as test_real shows
        ("a046", "friction 203 N, and 308 N more that fall over 7.4 mm/s", _friction(203.0, 308.0, 7.4e-3, on_motor=on_motor), (), encoder),
        (
            "a060", "spring 8 kN/mm; friction 200 N, and 250 N more that fall over 6 mm/s",
            (Hidden(("AxialResonance",), ("x_axis",)), *_friction(200.0, 250.0, 6e-3, on_motor=on_motor)), (), encoder,
        ),
    ]  # fmt: skip
    lesson, end = ("analytical_axis.yaml", "_motor") if on_motor else ("mass_and_drive.yaml", "")
    return [
        Case(f"{name}{end}", "suite_a", lesson, f"{name}_fit.h5", f"{name}_validate.h5", truth, hidden, (), deciding, values)
        for name, truth, hidden, values, deciding in made
    ]


def _true(parameter: str, value: float, unit: str, digit: float) -> Size:
    """Return a true value that is told to a last ``digit``."""
    return Size(parameter, value, unit, known=True, rounding=0.5 * digit)


def _friction(level: float, excess: float = 0.0, speed: float = 0.0, *, on_motor: bool) -> tuple[Hidden, ...]:
    """Return a friction [N] and how it exceeds its level at low speed [m/s], at the table or as a torque of the motor."""
    force, flow, per = ("N*m", "rad/s", LEAD) if on_motor else ("N", "m/s", 1.0)
    dry = _dry("x_axis", _true("level", level * per, force, per))
    peak = Hidden(
        ("StribeckFriction",),
        ("x_axis",),
        (_true("excess", excess * per, force, 2.0 * per), _true("stribeck_velocity", speed / per, flow, 1e-4 / per)),
    )
    return (dry, peak) if excess else (dry,)


def _dead_zone(half: float) -> Hidden:
    return Hidden(("AmplifierDeadZone",), ("x_drive", "x_axis", "x_dac"), (_true("half_width", half, "V", 0.01),))


def _pitch_error(amplitude: float, lead: float) -> Hidden:
    sizes = _true("amplitude", amplitude, "m", 1e-8), _true("lead", lead, "m", 0.0), _true("turn", lead, "m", 0.0)
    return Hidden(("PeriodicPitchError", "EncoderEccentricity"), ("x_scale", "x_encoder"), sizes)


def _growth(strain: float, time_constant: float) -> Hidden:
    return Hidden(
        ("ThermalScrewGrowth",), ("x_scale",), (_true("strain", strain, "1", 0.1e-6 / 0.3), _true("time_constant", time_constant, "s", 0.1))
    )


def _off(*, mass: float, viscous: float, on_motor: bool) -> tuple[Size, ...]:
    """Return the true values of what the lesson gives wrongly, by their shares."""
    given = ON_MOTOR if on_motor else ON_TABLE
    return tuple(
        _true(name, value * (1.0 + share), unit, 0.01 * value)
        for (name, value, unit), share in ((given["mass"], mass), (given["viscous"], viscous))
    )
