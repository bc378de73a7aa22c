"""Where coordinates begin and which tool cuts: work offsets, origin shifts, G10, reference points, nose compensation.

Source: LinuxCNC 2.9 manual, G10, G28, G30, G41, G52, G54, G92; Fanuc 0i-T operator's manual, coordinate system, G10, tool nose radius
compensation.
"""

from __future__ import annotations

from collections.abc import Iterable

from lathesim.errors import Fault
from lathesim.program.dialects import Dialect
from lathesim.program.meanings import Group, Meaning
from lathesim.program.modal import Modal, Point
from lathesim.program.motions import check_plane, go, target
from lathesim.program.moves import LEFT, ORIENTATIONS, RIGHT, Made, Nose, Tool, nose
from lathesim.program.vocabulary import AXES, Sorted
from lathesim.units import in_unit

_SIDES = {
    Meaning.COMPENSATION_LEFT: LEFT, Meaning.COMPENSATION_GIVEN_LEFT: LEFT, Meaning.COMPENSATION_RIGHT: RIGHT,
    Meaning.COMPENSATION_GIVEN_RIGHT: RIGHT,
}  # fmt: skip
_GIVEN = (Meaning.COMPENSATION_GIVEN_LEFT, Meaning.COMPENSATION_GIVEN_RIGHT)
_SAME = 1e-9
_WITHOUT, _WORK_DATA = 0.0, (2.0, 20.0)
"""The L of G10 that is left out, and those that set a work offset: as named, and from the present position."""
_FURTHER_OFFSETS = 300
"""Work offsets of G54.1 and G154. Source: Fanuc 0i-T operator's manual; Haas has 99 of them."""
_GEOMETRY = 10_000
"""P of G10 above it are geometry offsets of tools. Source: Fanuc 0i-T operator's manual, changing of tool offset amount."""


# ---- nose compensation ---------------------------------------------------------------------------------------------------------------


def plane(block: Sorted, modal: Modal, dialect: Dialect) -> Made:
    """Set the plane of the motions: XZ, or XY for drilling along Z."""
    meaning = block.of_group(Group.PLANE)
    if meaning is not None:
        if modal.turret.nose is not None and meaning is not Meaning.PLANE_XZ:
            raise Fault(f"{block.codes[meaning].text} changes the plane while nose compensation is on.", "Write G40 before it.")
        modal.modes.plane = meaning
    return ()


def compensation(block: Sorted, modal: Modal, dialect: Dialect) -> Made:
    """G40 to G42, and the choice of a work offset and of a tool offset."""
    _work_offset(block, modal, dialect)
    _length_offset(block, modal)
    meaning, turret = block.of_group(Group.COMPENSATION), modal.turret
    if meaning is Meaning.COMPENSATION_OFF:
        turret.side, turret.nose = 0, None
    elif meaning is not None:
        code = block.codes[meaning].text
        check_plane(modal, dialect, code)
        turret.side = _SIDES[meaning]
        tool = _given_nose(block, modal, code) if meaning in _GIVEN else _tool_of_nose(block, modal, code)
        turret.nose = _nose(modal, dialect, tool)
        if turret.nose is None:
            block.assume("nose_compensation", "a nose radius of 0: the tool point runs along the programmed path")
            block.warn(f"{code} is read with a nose radius of 0: the tool point runs along the programmed path.")
    return ()


def _nose(modal: Modal, dialect: Dialect, tool: Tool) -> Nose | None:
    if tool.radius == 0.0:
        return None
    return nose(modal.turret.side, tool, front=dialect.tools.in_front, starts_beside=dialect.tools.nose_starts_beside)


def _given_nose(block: Sorted, modal: Modal, code: str) -> Tool:
    """G41.1 and G42.1: D is the diameter of the nose, L its orientation."""
    d, orientation = block.take("D"), block.take("L")
    if d is None or d.value < 0.0:
        raise Fault(f"{code} needs the diameter of the nose.", f"Write it as {code} D0.8 L2.")
    return Tool(0.5 * modal.metres(d.value), _orientation(orientation.value if orientation is not None else 0.0, code))


def _tool_of_nose(block: Sorted, modal: Modal, code: str) -> Tool:
    """G41 and G42: the tool in use, or that of D."""
    d, turret = block.take("D"), modal.turret
    if d is None:
        return turret.tools.get(turret.offset or turret.use or 0, Tool())
    number = int(d.value)
    if d.value != number or number < 0 or (number not in turret.tools and number > turret.stations):
        raise Fault(f"{d.text} of {code} names an offset that there is not.", "Give the number of a tool of the turret.")
    return turret.tools.get(number, Tool())


def _orientation(value: float, code: str) -> int:
    if value not in ORIENTATIONS:
        raise Fault(f"{value:g} is no orientation of a tool for {code}.", "Orientations count from 0 to 9.")
    return int(value)


def call_tool(modal: Modal, dialect: Dialect, number: int) -> None:
    """Take over the offset that a T word calls; a compensation in force goes on with its nose."""
    turret = modal.turret
    tool = turret.tools.get(number, Tool())
    turret.offset, modal.origin.tool = number, (tool.x, tool.z)
    if turret.side:
        turret.nose = _nose(modal, dialect, tool)


