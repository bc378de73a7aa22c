"""Blocks of words to moves and events: ``interpret(blocks, dialect)``.

The steps of a block run in a fixed order, whatever the order of its words: comment, feed mode, F, S, T, M3 to M5, M7 to M9, dwell, plane,
units, distance mode, non-modal codes, motion, stops. Each is a function of the block, the modal state and the dialect that returns the
moves it makes. Anything a block says and no step uses is refused.

Source: NIST RS274NGC Interpreter version 3, table 8 (order of execution); LinuxCNC 2.9 rs274 for what the manuals leave open.
Left out: the cycles of other dialects (refused by name, see ``meanings``).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import replace

from lathesim.errors import Fault
from lathesim.program.contour_cycles import CONTOURED, contour_cycle
from lathesim.program.cycles import PECKING, REPEATED, SINGLE, peck_grooves, single_pass, thread_by_feed
from lathesim.program.dialects import DIALECTS, TWO_DIGITS, Dialect, dialect_named
from lathesim.program.flow import Flow, Step, subprogram
from lathesim.program.hole_cycles import hole, rigid_tapping
from lathesim.program.meanings import HOLES, Group, Meaning
from lathesim.program.modal import FeedInForce, Modal, ModesInForce, Turret
from lathesim.program.motions import PLAIN, go, plain_motion
from lathesim.program.moves import CUTTING, KINDS, Event, Made, MoveMode, Moves, Program, Tool
from lathesim.program.nose_compensation import compensated
from lathesim.program.offsets import call_tool, compensation, once, plane
from lathesim.program.threading_cycles import threading_cycle
from lathesim.program.vocabulary import AXES, Sorted, check_statements, drills, other_readings
from lathesim.program.words import Blocks, Warned, Word

TURRET_STATIONS = 12  # assumed: a common turret; a tool number beyond it is a slip
_REVOLUTION = 2.0 * math.pi
_FOOT = 0.3048  # [m]


def interpret(
    blocks: Blocks,
    dialect: str | Dialect = "paper",
    *,
    start: tuple[float, float] | None = None,
    tools: Mapping[int, Tool] | None = None,
    strict: bool = False,
) -> Program:
    """Return the moves, events and warnings of a program.

    ``start`` is where the tool stands at first (x, z) [m], without it the dialect's. ``tools`` gives their noses and
    offsets, else they have none. With ``strict`` codes that do nothing here are refused.

    Raises :class:`ProgramError` with ``file:line``, the word, what is wrong and what to do.
    """
    table = dialect if isinstance(dialect, Dialect) else dialect_named(dialect)
    start = table.start.place if start is None else start
    motion = table.start.motion
    modes = ModesInForce(table.start.x_is_diameter, motion=motion, motion_code=table.code_for(motion))
    modal = Modal(*start, modes, FeedInForce(table.start.per_revolution), Turret(TURRET_STATIONS, dict(tools or {})))
    flow = Flow(blocks, table, modal, _steps_of, strict)
    try:
        check_statements(blocks, table)
        flow.structure()
        flow.run_blocks()
        _close(flow)
        _note_assumptions(flow, start)
        moves, events = _compensated(flow)
    except Fault as fault:
        raise fault.at(blocks.name, blocks.last_line) from None
    contours = tuple(move for walked in flow.contours.values() for move in walked)
    return Program(blocks.name, table.name, moves, events, tuple(flow.warnings), flow.assumed, contours)


def _compensated(flow: Flow) -> tuple[Moves, tuple[Event, ...]]:
    """Return moves and events with the nose compensation carried out."""
    if all(mode.nose is None for mode in flow.moves.modes):
        return flow.moves, tuple(flow.events)
    made = compensated(list(flow.moves))
    places = [0, *itertools.accumulate(len(moves) for moves in made)]
    events = tuple(replace(event, before_move=places[event.before_move]) for event in flow.events)
    return Moves(move.in_mode(nose=None) for moves in made for move in moves), events


def _close(flow: Flow) -> None:
    """Refuse a corner without a move behind it, and refuse or warn of a program without an end, as the dialect has it."""
    blocks, corner = flow.blocks, flow.corner
    if corner is not None:
        raise Fault(f"{corner.text} has no move behind it.", "Take it out.", corner.line)
    if blocks.ending or flow.ended or not any(block.words for block in blocks.blocks):
        return
    if flow.dialect.program.end_required:
        raise Fault("The program has no end.", "Write M2 or M30 in its last block; it may be cut short.")
    if not flow.dialect.program.end_free:
        flow.warnings.append(Warned(blocks.last_line, "The program ends without M02 or M30."))


def _note_assumptions(flow: Flow, start: tuple[float, float]) -> None:
    """Name what the program leaves open and how it was taken."""
    dialect, modal, assumed = flow.dialect, flow.modal, flow.assumed
    if flow.blocks.deleted:
        assumed["block_delete"] = f"on; lines with / left out: {flow.blocks.deleted}"
    assumed["start"] = f"X{1e3 * start[0]:g} Z{1e3 * start[1]:g} mm, X as a radius"
    taken = {
        Group.UNITS: ("units", "millimetres"),
        Group.DISTANCE: ("distance", str(Meaning.ABSOLUTE)),
        Group.FEED_MODE: ("feed_mode", str(Meaning.PER_REVOLUTION if dialect.start.per_revolution else Meaning.PER_MINUTE)),
        Group.DIAMETER: ("x_mode", "diameter" if dialect.start.x_is_diameter else "radius"),
        Group.PLANE: ("plane", str(Meaning.PLANE_XZ)),
        Group.SPINDLE_MODE: ("spindle_mode", "" if modal.spindle.speed is None else str(Meaning.SPINDLE_SPEED)),
        Group.MOTION: ("motion", "" if dialect.start.motion is None else f"{dialect.start.motion} until the program says otherwise"),
    }
    assumed.update(dict(said for group, said in taken.items() if said[1] and group not in modal.said))
    if modal.turret.use is None and any(KINDS[kind] in CUTTING for kind in set(flow.moves.kinds)):
        assumed["tool"] = "the one in use, because the program calls none"


# ---- steps ---------------------------------------------------------------------------------------------------------------------------


def comment(block: Sorted, modal: Modal, dialect: Dialect) -> Made:
    """(MSG, text) is a message to the operator."""
    return [Event("message", block.line, text=text[4:].strip()) for text in block.comments if _says(text)]


def _says(text: str) -> bool:
    """Return whether a comment is a message to the operator."""
    return text.upper().startswith("MSG,")


def feed_mode(block: Sorted, modal: Modal, dialect: Dialect) -> Made:
    """A change between feed per minute and per revolution drops F: 5 mm/min must not become 5 mm per revolution."""
    mode, feed = block.of_group(Group.FEED_MODE), modal.feed
    if mode is None or feed.per_revolution == (mode is Meaning.PER_REVOLUTION):
        return ()
    feed.per_revolution = mode is Meaning.PER_REVOLUTION
    if feed.value is not None:
        feed.lost = f"{block.codes[mode].code} in line {block.line} dropped the one of line {feed.line}"
    feed.value = None
    return ()


_LEADS = frozenset({Meaning.THREAD_BY_FEED, Meaning.THREADING_CYCLE_SIMPLE, Meaning.THREADING_CYCLE})
"""Codes beside which F is a lead."""


def feed(block: Sorted, modal: Modal, dialect: Dialect) -> Made:
    """F in mm or inch per minute or per revolution."""
    if "F" not in block.words or (block.of_group(Group.MOTION) or modal.modes.motion) in _LEADS:
        return ()
    word = block.words["F"]
    block.used.add("F")
    if word.value < 0.0:
        raise Fault(f"{word.text} is a negative feed.", "Give the feed without a sign; the end point says the direction.")
    _check_units(block, modal, word)
    length = modal.metres(word.value)
    modal.feed.value, modal.feed.line = length if modal.feed.per_revolution else length / 60.0, block.line
    return ()


def _check_units(block: Sorted, modal: Modal, word: Word) -> None:
    """Refuse feeds and surface speeds in the very block that changes the units, as controls differ."""
    units = block.of_group(Group.UNITS)
    if units is not None and modal.modes.inch != (units is Meaning.INCH):
        code = block.codes[units].text
        fact = f"{word.text} stands in the block in which {code} changes the units, and controls differ in which unit it then has."
        raise Fault(fact, f"Write {code} in a block before it.")


def spindle_speed(block: Sorted, modal: Modal, dialect: Dialect) -> Made:
    """S and D with G96 and G97, and the spindle limit."""
    spindle, mode, word = modal.spindle, block.of_group(Group.SPINDLE_MODE), block.take("S")
    if word is not None and word.value < 0.0:
        raise Fault(f"{word.text} is a negative speed.", "Give it without a sign; M03 and M04 say the direction.")
    if block.has(Meaning.SPINDLE_LIMIT):
        code = block.codes[Meaning.SPINDLE_LIMIT].text
        if mode is not None or (word is None and block.words.keys().isdisjoint(AXES)):
            raise Fault(f"{code} needs the spindle speed limit as an S word, or a position.", f"Write it as {code} S2000.")
        spindle.limit = spindle.limit if word is None else word.value * _REVOLUTION / 60.0
        return ()
    if mode is not None:
        _set_spindle_mode(block, modal, dialect, mode, word)
    if word is not None and spindle.surface:
        _check_units(block, modal, word)
        spindle.speed = word.value * (_FOOT if modal.modes.inch else 1.0) / 60.0
    elif word is not None:
        spindle.speed = word.value * _REVOLUTION / 60.0
    return ()


def _set_spindle_mode(block: Sorted, modal: Modal, dialect: Dialect, mode: Meaning, word: Word | None) -> None:
    spindle, surface, code = modal.spindle, mode is Meaning.SURFACE_SPEED, block.codes[mode].text
    if word is None and surface:
        raise Fault(f"{code} needs a surface speed and has none.", f"Add an S word in m/min, for example {code} S150.")
    if word is None and spindle.surface and not surface:
        _keep_speed(block, modal, dialect, code)
    spindle.surface = surface
    if surface and dialect.roles.surface_limit:
        limit = block.take(dialect.roles.surface_limit)
        if limit is not None and limit.value <= 0.0:
            raise Fault(f"{limit.text} is no speed limit.", "Give it in rpm, above 0.")
        spindle.limit = None if limit is None else limit.value * _REVOLUTION / 60.0


def _keep_speed(block: Sorted, modal: Modal, dialect: Dialect, code: str) -> None:
    """G97 without S: Fanuc holds the speed that turned where the tool stands, LinuxCNC reads the number of G96 as rpm."""
    spindle = modal.spindle
    if dialect.spindle.surface_number_is_speed:
        number = (spindle.speed or 0.0) * 60.0 / (_FOOT if modal.modes.inch else 1.0)
        spindle.speed = number * _REVOLUTION / 60.0
        block.warn(f"{code} has no S word; the {number:.6g} of the surface speed counts in rpm now.")
        return
    radius = abs(modal.here[0])
    speed = (spindle.speed or 0.0) / radius if radius > 0.0 else math.inf
    speed = speed if spindle.limit is None else min(speed, spindle.limit)
    if math.isinf(speed) or not dialect.spindle.holds_speed:
        raise Fault(f"{code} needs a spindle speed and has none.", f"Add an S word in rpm, for example {code} S1000.")
    spindle.speed = speed
    block.warn(f"{code} has no S word and holds the speed of {speed * 60.0 / _REVOLUTION:.4g} rpm.")


def tool(block: Sorted, modal: Modal, dialect: Dialect) -> Made:
    """T and M6; where the dialect changes at T, the digits before the last two are the tool."""
    turret, word, offset = modal.turret, block.take("T"), 0
    if word is not None:
        if word.value < 0.0 or word.value != math.floor(word.value):
            raise Fault(f"{word.text} is no tool number.", "Tools count from 1 up.")
        number = offset = int(word.value)
        if dialect.tools.change_at_t and number >= TWO_DIGITS:
            number, offset = divmod(number, TWO_DIGITS)
        if number > turret.stations:
            raise Fault(f"{word.text} asks for tool {number}, and the turret has {turret.stations}.", "Use a tool of the turret.")
        turret.ready = number
        block.assume("tools", f"a turret of {turret.stations}, all tools of the same length")
    if block.has(Meaning.TOOL_CHANGE) and turret.ready is None:
        code = block.codes[Meaning.TOOL_CHANGE].text
        raise Fault(f"{code} changes the tool and no T word has named one.", f"Write it as T1 {code}.")
    at_t = word is not None and dialect.tools.change_at_t
    if not at_t and not block.has(Meaning.TOOL_CHANGE):
        return ()
    turret.use = turret.ready
    stops = dialect.spindle.stops_at_change and modal.spindle.direction != 0
    made = [*(_turn(block, modal, Meaning.SPINDLE_OFF) if stops else ()), Event("tool", block.line, tool=turret.use)]
    if at_t:
        call_tool(modal, dialect, offset)
    return made


def spindle(block: Sorted, modal: Modal, dialect: Dialect) -> Made:
    """M3 and M4, and M5 where it acts before the motion of its block."""
    meaning = block.of_group(Group.SPINDLE)
    return () if meaning is Meaning.SPINDLE_OFF and dialect.spindle.stops_after_motion else _turn(block, modal, meaning)


def spindle_behind(block: Sorted, modal: Modal, dialect: Dialect) -> Made:
    """M5 where it acts behind the motion of its block."""
    return _turn(block, modal, Meaning.SPINDLE_OFF) if block.has(Meaning.SPINDLE_OFF) and dialect.spindle.stops_after_motion else ()


def _turn(block: Sorted, modal: Modal, meaning: Meaning | None) -> Made:
    """Turn the spindle on or off."""
    if meaning is None:
        return ()
    modal.spindle.direction = {Meaning.SPINDLE_FORWARD: 1, Meaning.SPINDLE_REVERSE: -1}.get(meaning, 0)
    return [Event("spindle", block.line, direction=modal.spindle.direction)]


_WITHOUT_EFFECT = (
    Meaning.CLAMP_OPEN, Meaning.CLAMP_CLOSE, Meaning.CHIP_CONVEYOR, Meaning.OVERRIDE, Meaning.PATH_BLENDED, Meaning.LOOK_AHEAD,
    Meaning.MONITORING_OFF,
)  # fmt: skip
"""Codes of the machine that change nothing here."""


def coolant(block: Sorted, modal: Modal, dialect: Dialect) -> Made:
    """M7, M8, M9, and codes of the machine or of its builder that change nothing here."""
    for meaning in _WITHOUT_EFFECT:
        if block.has(meaning):
            _ignored(block, block.codes[meaning].text, str(meaning))
    if block.has(Meaning.CYCLE_RETURN):
        word = block.codes[Meaning.CYCLE_RETURN]
        modal.hole.returns_to_plane = word.code == "G99"
        if dialect.cycles.drills_in_xy and not drills(block.flow.blocks, dialect):
            block.warn(f"{word.text} ({Meaning.CYCLE_RETURN}) changes nothing, as no cycle drills; {other_readings(word.code, dialect)}.")
    if block.has(Meaning.PATH_BLENDED) or block.has(Meaning.LOOK_AHEAD):
        block.takes("PQE")
    for word in block.builders:
        _ignored(block, word.text, "a code of the machine's builder")
    events = (("mist_on", Meaning.MIST), ("flood_on", Meaning.FLOOD), ("flood_off", Meaning.COOLANT_OFF))
    return [Event(kind, block.line) for kind, meaning in events if block.has(meaning)]  # type: ignore[arg-type]


def _ignored(block: Sorted, text: str, what: str) -> None:
    """Warn that a word changes nothing in the simulation; a strict reading refuses it."""
    if block.flow.strict:
        raise Fault(f"{text} ({what}) does nothing in the simulation, and the program is read strictly.", "Take it out.")
    block.warn(f"{text} ({what}) changes nothing in the simulation.")


def dwell(block: Sorted, modal: Modal, dialect: Dialect) -> Made:
    """A pause; the letter and its unit are the dialect's."""
    if not block.has(Meaning.DWELL):
        return ()
    code = block.codes[Meaning.DWELL].text
    given = [word for letter in dialect.roles.dwell if (word := block.words.get(letter)) is not None]
    if len(given) != 1:
        fact = f"{code} needs a time and has none." if not given else f"{code} has two times."
        raise Fault(fact, f"Write one, as in {code} {next(iter(dialect.roles.dwell))}1.5.")
    word = given[0]
    block.used.add(word.letter)
    if word.value < 0.0:
        raise Fault(f"{word.letter} of {code} is a negative time.", "A dwell takes 0 s or more.")
    seconds = word.value * (1.0 if "." in word.text else dialect.roles.dwell[word.letter])
    return [go(block, modal, "dwell", modal.place, mode=MoveMode(seconds=seconds))]


