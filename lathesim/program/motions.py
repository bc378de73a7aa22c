"""The motions of a block: end points, feeds, threads, arcs, corners that are broken, and lines given by their angle. Lengths [m].

Seen with +Z to the right and +X up: G02 is clockwise, G03 counterclockwise, a positive sweep counterclockwise. A chamfer is ``,C`` or
``C``, a rounding ``,R`` or ``R``. Between moves along the axes a chamfer may be I or K, whose sign says which way the next move goes along
X or Z. ``,A`` or ``A`` is the angle of a line from +Z towards +X, of whose end X or Z is given.

Source: NIST RS274NGC Interpreter version 3, section 3.5 (3.5.3 for arcs); LinuxCNC 2.9 rs274 for tolerances and what the manuals leave
open; Fanuc 0i-T operator's manual, chamfering and corner R, direct drawing dimension programming; Haas lathe operator's manual, G01.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterable

from lathesim.errors import Fault
from lathesim.program.dialects import Dialect
from lathesim.program.meanings import Group, Meaning
from lathesim.program.modal import Modal, Point
from lathesim.program.moves import Arc, Corner, Made, Move, MoveKind, MoveMode, PlannedMove, turned
from lathesim.program.vocabulary import Sorted
from lathesim.program.words import Word
from lathesim.units import in_unit

_ARCS = (Meaning.ARC_CLOCKWISE, Meaning.ARC_COUNTERCLOCKWISE)
PLAIN = frozenset({Meaning.RAPID, Meaning.LINE, *_ARCS})
"""Motions other than cycles and threads."""
_TURN = 360.0
_LONG_LEAD = 0.05
"""[m] a lead above it is rather a feed per minute or a number of threads per inch, assumed: threads with many starts stay below."""

RADIUS_TOLERANCE = 2.83e-5  # [m] radii may differ so much ... Source: LinuxCNC 2.9 rs274
RELATIVE_TOLERANCE = 1e-3  # ... or by this share of the radius ...
LARGEST_DIFFERENCE = 2.83e-3  # [m] ... but never by more than this
CHORD_TOLERANCE = 5e-6  # [m] half a chord may exceed R by this, assumed: coordinates come rounded to 1 um or 0.0001 inch
SAME_POINT = 1e-9  # [m] points nearer than this are one, assumed: far below any programmed digit

_FULL_TURN = 2.0 * math.pi
_STRAIGHT = 1e-6
"""[rad] below this, two moves make no corner."""


_PER_TIME, _PER_TURN = MoveMode(), MoveMode(per_revolution=True)


def go(
    block: Sorted,
    modal: Modal,
    kind: MoveKind,
    end: Point,
    *,
    feed: float | None = None,
    arc: Arc | None = None,
    compensated: bool = True,
    mode: MoveMode = _PER_TIME,
) -> PlannedMove:
    """Go to ``end`` (x, z) [m] and return the move.

    Its ``mode`` gets the spindle, the tool and the compensation in force, which only moves that are ``compensated`` follow.
    """
    nose = modal.turret.nose if compensated else None
    if nose is not None and kind == "thread":
        block.warn("Nose compensation does not act on threads; the tool point follows them.")
        nose = None
    mode = mode._replace(spindle=modal.spindle.now, tool=modal.turret.use, cycle_line=block.line if mode.cycle else 0, nose=nose)
    start = (modal.x, modal.z)
    modal.x, modal.z = end
    return PlannedMove(kind, block.line, start, end, feed, arc, mode)


def feed_to(
    block: Sorted, modal: Modal, kind: MoveKind, end: Point, arc: Arc | None = None, corner: Corner | None = None
) -> list[PlannedMove]:
    """Return a move with the feed in force."""
    feed = modal.feed
    made = go(block, modal, kind, end, feed=feed.value, arc=arc, mode=_PER_TURN if feed.per_revolution else _PER_TIME)
    return [made if corner is None else made._replace(corner=corner)]


def target(block: Sorted, modal: Modal, dialect: Dialect, axes: Iterable[tuple[str, str]] = ()) -> Point:
    """Return the end point (x, z) of the block [m], X as a radius; ``axes`` are letters in place of the dialect's, each with its axis."""
    words = block.words
    x, z = modal.x, modal.z
    machine = Meaning.MACHINE_COORDINATES in block.codes
    zero = dialect.origin.machine_zero if machine else modal.origin.zero
    for letter, axis in axes or dialect.axes:
        if letter not in words:
            continue
        block.used.add(letter)
        absolute = letter == axis and (modal.modes.absolute or machine)
        if axis == "X":
            x = modal.across(words[letter].value) + (zero[0] if absolute else x)
        else:
            z = modal.metres(words[letter].value) + (zero[1] if absolute else z)
    return x, z


