"""Remedies as a control holds them: the lines to paste, and the remedy with the numbers as they went through their text.

A control knows no model of the loop: it shifts a reference where the reference turns. So the lag of the model is zero here, and the promise
shows its cost. Lengths are mm, speeds mm/min, times s.

Sources: LinuxCNC 2.9, INI Configuration, section [JOINT_n]; man 9 pid and biquad; usrmotintf.cc (a trim is nominal less actual). grblHAL,
config.h, ENABLE_BACKLASH_COMPENSATION, settings $160 on. Smoothieware, pull request 1543 (BACKLASH=1). Klipper, Config Reference,
[input_shaper]. Siemens, SINUMERIK 840D sl, Function Manual Extended Functions 03/2013, K3: 4.3 backlash, 4.4.2 p. 242 leadscrew error,
4.6 p. 295 friction; 808D, Function Manual 01/2017, p. 106 (a positive value moves the axis in the negative direction). Siemens, SINAMICS
S120, Function Manual FH1, 3.7 p. 81, current setpoint filter. Left out: friction that follows the acceleration, sag tables.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.compensation.diagnosed_machine import InsertedRemedy
from lathesim.effects.remedy import Remedy
from lathesim.engine.assembly import FloatArray
from lathesim.plugins import Registry

_LETTERS = "XYZABCUVW"
_GREEK = {"X": "alpha", "Y": "beta", "Z": "gamma"}
_MOST_TRIPLETS = 256
"""Rows that LinuxCNC reads of a compensation file."""
_SHARPEST, _FLATTEST = 0.2501, 0.9999
"""Damping of a notch of LinuxCNC: its Q = 1/(2 damping) lies between 0.5 and 2."""


@dataclass(frozen=True)
class Axis:
    """An axis as controls name it: its letter, its number among the axes of the machine, its part in the lesson and what controls it."""

    letter: str
    joint: int
    part: str
    controller: str


@dataclass(frozen=True)
class Held:
    """A remedy with the numbers that its text holds, and the lines: (file, section) -> lines; no lines where nothing of it is left."""

    line: InsertedRemedy
    texts: Mapping[tuple[str, str], Sequence[str]]


Writer = Callable[[InsertedRemedy, Axis, float], Held]
"""Writes a line of the remedy for an axis; the last argument is the play that the same axis takes up [m]."""
AT_REFERENCE = {"lag": 0.0, "inner": 0.0}
"""What a control does at the reference, without a model of where the axis is."""


@dataclass(frozen=True)
class ControlSetting:
    """How a control holds a remedy: its values there, what is left to tune, who writes it, and what it can and cannot, in a sentence."""

    write: Writer
    says: str
    fixed: Mapping[str, float] = dataclasses.field(default_factory=dict)
    tuned: tuple[str, ...] | None = None


@dataclass(frozen=True)
class Control:
    """A control: what begins a comment, the axes that it has settings for, what it holds, and what it lacks, in a sentence."""

    comment: str
    letters: str
    holds: Mapping[str, ControlSetting]
    lacks: str

    def setting(self, kind: type[Remedy], registry: Registry) -> ControlSetting | None:
        """Return how it holds a remedy, or one that a plug-in derives from it without another law; else none."""
        for name, setting in self.holds.items():
            own = registry.remedies[name]
            if issubclass(kind, own) and all(getattr(kind, law, None) is getattr(own, law, None) for law in ("output", "update")):
                return setting
        return None

    def fitted(self, line: InsertedRemedy, registry: Registry) -> InsertedRemedy | None:
        """Return a remedy as far as the control has it, before its values are tuned; none where it does not have it."""
        setting = self.setting(registry.remedies[line.remedy], registry)  # type: ignore[arg-type]
        if setting is None or letter_of(line.at) not in self.letters:
            return None
        tuned = line.tuned if setting.tuned is None else setting.tuned
        begins = {name: values for name, values in line.begins.items() if name in tuned}
        return dataclasses.replace(line, values={**line.values, **setting.fixed}, tuned=tuned, begins=begins)

    def held(self, lines: Sequence[InsertedRemedy], registry: Registry, axes: Sequence[Axis]) -> tuple[list[Held], dict[str, str]]:
        """Return the remedies as the control holds them, and the texts by the names of their files."""
        found: list[Held] = []
        texts: dict[str, dict[str, list[str]]] = {}
        for axis in axes:
            play = 0.0
            for line in sorted([line for line in lines if line.at == axis.controller], key=lambda item: "width" not in item.values):
                setting = self.setting(registry.remedies[line.remedy], registry)  # type: ignore[arg-type]
                assert setting is not None
                held = setting.write(line, axis, play)
                play = held.line.values.get("width", play)
                found.append(held)
                notes = [f"{self.comment} {axis.part}, against {', '.join(line.answers)}", f"{self.comment} {setting.says}"]
                for (file, section), rows in held.texts.items():
                    place = texts.setdefault(file, {}).setdefault(section, [])
                    place += [row for row in (*([] if file.endswith(_BARE) else notes), *rows) if row not in place]
        return found, {
            file: "\n".join(row for section, rows in parts.items() for row in ([section] if section else []) + rows) + "\n"
            for file, parts in texts.items()
        }


_BARE = ".comp"
"""How the name of a file ends that holds numbers only."""


def letter_of(part: str) -> str:
    """Return the letter of an axis from the name of its part, as X of ``x_controller``; X where it names none."""
    letter = part.partition("_")[0].upper()
    return letter if len(letter) == 1 and letter in _LETTERS else "X"


def _with(line: InsertedRemedy, values: Mapping[str, float]) -> InsertedRemedy:
    return dataclasses.replace(line, values={**line.values, **values}, share=1.0)


def _scaled(file: str, section: str, digits: str, factors: Mapping[str, float], *rows: str) -> Writer:
    """Return what writes values times their factors into rows, ``{width}``, with the whole share in them; ``digits`` is their format."""

    def write(line: InsertedRemedy, axis: Axis, play: float) -> Held:
        shared = {name: line.values[name] * (line.share if name in line.one_sided else 1.0) for name in factors}
        texts = {name: format(shared[name] * factor, digits) for name, factor in factors.items()}
        names = {"X": axis.letter, "x": axis.letter.lower(), "joint": axis.joint, "number": _LETTERS.index(axis.letter)}
        written = [row.format(**texts, **names, greek=_GREEK.get(axis.letter, "")) for row in rows]
        read = {name: float(texts[name]) / factor for name, factor in factors.items()}
        return Held(_with(line, read), {(file, section.format(**names)): written} if any(read.values()) else {})

    return write


def _linuxcnc_table(line: InsertedRemedy, axis: Axis, play: float) -> Held:
    """Write triplets of nominal and the places going forward and backward, the play in them, as BACKLASH is ignored beside them."""
    rows = _rows(line, _MOST_TRIPLETS)
    half = 0.5 * play
    places = np.stack([rows[:, 0], rows[:, 0] + rows[:, 1] - half, rows[:, 0] + rows[:, 2] + half], axis=1)
    texts = [[f"{1e3 * value:.6f}" for value in row] for row in places]
    read = 1e-3 * np.array(texts, dtype=float)
    held = np.stack([read[:, 0], read[:, 1] - read[:, 0] + half, read[:, 2] - read[:, 0] - half], axis=1)
    file = f"{axis.letter.lower()}.comp"
    section = [f"COMP_FILE = {file}", "COMP_FILE_TYPE = 0"]
    return Held(_with_rows(line, held), {("linuxcnc.ini", f"[JOINT_{axis.joint}]"): section, (file, ""): [" ".join(row) for row in texts]})


def _linuxcnc_notch(line: InsertedRemedy, axis: Axis, play: float) -> Held:
    """Write a biquad: its Q is half of one over the damping of the denominator."""
    damping = min(max(line.values["denominator"], _SHARPEST), _FLATTEST)
    frequency, sharpness = f"{line.values['frequency']:.3f}", f"{0.5 / damping:.4f}"
    name = f"{axis.letter.lower()}_notch"
    rows = [f"loadrt biquad names={name}", f"addf {name} servo-thread", f"setp {name}.type 2", f"setp {name}.f0 {frequency}",
            f"setp {name}.Q {sharpness}", f"setp {name}.enable 1"]  # fmt: skip
    return Held(_with(line, {"frequency": float(frequency), "denominator": 0.5 / float(sharpness)}), {("linuxcnc.hal", ""): rows})


def _rows(line: InsertedRemedy, most: int) -> FloatArray:
    """Return a table with the share in its errors, and with at most so many points, evenly spaced where there were more."""
    _, rows = next(iter(line.tables.values()))
    errors = np.column_stack([rows[:, 0], line.share * rows[:, 1:]])
    if len(rows) <= most:
        return errors
    places = np.linspace(rows[0, 0], rows[-1, 0], most)
    return np.column_stack([places, *(np.interp(places, rows[:, 0], column) for column in errors[:, 1:].T)])


def _with_rows(line: InsertedRemedy, rows: FloatArray) -> InsertedRemedy:
    name, (columns, _) = next(iter(line.tables.items()))
    return dataclasses.replace(line, tables={name: (columns, rows)}, share=1.0)


def _sinumerik_table(line: InsertedRemedy, axis: Axis, play: float) -> Held:
    """Write $AA_ENC_COMP: even steps, one value for both directions, positive where the axis is to go less far."""
    rows = _rows(line, len(next(iter(line.tables.values()))[1]))
    first = float(f"{1e3 * rows[0, 0]:.3f}")
    step = max(float(f"{1e3 * (rows[-1, 0] - rows[0, 0]) / (len(rows) - 1):.3f}"), 1e-3)
    places = first + step * np.arange(int(np.ceil((1e3 * rows[-1, 0] - first) / step)) + 1)
    texts = [f"{1e3 * value:.6f}" for value in np.interp(1e-3 * places, rows[:, 0], np.mean(rows[:, 1:], axis=1))]
    name = f"{axis.letter}1"
    program = [f"$AA_ENC_COMP[0,{number},{name}]={text}" for number, text in enumerate(texts)]
    program += [f"$AA_ENC_COMP_STEP[0,{name}]={step:.3f}", f"$AA_ENC_COMP_MIN[0,{name}]={first:.3f}",
                f"$AA_ENC_COMP_MAX[0,{name}]={places[-1]:.3f}", f"$AA_ENC_COMP_IS_MODULO[0,{name}]=0", "M17"]  # fmt: skip
    data = [f"N32700 $MA_ENC_COMP_ENABLE[0,{name}]=1", f"N38000 $MA_MM_ENC_COMP_MAX_POINTS[0,{name}]={len(texts)}"]
    errors = 1e-3 * np.array(texts, dtype=float)
    held = _with_rows(line, np.stack([1e-3 * places, errors, errors], axis=1))
    return Held(held, {(f"{axis.letter.lower()}_enc_comp.mpf", ""): program, (_DATA, ""): data})


def _shaper(line: InsertedRemedy, axis: Axis, play: float) -> Held:
    """Write a section of Klipper, whose zv and zvd have the pulses of the remedy, centred in time."""
    kind = "zvd" if line.values["kind"] > _BETWEEN_KINDS else "zv"
    rows = (f"shaper_type_{{x}}: {kind}", "shaper_freq_{x}: {frequency}", "damping_ratio_{x}: {damping}")
    return _scaled("printer.cfg", "[input_shaper]", ".4f", {"frequency": 1.0, "damping": 1.0}, *rows)(line, axis, play)


_BETWEEN_KINDS = 1.5
_INI, _HAL, _DATA = "linuxcnc.ini", "linuxcnc.hal", "sinumerik_md.ini"
_JOINT = "[JOINT_{joint}]"


def _play(says: str, file: str, section: str, digits: str, *rows: str) -> dict[str, ControlSetting]:
    """Return how a control takes up play: at once, where the reference turns, as much as it is."""
    return {
        "BacklashShift": ControlSetting(_scaled(file, section, digits, {"width": 1e3}, *rows), says, {**AT_REFERENCE, "spread": 0.0}, ())
    }


LINUXCNC = Control(
    "#",
    _LETTERS,
    {
        **_play(
            "mm. It ramps at MAX_ACCELERATION: with steppers, STEPGEN_MAXACCEL is to be 1.5 to 2 times as much.",
            *(_INI, _JOINT, ".6f", "BACKLASH = {width}"),
        ),
        "PitchTable": ControlSetting(
            _linuxcnc_table, "mm. 256 points at most; BACKLASH is ignored beside them, so the play is in them.", AT_REFERENCE
        ),
        "CommandBias": ControlSetting(
            _scaled(_INI, _JOINT, ".6f", {"bias": 1.0}, "BIAS = {bias}"),
            "V, for 'setp pid.N.bias [JOINT_N]BIAS'. Add it to the bias that is there.",
        ),
        "MotionFeedforward": ControlSetting(
            _scaled(
                *(_HAL, "", ".6g", {"velocity_gain": 1e-3, "acceleration_gain": 1e-3, "jerk_gain": 1e-3}),
                *("setp pid.{x}.FF1 {velocity_gain}", "setp pid.{x}.FF2 {acceleration_gain}", "setp pid.{x}.FF3 {jerk_gain}"),
            ),
            "V per mm/s, mm/s^2 and mm/s^3 of the reference. Add each to the gain that is there.",
            AT_REFERENCE,
        ),
        "CommandNotch": ControlSetting(
            _linuxcnc_notch,
            "Connect it between pid.N.output and the amplifier. Its notch has no floor, and Q lies between 0.5 and 2.",
            {"numerator": 0.0},
            ("frequency",),
        ),
    },
    "LinuxCNC compensates play, screw, offset, lag and resonance, and has no setting for friction or an input shaper",
)
GRBLHAL = Control(
    ";",
    _LETTERS[:6],
    _play(
        "mm. It needs a build with backlash compensation. It stops to take the play up, in whole steps.",
        *("grblhal.txt", "", ".3f", "$16{number}={width}"),
    ),
    "grblHAL compensates play, and has no setting for screw, friction or vibration",
)
SMOOTHIEWARE = Control(
    "#",
    _LETTERS[:3],
    _play(
        "mm. It needs a build with BACKLASH=1. M425 shows the value, and M500 does not save it.",
        *("config.txt", "", ".4f", "{greek}_backlash_mm {width}", "backlash_enable true"),
    ),
    "Smoothieware compensates play, and has no setting for screw, friction or vibration",
)
KLIPPER = Control(
    "#",
    _LETTERS[:2],
    {"InputShaper": ControlSetting(_shaper, "Hz. It rounds corners by half a vibration, and does not hold what a cut excites.")},
    "Klipper shapes the path of X and Y against vibration, and has no setting for play, screw or friction",
)
SINUMERIK = Control(
    ";",
    _LETTERS,
    {
        **_play(
            "mm. X1 is the machine axis. A force that pulls the table through its play is not held.",
            *(_DATA, "", ".6f", "N32450 $MA_BACKLASH[0,{X}1]={width}"),
        ),
        "PitchTable": ControlSetting(
            _sinumerik_table,
            "mm. Set MD38000 first, and load the table with MD32700 = 0. It is to be zero at the reference point.",
            AT_REFERENCE,
        ),
        "ReversalPulse": ControlSetting(
            _scaled(
                *(_DATA, "", ".6f", {"speed": 6e4, "fade": 1.0}),
                *(
                    "N32490 $MA_FRICT_COMP_MODE[{X}1]=1",
                    "N32500 $MA_FRICT_COMP_ENABLE[{X}1]=1",
                    "N32510 $MA_FRICT_COMP_ADAPT_ENABLE[{X}1]=0",
                ),
                *("N32520 $MA_FRICT_COMP_CONST_MAX[{X}1]={speed}", "N32540 $MA_FRICT_COMP_TIME[{X}1]={fade}"),
            ),
            "mm/min and s, one size for all accelerations. Friction that stays after the pulse is left to the integrator.",
        ),
        "CommandNotch": ControlSetting(
            _scaled(
                *("sinamics.txt", "", ".4f", {"frequency": 1.0, "denominator": 1.0, "numerator": 1.0}),
                *("p1656[0].0 = 1", "p1657[0] = 2", "p1658[0] = {frequency}", "p1659[0] = {denominator}"),
                *("p1660[0] = {frequency}", "p1661[0] = {numerator}"),
            ),
            "Current setpoint filter 1 of the drive, in Hz and damping ratios.",
        ),
    },
    "SINUMERIK compensates play, screw, friction at reversals and resonance; the lines for any other remedy are not known here",
)
CONTROLS = {"linuxcnc": LINUXCNC, "grblhal": GRBLHAL, "smoothieware": SMOOTHIEWARE, "klipper": KLIPPER, "sinumerik": SINUMERIK}
"""Name on the command line -> control."""