# ---- coordinates ---------------------------------------------------------------------------------------------------------------------


def _work_offset(block: Sorted, modal: Modal, dialect: Dialect) -> None:
    meaning, origin = block.of_group(Group.COORDINATES), modal.origin
    if meaning is None:
        return
    word = block.codes[meaning]
    further = meaning is Meaning.OFFSET_FURTHER
    origin.number = _further_offset(block, dialect, word.text) if further else dialect.origin.work_offsets[word.code]
    if meaning is not Meaning.OFFSET_FIRST and origin.number not in origin.offsets:
        block.assume("work_offsets", "all zero")
        block.warn(f"{word.text} is read with an offset of 0.")


def _further_offset(block: Sorted, dialect: Dialect, code: str) -> int:
    """Return the number of the work offset that P of G54.1 or G154 names: they count on behind those with a code of their own.

    Source: Fanuc 0i-T operator's manual, additional workpiece coordinate systems; Haas lathe operator's manual, G154.
    """
    p = block.take("P")
    if p is None or p.value != int(p.value) or not 1 <= p.value <= _FURTHER_OFFSETS:
        raise Fault(f"{code} needs the number of a work offset.", f"Write it as {code} P1, up to P{_FURTHER_OFFSETS}.")
    return len(dialect.origin.work_offsets) + int(p.value)


def _length_offset(block: Sorted, modal: Modal) -> None:
    """G43 takes over the offsets of the tool in use, or of H; G49 takes them out."""
    meaning, turret = block.of_group(Group.LENGTH), modal.turret
    if meaning is Meaning.LENGTH_OFF:
        modal.origin.tool = (0.0, 0.0)
    elif meaning is Meaning.LENGTH_ON:
        h = block.take("H")
        number = (turret.use or 0) if h is None else int(h.value)
        if h is not None and (h.value != number or not 0 <= number <= turret.stations):
            raise Fault(f"{h.text} names an offset that there is not.", "Give the number of a tool of the turret.")
        tool = turret.tools.get(number, Tool())
        modal.origin.tool = (tool.x, tool.z)


def _lengths(block: Sorted, modal: Modal, letters: Iterable[str]) -> dict[str, float]:
    """Return the lengths [m] of these words of the block, X and U halved while X is a diameter."""
    return {letter: (modal.across if letter in "XU" else modal.metres)(word.value) for letter, word in block.takes(letters).items()}


def once(block: Sorted, modal: Modal, dialect: Dialect) -> Made:
    """The codes that act in their block only."""
    if not block.of_group(Group.ONCE):
        return ()
    if block.has(Meaning.SET_DATA):
        _set_data(block, modal, dialect)
    elif block.has(Meaning.SHIFT) or block.has(Meaning.SPINDLE_LIMIT):
        _shift(block, modal, dialect)
    elif block.has(Meaning.SHIFT_LOCAL):
        _shift_local(block, modal, dialect)
    elif block.has(Meaning.HOME_SET) or block.has(Meaning.HOME_SET_SECOND):
        modal.origin.homes[Meaning.HOME if block.has(Meaning.HOME_SET) else Meaning.HOME_SECOND] = modal.place
    elif block.has(Meaning.HOME) or block.has(Meaning.HOME_SECOND):
        return _home(block, modal, dialect, Meaning.HOME if block.has(Meaning.HOME) else Meaning.HOME_SECOND)
    elif block.has(Meaning.SHIFT_OFF):
        modal.origin.shift = modal.origin.kept = (0.0, 0.0)
    elif block.has(Meaning.SHIFT_SUSPENDED):
        modal.origin.shift = (0.0, 0.0)
    elif block.has(Meaning.SHIFT_RESTORED):
        modal.origin.shift = modal.origin.kept
    return ()


def _shift(block: Sorted, modal: Modal, dialect: Dialect) -> None:
    """The present position gets the coordinates of the block; U and W move the origin by so much."""
    origin, meaning = modal.origin, Meaning.SHIFT if block.has(Meaning.SHIFT) else Meaning.SPINDLE_LIMIT
    given = _lengths(block, modal, ("X", "Z", *dialect.roles.incremental))
    code = block.codes[meaning].text
    if not given:
        if meaning is Meaning.SHIFT:
            raise Fault(f"{code} shifts the origin and names no axis.", "Add an X or a Z word.")
        return
    (x, z), here = origin.shift, modal.here
    x, z = x + (here[0] - given["X"] if "X" in given else 0.0), z + (here[1] - given["Z"] if "Z" in given else 0.0)
    origin.shift = origin.kept = (x - given.get("U", 0.0), z - given.get("W", 0.0))
    if meaning is Meaning.SPINDLE_LIMIT and max(abs(part) for part in origin.shift) > _SAME:
        shift, stands = (f"X {in_unit(x, 'mm', '.6g')} (radius), Z {in_unit(z, 'mm', '.6g')}" for x, z in (origin.shift, modal.place))
        block.warn(f"{code} puts the origin to {shift}, as the tool stands at {stands}.")