def plain_motion(block: Sorted, modal: Modal, dialect: Dialect) -> Made:
    """The motion of the block, by its own code or by the one in force."""
    meaning = block.of_group(Group.MOTION)
    if meaning is not None:
        modal.modes.motion, modal.modes.motion_code = meaning, block.codes[meaning].code
    axes = [letter for letter, _ in dialect.axes if letter in block.words and letter not in block.used]
    if not axes and not (modal.modes.motion in _ARCS and any(letter in block.words for letter in "IJKR")):
        if block.has(Meaning.MACHINE_COORDINATES):
            raise Fault(f"{block.codes[Meaning.MACHINE_COORDINATES].text} names no axis.", "Add an X or a Z word.")
        if meaning is Meaning.THREAD:
            raise Fault(f"{modal.modes.motion_code} names no end point.", "Add a Z word.")
        if meaning in _ARCS:
            raise _no_centre(modal)
        return ()
    if modal.modes.motion is None or modal.modes.motion is Meaning.MOTION_OFF:
        why = "none is set yet" if modal.modes.motion is None else f"{modal.modes.motion_code} has ended the one before"
        raise Fault(f"{block.words[axes[0]].text} needs a motion code and {why}.", "Write G0 or G1 in front of it.")
    if Meaning.MACHINE_COORDINATES in block.codes:
        _check_machine_coordinates(block.codes[Meaning.MACHINE_COORDINATES].text, modal)
    if modal.modes.motion is Meaning.RAPID:
        return [go(block, modal, "rapid", target(block, modal, dialect))]
    if modal.modes.motion is Meaning.LINE:
        check_feed(block, modal, dialect)
        corner = _corner(block, modal, dialect)
        return feed_to(block, modal, "feed", _line_end(block, modal, dialect), corner=corner)
    if modal.modes.motion in _ARCS:
        return _arc(block, modal, dialect, bool(axes))
    lead, angle = lead_along(block, modal, Meaning.THREAD), start_angle(block, dialect)
    return [go(block, modal, "thread", target(block, modal, dialect), feed=lead, mode=_PER_TURN._replace(start_angle=angle))]


def _corner(block: Sorted, modal: Modal, dialect: Dialect) -> Corner | None:
    """Return the chamfer or rounding that the block has between its end and the next move."""
    if ",C" not in dialect.letters or block.words.keys().isdisjoint(CORNER_LETTERS):
        return None
    words = list(block.takes(CORNER_LETTERS).values())
    if words[0].value == 0.0 or (words[0].letter.startswith(",") and words[0].value < 0.0) or len(words) > 1:
        raise Fault(f"{words[0].text} is no size of a corner, or there are two.", "Give one of ,C and ,R above 0.")
    return corner_of(words[0], modal.metres(words[0].value), block.line)


def _line_end(block: Sorted, modal: Modal, dialect: Dialect) -> Point:
    """Return the end point (x, z) of a straight feed [m], which an angle and one of X and Z may give as well."""
    angle = (block.take(",A") or block.take("A")) if ",A" in dialect.letters else None
    start, end = modal.place, target(block, modal, dialect)
    if angle is None:
        return end
    given = [axis for axis, letters in (("X", "XU"), ("Z", "ZW")) if any(letter in block.words for letter in letters)]
    if len(given) != 1:
        raise Fault(f"{angle.text} is the angle of a line whose end is named by X and Z.", "Give one of X and Z beside an angle.")
    found = end_at_angle(start, end, angle.value, x_given=given == ["X"])
    if found is None:
        raise Fault(f"A line at {angle.text} does not get to that {given[0]}.", "Correct the angle: it counts from +Z towards +X.")
    return found


