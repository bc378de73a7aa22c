"""What codes can mean, whatever their number: the words in which dialects are written down.

Two meanings of one group exclude each other in a block, and the modal ones stay in force until another of their group comes.
Source: NIST RS274NGC Interpreter version 3, table 4 (modal groups).
"""

from __future__ import annotations

from enum import StrEnum


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

HOLES = (
    Meaning.DRILLING, Meaning.DRILLING_WITH_DWELL, Meaning.PECK_DRILLING, Meaning.CHIP_BREAKING, Meaning.BORING, Meaning.BORING_STOPPED,
    Meaning.BORING_WITH_DWELL, Meaning.TAPPING, Meaning.TAPPING_LEFT,
)  # fmt: skip
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
