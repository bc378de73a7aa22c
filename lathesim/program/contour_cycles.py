"""The cycles of contours: find and run the contour, and expand G70 to G73 of Fanuc and G70 to G72.2 of LinuxCNC to moves.

The contour of LinuxCNC is a subprogram, that of Fanuc stands between the blocks that P and Q name.

Source: Fanuc 0i-T operator's manual, multiple repetitive cycle; LinuxCNC 2.9 manual, G70, G71 and G72. Left out: fillets (A) and chamfers
(C) between the moves of a contour of LinuxCNC.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

from lathesim.errors import Fault
from lathesim.program.cycles import (
    EPSILON,
    MICRON,
    CycleStep,
    carry_out,
    check_count,
    ignored_word,
    length,
    rapids,
    readings_elsewhere,
    retract,
    retract_of,
    without_nose,
)
from lathesim.program.dialects import Dialect
from lathesim.program.meanings import Meaning
from lathesim.program.modal import Modal, Point
from lathesim.program.motions import check_feed, check_plane, go, target
from lathesim.program.moves import LEFT, RIGHT, Event, Made, Move, MoveMode, PlannedMove, planned
from lathesim.program.nose_compensation import beside
from lathesim.program.roughing import Cuts, Roughing, air_side, contour_points, shifted
from lathesim.program.vocabulary import Sorted
from lathesim.program.words import Word
from lathesim.units import in_unit

_CUTS: dict[Meaning, Cuts] = {
    Meaning.ROUGHING_CYCLE: "all", Meaning.POCKETS_LATER: "open", Meaning.POCKETS_ONLY: "pockets",
    Meaning.FACING_CYCLE: "all", Meaning.FACE_POCKETS_LATER: "open", Meaning.FACE_POCKETS_ONLY: "pockets",
}  # fmt: skip
_ACROSS = (Meaning.FACING_CYCLE, Meaning.FACE_POCKETS_LATER, Meaning.FACE_POCKETS_ONLY)
"""Roughing cycles with passes along X."""
CONTOURED = (*_CUTS, Meaning.FINISHING_CYCLE, Meaning.REPEATING_CYCLE)
"""The cycles that run along a contour."""
_NAMED = 8
"""Block numbers that a sentence names."""


def contour_cycle(block: Sorted, modal: Modal, dialect: Dialect, meaning: Meaning) -> Made:
    """Expand the cycle as the dialect has it."""
    if dialect.cycles.contour_in_subprogram:
        return _profile(block, modal, dialect, meaning)
    if meaning is Meaning.FINISHING_CYCLE:
        return _finishing(block, modal, dialect)
    return _repeating(block, modal, dialect) if meaning is Meaning.REPEATING_CYCLE else _roughing(block, modal, dialect, meaning)


# ---- Fanuc ---------------------------------------------------------------------------------------------------------------------------


def _roughing(block: Sorted, modal: Modal, dialect: Dialect, meaning: Meaning) -> Made:
    """G71 and G72 in one block (D) or in two (the first with U or W and R)."""
    words, code, across = modal.roughing, block.codes[meaning].code, meaning in _ACROSS
    if block.words.keys().isdisjoint("PQ"):
        _keep_depth(block, modal, block.take("W" if across else "U"), block.take("R"), code)
        return ()
    first, last = _contour_ends(block, dialect, code)
    word = block.take("D")
    if word is not None:
        back = block.take("R")
        unread = back is None or back.value == 1.0
        for letter in "IKR" if unread else "IK":
            ignored_word(block, letter, code)
        _keep_depth(block, modal, word, None if unread else back, code)
    if words.depth <= 0.0:
        letter = "W" if across else "U"
        raise Fault(f"{code} needs a depth of cut above 0 and has none.", f"Write {code} {letter}2. R0.5 in a block before it, or add D.")
    allow_x, allow_z = _allowances(block, modal)
    start = modal.place
    walked = block.flow.walk(first, last, modal.copied()).moves
    contour = [move for move in walked if move.kind in ("feed", "arc")]
    ways = (abs(walked[0].end_z - walked[0].start_z), abs(walked[0].end_x - walked[0].start_x)) if walked else (0.0, 0.0)
    feeds_in = len(contour) > 1 and walked[0] is contour[0] and contour[0].kind == "feed" and ways[1 if across else 0] < MICRON
    contour = contour[1:] if feeds_in else contour
    if not contour:
        raise _cuts_nothing(code)
    back_by = retract(block, words.retract)
    side = air_side(start, contour, allow_z if across else allow_x, across=across)
    _check_one_way(block, contour, code, across)
    _check_start(block, modal, contour, code, across, side)
    without_nose(block, modal, walked)
    roughing = Roughing(start, tuple(contour), allow_x, allow_z, words.depth, back_by, side, across, feeds_in)
    made = _rough(block, modal, dialect, roughing, code)
    _pass_over(block, first, last, code)
    return made


def _keep_depth(block: Sorted, modal: Modal, depth: Word | None, back: Word | None, code: str) -> None:
    words = modal.roughing
    words.depth = length(block, modal, depth) if depth is not None else words.depth
    words.retract = retract_of(block, modal, back, code) if back is not None else words.retract


def _rough(block: Sorted, modal: Modal, dialect: Dialect, roughing: Roughing, code: str) -> Made:
    """Carry out a roughing cycle whose words have been read."""
    start, across = roughing.start, roughing.across
    extent = max(abs((move.end_z if across else move.end_x) - (start[1] if across else start[0])) for move in roughing.contour)
    check_count(extent / roughing.depth * len(roughing.contour), code)
    check_feed(block, modal, dialect)
    return carry_out(block, modal, roughing.steps(), code, compensated=False)


def _pass_over(block: Sorted, first: int, last: int, code: str) -> None:
    """Skip the contour after a roughing cycle; blocks between the cycle and the contour run, and a warning names them."""
    flow = block.flow
    between = [own.line for own in flow.blocks.blocks[flow.position + 1 : first] if own.words or own.statement is not None]
    if between:
        lines = f"Line {between[0]} stands" if len(between) == 1 else f"Lines {between[0]} to {between[-1]} stand"
        block.warn(
            f"{lines} between {code} and its contour. Here they run after the cycle; controls that continue after the contour skip them. "
            "Move them before the cycle or after the contour."
        )
    flow.passed |= set(range(first, last + 1))


def _finishing(block: Sorted, modal: Modal, dialect: Dialect) -> Made:
    """G70: the contour once along itself, with its own feeds, and back to the start.

    U and W of Haas's G70, which programs copy from G71, leave no allowance.
    """
    code = block.codes[Meaning.FINISHING_CYCLE].code
    first, last = _contour_ends(block, dialect, code)
    for word in block.takes("UW").values():
        if word.value != 0.0:
            block.warn(f"{word.text} of {code} leaves no allowance; the finishing cycle cuts the contour itself.")
    start, motion = modal.place, (modal.modes.motion, modal.modes.motion_code)
    walked = block.flow.walk(first, last, modal)
    modal.modes.motion, modal.modes.motion_code = motion
    made: list[PlannedMove | Event] = []
    for place, move in enumerate(walked.moves):
        made += [event for event in walked.events if event.before_move == place]
        made.append(planned(move.in_mode(cycle=code, cycle_line=block.line)))
    made += [event for event in walked.events if event.before_move == len(walked.moves)]
    return [*made, go(block, modal, "rapid", start, mode=MoveMode(cycle=code))]


def _repeating(block: Sorted, modal: Modal, dialect: Dialect) -> Made:
    """G73: the whole contour again and again, nearer each time."""
    words, code = modal.roughing, block.codes[Meaning.REPEATING_CYCLE].code
    if block.words.keys().isdisjoint("PQ"):
        relief = block.takes("UW")
        x, z = (length(block, modal, relief[letter]) if letter in relief else 0.0 for letter in "UW")
        words.relief = (x, z)
        _set_passes(modal, block.take("R"), code, otherwise=1)
        return ()
    first, last = _contour_ends(block, dialect, code)
    allow = _allowances(block, modal)
    relief = block.takes("IK")
    if relief:
        x, z = (modal.metres(relief[letter].value) if letter in relief else 0.0 for letter in "IK")
        words.relief = (x, z)
    _set_passes(modal, block.take("D"), code, otherwise=words.passes)
    if words.relief == (0.0, 0.0):
        fact = f"{code} has no distance from the contour to begin at, and cuts all in one pass."
        block.warn(f"{fact} Write U, W and R in a {code} before it.")
    start = modal.place
    contour = block.flow.walk(first, last, modal.copied()).moves
    if not contour:
        raise _cuts_nothing(code)
    without_nose(block, modal, contour)
    check_feed(block, modal, dialect)
    side = air_side(start, contour, allow[0] or words.relief[0], across=False)
    if words.relief[0] * side < 0.0:
        block.warn(f"The relief of {code} goes into the part, so its first pass cuts too deep. Change the sign of U or I.")
    out = side * max(side * start[0], *(side * point[0] for point in contour_points(contour)[1:]))
    steps: list[CycleStep] = []
    for number in range(words.passes):
        share = 1.0 - (number / (words.passes - 1) if words.passes > 1 else 1.0)
        dx, dz = allow[0] + share * words.relief[0], allow[1] + share * words.relief[1]
        steps += [shifted(move, dx, dz) for move in contour]
        steps += rapids((out + dx, steps[-1].end[1]), (out + dx, start[1] + dz), (start[0] + dx, start[1] + dz))
    made = carry_out(block, modal, [*steps, *rapids(start)], code, compensated=False)
    _pass_over(block, first, last, code)
    return made


def _set_passes(modal: Modal, word: Word | None, code: str, otherwise: int) -> None:
    modal.roughing.passes = max(1, round(word.value)) if word is not None else otherwise
    check_count(float(modal.roughing.passes), code)


def _allowances(block: Sorted, modal: Modal) -> Point:
    x, z = block.take("U"), block.take("W")
    return modal.across(x.value) if x is not None else 0.0, modal.metres(z.value) if z is not None else 0.0


def _contour_ends(block: Sorted, dialect: Dialect, code: str) -> tuple[int, int]:
    """Return the places of the blocks that P and Q name, looked for from the cycle on, else from the beginning."""
    p, q, flow = block.take("P"), block.take("Q"), block.flow
    if p is None or q is None:
        fact = f"{code} needs P and Q, the first and the last block of its contour{readings_elsewhere(block, dialect)}."
        raise Fault(fact, f"Write it as {code} P10 Q20.")
    if block.number and block.number == str(round(p.value)):
        raise Fault(f"{p.text} of {code} names the block it stands in.", "P names the first block of the contour, behind the cycle.")
    places = sorted(flow.numbered(p.value), key=lambda place: (place < flow.position, place))
    first = next((place for place in places if place != flow.position), None)
    if first is None:
        raise _no_block(block, p, code)
    ends = flow.numbered(q.value)
    if q.value != p.value and ends and max(ends) < first:
        raise Fault(f"The last block of the contour, {q.text} of {code}, stands before the first, {p.text}.", "Swap P and Q.")
    last = next((place for place in ends if place >= first), None)
    if last is None:
        raise _no_block(block, q, code)
    return first, last


def _cuts_nothing(code: str) -> Fault:
    return Fault(f"The contour of {code} cuts nothing.", "Write it with G1, G2 and G3 behind its first block.")


def _no_block(block: Sorted, word: Word, code: str) -> Fault:
    known = [own.number for own in block.flow.blocks.blocks if own.number]
    names = f"It has N{', N'.join(known[:_NAMED])}{' and more' if len(known) > _NAMED else ''}." if known else "It has no N numbers."
    return Fault(f"{word.text} of {code} names a block N{round(word.value)} that is not there.", names)


# ---- LinuxCNC ------------------------------------------------------------------------------------------------------------------------


def _profile(block: Sorted, modal: Modal, dialect: Dialect, meaning: Meaning) -> Made:
    """Expand LinuxCNC's G70 to G72.2: Q names the subprogram of the contour; I is the depth, R the retract, D the allowance.

    All lengths except X are radii, also in G7. Source: LinuxCNC 2.9, interp_g7x.cc.
    """
    code, across, finishes = block.codes[meaning].code, meaning in _ACROSS, meaning is Meaning.FINISHING_CYCLE
    check_plane(modal, dialect, code)
    if not modal.modes.absolute:
        raise Fault(f"{code} does not go with incremental positions.", f"Write {dialect.code_for(Meaning.ABSOLUTE)} before it.")
    words = block.takes("QDEIPRUW")
    value = {letter: modal.metres(word.value) for letter, word in words.items()}
    if modal.turret.nose is not None and not finishes:
        raise Fault(f"{code} does not go with nose compensation.", "Write G40 before it.")
    start = target(block, modal, dialect)
    contour = _subprogram_contour(block, modal, dialect, words.get("Q"), start, code)
    left_or_right, distance = _left_or_right(start, contour), value.get("D", 0.0)
    if finishes:
        passes = round(words["P"].value) if "P" in words else 1
        check_count(float(passes) * len(contour), code)
        check_feed(block, modal, dialect)
        if start == modal.place:
            _check_over(block, modal, start, contour, code)
        made = [go(block, modal, "rapid", start, compensated=False, mode=MoveMode(cycle=code))] if start != modal.place else []
        steps: list[CycleStep] = []
        for number in range(passes, 0, -1):
            near = value.get("E", 0.0)
            along = beside(contour, left_or_right, (number - 1) * (distance - near) / passes + near)
            steps += rapids(start, (along[0].start_x, along[0].start_z))
            steps += [shifted(move) for move in along]
        return [*made, *carry_out(block, modal, steps, code)]
    depth = value.get("I", modal.metres(1.0))
    if depth <= 0.0:
        raise Fault(f"{code} needs a depth of cut above 0.", f"Write it as {code} Q100 I1.")
    along = beside(contour, left_or_right, distance)
    side = air_side(start, contour, value.get("W" if across else "U", 0.0), across=across)
    _check_one_way(block, along, code, across)
    _check_allowance(block, code, across, side)
    approach = carry_out(block, modal, rapids(start), code)
    back = retract_of(block, modal, words["R"], code) if "R" in words else modal.metres(0.5)
    for letter, taken in (("I", depth), ("R", back)):
        if letter not in words:
            block.assume(f"{letter} of {code}", f"{in_unit(taken, 'mm', 'g')}, as in LinuxCNC")
    if distance < 0.0:
        block.warn(f"D of {code} is below 0 and cuts beyond the contour. Change its sign.")
    allow_x, allow_z = value.get("U", 0.0), value.get("W", 0.0)
    roughing = Roughing(start, tuple(along), allow_x, allow_z, depth, back, side, across, cuts=_CUTS[meaning], returns=False)
    return [*approach, *_rough(block, modal, dialect, roughing, code)]


def _subprogram_contour(block: Sorted, modal: Modal, dialect: Dialect, q: Word | None, start: Point, code: str) -> list[Move]:
    """Return the contour in a subprogram after its first move, which approaches it from ``start``; its variables are local."""
    flow, found = block.flow, block.flow.structure()
    if q is None or f"{q.value:g}" not in found.subs:
        fact = f"{code} needs Q, the number of the subprogram with its contour{readings_elsewhere(block, dialect)}."
        fact = fact if q is None else f"There is no subprogram O{q.value:g} for {code}."
        raise Fault(fact, f"Write the contour from O100 SUB to O100 ENDSUB, and {code} Q100.")
    first = found.subs[f"{q.value:g}"]
    own = modal.copied()
    own.x, own.z = start
    flow.variables.enter({})
    moves = flow.walk(first + 1, found.partner[first] - 1, own).moves
    flow.variables.leave()
    walked = [move for move in moves if move.length > MICRON]
    if len(walked) < 2:
        raise Fault(f"The contour of {code} cuts nothing.", "Its first block approaches the contour, the others follow it.")
    if modal.turret.nose is None and any(move.mode.nose is not None for move in walked):
        block.warn(f"Nose compensation in the contour of {code} does nothing in LinuxCNC. Write it before G70.")
    return [replace(move.in_mode(nose=None), kind="feed" if move.kind == "rapid" else move.kind) for move in walked[1:]]


def _check_over(block: Sorted, modal: Modal, start: Point, contour: list[Move], code: str) -> None:
    """Warn of a cycle that begins over its contour, at the end of the previous cycle: its rapid to the first point crosses the part."""
    points = contour_points(contour)
    first, last = points[0], points[-1]
    if min((start[1] - first[1]) * (last[1] - first[1]), (start[0] - first[0]) * (last[0] - first[0])) > MICRON**2:
        x, z = modal.here
        block.warn(
            f"{code} begins at X {in_unit(x, 'mm', '.6g')} (radius), Z {in_unit(z, 'mm', '.6g')}, over its contour, and its rapid to "
            "the first point crosses the part. Add X and Z of a point in front of the contour."
        )


def _left_or_right(start: Point, contour: list[Move]) -> int:
    """Return the side of a contour, looking along it, on which a tool at ``start`` [m] waits: the sign of the enclosed area decides."""
    points = [start, *contour_points(contour), start]
    return LEFT if sum(here[1] * there[0] - there[1] * here[0] for here, there in itertools.pairwise(points)) > 0.0 else RIGHT


# ---- checks --------------------------------------------------------------------------------------------------------------------------


def _check_start(block: Sorted, modal: Modal, contour: list[Move], code: str, across: bool, side: float) -> None:
    """Warn of a cycle that begins inside the depths of its contour, or whose allowance cuts into the contour."""
    depths = [depth for move in contour for depth in ((move.start_z, move.end_z) if across else (move.start_x, move.end_x))]
    start = modal.z if across else modal.x
    _check_allowance(block, code, across, side)
    if min(depths) + MICRON < start < max(depths) - MICRON:
        axis, double = ("Z", 1.0) if across else ("X", 2.0 if modal.modes.diameter else 1.0)
        begin, low, high = (f"{1e3 * double * depth:.6g}" for depth in (start, min(depths), max(depths)))
        fact = f"{code} begins at {axis} {begin} mm, inside its contour from {low} to {high} mm."
        block.warn(f"{fact} Begin it outside; its rapid moves return there.")


def _check_allowance(block: Sorted, code: str, across: bool, side: float) -> None:
    """Warn of an allowance that is taken off the part."""
    allowance = block.words.get("W" if across else "U")
    if allowance is not None and allowance.value * side < 0.0:
        way = f"{'+' if side < 0.0 else '-'}{'Z' if across else 'X'}"
        block.warn(f"{allowance.text} of {code} cuts into the contour, because the tool works towards {way}. Change its sign.")


def _check_one_way(block: Sorted, contour: list[Move], code: str, across: bool) -> None:
    """Warn of a contour that goes back: no turning tool follows it."""
    places = [contour[0].start_x if across else contour[0].start_z, *((move.end_x if across else move.end_z) for move in contour)]
    ways = [there - here for here, there in itertools.pairwise(places) if abs(there - here) > EPSILON]
    if any(way * ways[0] < 0.0 for way in ways):
        block.warn(f"The contour of {code} goes back along {'X' if across else 'Z'}; a tool may not reach what lies behind.")