def _arc(block: Sorted, modal: Modal, dialect: Dialect, moves_axes: bool) -> Made:
    """G2, G3 by radius or by centre."""
    code, clockwise = modal.modes.motion_code, modal.modes.motion is Meaning.ARC_CLOCKWISE
    check_plane(modal, dialect, code)
    i, j, k, r = (block.take(letter) for letter in "IJKR")
    if j is not None and j.value != 0.0:
        raise Fault(f"{j.text} is an arc centre along Y, and this lathe has no Y.", "Take it out; I goes along X and K along Z.")
    other = i or k
    if r is not None and other is not None:
        raise Fault(f"{code} has both {r.text} and {other.text}.", "Give the radius with R, or the centre with I and K.")
    if r is None and other is None:
        raise _no_centre(modal)
    check_feed(block, modal, dialect)
    start = modal.place
    if r is not None:
        if not moves_axes:
            raise Fault(f"{code} with R names no end point.", "Add X and Z words.")
        end = target(block, modal, dialect)
        return feed_to(block, modal, "arc", end, arc_by_radius(start, end, modal.metres(r.value), clockwise, code))
    if modal.modes.arc_absolute and (i is None or k is None):
        raise Fault(f"{code} needs both I and K while arc centres are absolute.", "Add the missing one, or write G91.1.")
    zero = modal.origin.zero if modal.modes.arc_absolute else start
    end = target(block, modal, dialect)
    centre = (zero[0] + modal.metres(i.value if i else 0.0), zero[1] + modal.metres(k.value if k else 0.0))
    return feed_to(block, modal, "arc", end, arc_by_centre(start, end, centre, clockwise, code))


def check_plane(modal: Modal, dialect: Dialect, code: str) -> None:
    """Raise :class:`Fault` for a code that needs the XZ plane while another plane is in force."""
    if modal.modes.plane is not Meaning.PLANE_XZ:
        raise Fault(f"{code} needs the plane of X and Z, but {dialect.code_for(modal.modes.plane)} is in force.", "Write G18 before it.")


def _no_centre(modal: Modal) -> Fault:
    fact = f"{modal.modes.motion_code} needs I and K, or R, and has none of them."
    return Fault(fact, "Give the centre with I and K, or the radius with R.")


def lead_along(block: Sorted, modal: Modal, meaning: Meaning) -> float:
    """Return the lead along the path [m] that K gives G33 and G33.1; the previous lead holds if the code is not repeated."""
    lead = lead_of(block, modal, "K", repeats=not block.has(meaning))
    check_thread(block, modal, modal.modes.motion_code)
    return lead


def lead_of(block: Sorted, modal: Modal, letters: str, *, repeats: bool = True) -> float:
    """Return the lead of a thread [m] that a word gives; the one before holds where the block ``repeats`` it."""
    word = next((word for letter in letters if (word := block.take(letter)) is not None), None)
    letter = letters[0]
    example = f"for example {letter}1.5."
    if word is not None:
        if word.value <= 0.0:
            raise Fault(f"{word.text} is no lead.", f"Give the lead of the thread above 0, {example}")
        modal.feed.lead = _long_lead(block, word, modal.metres(word.value))
    elif modal.feed.lead is None or not repeats:
        raise Fault(
            f"{modal.modes.motion_code} needs a lead and has none.", f"Add {'a' if letter == 'K' else 'an'} {letter} word, {example}"
        )
    return modal.feed.lead


def _long_lead(block: Sorted, word: Word, lead: float) -> float:
    """Return the lead [m]; one that looks like a feed per minute is warned of."""
    if lead > _LONG_LEAD:
        block.warn(f"{word.text} is a lead of {in_unit(lead, 'mm', '.6g')} per revolution here. Check that it is no feed per minute.")
    return lead


def check_thread(block: Sorted, modal: Modal, code: str) -> None:
    """Refuse a thread without a turning spindle, and warn of one whose spindle has no constant speed.

    Source: Fanuc 0i-T operator's manual, constant lead threading: G97 for scroll and taper threads.
    """
    if not modal.spindle.turns:
        raise Fault(f"{code} follows the spindle, and the spindle stands still.", "Turn it on with M3 and an S word.")
    if modal.spindle.surface:
        block.warn(f"{code} threads at constant surface speed, so the spindle changes its speed with X. Write G97 with S before it.")


def start_angle(block: Sorted, dialect: Dialect) -> float:
    """Return the angle [rad] from the index of the spindle to the start of a thread; it holds only for its block."""
    letter, unit = dialect.roles.start_angle
    word, moves = block.take(letter), block.flow.moves
    if word is None:
        return 0.0
    degrees = abs(word.value) * unit
    half = f"{letter}{180.0 / unit:.0f}"
    if unit < 1.0 and ("." in word.text or word.value < 0.0):
        remedy = f"It is an integer in units of {unit:g} degree: {half} is half a turn."
        raise Fault(f"{word.text} is not a start angle of a thread.", remedy)
    if degrees > _TURN:
        raise Fault(f"{word.text} is a start angle of {degrees:g} degrees, more than a turn.", f"Write {half} for half a turn.")
    if 0.0 < degrees < 1.0:
        block.warn(f"{word.text} is a start angle of {degrees:g} degrees. Write {half} for half a turn.")
    if word.value < 0.0:
        block.warn(f"The sign of {word.text} is ignored: the thread begins {degrees:g} degrees behind the index.")
    if moves and moves[-1].kind == "thread":
        block.warn(f"{word.text} changes nothing: the thread continues the previous one.")
    if unit == 1.0:
        block.assume("start_angle", f"{letter} of a thread as in LinuxCNC 2.10; 2.9 refuses it")
    return math.radians(degrees)


