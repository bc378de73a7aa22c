"""Blocks of words to moves and events: ``interpret(blocks, dialect)``.

The steps of a block run in a fixed order, whatever the order of its words: comment, feed mode, F, S, T, M3 to M5, M7 to M9, dwell, plane,
units, distance mode, non-modal codes, motion, stops. Anything a block says and no step uses is refused.

Source: NIST RS274NGC Interpreter version 3, table 8 (order of execution); LinuxCNC 2.9 rs274 for what the manuals leave open.
Left out: O-words and the cycles of other dialects (refused by name, see ``meanings``); nose radii and work offsets are taken as zero,
and that is said.
"""

from __future__ import annotations

import math
from dataclasses import replace

from lathesim.errors import ProgramError
from lathesim.program.cycle_blocks import Cycles
from lathesim.program.dialects import Dialect, dialect_named
from lathesim.program.meanings import Group, Meaning
from lathesim.program.moves import Program
from lathesim.program.vocabulary import check_vocabulary, other_readings, sort_block
from lathesim.program.words import Block, Blocks, Warned, Word

TURRET_STATIONS = 12  # assumed: a common turret; a tool number beyond it is a slip
DEEPEST_CALL = 4  # Source: Fanuc 0i-T operator's manual, subprogram nesting
MOST_CALLS = 9999  # repeats of one call. Source: the same
MOST_RUNS = 100_000  # runs of subprograms in one program, assumed: far more than any part needs, and done in seconds
_REVOLUTION = 2.0 * math.pi


def interpret(
    blocks: Blocks,
    dialect: str | Dialect = "paper",
    *,
    start: tuple[float, float] | None = None,
    stations: int = TURRET_STATIONS,
) -> Program:
    """Give the moves, events and warnings of a program.

    ``start`` is where the tool stands at first (x, z) [m], without it the dialect's; ``stations`` how many tools the
    turret holds. Raises :class:`ProgramError` with ``file:line``, the word, what is wrong and what to do.
    """
    table = dialect if isinstance(dialect, Dialect) else dialect_named(dialect)
    check_vocabulary(blocks, table)
    return _Interpreter(blocks, table, table.start if start is None else start, stations).program()


