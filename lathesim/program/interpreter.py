"""Blocks of words to moves and events: ``interpret(blocks, dialect)``.

The steps of a block run in a fixed order, whatever the order of its words: comment, feed mode, F, S, T, M3 to M5, M7 to M9, dwell, plane,
units, distance mode, non-modal codes, motion, stops. Anything a block says and no step uses is refused.

Source: NIST RS274NGC Interpreter version 3, table 8 (order of execution); LinuxCNC 2.9 rs274 for what the manuals leave open.
Left out: the cycles of other dialects (refused by name, see ``meanings``).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import replace

from lathesim.errors import ProgramError
from lathesim.program.dialects import DIALECTS, Dialect, dialect_named
from lathesim.program.meanings import HOLES, Group, Meaning
from lathesim.program.moves import CUTTING, KINDS, Event, Moves, Program, Tool
from lathesim.program.nose_compensation import compensated
from lathesim.program.offsets import Offsets
from lathesim.program.vocabulary import Sorted, check_statements, other_readings, sort_block
from lathesim.program.words import Block, Blocks, Warned, Word

TURRET_STATIONS = 12  # assumed: a common turret; a tool number beyond it is a slip
_REVOLUTION = 2.0 * math.pi


def interpret(
    blocks: Blocks,
    dialect: str | Dialect = "paper",
    *,
    start: tuple[float, float] | None = None,
    stations: int = TURRET_STATIONS,
    tools: Mapping[int, Tool] | None = None,
    strict: bool = False,
) -> Program:
    """Return the moves, events and warnings of a program.

    ``start`` is where the tool stands at first (x, z) [m], without it the dialect's; ``stations`` how many tools the
    turret holds. ``tools`` gives their noses and offsets, else they have none. With ``strict`` codes that do
    nothing here are refused. Raises :class:`ProgramError` with ``file:line``, the word, what is wrong and what to do.
    """
    table = dialect if isinstance(dialect, Dialect) else dialect_named(dialect)
    check_statements(blocks, table)
    interpreter = _Interpreter(blocks, table, table.start if start is None else start, stations)
    interpreter.modal.tools.update(tools or {})
    interpreter.strict = strict
    return interpreter.program()


_LEADS = frozenset({Meaning.THREAD_BY_FEED, Meaning.THREADING_CYCLE_SIMPLE, Meaning.THREADING_CYCLE})
"""Codes beside which F is a lead."""


class _Interpreter(Offsets):
    """Runs the steps of every block in their order; ``moved`` says whether there was a move yet."""

    moved = False
    drills = False
    _only_moves = frozenset({Meaning.RAPID, Meaning.LINE, Meaning.ARC_CLOCKWISE, Meaning.ARC_COUNTERCLOCKWISE})

    def program(self) -> Program:
        """Run every block and give the program."""
        self._steps = (
            self.comment, self.feed_mode, self.feed, self.spindle_speed, self.tool, self.spindle, self.coolant, self.builders, self.dwell,
            self.plane, self.units, self.compensation, self.distance, self.once, self.motion, self.spindle_behind, self.subprogram,
            self.stops, self.unused,
        )  # fmt: skip
        self._motion_steps = (self.feed, self.motion, self.unused)
        self._macro_steps = (self.comment, self.subprogram, self.unused)
        self.structure()
        self.drills = any(
            self.dialect.codes.get(word.code) in HOLES
            for block in self.blocks.shapes.values()
            for word in block.words
            if word.letter == "G"
        )
        self.run_blocks()
        if self.corner is not None:
            raise ProgramError(f"{self.corner.text} has no move behind it.", place=self.corner.place, remedy="Take it out.")
        self.close()
        self.note_assumptions()
        moves, events = self._compensated()
        contours = tuple(move for walked in self.contours.values() for move in walked)
        return Program(self.blocks.name, self.dialect.name, moves, events, tuple(self.warnings), self.assumed, contours)

    def _steps_of(self, block: Sorted) -> tuple[Callable[[], object], ...]:
        """Return the steps that a block may need; one that only moves needs three."""
        if (
            self._only_moves.issuperset(block.codes)
            and not block.builders
            and not any(_says(comment) for comment in block.comments)
            and "S" not in block.words
            and "T" not in block.words
        ):
            return self._motion_steps
        return self._macro_steps if Meaning.MACRO_CALL in block.codes else self._steps

    def _compensated(self) -> tuple[Moves, tuple[Event, ...]]:
        """Return moves and events with the nose compensation carried out."""
        if all(mode.nose is None for mode in self.moves.modes):
            return self.moves, tuple(self.events)
        made = compensated(list(self.moves), self.blocks.name)
        places = [0, *itertools.accumulate(len(moves) for moves in made)]
        events = tuple(replace(event, before_move=places[event.before_move]) for event in self.events)
        return Moves(replace(move, nose=None) for moves in made for move in moves), events

    def run_block(self, block: Block) -> None:
        """Run the steps of a block in their order."""
        if block.assignments or block.computed:
            block = self.computed(block)
        own = self.block = sort_block(block, self.blocks, self.dialect, self._known)
        self.block_number, self.used = block.number.lstrip("0"), set()
        if not (own.codes or own.words or own.comments or own.builders):
            return
        for step in self._steps_of(own):
            step()
        if not self.moved:
            self.say_groups()
            self.moved = bool(self.moves)

    def comment(self) -> None:
        """(MSG, text) is a message to the operator."""
        for comment in self.block.comments:
            if _says(comment):
                self.event("message", text=comment[4:].strip())

    def feed_mode(self) -> None:
        """A change between feed per minute and per revolution drops F: 5 mm/min must not become 5 mm per revolution."""
        mode = self.block.of_group(Group.FEED_MODE)
        if mode is None or self.modal.per_revolution == (mode is Meaning.PER_REVOLUTION):
            return
        self.modal.per_revolution = mode is Meaning.PER_REVOLUTION
        if self.modal.feed is not None:
            self.modal.feed_lost = f"{self.block.codes[mode].code} in line {self.block.line} dropped the one of line {self.modal.feed_line}"
        self.modal.feed = None

    def feed(self) -> None:
        """F in mm or inch per minute or per revolution."""
        if "F" not in self.block.words or self._feed_is_lead():
            return
        word = self.block.words["F"]
        self.used.add("F")
        if word.value < 0.0:
            raise self.error(f"{word.text} is a negative feed.", "Give the feed without a sign; the end point says the direction.")
        self.no_units_change(word)
        length = self.modal.metres(word.value)
        self.modal.feed = length if self.modal.per_revolution else length / 60.0
        self.modal.feed_line = self.block.line

    def _feed_is_lead(self) -> bool:
        """Return whether F of this block is the lead of a thread."""
        return (self.block.of_group(Group.MOTION) or self.modal.motion) in _LEADS

    def no_units_change(self, word: Word) -> None:
        """F and surface speeds in the very block that changes the units: controls differ, so it is refused."""
        units = self.block.of_group(Group.UNITS)
        if units is not None and self.modal.inch != (units is Meaning.INCH):
            code = self.block.codes[units].text
            raise self.error(
                f"{word.text} stands in the block in which {code} changes the units, and controls differ in which unit it then has.",
                f"Write {code} in a block before it.",
            )

    def spindle_speed(self) -> None:
        """S and D with G96 and G97, and the spindle limit."""
        modal = self.modal
        mode = self.block.of_group(Group.SPINDLE_MODE)
        word = self.take("S")
        if word is not None and word.value < 0.0:
            raise self.error(f"{word.text} is a negative speed.", "Give it without a sign; M03 and M04 say the direction.")
        if self.has(Meaning.SPINDLE_LIMIT):
            code = self.block.codes[Meaning.SPINDLE_LIMIT].text
            if mode is not None or (word is None and not {"X", "Z", "U", "W"} & set(self.block.words)):
                raise self.error(f"{code} needs the spindle speed limit as an S word, or a position.", f"Write it as {code} S2000.")
            if word is not None:
                modal.limit = word.value * _REVOLUTION / 60.0
            return
        if mode is not None:
            surface = mode is Meaning.SURFACE_SPEED
            code = self.block.codes[mode].text
            if word is None and surface:
                raise self.error(f"{code} needs a surface speed and has none.", f"Add an S word in m/min, for example {code} S150.")
            if word is None and modal.surface and not surface:
                self._keep_speed(code)
            modal.surface = surface
            if surface and self.dialect.surface_limit:
                limit = self.take(self.dialect.surface_limit)
                if limit is not None and limit.value <= 0.0:
                    raise self.error(f"{limit.text} is no speed limit.", "Give it in rpm, above 0.")
                modal.limit = None if limit is None else limit.value * _REVOLUTION / 60.0
        if word is None:
            return
        if modal.surface:
            self.no_units_change(word)
            modal.speed = word.value * (0.3048 if modal.inch else 1.0) / 60.0
        else:
            modal.speed = word.value * _REVOLUTION / 60.0

    def _keep_speed(self, code: str) -> None:
        """G97 without S: Fanuc holds the speed that turned where the tool stands, LinuxCNC reads the number of G96 as rpm."""
        modal = self.modal
        if self.dialect.surface_number_is_speed:
            number = (modal.speed or 0.0) * 60.0 / (0.3048 if modal.inch else 1.0)
            modal.speed = number * _REVOLUTION / 60.0
            self.warn(f"{code} has no S word; the {number:.6g} of the surface speed counts in rpm now.")
            return
        radius = abs(modal.here[0])
        speed = (modal.speed or 0.0) / radius if radius > 0.0 else math.inf
        speed = speed if modal.limit is None else min(speed, modal.limit)
        if math.isinf(speed) or not self.dialect.program_number:
            raise self.error(f"{code} needs a spindle speed and has none.", f"Add an S word in rpm, for example {code} S1000.")
        modal.speed = speed
        self.warn(f"{code} has no S word and holds the speed of {speed * 60.0 / _REVOLUTION:.4g} rpm.")

    def tool(self) -> None:
        """T and M6; where the dialect changes at T, the digits before the last two are the tool."""
        modal = self.modal
        word = self.take("T")
        if word is not None:
            if word.value < 0.0 or word.value != math.floor(word.value):
                raise self.error(f"{word.text} is no tool number.", "Tools count from 1 up.")
            number = int(word.value)
            offset = number
            if self.dialect.tool_changes_at_t and number >= 100:
                number, offset = number // 100, number % 100
            if number > self.stations:
                raise self.error(f"{word.text} asks for tool {number}, and the turret has {self.stations}.", "Use a tool of the turret.")
            modal.tool_ready = number
            self.assumed["tools"] = f"a turret of {self.stations}, all tools of the same length"
        if self.has(Meaning.TOOL_CHANGE) and modal.tool_ready is None:
            code = self.block.codes[Meaning.TOOL_CHANGE].text
            raise self.error(f"{code} changes the tool and no T word has named one.", f"Write it as T1 {code}.")
        if self.has(Meaning.TOOL_CHANGE) or (word is not None and self.dialect.tool_changes_at_t):
            modal.tool = modal.tool_ready
            if self.dialect.change_stops_spindle and modal.direction != 0:
                self.turn_spindle(Meaning.SPINDLE_OFF)
            self.event("tool", tool=modal.tool)
            if word is not None and self.dialect.tool_changes_at_t:
                self.offset_of_tool(offset)

    def spindle(self) -> None:
        """M3 and M4, and M5 where it acts before the motion of its block."""
        meaning = self.block.of_group(Group.SPINDLE)
        if meaning is Meaning.SPINDLE_OFF and self.dialect.spindle_stops_after_motion:
            return
        self.turn_spindle(meaning)

    def spindle_behind(self) -> None:
        """M5 where it acts behind the motion of its block."""
        if self.has(Meaning.SPINDLE_OFF) and self.dialect.spindle_stops_after_motion:
            self.turn_spindle(Meaning.SPINDLE_OFF)

    def turn_spindle(self, meaning: Meaning | None) -> None:
        """Turn the spindle on or off."""
        if meaning is not None:
            self.modal.direction = {Meaning.SPINDLE_FORWARD: 1, Meaning.SPINDLE_REVERSE: -1}.get(meaning, 0)
            self.event("spindle", direction=self.modal.direction)

    def coolant(self) -> None:
        """M7, M8, M9, and codes of the machine that change nothing here."""
        if self.has(Meaning.MIST):
            self.event("mist_on")
        if self.has(Meaning.FLOOD):
            self.event("flood_on")
        if self.has(Meaning.COOLANT_OFF):
            self.event("flood_off")
        for meaning in (
            Meaning.CLAMP_OPEN,
            Meaning.CLAMP_CLOSE,
            Meaning.CHIP_CONVEYOR,
            Meaning.OVERRIDE,
            Meaning.PATH_BLENDED,
            Meaning.LOOK_AHEAD,
            Meaning.MONITORING_OFF,
        ):
            if self.has(meaning):
                self.ignored(self.block.codes[meaning].text, str(meaning))
        if self.has(Meaning.CYCLE_RETURN):
            word = self.block.codes[Meaning.CYCLE_RETURN]
            self.modal.returns_to_plane = word.code == "G99"
            if self.dialect.drills_in_xy and not self.drills:
                told = other_readings(word.code, self.dialect)
                self.warn(f"{word.text} ({Meaning.CYCLE_RETURN}) changes nothing, as no cycle drills; {told}.")
        if self.has(Meaning.PATH_BLENDED) or self.has(Meaning.LOOK_AHEAD):
            for letter in ("P", "Q", "E"):
                self.take(letter)

    def builders(self) -> None:
        """M codes of the machine's builder do nothing here, and that is said."""
        for word in self.block.builders:
            self.ignored(word.text, "a code of the machine's builder")

    def ignored(self, text: str, what: str) -> None:
        """Warn that a word changes nothing in the simulation; with ``strict`` it is refused."""
        if self.strict:
            raise self.error(f"{text} ({what}) does nothing in the simulation, and the program is read strictly.", "Take it out.")
        self.warn(f"{text} ({what}) changes nothing in the simulation.")

    def dwell(self) -> None:
        """A pause; the letter and its unit are the dialect's."""
        if not self.has(Meaning.DWELL):
            return
        code = self.block.codes[Meaning.DWELL].text
        allowed = self.dialect.dwell or {}
        given = [letter for letter in allowed if letter in self.block.words]
        if len(given) != 1:
            fact = f"{code} needs a time and has none." if not given else f"{code} has two times."
            raise self.error(fact, f"Write one, as in {code} {next(iter(allowed))}1.5.")
        word = self.take(given[0])
        if word is None or word.value < 0.0:
            raise self.error(f"{given[0]} of {code} is a negative time.", "A dwell takes 0 s or more.")
        self.add("dwell", (self.modal.x, self.modal.z), seconds=word.value * (1.0 if "." in word.text else allowed[given[0]]))

    def units(self) -> None:
        """Inch or millimetre."""
        meaning = self.block.of_group(Group.UNITS)
        if meaning is not None:
            if self.modal.nose is not None and self.modal.inch != (meaning is Meaning.INCH):
                raise self.error(
                    f"{self.block.codes[meaning].text} changes the units while nose compensation is on.", "Write G40 before it."
                )
            self.modal.inch = meaning is Meaning.INCH

    def distance(self) -> None:
        """Absolute or incremental, for positions and for arc centres; X as diameter or radius."""
        modal = self.modal
        meaning = self.block.of_group(Group.DISTANCE)
        modal.absolute = modal.absolute if meaning is None else meaning is Meaning.ABSOLUTE
        meaning = self.block.of_group(Group.ARC_DISTANCE)
        modal.arc_absolute = modal.arc_absolute if meaning is None else meaning is Meaning.ARC_ABSOLUTE
        meaning = self.block.of_group(Group.DIAMETER)
        modal.diameter = modal.diameter if meaning is None else meaning is Meaning.X_DIAMETER

    def stops(self) -> None:
        """M0, M1, M2, M30; the end of a program turns the spindle off."""
        meaning = self.block.of_group(Group.STOP)
        if meaning is Meaning.STOP:
            self.event("program_stop")
        elif meaning is Meaning.OPTIONAL_STOP:
            self.event("optional_program_stop")
        elif meaning is Meaning.END:
            self.event("spindle")
            self.event("program_end")
            self.ended = not self.walking

    def unused(self) -> None:
        """Refuse the first word that nothing has used."""
        for letter, word in self.block.words.items():
            if letter not in self.used and not (letter == "O" and self.dialect.program_number):
                others = [
                    d for d in DIALECTS.values() if d.letters.get(letter, self.dialect.letters[letter]) != self.dialect.letters[letter]
                ]
                told = f"; in the dialect '{others[0].name}' it is {others[0].letters[letter]}" if others else ""
                fact = f"{word.text} has no code in its block that uses it ({self.dialect.letters[letter]}){told}."
                raise self.error(fact, "Take it out, or add the code.")

    def close(self) -> None:
        """A program without an end is refused or warned of, as the dialect has it."""
        if self.blocks.ending or self.ended or not any(block.words for block in self.blocks.blocks):
            return
        if self.dialect.end_required:
            raise ProgramError(
                "The program has no end.",
                place=self.blocks.place(self.blocks.last_line),
                remedy="Write M2 or M30 in its last block; it may be cut short.",
            )
        if not self.dialect.end_free:
            self.warnings.append(Warned(self.blocks.last_line, "The program ends without M02 or M30."))

    def say_groups(self) -> None:
        """Keep in mind which modal groups the program names before or with its first move."""
        for group in (
            Group.UNITS, Group.DISTANCE, Group.FEED_MODE, Group.PLANE, Group.DIAMETER, Group.SPINDLE_MODE, Group.MOTION,
        ):  # fmt: skip
            if self.block.of_group(group) is not None:
                self.modal.said.add(group)

    def note_assumptions(self) -> None:
        """Name what the program leaves open and how it was taken."""
        said = self.modal.said
        zero = self.start
        if self.blocks.deleted:
            self.assumed["block_delete"] = f"on; lines with / left out: {self.blocks.deleted}"
        self.assumed["start"] = f"X{1e3 * zero[0]:g} Z{1e3 * zero[1]:g} mm, X as a radius"
        if Group.UNITS not in said:
            self.assumed["units"] = "millimetres"
        if Group.DISTANCE not in said:
            self.assumed["distance"] = str(Meaning.ABSOLUTE)
        if Group.FEED_MODE not in said:
            self.assumed["feed_mode"] = str(Meaning.PER_REVOLUTION if self.dialect.per_revolution else Meaning.PER_MINUTE)
        if Group.DIAMETER not in said:
            self.assumed["x_mode"] = "diameter" if self.dialect.x_is_diameter else "radius"
        if Group.PLANE not in said:
            self.assumed["plane"] = str(Meaning.PLANE_XZ)
        if Group.SPINDLE_MODE not in said and self.modal.speed is not None:
            self.assumed["spindle_mode"] = str(Meaning.SPINDLE_SPEED)
        if Group.MOTION not in said and self.dialect.first_motion is not None:
            self.assumed["motion"] = f"{self.dialect.first_motion} until the program says otherwise"
        if self.modal.tool is None and any(KINDS[kind] in CUTTING for kind in set(self.moves.kinds)):
            self.assumed["tool"] = "the one in use, because the program calls none"


def _says(comment: str) -> bool:
    """Return whether a comment is a message to the operator."""
    return comment[:4].upper() == "MSG,"