def _shift_local(block: Sorted, modal: Modal, dialect: Dialect) -> None:
    given, origin = _lengths(block, modal, "XZ"), modal.origin
    if not given:
        raise Fault(f"{block.codes[Meaning.SHIFT_LOCAL].text} shifts the origin and names no axis.", "Add an X or a Z word.")
    x, z = origin.shift if dialect.origin.local_is_shift else origin.local
    place = (given.get("X", x), given.get("Z", z))
    if dialect.origin.local_is_shift:
        origin.shift = origin.kept = place
    else:
        origin.local = place


def _home(block: Sorted, modal: Modal, dialect: Dialect, which: Meaning) -> Made:
    """Over the point of the block, if it names one, to the reference point; without axes all of them go there."""
    if which is Meaning.HOME_SECOND:
        block.take("P")
    named = [letter for letter in AXES if letter in block.words]
    axes = {"X": "X", "Z": "Z", **dialect.roles.data_incremental}
    made = [go(block, modal, "rapid", target(block, modal, dialect, axes.items()), compensated=False)] if named else []
    zero = modal.origin.homes.get(which, dialect.origin.machine_zero)
    block.assume("reference_point", f"X{1e3 * zero[0]:g} Z{1e3 * zero[1]:g} mm, X as a radius")
    x = zero[0] if not named or "X" in named or "U" in named else modal.x
    z = zero[1] if not named or "Z" in named or "W" in named else modal.z
    return [*made, go(block, modal, "rapid", (x, z), compensated=False)]


# ---- G10 -----------------------------------------------------------------------------------------------------------------------------


def _set_data(block: Sorted, modal: Modal, dialect: Dialect) -> None:
    """Set a work offset (L2, L20) or a tool (L1, and on Fanuc also without L)."""
    code = block.codes[Meaning.SET_DATA].text
    kind, p = block.take("L"), block.take("P")
    number = -1 if p is None else int(p.value)
    if p is None or number < 0 or p.value != number:
        raise Fault(f"{code} needs the number of an offset.", f"Write it as {code} L2 P1 X0 Z0.")
    sort = kind.value if kind is not None else _WITHOUT
    if sort in _WORK_DATA:
        further = sort == _WORK_DATA[1] and dialect.origin.further_by_l20
        first, last = (1, _FURTHER_OFFSETS) if further else (0, len(dialect.origin.work_offsets))
        if not first <= number <= last:
            raise Fault(f"P{number} of {code} is no work offset.", f"There are P1 to P{last}.")
        number += len(dialect.origin.work_offsets) if further else 0
        _set_work_offset(block, modal, dialect, code, number, sort == _WORK_DATA[1] and not further)
    elif sort in dialect.tools.data:
        _set_tool(block, modal, dialect, code, number)
    else:
        kinds = "L2 and L20 (work offset), " + ("and no L, L10 or L11 (tool)" if _WITHOUT in dialect.tools.data else "L1 (tool)")
        raise Fault(f"{code} with {kind.text if kind is not None else 'no L'} is not interpreted.", f"There are {kinds}.")


def _given(block: Sorted, modal: Modal, dialect: Dialect, before: Point, here: Point | None = None) -> Point:
    """Return the offset that a block of G10 makes of the one ``before``; from ``here`` its words count, if it is given."""
    given = _lengths(block, modal, ("X", "Z", *dialect.roles.data_incremental))
    if here is not None:
        given = {letter: here[0 if letter == "X" else 1] - value for letter, value in given.items()}
    return given.get("X", before[0]) + given.get("U", 0.0), given.get("Z", before[1]) + given.get("W", 0.0)


def _set_work_offset(block: Sorted, modal: Modal, dialect: Dialect, code: str, number: int, from_here: bool) -> None:
    r, origin = block.take("R"), modal.origin
    if r is not None and r.value != 0.0:
        raise Fault(f"{r.text} of {code} turns the coordinates, and a lathe has no such plane.", "Leave R out.")
    number = number or origin.number
    work = origin.offsets.get(origin.number, (0.0, 0.0))
    here = (modal.here[0] + work[0], modal.here[1] + work[1])
    origin.offsets[number] = _given(block, modal, dialect, origin.offsets.get(number, (0.0, 0.0)), here if from_here else None)


def _set_tool(block: Sorted, modal: Modal, dialect: Dialect, code: str, number: int) -> None:
    turret = modal.turret
    number = number - _GEOMETRY if number > _GEOMETRY else number
    tool = turret.tools.get(number, Tool())
    x, z = _given(block, modal, dialect, (tool.x, tool.z))
    radius, orientation = block.take("R"), block.take("Q")
    if radius is not None and radius.value < 0.0:
        raise Fault(f"{radius.text} of {code} is a negative nose radius.", "Give it without a sign.")
    size = tool.radius if radius is None else modal.metres(radius.value)
    turret.tools[number] = Tool(size, tool.orientation if orientation is None else _orientation(orientation.value, code), x, z)
    if dialect.tools.data_at_once and number == turret.offset:
        modal.origin.tool = (x, z)