class _Interpreter(Cycles):
    """Runs the steps of every block in their order; ``depth`` counts the subprograms under way, ``runs`` all of them."""

    depth = 0
    runs = 0

    def program(self) -> Program:
        """Run every block and give the program."""
        self.run_blocks()
        self.close()
        self.note_assumptions()
        return Program(self.blocks.name, self.dialect.name, tuple(self.moves), tuple(self.events), tuple(self.warnings), self.assumed)

    def run_blocks(self) -> None:
        """Run one block after the other, up to the end or the return from a subprogram."""
        for position, block in enumerate(self.blocks.blocks):
            self.position = position
            if position in self.passed:
                continue
            moves_before = len(self.moves)
            self.run_block(block)
            if not self.moves or moves_before == 0:
                self.say_groups()
            if self.has(Meaning.SUBPROGRAM_END):
                return

    def subprogram(self) -> None:
        """M98 P n L k calls the program O n k times; P 30012 calls O0012 three times."""
        if self.has(Meaning.SUBPROGRAM_END) and self.depth == 0:
            code = self.block.codes[Meaning.SUBPROGRAM_END].text
            raise self.error(f"{code} in the main program would repeat it without end.", "Write M30; M99 ends a subprogram.")
        if not self.has(Meaning.SUBPROGRAM):
            return
        code, p, repeats = self.block.codes[Meaning.SUBPROGRAM].text, self.take("P"), self.take("L")
        if p is None or p.value < 0.0 or p.value != math.floor(p.value):
            raise self.error(f"{code} needs the number of a program.", f"Write it as {code} P0012.")
        number, times = int(p.value), 1 if repeats is None else int(repeats.value)
        if number not in self.blocks.subprograms and number > 9999 and repeats is None:
            number, times = number % 10_000, number // 10_000
        if number not in self.blocks.subprograms:
            known = ", ".join(f"O{key:04d}" for key in self.blocks.subprograms)
            remedy = f"It has {known}." if known else "Write it behind the M30 of the main program, from its O number to M99."
            raise self.error(f"{code} calls the program O{number:04d}, which the file does not have.", remedy)
        if self.depth >= DEEPEST_CALL:
            raise self.error(f"{code} calls more than {DEEPEST_CALL} programs deep.", "A program may not call itself.")
        if not 0 <= times <= MOST_CALLS:
            raise self.error(f"{code} repeats {times} times.", f"Repeat at most {MOST_CALLS} times.")
        kept = (self.blocks, self.block, self.block_number, self.used, self.position, self.passed)
        self.depth += 1
        for _ in range(times):
            self.runs += 1
            if self.runs > MOST_RUNS:
                raise self.error(f"Subprograms are run more than {MOST_RUNS} times.", "Repeat less often.")
            self.blocks, self.passed = replace(self.blocks, blocks=self.blocks.subprograms[number]), set()
            self.run_blocks()
            self.blocks = kept[0]
        self.depth -= 1
        self.blocks, self.block, self.block_number, self.used, self.position, self.passed = kept

    def run_block(self, block: Block) -> None:
        """Run the steps of a block in their order."""
        self.block = sort_block(block, self.dialect, self.blocks.place(block.line))
        self.block_number, self.used = block.number.lstrip("0"), set()
        for step in (
            self.comment, self.feed_mode, self.feed, self.spindle_speed, self.tool, self.spindle, self.coolant, self.dwell, self.units,
            self.compensation, self.distance, self.once, self.motion, self.spindle_behind, self.subprogram, self.stops, self.unused,
        ):  # fmt: skip
            step()

    def compensation(self) -> None:
        """G41, G42 and further work offsets are read; both are taken as zero, and that is said."""
        if self.has(Meaning.COMPENSATION_ON):
            code = self.block.codes[Meaning.COMPENSATION_ON].text
            self.take("D")
            self.assumed["nose_compensation"] = "a nose radius of 0: the tool point runs along the programmed path"
            self.warn(f"{code} is read with a nose radius of 0: the tool point runs along the programmed path.")
        if self.has(Meaning.OFFSET_OTHER):
            self.assumed["work_offsets"] = "all zero"
            self.warn(f"{self.block.codes[Meaning.OFFSET_OTHER].text} is read with an offset of 0.")

    def comment(self) -> None:
        """(MSG, text) is a message to the operator."""
        for comment in self.block.comments:
            if comment[:4].upper() == "MSG,":
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
        if self._feed_is_lead():
            return
        word = self.take("F")
        if word is None:
            return
        if word.value < 0.0:
            raise self.error(f"{word.text} is a negative feed.", "Give the feed without a sign; the end point says the direction.")
        self.no_units_change(word)
        length = self.modal.metres(word.value)
        self.modal.feed = length if self.modal.per_revolution else length / 60.0
        self.modal.feed_line = self.block.line

    def _feed_is_lead(self) -> bool:
        """Say whether F of this block is the lead of a thread."""
        leads = (Meaning.THREAD_BY_FEED, Meaning.THREADING_CYCLE_SIMPLE, Meaning.THREADING_CYCLE)
        own = self.block.of_group(Group.MOTION)
        return own in leads or (own is None and self.modal.motion in leads)

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
            if word is None or mode is not None or "X" in self.block.words or "Z" in self.block.words:
                code = self.block.codes[Meaning.SPINDLE_LIMIT].text
                raise self.error(
                    f"{code} is read as the spindle speed limit, and takes one S word, and no X, Z, G96 or G97.",
                    f"Write it as {code} S2000.",
                )
            modal.limit = word.value * _REVOLUTION / 60.0
            return
        if mode is not None:
            surface = mode is Meaning.SURFACE_SPEED
            code = self.block.codes[mode].text
            if word is None and surface:
                raise self.error(f"{code} needs a surface speed and has none.", f"Add an S word in m/min, for example {code} S150.")
            if word is None and modal.surface:
                raise self.error(f"{code} needs a spindle speed and has none.", f"Add an S word in rpm, for example {code} S1000.")
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

    def tool(self) -> None:
        """T and M6; where the dialect changes at T, the digits before the last two are the tool."""
        modal = self.modal
        word = self.take("T")
        if word is not None:
            if word.value < 0.0 or word.value != math.floor(word.value):
                raise self.error(f"{word.text} is no tool number.", "Tools count from 1 up.")
            number = int(word.value)
            if self.dialect.tool_changes_at_t and number >= 100:
                number //= 100
            if number > self.stations:
                raise self.error(f"{word.text} asks for tool {number}, and the turret has {self.stations}.", "Use a tool of the turret.")
            modal.tool_ready = number
            self.assumed["tools"] = f"a turret of {self.stations}, all tools of the same length"
        if self.has(Meaning.TOOL_CHANGE) and modal.tool_ready is None:
            code = self.block.codes[Meaning.TOOL_CHANGE].text
            raise self.error(f"{code} changes the tool and no T word has named one.", f"Write it as T1 {code}.")
        if self.has(Meaning.TOOL_CHANGE) or (word is not None and self.dialect.tool_changes_at_t):
            modal.tool = modal.tool_ready
            self.event("tool", tool=modal.tool)

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
        for meaning in (Meaning.CLAMP_OPEN, Meaning.CLAMP_CLOSE, Meaning.CHIP_CONVEYOR, Meaning.OVERRIDE, Meaning.PATH_BLENDED):
            if self.has(meaning):
                self.warn(f"{self.block.codes[meaning].text} ({meaning}) changes nothing in the simulation.")
        if self.has(Meaning.CYCLE_RETURN):
            word = self.block.codes[Meaning.CYCLE_RETURN]
            self.warn(f"{word.text} ({Meaning.CYCLE_RETURN}) changes nothing in the simulation; {other_readings(word.code, self.dialect)}.")
        if self.has(Meaning.PATH_BLENDED):
            self.take("P")
            self.take("Q")

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
        self.add("dwell", (self.modal.x, self.modal.z), seconds=word.value * allowed[given[0]])

    def units(self) -> None:
        """Inch or millimetre."""
        meaning = self.block.of_group(Group.UNITS)
        if meaning is not None:
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

    def once(self) -> None:
        """Origin shift and return to the reference point."""
        modal = self.modal
        if self.has(Meaning.SHIFT_OFF):
            modal.shift_x = modal.shift_z = 0.0
        elif self.has(Meaning.SHIFT):
            x, z = self.take("X"), self.take("Z")
            if x is None and z is None:
                raise self.error(f"{self.block.codes[Meaning.SHIFT].text} shifts the origin and names no axis.", "Add an X or a Z word.")
            if x is not None:
                modal.shift_x = modal.x - modal.metres(x.value) * (0.5 if modal.diameter else 1.0)
            if z is not None:
                modal.shift_z = modal.z - modal.metres(z.value)
        elif self.has(Meaning.HOME):
            named = [letter for letter in ("X", "Z", "U", "W") if letter in self.block.words]
            if named:
                self.add("rapid", self.target())
            x_home = not named or "X" in named or "U" in named
            z_home = not named or "Z" in named or "W" in named
            zero = self.dialect.machine_zero
            self.assumed["reference_point"] = f"X{1e3 * zero[0]:g} Z{1e3 * zero[1]:g} mm, X as a radius"
            self.add("rapid", (zero[0] if x_home else modal.x, zero[1] if z_home else modal.z))

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

    def unused(self) -> None:
        """Refuse the first word that nothing has used."""
        for letter, word in self.block.words.items():
            if letter not in self.used and not (letter == "O" and self.dialect.program_number):
                raise self.error(
                    f"{word.text} has no code in its block that uses it ({self.dialect.letters[letter]}).", "Take it out, or add the code."
                )

    def close(self) -> None:
        """A program without an end is refused or warned of, as the dialect has it."""
        if self.blocks.ending or not any(block.words for block in self.blocks.blocks):
            return
        if self.dialect.end_required:
            raise ProgramError(
                "The program has no end.",
                place=self.blocks.place(self.blocks.last_line),
                remedy="Write M2 or M30 in its last block; it may be cut short.",
            )
        self.warnings.append(Warned(self.blocks.last_line, "The program ends without M02 or M30."))

    def say_groups(self) -> None:
        """Keep in mind which modal groups the program names before or with its first move."""
        for group in (Group.UNITS, Group.DISTANCE, Group.FEED_MODE, Group.PLANE, Group.DIAMETER):
            if self.block.of_group(group) is not None:
                self.modal.said.add(group)

    def note_assumptions(self) -> None:
        """Name what the program leaves open and how it was taken."""
        said = self.modal.said
        zero = self.start
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
