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
    """What one code does; the text is how messages name it."""

    RAPID = "rapid traverse"
    LINE = "straight feed"
    ARC_CLOCKWISE = "clockwise arc"
    ARC_COUNTERCLOCKWISE = "counterclockwise arc"
    THREAD = "thread move"
    MOTION_OFF = "motion mode off"
    THREAD_BY_FEED = "thread cutting with the lead in F"
    ROUGHING_CYCLE = "the roughing cycle"
    FACING_CYCLE = "the face roughing cycle"
    REPEATING_CYCLE = "the pattern repeating cycle"
    FINISHING_CYCLE = "the finishing cycle"
    FACE_GROOVING_CYCLE = "the face grooving cycle"
    GROOVING_CYCLE = "the grooving cycle"
    THREADING_CYCLE = "the threading cycle"
    TURNING_CYCLE_SIMPLE = "the simple turning cycle"
    THREADING_CYCLE_SIMPLE = "the simple threading cycle"
    FACING_CYCLE_SIMPLE = "the simple facing cycle"
    DRILLING_WITH_DWELL = "the drilling cycle with a dwell"
    PECK_DRILLING = "the peck drilling cycle"
    DRILLING = "the drilling cycle"
    CHIP_BREAKING = "the drilling cycle that breaks chips"
    TAPPING = "the tapping cycle"
    TAPPING_LEFT = "the tapping cycle for left-hand threads"
    RIGID_TAPPING = "rigid tapping"
    BORING = "the boring cycle"
    BORING_STOPPED = "the boring cycle that stops the spindle"
    BORING_WITH_DWELL = "the boring cycle with a dwell"
    POCKETS_LATER = "the roughing cycle without pockets"
    POCKETS_ONLY = "the roughing cycle of pockets only"
    FACE_POCKETS_LATER = "the face roughing cycle without pockets"
    FACE_POCKETS_ONLY = "the face roughing cycle of pockets only"
    PROBE = "probing"
    PLANE_XZ = "the plane of X and Z"
    PLANE_XY = "the plane of X and Y, for drilling along Z"
    PLANE_OTHER = "a plane with Y in it"
    ABSOLUTE = "absolute positions"
    INCREMENTAL = "incremental positions"
    ARC_ABSOLUTE = "absolute arc centres"
    ARC_INCREMENTAL = "incremental arc centres"
    PER_MINUTE = "feed per minute"
    PER_REVOLUTION = "feed per revolution"
    INVERSE_TIME = "inverse time feed"
    INCH = "inches"
    MILLIMETRE = "millimetres"
    X_DIAMETER = "X as a diameter"
    X_RADIUS = "X as a radius"
    SURFACE_SPEED = "constant surface speed"
    SPINDLE_SPEED = "constant spindle speed"
    COMPENSATION_OFF = "nose compensation off"
    COMPENSATION_LEFT = "nose compensation, tool on the left"
    COMPENSATION_RIGHT = "nose compensation, tool on the right"
    COMPENSATION_GIVEN_LEFT = "nose compensation with a given nose, tool on the left"
    COMPENSATION_GIVEN_RIGHT = "nose compensation with a given nose, tool on the right"
    LENGTH_OFF = "tool length offset off"
    LENGTH_ON = "a tool length offset"
    LENGTH_GIVEN = "a tool length offset given in the block"
    OFFSET_FIRST = "the first work offset"
    OFFSET_OTHER = "another work offset"
    OFFSET_FURTHER = "a further work offset"
    CYCLE_RETURN = "the return level of canned cycles"
    PATH_EXACT = "exact path"
    PATH_BLENDED = "path blending"
    DWELL = "dwell"
    SET_DATA = "setting offsets"
    HOME = "return to the reference point"
    HOME_SECOND = "return to the second reference point"
    HOME_SET = "setting the reference point"
    HOME_SET_SECOND = "setting the second reference point"
    MACHINE_COORDINATES = "machine coordinates"
    SHIFT = "origin shift"
    SHIFT_OFF = "origin shift off"
    SHIFT_SUSPENDED = "suspending the origin shift"
    SHIFT_RESTORED = "restoring the origin shift"
    SHIFT_LOCAL = "a local origin shift"
    SPINDLE_LIMIT = "spindle speed limit"
    STOP = "program stop"
    OPTIONAL_STOP = "optional stop"
    END = "program end"
    SPINDLE_FORWARD = "spindle on clockwise"
    SPINDLE_REVERSE = "spindle on counterclockwise"
    SPINDLE_OFF = "spindle off"
    SPINDLE_ORIENT = "spindle orientation"
    MIST = "mist coolant on"
    FLOOD = "flood coolant on"
    COOLANT_OFF = "coolant off"
    TOOL_CHANGE = "tool change"
    CLAMP_OPEN = "chuck open"
    CLAMP_CLOSE = "chuck close"
    CHIP_CONVEYOR = "chip conveyor"
    SUBPROGRAM = "a subprogram call"
    LOCAL_SUBPROGRAM = "a call of a subprogram of the same program"
    MACRO_CALL = "a macro call"
    SUBPROGRAM_END = "the return from a subprogram"
    OVERRIDE = "override switches"
    LOOK_AHEAD = "look-ahead or smoothing of the control"
    MONITORING_OFF = "monitoring off"


