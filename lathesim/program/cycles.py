"""Canned cycles: what all of them need to become moves, and the cycles of single passes and of grooving.

The single-pass cycles G90, G92 and G94 of system A go in, along, out and back. ``taper`` is the word R: how far the start of the cut lies
from its end. The grooving and pecking cycles G74 (along Z) and G75 (across) go in by steps, a little back, on, out, and aside.

Source: Fanuc 0i-T operator's manual, canned cycle (outer and inner diameter cutting, thread cutting, end face turning), end face peck
drilling cycle and outer diameter drilling cycle. Left out: the relief at the bottom.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from lathesim.errors import Fault
from lathesim.program.dialects import Dialect
from lathesim.program.meanings import HOLES, Group, Meaning
from lathesim.program.modal import Modal, Point
from lathesim.program.motions import check_feed, check_thread, go, lead_of, start_angle, target
from lathesim.program.moves import Arc, Event, Made, Move, MoveKind, MoveMode, PlannedMove
from lathesim.program.vocabulary import AXES, Sorted, other_readings
from lathesim.program.words import Word
from lathesim.units import in_unit

SINGLE = (Meaning.TURNING_CYCLE_SIMPLE, Meaning.THREADING_CYCLE_SIMPLE, Meaning.FACING_CYCLE_SIMPLE)
PECKING = (Meaning.FACE_GROOVING_CYCLE, Meaning.GROOVING_CYCLE)
REPEATED = frozenset({*SINGLE, *HOLES, Meaning.RIGID_TAPPING, Meaning.THREAD_BY_FEED})
"""The cycles that a block with an axis word repeats."""
RETRACT = 0.5e-3
"""[m] how far a cycle withdraws where the program does not say, assumed: a common setting of controls."""
EPSILON = 1e-9
"""[m] below this, two places are one."""
MICRON = 1e-6
"""[m] up to which coordinates are rounded; also the smallest unit of millimetres. Source: Fanuc 0i-T, least input increment."""
_TENTH = 2.54e-6
"""[m] one unit of a number without a decimal point in inches. Source: Fanuc 0i-T, least input increment."""
_DEEPEST = 0.1
"""[m] from this on, a depth of a cycle without a decimal point is one in smallest units, assumed: nobody cuts 100 mm deep."""
_SLIGHT = 10e-6
"""[m] below this, a step that a number without a decimal point gives is a slip, assumed: no tool cuts so little."""
_MOST_STEPS = 200_000


@dataclass(frozen=True)
class CycleStep:
    """A rapid, a feed, an arc or a thread to ``end``, or a dwell of ``seconds``.

    A thread has a ``lead`` [m] along the path. ``spin`` is the spindle speed over the speed in force: below zero the spindle is reversed,
    and a thread is then the way out of a tapped hole.
    """

    kind: MoveKind
    end: Point
    arc: Arc | None = None
    lead: float | None = None
    seconds: float = 0.0
    spin: float = 1.0


def rapids(*ends: Point) -> list[CycleStep]:
    """Return rapids to these places."""
    return [CycleStep("rapid", end) for end in ends]


def feeds(*ends: Point) -> list[CycleStep]:
    """Return feeds to these places."""
    return [CycleStep("feed", end) for end in ends]


def carry_out(
    block: Sorted,
    modal: Modal,
    steps: Iterable[CycleStep],
    code: str,
    *,
    compensated: bool = True,
    start_angle: float = 0.0,
    keep: bool = False,
) -> list[PlannedMove | Event]:
    """Return the moves of a cycle, with nose compensation if ``compensated``; moves without length are left out unless ``keep``.

    Its threads begin at ``start_angle`` [rad].
    """
    if not compensated:
        without_nose(block, modal)
    made: list[PlannedMove | Event] = []
    direction, speed = modal.spindle.direction, modal.spindle.speed
    for step in steps:
        if step.arc is None and step.kind != "dwell" and step.end == (modal.x, modal.z) and not keep:
            continue
        made += _spin(block, modal, step.spin, direction, speed)
        is_thread = step.kind == "thread"
        feed, per_revolution = (step.lead, True) if is_thread else (modal.feed.value, modal.feed.per_revolution)
        if step.kind in ("rapid", "dwell"):
            feed, per_revolution = None, False
        made.append(
            go(
                block, modal, step.kind, step.end, feed=feed, arc=step.arc, compensated=compensated,
                mode=MoveMode(
                    per_revolution=per_revolution, seconds=step.seconds, cycle=code, start_angle=start_angle if is_thread else 0.0,
                    spin_back=is_thread and step.spin < 0.0,
                ),
            )
        )  # fmt: skip
    return made + _spin(block, modal, 1.0, direction, speed)


def _spin(block: Sorted, modal: Modal, share: float, direction: int, speed: float | None) -> list[PlannedMove | Event]:
    """Turn the spindle at a ``share`` of a speed; a negative share reverses it."""
    spindle, wanted = modal.spindle, direction if share > 0.0 else -direction if share < 0.0 else 0
    turns = wanted != spindle.direction
    spindle.direction, spindle.speed = wanted, speed if speed is None or abs(share) in (0.0, 1.0) else abs(share) * speed
    return [Event("spindle", block.line, direction=wanted)] if turns else []


def without_nose(block: Sorted, modal: Modal, contour: Iterable[Move] = ()) -> None:
    """Note that a cycle does not follow the nose compensation, in force or in its contour."""
    if modal.turret.nose is not None or any(move.mode.nose is not None for move in contour):
        block.assume("nose_in_cycles", "G70 and single passes follow it; all other cycles run without it")


def check_count(count: float, code: str) -> None:
    """Refuse a cycle of more passes than are laid out."""
    if not count < _MOST_STEPS:
        raise Fault(f"{code} would make more than {_MOST_STEPS} passes.", "Take a larger depth of cut.")


def begun(block: Sorted, modal: Modal, meaning: Meaning) -> bool:
    """Return whether the block itself has the code of a cycle, which is then in force."""
    if not block.has(meaning):
        return False
    modal.modes.motion, modal.modes.motion_code = meaning, block.codes[meaning].code
    return True


def readings_elsewhere(block: Sorted, dialect: Dialect) -> str:
    """Return what the motion code of a block means in other dialects, as ``; in the dialect 'paper' it means millimetres``, or nothing."""
    meaning = block.of_group(Group.MOTION)
    others = "" if meaning is None else other_readings(block.codes[meaning].code, dialect)
    return f"; {others}" if others else ""


# ---- words ---------------------------------------------------------------------------------------------------------------------------


def in_steps(word: Word, modal: Modal) -> float:
    """Return a length of a cycle [m]: without a decimal point it counts in the smallest unit of the control."""
    return modal.metres(word.value) if "." in word.text else word.value * (_TENTH if modal.modes.inch else MICRON)


def length(block: Sorted, modal: Modal, word: Word) -> float:
    """Return a length of a cycle that is written with and without a point [m]: a large one without counts in the smallest unit."""
    whole = modal.metres(word.value)
    if "." in word.text or abs(whole) < _DEEPEST:
        return whole
    before = block.flow.assumed.get("numbers_without_point", "").split(" of ")[0].split(", ")
    words = ", ".join(dict.fromkeys([*filter(None, before), word.text]))
    block.assume("numbers_without_point", f"{words} of a cycle, in the smallest unit of the control")
    return in_steps(word, modal)


def retract_of(block: Sorted, modal: Modal, word: Word, code: str) -> float:
    """Return how far a cycle withdraws [m], which has no sign."""
    found = length(block, modal, word)
    if found < 0.0:
        raise Fault(f"{word.text} of {code} is a retract below 0, which goes into the part.", "Give it without a sign.")
    return found


def retract(block: Sorted, programmed: float | None, cut: float = RETRACT) -> float:
    """Return the retract of a cycle [m]: the programmed one, or an assumed one that is never longer than one ``cut`` [m]."""
    if programmed is not None:
        return programmed
    block.assume("cycle_retract", f"{in_unit(RETRACT, 'mm', 'g')} if a cycle does not say, never more than one peck")
    return min(RETRACT, cut)


def ignored_word(block: Sorted, letter: str, code: str) -> None:
    """Warn that a word of a cycle changes nothing here."""
    word = block.take(letter)
    if word is not None:
        block.warn(f"{word.text} of {code} changes nothing in the simulation.")


# ---- single passes -------------------------------------------------------------------------------------------------------------------


def single_pass(block: Sorted, modal: Modal, dialect: Dialect, meaning: Meaning) -> Made:
    """G90, G92 and G94 of system A."""
    start, words = modal.place, modal.thread
    if begun(block, modal, meaning):
        words.taper, words.end = 0.0, start
    code, across = modal.modes.motion_code, meaning is Meaning.FACING_CYCLE_SIMPLE
    if block.words.keys().isdisjoint(AXES):
        fact = f"{code} is a cycle here and names no end point{readings_elsewhere(block, dialect)}."
        raise Fault(fact, "Add X and Z words, or take it out.")
    word = block.take("R") or block.take("K" if across else "I")
    words.taper = length(block, modal, word) if word is not None else words.taper
    from_start = {letter for letter in ("UW" if modal.modes.absolute else AXES) if letter in block.words}
    end = words.end or start
    modal.x, modal.z = start[0] if from_start & {"U", "X"} else end[0], start[1] if from_start & {"W", "Z"} else end[1]
    words.end = end = target(block, modal, dialect)
    modal.x, modal.z = start
    if (start[0] == end[0] if across else start[1] == end[1]) and words.taper == 0.0:
        axis = "X" if across else "Z"
        block.warn(f"{code} ends at the {axis} where it begins, and cuts nothing. Add {axis}.")
    if meaning is Meaning.THREADING_CYCLE_SIMPLE:
        check_thread(block, modal, code)
        lead = lead_of(block, modal, "FE")
        if words.chamfer == 0.0:
            block.assume("thread_run_out", f"none at the end of {code}, because no block of G76 sets one")
        begin = (end[0] + words.taper, start[1])
        cut = thread_with_run_out(begin, end, lead, words.chamfer * lead, 1.0 if start[0] >= end[0] else -1.0)
        steps = [*rapids(begin), *cut, *rapids((start[0], end[1]), start)]
        return carry_out(block, modal, steps, code, compensated=False, start_angle=start_angle(block, dialect))
    check_feed(block, modal, dialect)
    begin, out = (
        ((start[0], end[1] + words.taper), (end[0], start[1])) if across else ((end[0] + words.taper, start[1]), (start[0], end[1]))
    )
    return carry_out(block, modal, [*rapids(begin), *feeds(end, out), *rapids(start)], code)


def thread_by_feed(block: Sorted, modal: Modal, dialect: Dialect, meaning: Meaning) -> Made:
    """G32: one thread move, its lead in F counted along the longer axis."""
    begun(block, modal, meaning)
    check_thread(block, modal, modal.modes.motion_code)
    lead, angle = lead_of(block, modal, "FE"), start_angle(block, dialect)
    begin, end = modal.place, target(block, modal, dialect)
    if end == begin:
        raise Fault(f"{modal.modes.motion_code} names no end point.", "Add a Z word.")
    return [go(block, modal, "thread", end, feed=lead_along_path(begin, end, lead), mode=MoveMode(per_revolution=True, start_angle=angle))]


def thread_with_run_out(begin: Point, end: Point, lead: float, chamfer: float, outside: float) -> list[CycleStep]:
    """Return a thread that runs out over its last ``chamfer`` [m] along Z, at 45 degrees to the side ``outside`` of X, in one motion.

    Without a chamfer, or with a chamfer as long as the thread, there is no run-out.
    """
    along, length = lead_along_path(begin, end, lead), abs(end[1] - begin[1])
    if not 0.0 < chamfer < length:
        return [CycleStep("thread", end, lead=along)]
    share = 1.0 - chamfer / length
    leave = (begin[0] + share * (end[0] - begin[0]), begin[1] + share * (end[1] - begin[1]))
    out = (leave[0] + outside * chamfer, end[1])
    return [CycleStep("thread", leave, lead=along), CycleStep("thread", out, lead=lead_along_path(leave, out, lead))]


def lead_along_path(begin: Point, end: Point, lead: float) -> float:
    """Return the lead along the path [m] of a thread whose ``lead`` [m] is counted along its longer axis, as F of G32 and G92."""
    across, along = abs(end[0] - begin[0]), abs(end[1] - begin[1])
    longer = max(across, along)
    return lead * math.hypot(across, along) / longer if longer > 0.0 else lead


# ---- grooving ------------------------------------------------------------------------------------------------------------------------


def peck_grooves(block: Sorted, modal: Modal, dialect: Dialect, meaning: Meaning) -> Made:
    """G74 and G75, in two blocks (R alone, then the cycle with P and Q) or in one (I and K)."""
    words, code, across = modal.roughing, block.codes[meaning].code, meaning is Meaning.GROOVING_CYCLE
    if block.words.keys().isdisjoint(AXES):
        word = block.take("R")
        words.peck_retract = retract_of(block, modal, word, code) if word is not None else words.peck_retract
        return ()
    step_x, step_z = _step(block, modal, "P", "I", code), _step(block, modal, "Q", "K", code)
    ignored_word(block, "R", code)
    start, end = modal.place, target(block, modal, dialect)
    if step_x < 0.0 or step_z < 0.0:
        raise Fault(f"{code} has a step below 0.", "Give steps without a sign; the end point says the direction.")
    check_feed(block, modal, dialect)
    step, aside = (step_x, step_z) if across else (step_z, step_x)
    back = retract(block, words.peck_retract, step or RETRACT)
    ways = (abs(end[0] - start[0]), abs(end[1] - start[1]))
    deep, wide = ways if across else ways[::-1]
    if wide > MICRON and not aside:
        block.warn(f"{code} has no step to the side and cuts at both ends only. Add {'Q or K' if across else 'P or I'}.")
    check_count((deep / step if step else 1.0) * (wide / aside + 1.0 if aside else 2.0), code)
    return carry_out(block, modal, pecking(start, end, across=across, step=step, aside=aside, retract=back), code, compensated=False)


def _step(block: Sorted, modal: Modal, letter: str, other: str, code: str) -> float:
    """Return a step of a cycle [m], of ``letter`` in the smallest unit without a point; one too small to be meant is warned of."""
    word, plain = block.take(letter), block.take(other)
    if word is None:
        return 0.0 if plain is None else modal.metres(plain.value)
    found = in_steps(word, modal)
    if "." not in word.text and 0.0 < found < _SLIGHT:
        units = 1.0 / (_TENTH / 0.0254 if modal.modes.inch else MICRON / 1e-3)
        meant = f"{word.letter}{word.value * units:.0f} for {word.value:g} {'inch' if modal.modes.inch else 'mm'}"
        block.warn(f"{word.text} of {code} is a step of {in_unit(found, 'mm', 'g')}, as it has no point. Write {meant}.")
    return found


def pecking(start: Point, end: Point, *, across: bool, step: float, aside: float, retract: float) -> list[CycleStep]:
    """Return the cycle: pecks of ``step`` along Z (along X with ``across``), withdrawn by ``retract``, repeated every ``aside`` [m].

    No retract is longer than the depth cut so far, so the tool does not move back beyond the start.
    """
    deep, wide = (0, 1) if across else (1, 0)
    steps: list[CycleStep] = []
    depths = _places(start[deep], end[deep], step)[1:]
    for place in _places(start[wide], end[wide], aside):
        steps += rapids(_point(across, start[deep], place))
        for number, depth in enumerate(depths):
            steps += feeds(_point(across, depth, place))
            if number < len(depths) - 1:
                back = math.copysign(min(retract, abs(depth - start[deep])), start[deep] - end[deep])
                steps += rapids(_point(across, depth + back, place))
        steps += rapids(_point(across, start[deep], place))
    return [*steps, *rapids(start)]


def _places(begin: float, end: float, step: float) -> list[float]:
    """Return the places from begin to end, ``step`` apart and the last at the end; all at once without a step."""
    way = end - begin
    if abs(way) < EPSILON:
        return [begin]
    count = max(1, -int(-(abs(way) - EPSILON) // step)) if step > 0.0 else 1
    sign = 1.0 if way > 0.0 else -1.0
    return [begin, *(begin + sign * step * number for number in range(1, count)), end]


def _point(across: bool, depth: float, place: float) -> Point:
    return (depth, place) if across else (place, depth)
