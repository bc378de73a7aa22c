"""The motions of a block: end points, arcs, feeds, threads, and what they need.

Source: NIST RS274NGC Interpreter version 3, section 3.5; LinuxCNC 2.9 rs274 for what the manuals leave open.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from lathesim.errors import Fault
from lathesim.program.arcs_and_corners import CORNER_LETTERS, arc_by_centre, arc_by_radius, corner_of, end_at_angle
from lathesim.program.dialects import Dialect
from lathesim.program.flow import Made
from lathesim.program.meanings import Group, Meaning
from lathesim.program.modal import Modal, Point
from lathesim.program.moves import Arc, Corner, MoveKind, MoveMode, PlannedMove
from lathesim.program.vocabulary import Sorted
from lathesim.program.words import Word
from lathesim.units import in_unit

_ARCS = (Meaning.ARC_CLOCKWISE, Meaning.ARC_COUNTERCLOCKWISE)
PLAIN = frozenset({Meaning.RAPID, Meaning.LINE, *_ARCS})
"""Motions other than cycles and threads."""
_TURN = 360.0
_LONG_LEAD = 0.05
"""[m] a lead above it is rather a feed per minute or a number of threads per inch, assumed: threads with many starts stay below."""


def go(
    block: Sorted,
    modal: Modal,
    kind: MoveKind,
    end: Point,
    *,
    feed: float | None = None,
    per_revolution: bool = False,
    seconds: float = 0.0,
    arc: Arc | None = None,
    cycle: str = "",
    compensated: bool = True,
    start_angle: float = 0.0,
    spin_back: bool = False,
    corner: Corner | None = None,
) -> PlannedMove:
    """Go to ``end`` (x, z) [m] and return the move; only those that are ``compensated`` follow the nose compensation in force."""
    nose = modal.turret.nose if compensated else None
    if nose is not None and kind == "thread":
        block.warn("Nose compensation does not act on threads; the tool point follows them.")
        nose = None
    cycle_line = block.line if cycle else 0
    mode = MoveMode(modal.spindle.now, per_revolution, seconds, modal.turret.use, cycle, cycle_line, nose, start_angle, spin_back)
    start = (modal.x, modal.z)
    modal.x, modal.z = end
    return PlannedMove(kind, block.line, start, end, feed, arc, mode, corner)


def feed_to(
    block: Sorted, modal: Modal, kind: MoveKind, end: Point, arc: Arc | None = None, corner: Corner | None = None
) -> list[PlannedMove]:
    """Return a move with the feed in force."""
    feed = modal.feed
    return [go(block, modal, kind, end, feed=feed.value, per_revolution=feed.per_revolution, arc=arc, corner=corner)]


def target(block: Sorted, modal: Modal, dialect: Dialect, axes: Iterable[tuple[str, str]] = ()) -> Point:
    """Return the end point (x, z) of the block [m], X as a radius; ``axes`` are letters in place of the dialect's, each with its axis."""
    words = block.words
    x, z = modal.x, modal.z
    machine = Meaning.MACHINE_COORDINATES in block.codes
    zero = dialect.machine_zero if machine else modal.origin.zero
    for letter, axis in axes or dialect.axes:
        if letter not in words:
            continue
        block.used.add(letter)
        absolute = letter == axis and (modal.absolute or machine)
        if axis == "X":
            x = modal.across(words[letter].value) + (zero[0] if absolute else x)
        else:
            z = modal.metres(words[letter].value) + (zero[1] if absolute else z)
    return x, z