def units(block: Sorted, modal: Modal, dialect: Dialect) -> Made:
    """Inch or millimetre."""
    meaning = block.of_group(Group.UNITS)
    if meaning is not None:
        if modal.turret.nose is not None and modal.modes.inch != (meaning is Meaning.INCH):
            raise Fault(f"{block.codes[meaning].text} changes the units while nose compensation is on.", "Write G40 before it.")
        modal.modes.inch = meaning is Meaning.INCH
    return ()


def distance(block: Sorted, modal: Modal, dialect: Dialect) -> Made:
    """Absolute or incremental, for positions and for arc centres; X as diameter or radius."""
    meaning = block.of_group(Group.DISTANCE)
    modal.modes.absolute = modal.modes.absolute if meaning is None else meaning is Meaning.ABSOLUTE
    meaning = block.of_group(Group.ARC_DISTANCE)
    modal.modes.arc_absolute = modal.modes.arc_absolute if meaning is None else meaning is Meaning.ARC_ABSOLUTE
    meaning = block.of_group(Group.DIAMETER)
    modal.modes.diameter = modal.modes.diameter if meaning is None else meaning is Meaning.X_DIAMETER
    return ()


_CYCLES = {
    **dict.fromkeys(SINGLE, single_pass), **dict.fromkeys(PECKING, peck_grooves), **dict.fromkeys(CONTOURED, contour_cycle),
    **dict.fromkeys(HOLES, hole), Meaning.THREADING_CYCLE: threading_cycle, Meaning.RIGID_TAPPING: rigid_tapping,
    Meaning.THREAD_BY_FEED: thread_by_feed,
}  # fmt: skip