def _check_machine_coordinates(code: str, modal: Modal) -> None:
    """Refuse machine coordinates with other motions than absolute rapids and straight feeds."""
    if modal.modes.motion not in (Meaning.RAPID, Meaning.LINE):
        raise Fault(f"{code} goes with G0 and G1 only, and {modal.modes.motion_code} is in force.", "Write G0 or G1 in its block.")
    if not modal.modes.absolute:
        raise Fault(f"{code} names machine coordinates and positions are incremental.", "Write G90 before it.")


def check_feed(block: Sorted, modal: Modal, dialect: Dialect) -> None:
    """Refuse a feed move without a feed, and one per revolution while the spindle stands still."""
    feed, spindle = modal.feed, modal.spindle
    if not feed.value:
        mode = dialect.code_for(Meaning.PER_REVOLUTION if feed.per_revolution else Meaning.PER_MINUTE)
        example = f"Add an F word, for example {'F0.2' if feed.per_revolution else 'F120'} with {mode}."
        why = f"the feed of line {feed.line} is 0" if feed.value is not None else feed.lost or "none is set yet"
        raise Fault(f"{modal.modes.motion_code} needs a feed and {why}.", example)
    if not spindle.turns and feed.per_revolution:
        other = dialect.code_for(Meaning.PER_MINUTE)
        remedy = f"Turn it on with {'M3' if spindle.speed else 'M3 and an S word'}, or use {other}."
        raise Fault(f"{modal.modes.motion_code} feeds per revolution and the spindle stands still.", remedy)
    if not spindle.turns:
        block.warn("The tool feeds while the spindle stands still.")


# ---- arcs and corners ----------------------------------------------------------------------------------------------------------------


def arc_by_centre(start: Point, end: Point, centre: Point, clockwise: bool, code: str) -> Arc:
    """Return the arc from start to end (x, z) about ``centre``; equal ends make a full circle.

    Raises :class:`Fault` where the centre coincides with the start or is not equally far from both ends.
    """
    begin, finish, middle = _in_plane(start), _in_plane(end), _in_plane(centre)
    radius, end_radius = abs(begin - middle), abs(finish - middle)
    if radius < SAME_POINT:
        raise Fault(f"{code} has its centre where it starts.", "I and K point from the start to the centre.")
    difference = abs(end_radius - radius)
    if difference > LARGEST_DIFFERENCE or (difference > RADIUS_TOLERANCE and difference > RELATIVE_TOLERANCE * radius):
        raise Fault(
            f"{code} ends {in_unit(end_radius, 'mm', '.4f')} from its centre and starts {in_unit(radius, 'mm', '.4f')} from it.",
            "Correct I and K, or the end point, so that both lie on one circle.",
        )
    sweep = 0.0 if abs(finish - begin) < SAME_POINT else turned(middle, begin, finish, clockwise=clockwise)
    sweep = sweep or _FULL_TURN
    return Arc(centre[0], centre[1], radius, end_radius, cmath.phase(begin - middle), -sweep if clockwise else sweep)


def _in_plane(point: Point) -> complex:
    """Return a point (x, z) as a place in the plane."""
    return complex(point[1], point[0])


def arc_by_radius(start: Point, end: Point, radius: float, clockwise: bool, code: str) -> Arc:
    """Return the arc of this radius from start to end (x, z); a negative radius takes the longer way round.

    Raises :class:`Fault` where the ends are one point or too far apart.
    """
    way = _in_plane(end) - _in_plane(start)
    chord = abs(way)
    if radius == 0.0:
        raise Fault(f"{code} has the radius 0.", "Give R, or the centre with I and K.")
    if chord < SAME_POINT:
        raise Fault(
            f"{code} with R ends where it starts, so its centre could lie anywhere.", "Give the centre of a full circle with I and K."
        )
    size = abs(radius)
    if 0.5 * chord > size + CHORD_TOLERANCE:
        raise Fault(
            f"{code} has the radius {in_unit(size, 'mm', '.4f')}, too small to reach its end {in_unit(chord, 'mm', '.4f')} away.",
            f"It takes {500.0 * chord:.4f} mm at least.",
        )
    size = max(size, 0.5 * chord)
    height = math.sqrt(max(0.0, size * size - 0.25 * chord * chord))
    # Seen with +Z right and +X up, the centre of a short clockwise arc lies to the right of the way from start to end.
    side = 1.0 if clockwise == (radius > 0.0) else -1.0
    centre = 0.5 * (_in_plane(start) + _in_plane(end)) - side * height * 1j * way / chord
    half = math.asin(min(1.0, 0.5 * chord / size))
    sweep = 2.0 * half if radius > 0.0 else _FULL_TURN - 2.0 * half
    return Arc(centre.imag, centre.real, size, size, cmath.phase(_in_plane(start) - centre), -sweep if clockwise else sweep)