def plain_motion(block: Sorted, modal: Modal, dialect: Dialect) -> Made:
    """The motion of the block, by its own code or by the one in force."""
    meaning = block.of_group(Group.MOTION)
    if meaning is not None:
        modal.motion, modal.motion_code = meaning, block.codes[meaning].code
    axes = [letter for letter, _ in dialect.axes if letter in block.words and letter not in block.used]
    if not axes and not (modal.motion in _ARCS and any(letter in block.words for letter in "IJKR")):
        if block.has(Meaning.MACHINE_COORDINATES):
            raise Fault(f"{block.codes[Meaning.MACHINE_COORDINATES].text} names no axis.", "Add an X or a Z word.")
        if meaning is Meaning.THREAD:
            raise Fault(f"{modal.motion_code} names no end point.", "Add a Z word.")
        if meaning in _ARCS:
            raise _no_centre(modal)
        return ()
    if modal.motion is None or modal.motion is Meaning.MOTION_OFF:
        why = "none is set yet" if modal.motion is None else f"{modal.motion_code} has ended the one before"
        raise Fault(f"{block.words[axes[0]].text} needs a motion code and {why}.", "Write G0 or G1 in front of it.")
    if Meaning.MACHINE_COORDINATES in block.codes:
        _check_machine_coordinates(block.codes[Meaning.MACHINE_COORDINATES].text, modal)
    if modal.motion is Meaning.RAPID:
        return [go(block, modal, "rapid", target(block, modal, dialect))]
    if modal.motion is Meaning.LINE:
        check_feed(block, modal, dialect)
        corner = _corner(block, modal, dialect)
        return feed_to(block, modal, "feed", _line_end(block, modal, dialect), corner=corner)
    if modal.motion in _ARCS:
        return _arc(block, modal, dialect, bool(axes))
    lead, angle = lead_along(block, modal, Meaning.THREAD), start_angle(block, dialect)
    return [go(block, modal, "thread", target(block, modal, dialect), feed=lead, per_revolution=True, start_angle=angle)]


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
    code, clockwise = modal.motion_code, modal.motion is Meaning.ARC_CLOCKWISE
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
    if modal.arc_absolute and (i is None or k is None):
        raise Fault(f"{code} needs both I and K while arc centres are absolute.", "Add the missing one, or write G91.1.")
    zero = modal.origin.zero if modal.arc_absolute else start
    end = target(block, modal, dialect)
    centre = (zero[0] + modal.metres(i.value if i else 0.0), zero[1] + modal.metres(k.value if k else 0.0))
    return feed_to(block, modal, "arc", end, arc_by_centre(start, end, centre, clockwise, code))


def check_plane(modal: Modal, dialect: Dialect, code: str) -> None:
    """Raise :class:`Fault` for a code that needs the XZ plane while another plane is in force."""
    if modal.plane is not Meaning.PLANE_XZ:
        raise Fault(f"{code} needs the plane of X and Z, but {dialect.code_for(modal.plane)} is in force.", "Write G18 before it.")


def _no_centre(modal: Modal) -> Fault:
    fact = f"{modal.motion_code} needs I and K, or R, and has none of them."
    return Fault(fact, "Give the centre with I and K, or the radius with R.")


def lead_along(block: Sorted, modal: Modal, meaning: Meaning) -> float:
    """Return the lead along the path [m] that K gives G33 and G33.1; the previous lead holds if the code is not repeated."""
    lead = lead_of(block, modal, "K", repeats=not block.has(meaning))
    check_thread(block, modal, modal.motion_code)
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
        raise Fault(f"{modal.motion_code} needs a lead and has none.", f"Add {'a' if letter == 'K' else 'an'} {letter} word, {example}")
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
    letter, unit = dialect.start_angle
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
    if modal.motion not in (Meaning.RAPID, Meaning.LINE):
        raise Fault(f"{code} goes with G0 and G1 only, and {modal.motion_code} is in force.", "Write G0 or G1 in its block.")
    if not modal.absolute:
        raise Fault(f"{code} names machine coordinates and positions are incremental.", "Write G90 before it.")


def check_feed(block: Sorted, modal: Modal, dialect: Dialect) -> None:
    """Refuse a feed move without a feed, and one per revolution while the spindle stands still."""
    feed, spindle = modal.feed, modal.spindle
    if not feed.value:
        mode = dialect.code_for(Meaning.PER_REVOLUTION if feed.per_revolution else Meaning.PER_MINUTE)
        example = f"Add an F word, for example {'F0.2' if feed.per_revolution else 'F120'} with {mode}."
        why = f"the feed of line {feed.line} is 0" if feed.value is not None else feed.lost or "none is set yet"
        raise Fault(f"{modal.motion_code} needs a feed and {why}.", example)
    if not spindle.turns and feed.per_revolution:
        other = dialect.code_for(Meaning.PER_MINUTE)
        remedy = f"Turn it on with {'M3' if spindle.speed else 'M3 and an S word'}, or use {other}."
        raise Fault(f"{modal.motion_code} feeds per revolution and the spindle stands still.", remedy)
    if not spindle.turns:
        block.warn("The tool feeds while the spindle stands still.")
