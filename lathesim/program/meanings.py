"""What codes can mean, whatever their number: the words in which dialects are written down.

Two meanings of one group exclude each other in a block, and the modal ones stay in force until another of their group comes.
Source: NIST RS274NGC Interpreter version 3, table 4 (modal groups).

Codes and programs of other controls, named where they are refused.

Codes of other controls that no dialect here has, with their meanings, so that a refusal names them.

Source: Fanuc 0i-T and 0i-M operator's manuals, lists of G codes; Haas lathe and mill operator's manuals, G and M codes; LinuxCNC 2.9
manual, chapters G-Codes and M-Codes; grblHAL, list of supported codes; Siemens, Sinumerik 828D programming manual, G functions.

Whether a program is written for a control that is not supported here, told by words that only that control has.

Source: Siemens, Sinumerik 828D turning programming manual; Okuma, OSP programming manual for lathes; Heidenhain, TNC user's manual.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from lathesim.errors import Fault


class Group(StrEnum):
    """A modal group; the text is how messages name it."""

    MOTION = "motion"
    PLANE = "plane"
    DISTANCE = "absolute or incremental"
    ARC_DISTANCE = "arc centre"
    FEED_MODE = "feed mode"
    UNITS = "units"
    DIAMETER = "diameter or radius"
    SPINDLE_MODE = "spindle mode"
    COMPENSATION = "nose compensation"
    LENGTH = "tool length"
    COORDINATES = "work offset"
    CYCLE_RETURN = "cycle return"
    PATH_MODE = "path mode"
    ONCE = "non-modal codes"
    STOP = "stops"
    SPINDLE = "spindle"
    COOLANT = "coolant"
    TOOL = "tool change"
    OTHER = "other codes"


class Meaning(StrEnum):
    """What one code does, and its modal group; the text is how messages name it."""

    group: Group

    def __new__(cls, text: str, group: Group) -> Meaning:
        """Return the meaning with its text as its value."""
        own = str.__new__(cls, text)
        own._value_, own.group = text, group
        return own

    RAPID = "rapid traverse", Group.MOTION
    LINE = "straight feed", Group.MOTION
    ARC_CLOCKWISE = "clockwise arc", Group.MOTION
    ARC_COUNTERCLOCKWISE = "counterclockwise arc", Group.MOTION
    THREAD = "thread move", Group.MOTION
    MOTION_OFF = "motion mode off", Group.MOTION
    THREAD_BY_FEED = "thread cutting with the lead in F", Group.MOTION
    ROUGHING_CYCLE = "the roughing cycle", Group.MOTION
    FACING_CYCLE = "the face roughing cycle", Group.MOTION
    REPEATING_CYCLE = "the pattern repeating cycle", Group.MOTION
    FINISHING_CYCLE = "the finishing cycle", Group.MOTION
    FACE_GROOVING_CYCLE = "the face grooving cycle", Group.MOTION
    GROOVING_CYCLE = "the grooving cycle", Group.MOTION
    THREADING_CYCLE = "the threading cycle", Group.MOTION
    TURNING_CYCLE_SIMPLE = "the simple turning cycle", Group.MOTION
    THREADING_CYCLE_SIMPLE = "the simple threading cycle", Group.MOTION
    FACING_CYCLE_SIMPLE = "the simple facing cycle", Group.MOTION
    DRILLING_WITH_DWELL = "the drilling cycle with a dwell", Group.MOTION
    PECK_DRILLING = "the peck drilling cycle", Group.MOTION
    DRILLING = "the drilling cycle", Group.MOTION
    CHIP_BREAKING = "the drilling cycle that breaks chips", Group.MOTION
    TAPPING = "the tapping cycle", Group.MOTION
    TAPPING_LEFT = "the tapping cycle for left-hand threads", Group.MOTION
    RIGID_TAPPING = "rigid tapping", Group.MOTION
    BORING = "the boring cycle", Group.MOTION
    BORING_STOPPED = "the boring cycle that stops the spindle", Group.MOTION
    BORING_WITH_DWELL = "the boring cycle with a dwell", Group.MOTION
    POCKETS_LATER = "the roughing cycle without pockets", Group.MOTION
    POCKETS_ONLY = "the roughing cycle of pockets only", Group.MOTION
    FACE_POCKETS_LATER = "the face roughing cycle without pockets", Group.MOTION
    FACE_POCKETS_ONLY = "the face roughing cycle of pockets only", Group.MOTION
    PROBE = "probing", Group.MOTION
    PLANE_XZ = "the plane of X and Z", Group.PLANE
    PLANE_XY = "the plane of X and Y, for drilling along Z", Group.PLANE
    PLANE_OTHER = "a plane with Y in it", Group.PLANE
    ABSOLUTE = "absolute positions", Group.DISTANCE
    INCREMENTAL = "incremental positions", Group.DISTANCE
    ARC_ABSOLUTE = "absolute arc centres", Group.ARC_DISTANCE
    ARC_INCREMENTAL = "incremental arc centres", Group.ARC_DISTANCE
    PER_MINUTE = "feed per minute", Group.FEED_MODE
    PER_REVOLUTION = "feed per revolution", Group.FEED_MODE
    INVERSE_TIME = "inverse time feed", Group.FEED_MODE
    INCH = "inches", Group.UNITS
    MILLIMETRE = "millimetres", Group.UNITS
    X_DIAMETER = "X as a diameter", Group.DIAMETER
    X_RADIUS = "X as a radius", Group.DIAMETER
    SURFACE_SPEED = "constant surface speed", Group.SPINDLE_MODE
    SPINDLE_SPEED = "constant spindle speed", Group.SPINDLE_MODE
    COMPENSATION_OFF = "nose compensation off", Group.COMPENSATION
    COMPENSATION_LEFT = "nose compensation, tool on the left", Group.COMPENSATION
    COMPENSATION_RIGHT = "nose compensation, tool on the right", Group.COMPENSATION
    COMPENSATION_GIVEN_LEFT = "nose compensation with a given nose, tool on the left", Group.COMPENSATION
    COMPENSATION_GIVEN_RIGHT = "nose compensation with a given nose, tool on the right", Group.COMPENSATION
    LENGTH_OFF = "tool length offset off", Group.LENGTH
    LENGTH_ON = "a tool length offset", Group.LENGTH
    LENGTH_GIVEN = "a tool length offset given in the block", Group.LENGTH
    OFFSET_FIRST = "the first work offset", Group.COORDINATES
    OFFSET_OTHER = "another work offset", Group.COORDINATES
    OFFSET_FURTHER = "a further work offset", Group.COORDINATES
    CYCLE_RETURN = "the return level of canned cycles", Group.CYCLE_RETURN
    PATH_EXACT = "exact path", Group.PATH_MODE
    PATH_BLENDED = "path blending", Group.PATH_MODE
    DWELL = "dwell", Group.ONCE
    SET_DATA = "setting offsets", Group.ONCE
    HOME = "return to the reference point", Group.ONCE
    HOME_SECOND = "return to the second reference point", Group.ONCE
    HOME_SET = "setting the reference point", Group.ONCE
    HOME_SET_SECOND = "setting the second reference point", Group.ONCE
    MACHINE_COORDINATES = "machine coordinates", Group.ONCE
    SHIFT = "origin shift", Group.ONCE
    SHIFT_OFF = "origin shift off", Group.ONCE
    SHIFT_SUSPENDED = "suspending the origin shift", Group.ONCE
    SHIFT_RESTORED = "restoring the origin shift", Group.ONCE
    SHIFT_LOCAL = "a local origin shift", Group.ONCE
    SPINDLE_LIMIT = "spindle speed limit", Group.ONCE
    STOP = "program stop", Group.STOP
    OPTIONAL_STOP = "optional stop", Group.STOP
    END = "program end", Group.STOP
    SPINDLE_FORWARD = "spindle on clockwise", Group.SPINDLE
    SPINDLE_REVERSE = "spindle on counterclockwise", Group.SPINDLE
    SPINDLE_OFF = "spindle off", Group.SPINDLE
    SPINDLE_ORIENT = "spindle orientation", Group.SPINDLE
    MIST = "mist coolant on", Group.COOLANT
    FLOOD = "flood coolant on", Group.COOLANT
    COOLANT_OFF = "coolant off", Group.COOLANT
    TOOL_CHANGE = "tool change", Group.TOOL
    CLAMP_OPEN = "chuck open", Group.OTHER
    CLAMP_CLOSE = "chuck close", Group.OTHER
    CHIP_CONVEYOR = "chip conveyor", Group.OTHER
    SUBPROGRAM = "a subprogram call", Group.OTHER
    LOCAL_SUBPROGRAM = "a call of a subprogram of the same program", Group.OTHER
    MACRO_CALL = "a macro call", Group.ONCE
    SUBPROGRAM_END = "the return from a subprogram", Group.OTHER
    OVERRIDE = "override switches", Group.OTHER
    LOOK_AHEAD = "look-ahead or smoothing of the control", Group.OTHER
    MONITORING_OFF = "monitoring off", Group.OTHER


HOLES = frozenset({
    Meaning.DRILLING, Meaning.DRILLING_WITH_DWELL, Meaning.PECK_DRILLING, Meaning.CHIP_BREAKING, Meaning.BORING, Meaning.BORING_STOPPED,
    Meaning.BORING_WITH_DWELL, Meaning.TAPPING, Meaning.TAPPING_LEFT,
})  # fmt: skip
"""The cycles that make a hole, modal until another motion code comes."""

# Meanings that dialects have and this interpreter does not carry out, with what to do instead. They are refused, never skipped.
NOT_INTERPRETED: dict[Meaning, str] = {
    Meaning.PROBE: "Take it out; nothing can be probed here.",
    Meaning.PLANE_OTHER: "This is for a mill; a two-axis lathe moves in the plane of X and Z. Write G18.",
    Meaning.LENGTH_GIVEN: "Set the tool with G10 L1 and call it with G43.",
    Meaning.INVERSE_TIME: "Use feed per minute or per revolution.",
    Meaning.SPINDLE_ORIENT: "Take it out; a turning spindle needs no orientation.",
    Meaning.SUBPROGRAM: "Use O-words: O100 SUB to O100 ENDSUB, and O100 CALL.",
    Meaning.SUBPROGRAM_END: "Use O-words: O100 SUB to O100 ENDSUB, and O100 CALL.",
}


SINUMERIK = "Sinumerik"
"""The control whose programs are recognised by their codes alone."""

CODES_ELSEWHERE: dict[str, str] = {
    "G5": "a cubic spline (LinuxCNC, grblHAL) or high-speed cutting (Fanuc)",
    "G5.1": "a quadratic spline (LinuxCNC, grblHAL) or contour control (Fanuc)",
    "G5.2": "a NURBS curve (LinuxCNC)", "G5.3": "the end of a NURBS curve (LinuxCNC)", "G6.2": "a NURBS curve (Fanuc)",
    "G7.1": "cylindrical interpolation (Fanuc)", "G107": "cylindrical interpolation (Fanuc, Haas)",
    "G9": "exact stop in one block (Fanuc, Haas)", "G11": "the end of setting offsets (Fanuc)",
    "G12": "circular pocket milling (Haas)", "G13": "circular pocket milling (Haas)",
    "G12.1": "polar coordinate interpolation (Fanuc, Haas)", "G13.1": "the end of polar coordinate interpolation (Fanuc, Haas)",
    "G112": "polar coordinate interpolation (Fanuc, Haas)", "G113": "the end of polar coordinate interpolation (Fanuc, Haas)",
    "G15": "the end of polar coordinates (Fanuc)", "G16": "polar coordinates (Fanuc)", "G17.1": "the plane of U and V (LinuxCNC)",
    "G18.1": "the plane of W and U (LinuxCNC)", "G19.1": "the plane of V and W (LinuxCNC)",
    "G22": "the stored stroke check (Fanuc)", "G26": "the spindle speed check (Fanuc) or a spindle speed limit (Sinumerik)",
    "G27": "the reference point check (Fanuc)", "G29": "the return from the reference point (Fanuc, Haas)",
    "G31": "skip, which is probing (Fanuc, Haas)", "G34": "a thread of variable lead (Fanuc, Haas)",
    "G35": "a clockwise arc thread (Fanuc)",
    "G36": "automatic tool offset or an arc thread (Fanuc)", "G37": "automatic tool offset (Fanuc)", "G38": "probing",
    "G43.3": "a tool length offset (Fanuc)", "G43.4": "tool centre point control (Fanuc)", "G44": "a negative tool length (Fanuc, Haas)",
    "G45": "a tool offset (Fanuc)", "G46": "a tool offset (Fanuc)", "G47": "text engraving (Haas) or a tool offset (Fanuc)",
    "G48": "a tool offset (Fanuc)",
    "G50.1": "the end of mirroring (Fanuc)", "G51.1": "mirroring (Fanuc)", "G50.2": "the end of polygon turning (Fanuc)",
    "G51.2": "polygon turning (Fanuc)", "G250": "the end of polygon turning (Fanuc)", "G251": "polygon turning (Fanuc)",
    "G50.3": "the preset of the work coordinates (Fanuc)", "G51": "scaling (Fanuc mills, Haas, grblHAL)",
    "G60": "positioning from one side (Fanuc)", "G62": "the corner override (Fanuc)", "G63": "the tapping mode (Fanuc)",
    "G66": "a modal macro call (Fanuc)", "G66.1": "a modal macro call (Fanuc)", "G67": "the end of a modal macro call (Fanuc)",
    "G68": "mirroring for double turrets, or rotated coordinates (Fanuc, Haas)",
    "G69": "the end of mirroring or of rotated coordinates (Fanuc, Haas)",
    "G87": "a cross drilling cycle (Fanuc)", "G88": "a cross tapping cycle (Fanuc)",
    "G100": "the end of mirroring (Haas)", "G101": "mirroring (Haas)",
    "G105": "the bar feeder (Haas)", **{f"G{number}": "a further work offset (Haas)" for number in (110, 111, *range(114, 130))},
    "G150": "pocket milling (Haas)", "G184": "the left-hand tapping cycle (Haas)", "G186": "tapping with a driven tool (Haas)",
    "G195": "tapping with a driven tool (Haas)", "G196": "tapping with a driven tool (Haas)",
    "G198": "the end of two spindles in step (Haas)", "G199": "two spindles in step (Haas)", "G200": "a tool change while moving (Haas)",
    "G241": "a radial drilling cycle (Haas)", "G242": "a radial drilling cycle (Haas)", "G243": "a radial drilling cycle (Haas)",
    "G245": "a radial boring cycle (Haas)", "G266": "moving an axis by its letter (Haas)",
    **{f"G{number}": SINUMERIK for number in (74.1, 75.1, 147, 148, 153, 247, 248, 340, 341, 347, 348, 450, 451, 460, *range(500, 600))},
    **{f"G{number}": SINUMERIK for number in (601, 602, 603, 621, 641, 642, 643, 644, 645, 810, 820, 961, 962, 971, 972, 973)},
    "M17": "the return from a subprogram (Sinumerik)", "M50": "the feed override switch (LinuxCNC)",
    "M51": "the speed override switch (LinuxCNC)", "M52": "adaptive feed (LinuxCNC)", "M53": "the feed stop switch (LinuxCNC)",
    "M56": "the parking override (GRBL)", "M60": "a pallet change", "M61": "setting the tool number (LinuxCNC)",
    **{f"M{number}": "an output of the control (LinuxCNC)" for number in (62, 63, 64, 65, 67, 68)},
    "M66": "waiting for an input (LinuxCNC)",
    "M70": "keeping the modal state (LinuxCNC)", "M71": "dropping the modal state (LinuxCNC)",
    "M72": "restoring the modal state (LinuxCNC)", "M73": "keeping the modal state of a subprogram (LinuxCNC)",
    **{f"M{number}": "a command of the user (LinuxCNC) or of the builder (Fanuc)" for number in range(100, 200)},
}  # fmt: skip


@dataclass(frozen=True)
class _Control:
    name: str
    words: re.Pattern[str]


_CONTROLS = (
    _Control(
        "Sinumerik",
        re.compile(
            r"\b(CYCLE\d{2,3}|MCALL|DIAM(?:ON|OF|90)|LIMS\s*=|CR\s*=|RND\s*=|CHF\s*=|CHR\s*=|AC\s*\(|IC\s*\(|TRANS\b|ATRANS\b|G500\b|GOTO[BFC]\b|SUPA\b|STOPRE\b|SPOS\s*=|T\s*=\s*\"|^[A-Z_]{2}\w*:|"
            r"SETMS|\bSF\s*=|\b[SM]\d\s*=|WORKPIECE\s*\(|MSG\s*\(|\$[A-Z]+_|R\d+\s*=|[XZ]\d*\s*=\s*[-+.\dA-Z])"
        )
    ),
    _Control(
        "Okuma OSP",
        re.compile(r"\b(NLAP\d|NOEX|VZOF[XZ]|VC\d+\s*=|V\d+\s*=|G1[34]0?\b(?![.\d])|G8[0-9]\s+N[A-Z]+\d*|CALL\s+O[A-Z]|NAT\d+|RTS\b|SB\s*=|LAP\d)")
    ),
    _Control("Heidenhain", re.compile(r"^\s*\d+\s+(BEGIN PGM|BLK FORM|TOOL CALL|L\s+[XYZ][+-]|CYCL DEF)|\bFMAX\b|\bLBL\s+\d")),
)  # fmt: skip


def foreign_control(text: str, lines: Iterable[int]) -> Fault | None:
    """Return the fault that names the control of another maker, where one of the ``lines`` (from 1) has a word of it; else None."""
    rows = re.split(r"\r\n|\n|\r", text)
    for line in lines:
        row = rows[line - 1].upper() if 0 < line <= len(rows) else ""
        code = re.sub(r"\([^()]*\)|;.*", "", row)
        for control in _CONTROLS:
            found = control.words.search(code) or control.words.search(row)
            if found is not None:
                return foreign_program(control.name, " ".join(found.group().split()), line)
    return None


def foreign_program(control: str, word: str, line: int) -> Fault:
    """Return the fault of a program of another control, recognised by a ``word``."""
    fact = f"This is a program for {control} ({word}), and that control is not supported here."
    return Fault(fact, "Write it for Fanuc or LinuxCNC, or have the program system post it so.", line)