def _groups() -> dict[Meaning, Group]:
    m, g = Meaning, Group
    table: dict[Group, tuple[Meaning, ...]] = {
        g.MOTION: (
            m.RAPID, m.LINE, m.ARC_CLOCKWISE, m.ARC_COUNTERCLOCKWISE, m.THREAD, m.MOTION_OFF, m.THREAD_BY_FEED, m.ROUGHING_CYCLE,
            m.FACING_CYCLE, m.REPEATING_CYCLE, m.FINISHING_CYCLE, m.FACE_GROOVING_CYCLE, m.GROOVING_CYCLE, m.THREADING_CYCLE,
            m.TURNING_CYCLE_SIMPLE, m.THREADING_CYCLE_SIMPLE, m.FACING_CYCLE_SIMPLE, m.DRILLING, m.DRILLING_WITH_DWELL,
            m.PECK_DRILLING, m.CHIP_BREAKING, m.TAPPING, m.TAPPING_LEFT, m.RIGID_TAPPING, m.BORING, m.BORING_STOPPED, m.BORING_WITH_DWELL,
            m.PROBE, m.POCKETS_LATER, m.POCKETS_ONLY, m.FACE_POCKETS_LATER, m.FACE_POCKETS_ONLY,
        ),
        g.PLANE: (m.PLANE_XZ, m.PLANE_XY, m.PLANE_OTHER),
        g.DISTANCE: (m.ABSOLUTE, m.INCREMENTAL),
        g.ARC_DISTANCE: (m.ARC_ABSOLUTE, m.ARC_INCREMENTAL),
        g.FEED_MODE: (m.PER_MINUTE, m.PER_REVOLUTION, m.INVERSE_TIME),
        g.UNITS: (m.INCH, m.MILLIMETRE),
        g.DIAMETER: (m.X_DIAMETER, m.X_RADIUS),
        g.SPINDLE_MODE: (m.SURFACE_SPEED, m.SPINDLE_SPEED),
        g.COMPENSATION: (
            m.COMPENSATION_OFF, m.COMPENSATION_LEFT, m.COMPENSATION_RIGHT, m.COMPENSATION_GIVEN_LEFT, m.COMPENSATION_GIVEN_RIGHT,
        ),
        g.LENGTH: (m.LENGTH_OFF, m.LENGTH_ON, m.LENGTH_GIVEN),
        g.COORDINATES: (m.OFFSET_FIRST, m.OFFSET_OTHER, m.OFFSET_FURTHER),
        g.CYCLE_RETURN: (m.CYCLE_RETURN,),
        g.PATH_MODE: (m.PATH_EXACT, m.PATH_BLENDED),
        g.ONCE: (
            m.DWELL, m.SET_DATA, m.HOME, m.HOME_SECOND, m.HOME_SET, m.HOME_SET_SECOND, m.MACHINE_COORDINATES, m.SHIFT, m.SHIFT_OFF,
            m.SHIFT_SUSPENDED, m.SHIFT_RESTORED, m.SHIFT_LOCAL, m.SPINDLE_LIMIT, m.MACRO_CALL,
        ),
        g.STOP: (m.STOP, m.OPTIONAL_STOP, m.END),
        g.SPINDLE: (m.SPINDLE_FORWARD, m.SPINDLE_REVERSE, m.SPINDLE_OFF, m.SPINDLE_ORIENT),
        g.COOLANT: (m.MIST, m.FLOOD, m.COOLANT_OFF),
        g.TOOL: (m.TOOL_CHANGE,),
        g.OTHER: (
            m.CLAMP_OPEN, m.CLAMP_CLOSE, m.CHIP_CONVEYOR, m.SUBPROGRAM, m.LOCAL_SUBPROGRAM, m.SUBPROGRAM_END, m.OVERRIDE,
            m.LOOK_AHEAD, m.MONITORING_OFF,
        ),
    }  # fmt: skip
    return {meaning: group for group, meanings in table.items() for meaning in meanings}


GROUP_OF: dict[Meaning, Group] = _groups()

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
        ),
    ),
    _Control(
        "Okuma OSP",
        re.compile(r"\b(NLAP\d|NOEX|VZOF[XZ]|VC\d+\s*=|V\d+\s*=|G1[34]0?\b(?![.\d])|G8[0-9]\s+N[A-Z]+\d*|CALL\s+O[A-Z]|NAT\d+|RTS\b|SB\s*=|LAP\d)"),
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