def motion(block: Sorted, modal: Modal, dialect: Dialect) -> Made:
    """The motion or cycle of the block, by its own code or by the one in force."""
    meaning = block.of_group(Group.MOTION)
    if (meaning or modal.modes.motion) not in PLAIN:
        if meaning is None and modal.modes.motion in REPEATED and block.moves_an_axis:
            meaning = modal.modes.motion
        if meaning in _CYCLES:
            return _CYCLES[meaning](block, modal, dialect, meaning)
    return plain_motion(block, modal, dialect)


def stops(block: Sorted, modal: Modal, dialect: Dialect) -> Made:
    """M0, M1, M2, M30; the end of a program turns the spindle off."""
    meaning = block.of_group(Group.STOP)
    if meaning is Meaning.END:
        block.flow.ended = not block.flow.walking
        return [Event("spindle", block.line), Event("program_end", block.line)]
    kinds = {Meaning.STOP: "program_stop", Meaning.OPTIONAL_STOP: "optional_program_stop"}
    return [Event(kinds[meaning], block.line)] if meaning is not None else ()  # type: ignore[arg-type]


def unused(block: Sorted, modal: Modal, dialect: Dialect) -> Made:
    """Refuse the first word that nothing has used."""
    for letter, word in block.words.items():
        if letter not in block.used and not (letter == "O" and dialect.program.number):
            carried = dialect.letters[letter]
            other = next((other for other in DIALECTS.values() if other.letters.get(letter, carried) != carried), None)
            elsewhere = f"; in the dialect '{other.name}' it is {other.letters[letter]}" if other is not None else ""
            raise Fault(f"{word.text} has no code in its block that uses it ({carried}){elsewhere}.", "Take it out, or add the code.")
    return ()


STEPS: tuple[Step, ...] = (
    comment, feed_mode, feed, spindle_speed, tool, spindle, coolant, dwell, plane, units, compensation, distance, once, motion,
    spindle_behind, subprogram, stops, unused,
)  # fmt: skip
"""What is done with a block, in this order."""
_MOTION_STEPS: tuple[Step, ...] = (feed, motion, unused)
_MACRO_STEPS: tuple[Step, ...] = (comment, subprogram, unused)


def _steps_of(block: Sorted) -> tuple[Step, ...]:
    """Return the steps that a block may need; one that only moves needs three."""
    plain = PLAIN.issuperset(block.codes) and not block.builders and "S" not in block.words and "T" not in block.words
    if plain and not (block.comments and any(_says(text) for text in block.comments)):
        return _MOTION_STEPS
    return _MACRO_STEPS if block.has(Meaning.MACRO_CALL) else STEPS
