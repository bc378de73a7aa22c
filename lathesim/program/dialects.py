"""The dialects as tables: which code means what, which letters there are, and the few facts in which controls differ.

``paper`` is what Liu and Landers' simulator reads, ``linuxcnc`` the lathe words of LinuxCNC 2.9, ``fanuc`` G-code system A of Fanuc and
Haas lathes, ``grbl`` the words of GRBL and grblHAL. The interpreter asks the table and never the dialect's name.

Source: Liu, Landers, A Modular Machine Tool Simulator (2004), section Part program; LinuxCNC 2.9 manual, chapters G-Codes and M-Codes;
Fanuc 0i-T operator's manual, list of G codes, system A; GRBL 1.1 documentation, commands (state after a reset: G0 G54 G17 G21 G90 G94
M5 M9); grblHAL, list of supported codes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

from lathesim.errors import ProgramError, nearest
from lathesim.program.meanings import NOT_INTERPRETED, Meaning
from lathesim.program.statements import MACROS, Keyword

M = Meaning  # the tables name it on every line
TWO_DIGITS = 100
"""A T word from here on names a tool, and with its last two digits an offset."""


@dataclass(frozen=True)
class LetterRoles:
    """What letters do beside what they are called.

    ``incremental`` letters move an axis incrementally; with G28 and G10 the ``data_incremental`` ones add to X and Z. ``dwell`` gives what
    one unit of a letter is in seconds, ``start_angle`` the letter of the start angle of a thread and its unit in degrees. ``surface_limit``
    bounds the spindle speed beside a surface speed. With ``least_increments`` a control may count positions without a point in its
    smallest unit.
    """

    incremental: Mapping[str, str] = field(default_factory=dict)
    data_incremental: Mapping[str, str] = field(default_factory=dict)
    dwell: Mapping[str, float] = field(default_factory=dict)
    surface_limit: str = ""
    start_angle: tuple[str, float] = ("", 1.0)
    least_increments: bool = False


@dataclass(frozen=True)
class StartState:
    """What holds until a program says else: the ``motion`` in force, and the ``place`` of the tool (x, z) [m], X as a radius."""

    x_is_diameter: bool = False
    per_revolution: bool = False
    motion: M | None = None
    place: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class SpindleFacts:
    """How a control turns the spindle.

    With ``surface_number_is_speed`` G97 without S takes the number of the surface speed for rpm, with ``holds_speed`` the speed that
    turned. With ``stops_after_motion`` M5 acts at the end of its block, and with ``stops_at_change`` a tool change turns the spindle off.
    """

    surface_number_is_speed: bool = False
    holds_speed: bool = False
    stops_after_motion: bool = False
    stops_at_change: bool = False


@dataclass(frozen=True)
class ToolFacts:
    """How a control takes tools.

    With ``change_at_t`` the T word changes the tool. ``data`` are the L of G10 that set one (0 without L), which acts at once with
    ``data_at_once``. With ``in_front`` orientations count with X mirrored, with ``nose_starts_beside`` compensation begins beside the path.
    """

    change_at_t: bool = False
    data: tuple[float, ...] = (0.0, 10.0, 11.0, 12.0, 13.0)
    data_at_once: bool = True
    in_front: bool = False
    nose_starts_beside: bool = True


@dataclass(frozen=True)
class OriginFacts:
    """Where coordinates begin: ``machine_zero`` [m, X as a radius], and the numbers of ``work_offsets`` by their codes.

    With ``further_by_l20`` L20 of G10 sets a further work offset, else the one in force from here. With ``local_is_shift`` G52 is the shift
    of G92.
    """

    machine_zero: tuple[float, float] = (0.0, 0.0)
    work_offsets: Mapping[str, int] = field(default_factory=dict)
    further_by_l20: bool = True
    local_is_shift: bool = False


@dataclass(frozen=True)
class ProgramFacts:
    """What a program may hold beside words for moves.

    One without an end is refused with ``end_required``, and accepted without a warning with ``end_free``. ``carried_out`` are meanings
    that not every dialect's codes are interpreted in. With ``builder_codes`` further M codes belong to the machine's builder and do
    nothing here. With ``variables`` there are expressions; ``statements`` choose the next block. Variables up to ``locals_up_to`` are
    local; with ``unset_is_empty`` one that is not set is empty, else 0; setting ``alarm_variable`` is an alarm (Fanuc 0i operator's
    manual, custom macro, system variables); ``numbered_parameters`` are those of RS274 and no macro variables.
    """

    number: bool = False
    end_required: bool = False
    end_free: bool = False
    carried_out: frozenset[M] = frozenset()
    builder_codes: bool = False
    statements: frozenset[Keyword] = frozenset()
    variables: bool = False
    locals_up_to: int = 33
    unset_is_empty: bool = True
    alarm_variable: int | None = 3000
    numbered_parameters: bool = False


@dataclass(frozen=True)
class CycleFacts:
    """How a control reads its cycles.

    With ``thread_drive_line`` G76 is that of LinuxCNC. With ``contour_in_subprogram`` Q of a contour cycle names a subprogram; with
    ``whole_numbers_are_steps`` a length without a point counts in the smallest unit. With ``drills_in_xy`` the drilling cycles are those of
    LinuxCNC, along Z in the plane of X and Y; with ``returns_to_plane`` they end at the R plane until a code says else. With
    ``cancels_beside_motion`` G80 may stand beside another motion code, which then counts.
    """

    thread_drive_line: bool = False
    contour_in_subprogram: bool = False
    whole_numbers_are_steps: bool = True
    drills_in_xy: bool = False
    returns_to_plane: bool = False
    cancels_beside_motion: bool = False


@dataclass(frozen=True)
class Dialect:
    """One way of writing part programs.

    ``codes`` gives the meaning of each G and M code, ``letters`` what each further letter carries. ``variant_of`` names the dialect of
    which this one is a rarer form; where both have a word, messages name that one.
    """

    name: str
    title: str
    codes: Mapping[str, M]
    letters: Mapping[str, str]
    roles: LetterRoles = LetterRoles()
    start: StartState = StartState()
    spindle: SpindleFacts = SpindleFacts()
    tools: ToolFacts = ToolFacts()
    origin: OriginFacts = OriginFacts()
    program: ProgramFacts = ProgramFacts()
    cycles: CycleFacts = CycleFacts()
    variant_of: str = ""

    @cached_property
    def axes(self) -> tuple[tuple[str, str], ...]:
        """Letters of positions, each with its axis."""
        return tuple({"X": "X", "Z": "Z", **self.roles.incremental}.items())

    def code_for(self, meaning: M | None) -> str:
        """Return the first code of a meaning, or nothing without one."""
        return next((code for code, own in self.codes.items() if own is meaning), "")


_COMMON_CODES: dict[str, M] = {
    "G0": M.RAPID, "G1": M.LINE, "G2": M.ARC_CLOCKWISE, "G3": M.ARC_COUNTERCLOCKWISE,
    "G17": M.PLANE_OTHER, "G18": M.PLANE_XZ, "G19": M.PLANE_OTHER,
    "G96": M.SURFACE_SPEED, "G97": M.SPINDLE_SPEED,
    "M0": M.STOP, "M2": M.END, "M30": M.END, "M3": M.SPINDLE_FORWARD, "M4": M.SPINDLE_REVERSE, "M5": M.SPINDLE_OFF,
}  # fmt: skip

_COMMON_LETTERS: dict[str, str] = {
    "X": "position across", "Z": "position along", "I": "arc centre along X", "K": "arc centre along Z", "R": "arc radius",
    "F": "feed", "S": "speed",
}  # fmt: skip

PAPER = Dialect(
    name="paper",
    title="the simulator of Liu and Landers (2004), X as a radius",
    codes={
        **_COMMON_CODES,
        "G70": M.INCH, "G71": M.MILLIMETRE, "G90": M.ABSOLUTE, "G91": M.INCREMENTAL,
        "G94": M.PER_MINUTE, "G95": M.PER_REVOLUTION, "G98": M.PER_MINUTE,
    },
    letters={**_COMMON_LETTERS, "J": "arc centre along Y"}
)  # fmt: skip

_WORK_OFFSETS = {"G54": 1, "G55": 2, "G56": 3, "G57": 4, "G58": 5, "G59": 6, "G59.1": 7, "G59.2": 8, "G59.3": 9}

LINUXCNC = Dialect(
    name="linuxcnc",
    title="LinuxCNC 2.9, X as a radius until G7",
    codes={
        **_COMMON_CODES,
        "G4": M.DWELL, "G7": M.X_DIAMETER, "G8": M.X_RADIUS, "G10": M.SET_DATA, "G20": M.INCH, "G21": M.MILLIMETRE,
        "G28": M.HOME, "G28.1": M.HOME_SET, "G30": M.HOME_SECOND, "G30.1": M.HOME_SET_SECOND, "G33": M.THREAD, "G33.1": M.RIGID_TAPPING,
        "G38.2": M.PROBE, "G38.3": M.PROBE, "G38.4": M.PROBE, "G38.5": M.PROBE,
        "G40": M.COMPENSATION_OFF, "G41": M.COMPENSATION_LEFT, "G41.1": M.COMPENSATION_GIVEN_LEFT,
        "G42": M.COMPENSATION_RIGHT, "G42.1": M.COMPENSATION_GIVEN_RIGHT,
        "G43": M.LENGTH_ON, "G43.1": M.LENGTH_GIVEN, "G43.2": M.LENGTH_GIVEN, "G49": M.LENGTH_OFF, "G52": M.SHIFT_LOCAL,
        "G53": M.MACHINE_COORDINATES,
        "G54": M.OFFSET_FIRST, "G55": M.OFFSET_OTHER, "G56": M.OFFSET_OTHER, "G57": M.OFFSET_OTHER, "G58": M.OFFSET_OTHER,
        "G59": M.OFFSET_OTHER,
        "G59.1": M.OFFSET_OTHER, "G59.2": M.OFFSET_OTHER, "G59.3": M.OFFSET_OTHER,
        "G61": M.PATH_EXACT, "G61.1": M.PATH_EXACT, "G64": M.PATH_BLENDED,
        "G70": M.FINISHING_CYCLE, "G71": M.ROUGHING_CYCLE, "G71.1": M.POCKETS_LATER, "G71.2": M.POCKETS_ONLY,
        "G72": M.FACING_CYCLE, "G72.1": M.FACE_POCKETS_LATER, "G72.2": M.FACE_POCKETS_ONLY,
        "G17": M.PLANE_XY, "G73": M.CHIP_BREAKING, "G74": M.TAPPING_LEFT, "G76": M.THREADING_CYCLE, "G80": M.MOTION_OFF,
        "G81": M.DRILLING, "G82": M.DRILLING_WITH_DWELL, "G83": M.PECK_DRILLING, "G84": M.TAPPING, "G85": M.BORING,
        "G86": M.BORING_STOPPED, "G89": M.BORING_WITH_DWELL,
        "G90": M.ABSOLUTE, "G91": M.INCREMENTAL, "G90.1": M.ARC_ABSOLUTE, "G91.1": M.ARC_INCREMENTAL,
        "G92": M.SHIFT, "G92.1": M.SHIFT_OFF, "G92.2": M.SHIFT_SUSPENDED, "G92.3": M.SHIFT_RESTORED,
        "G93": M.INVERSE_TIME, "G94": M.PER_MINUTE, "G95": M.PER_REVOLUTION, "G98": M.CYCLE_RETURN, "G99": M.CYCLE_RETURN,
        "M1": M.OPTIONAL_STOP, "M6": M.TOOL_CHANGE, "M7": M.MIST, "M8": M.FLOOD, "M9": M.COOLANT_OFF, "M19": M.SPINDLE_ORIENT,
        "M48": M.OVERRIDE, "M49": M.OVERRIDE, "M98": M.SUBPROGRAM, "M99": M.SUBPROGRAM_END,
    },
    letters={
        **_COMMON_LETTERS,
        "J": "arc centre along Y", "D": "speed limit, offset number or start angle", "P": "seconds of a dwell", "T": "tool and offset",
        "H": "length offset",
        "L": "repeats", "Q": "contour or depth", "E": "taper of a thread", "U": "allowance along X", "W": "allowance along Z",
    },
    roles=LetterRoles(dwell={"P": 1.0}, surface_limit="D", start_angle=("D", 1.0)),
    spindle=SpindleFacts(surface_number_is_speed=True, stops_at_change=True),
    tools=ToolFacts(data=(1.0,), data_at_once=False, in_front=True, nose_starts_beside=False),
    origin=OriginFacts(work_offsets=_WORK_OFFSETS, further_by_l20=False, local_is_shift=True),
    program=ProgramFacts(
        end_required=True, statements=frozenset(Keyword) - MACROS, variables=True, locals_up_to=30, unset_is_empty=False,
        alarm_variable=None, numbered_parameters=True,
    ),
    cycles=CycleFacts(
        thread_drive_line=True, contour_in_subprogram=True, whole_numbers_are_steps=False, drills_in_xy=True, returns_to_plane=True
    ),
)  # fmt: skip

_LINUXCNC_ONLY = {
    "G41", "G41.1", "G42", "G42.1", "G43.2", "G52", "G70", "G71", "G71.1", "G71.2", "G72", "G72.1", "G72.2", "G74", "G84", "G90.1", "M19",
    "M98", "M99",
}  # fmt: skip
"""Codes of LinuxCNC that grblHAL lacks, or has only in rare builds."""

GRBL = replace(
    LINUXCNC,
    name="grbl",
    title="GRBL 1.1 and grblHAL for lathes: starts in G0, and a program needs no end",
    codes={code: meaning for code, meaning in LINUXCNC.codes.items() if code not in _LINUXCNC_ONLY},
    start=StartState(motion=M.RAPID),
    program=replace(LINUXCNC.program, end_required=False, end_free=True),
    variant_of="linuxcnc",
)

_FANUC_CODES: dict[str, M] = {
    **_COMMON_CODES,
    "G4": M.DWELL, "G10": M.SET_DATA, "G20": M.INCH, "G21": M.MILLIMETRE, "G28": M.HOME, "G30": M.HOME_SECOND,
    "G40": M.COMPENSATION_OFF, "G41": M.COMPENSATION_LEFT, "G42": M.COMPENSATION_RIGHT, "G52": M.SHIFT_LOCAL,
    "G53": M.MACHINE_COORDINATES, "G54": M.OFFSET_FIRST, "G55": M.OFFSET_OTHER, "G56": M.OFFSET_OTHER, "G57": M.OFFSET_OTHER,
    "G58": M.OFFSET_OTHER, "G59": M.OFFSET_OTHER, "G54.1": M.OFFSET_FURTHER, "G154": M.OFFSET_FURTHER,
    "G23": M.MONITORING_OFF, "G25": M.MONITORING_OFF, "G103": M.LOOK_AHEAD, "G187": M.LOOK_AHEAD,
    "G61": M.PATH_EXACT, "G64": M.PATH_BLENDED, "G65": M.MACRO_CALL,
    "G70": M.FINISHING_CYCLE, "G71": M.ROUGHING_CYCLE, "G72": M.FACING_CYCLE, "G73": M.REPEATING_CYCLE, "G74": M.FACE_GROOVING_CYCLE,
    "G75": M.GROOVING_CYCLE, "G76": M.THREADING_CYCLE, "G80": M.MOTION_OFF, "G81": M.DRILLING, "G82": M.DRILLING_WITH_DWELL,
    "G83": M.PECK_DRILLING, "G84": M.TAPPING, "G85": M.BORING,
    "M1": M.OPTIONAL_STOP, "M7": M.MIST, "M8": M.FLOOD, "M9": M.COOLANT_OFF, "M6": M.TOOL_CHANGE, "M19": M.SPINDLE_ORIENT,
    "M10": M.CLAMP_CLOSE, "M11": M.CLAMP_OPEN, "M31": M.CHIP_CONVEYOR, "M33": M.CHIP_CONVEYOR, "M97": M.LOCAL_SUBPROGRAM,
    "M98": M.SUBPROGRAM, "M99": M.SUBPROGRAM_END,
}  # fmt: skip

FANUC = Dialect(
    name="fanuc",
    title="Fanuc and Haas lathes, G-code system A, X as a diameter",
    codes={
        **_FANUC_CODES,
        "G32": M.THREAD_BY_FEED, "G50": M.SPINDLE_LIMIT,
        "G90": M.TURNING_CYCLE_SIMPLE, "G92": M.THREADING_CYCLE_SIMPLE, "G94": M.FACING_CYCLE_SIMPLE,
        "G98": M.PER_MINUTE, "G99": M.PER_REVOLUTION,
    },
    letters={
        **_COMMON_LETTERS,
        "U": "incremental X", "W": "incremental Z", "P": "block number or milliseconds", "Q": "block number, depth or start angle",
        "T": "tool and offset",
        "O": "program number", "D": "depth of a cycle", "E": "lead of a thread",
        "A": "angle of a thread", "L": "repeats", "B": "argument of a macro", "C": "argument of a macro", "H": "argument of a macro",
        "J": "argument of a macro", ",C": "chamfer at the corner", ",R": "rounding at the corner", ",A": "angle of the line",
    },
    roles=LetterRoles(
        incremental={"U": "X", "W": "Z"}, data_incremental={"U": "X", "W": "Z"}, dwell={"X": 1.0, "U": 1.0, "P": 0.001},
        start_angle=("Q", 1e-3), least_increments=True,
    ),
    start=StartState(x_is_diameter=True, per_revolution=True, place=(0.1, 0.2)),
    spindle=SpindleFacts(holds_speed=True, stops_after_motion=True),
    tools=ToolFacts(change_at_t=True),
    origin=OriginFacts(machine_zero=(0.1, 0.2), work_offsets=_WORK_OFFSETS),
    program=ProgramFacts(
        number=True, carried_out=frozenset({M.SUBPROGRAM, M.SUBPROGRAM_END}), builder_codes=True, statements=MACROS, variables=True
    ),
    cycles=CycleFacts(cancels_beside_motion=True),
)  # fmt: skip

FANUC_B = replace(
    FANUC,
    name="fanuc-b",
    title="Fanuc lathes, G-code system B, X as a diameter: G90 and G91, feed with G94 and G95",
    codes={
        **_FANUC_CODES,
        "G33": M.THREAD_BY_FEED, "G92": M.SPINDLE_LIMIT,
        "G77": M.TURNING_CYCLE_SIMPLE, "G78": M.THREADING_CYCLE_SIMPLE, "G79": M.FACING_CYCLE_SIMPLE,
        "G90": M.ABSOLUTE, "G91": M.INCREMENTAL, "G94": M.PER_MINUTE, "G95": M.PER_REVOLUTION,
        "G98": M.CYCLE_RETURN, "G99": M.CYCLE_RETURN,
    },
    letters={**FANUC.letters, "U": "depth or allowance along X", "W": "depth or allowance along Z"},
    roles=replace(FANUC.roles, incremental={}),
    variant_of="fanuc"
)  # fmt: skip

DIALECTS: dict[str, Dialect] = {dialect.name: dialect for dialect in (PAPER, LINUXCNC, FANUC, GRBL, FANUC_B)}


_ALSO_CALLED = {"fanuc-a": "fanuc", "haas": "fanuc", "emc2": "linuxcnc", "grblhal": "grbl"}
"""Other names that people write for a dialect."""


def not_interpreted(meaning: M, dialect: Dialect) -> bool:
    """Return whether a dialect has a meaning that is not carried out for it."""
    return meaning in NOT_INTERPRETED and meaning not in dialect.program.carried_out


def dialect_named(name: str) -> Dialect:
    """Return the dialect of this name, or refuse with the nearest one."""
    name = _ALSO_CALLED.get(name.lower(), name)
    if name not in DIALECTS:
        raise ProgramError(f"There is no dialect '{name}'; there are {', '.join(DIALECTS)}.", remedy=nearest(name, DIALECTS))
    return DIALECTS[name]