CORNER_AXES = {"I": "X", "K": "Z"}
"""The axis of the next move that a letter of a corner tells."""
CORNER_LETTERS = (",C", ",R", "C", "R", *CORNER_AXES)


def corner_of(word: Word, metres: float, line: int) -> Corner:
    """Return the corner that a word asks for; ``metres`` is its value."""
    axis = CORNER_AXES.get(word.letter, "")
    sign = math.copysign(1.0, metres) if axis or metres < 0.0 else 0.0
    return Corner(word.letter in (",R", "R"), abs(metres), word.text, line, axis, sign)


def end_at_angle(start: Point, end: Point, degrees: float, *, x_given: bool) -> Point | None:
    """Return the end (x, z) [m] of a line at an angle from +Z towards +X, of which X or Z is given; none where it never gets there."""
    along_z, along_x = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    way, given = (end[0] - start[0], along_x) if x_given else (end[1] - start[1], along_z)
    if abs(given) < _STRAIGHT or way / given < 0.0:
        return None
    return start[0] + way / given * along_x, start[1] + way / given * along_z


def broken(before: Move, after: Move, corner: Corner) -> list[Move]:
    """Return the two moves with their corner broken: the first, the chamfer or rounding, the second."""
    if before.arc is not None or after.kind != "feed" or after.arc is not None:
        raise Fault(f"{corner.text} needs a straight feed before and behind it.", "Write arcs with G2 and G3.")
    length = (before.length, after.length)
    if min(length) < SAME_POINT:
        raise Fault(f"{corner.text} stands beside a move without a length.", "Take one of the two out.")
    u, v = (before.end - before.start) / length[0], (after.end - after.start) / length[1]
    if corner.sign != 0.0:
        _check_direction(corner, (u.real, u.imag), (v.real, v.imag))
    turn = cmath.phase(u.conjugate() * v)
    if abs(turn) < _STRAIGHT:
        return [before, after]
    if abs(turn) > math.pi - _STRAIGHT:
        raise Fault(f"{corner.text} stands where the tool turns back.", "Take it out.")
    cut = corner.size * math.tan(0.5 * abs(turn)) if corner.rounds else corner.size
    if cut > min(length) + SAME_POINT:
        raise Fault(
            f"{corner.text} takes {in_unit(cut, 'mm')} off moves of {1e3 * length[0]:.4g} and {1e3 * length[1]:.4g} mm.", "Make it smaller."
        )
    begin, end = before.end - cut * u, before.end + cut * v
    arc = None
    if corner.rounds:
        centre = begin + math.copysign(1.0, turn) * corner.size * 1j * u
        arc = Arc(centre.imag, centre.real, corner.size, corner.size, cmath.phase(begin - centre), turn)
    kind: MoveKind = "arc" if arc is not None else "feed"
    chamfer = before.between(begin, end, kind=kind, arc=arc)
    return [before.between(before.start, begin), chamfer, after.between(end, after.end)]


def _check_direction(corner: Corner, u: Point, v: Point) -> None:
    """Refuse a corner whose sign says another way than that of the next move; ``u`` and ``v`` are directions (z, x)."""
    place = max((0, 1), key=lambda number: abs(v[number]))
    if min(abs(v[0]), abs(v[1])) > _STRAIGHT or abs(u[place]) > _STRAIGHT:
        fact = f"{corner.text} needs a move along one axis before it and one along the other behind it."
        raise Fault(fact, f"Write ,{'R' if corner.rounds else 'C'}{1e3 * corner.size:g} for any corner.")
    if v[place] * corner.sign < 0.0 or (corner.axis and corner.axis != "ZX"[place]):
        way = f"{'+' if v[place] > 0.0 else '-'}{'ZX'[place]}"
        told = f"{'+' if corner.sign > 0.0 else '-'}{corner.axis}" if corner.axis else f"{'+' if corner.sign > 0.0 else '-'}{'ZX'[place]}"
        fact = f"{corner.text} says that the next move goes to {told}, and it goes to {way}."
        raise Fault(fact, "Correct the sign or the letter.")
