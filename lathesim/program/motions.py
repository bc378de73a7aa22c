"""The motions of a block: end points, arcs, feeds, threads, with the memory they need.

The interpreter runs the other steps of a block around them; see ``interpreter`` for their order.
Source: NIST RS274NGC Interpreter version 3, section 3.5; LinuxCNC 2.9 rs274 for what the manuals leave open.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from lathesim.errors import ProgramError
from lathesim.program.arcs_and_corners import CORNER_LETTERS, Corner, arc_by_centre, arc_by_radius, broken, corner_of, end_at_angle
from lathesim.program.dialects import Dialect
from lathesim.program.meanings import Group, Meaning
from lathesim.program.modal import Modal
from lathesim.program.moves import Arc, Event, EventKind, Move, MoveKind, MoveMode, Moves
from lathesim.program.vocabulary import Codes, Sorted, other_readings
from lathesim.program.words import Block, Blocks, Warned, Word
from lathesim.units import in_unit

_ARCS = (Meaning.ARC_CLOCKWISE, Meaning.ARC_COUNTERCLOCKWISE)
_PLAIN = frozenset({Meaning.RAPID, Meaning.LINE, *_ARCS})
"""Motions other than cycles."""
_TURN = 360.0
_LONG_LEAD = 0.05
"""[m] a lead above it is rather a feed per minute or a number of threads per inch, assumed: threads with many starts stay below."""


class Motions:
    """Carries the motions of one block after the other into ``moves``; ``block`` is the present one, ``used`` the letters it has used."""

    def __init__(self, blocks: Blocks, dialect: Dialect, start: tuple[float, float], stations: int) -> None:
        self.blocks = blocks
        self.dialect = dialect
        self.stations = stations
        self.start = start
        self.modal = Modal(start[0], start[1], diameter=dialect.x_is_diameter, per_revolution=dialect.per_revolution)
        self.modal.motion = dialect.first_motion
        self.modal.motion_code = self.code_for(dialect.first_motion) if dialect.first_motion is not None else ""
        self.moves = Moves()
        self.events: list[Event] = []
        self.warnings: list[Warned] = list(blocks.warnings)
        self.assumed: dict[str, str] = {}
        self.used: set[str] = set()
        self.block = Sorted(0, "", {}, {}, ())
        self.block_number = ""
        self._axes = tuple({"X": "X", "Z": "Z", **(dialect.incremental or {})}.items())
        self._numbers: dict[int, dict[float, list[int]]] = {}
        self._known: dict[tuple[Word, ...], Codes] = {}
        self.passed: set[int] = set()
        self.walking = False
        self.contours: dict[int, tuple[Move, ...]] = {}
        self.corner: Corner | None = None

    # ---- small tools of the steps ------------------------------------------------------------------------------------------------

    def error(self, fact: str, remedy: str) -> ProgramError:
        """An error at the place of the present block."""
        return ProgramError(fact, place=self.block.place, remedy=remedy)

    def has(self, meaning: Meaning) -> bool:
        """Whether the block has a code of this meaning."""
        return meaning in self.block.codes

    def take(self, letter: str) -> Word | None:
        """The word of this letter, marked as used."""
        word = self.block.words.get(letter)
        if word is not None:
            self.used.add(letter)
        return word

    def code_for(self, *meanings: Meaning) -> str:
        """The dialect's code for the first of these meanings that it has."""
        return next((code for meaning in meanings for code, own in self.dialect.codes.items() if own is meaning), "")

    def readings(self, word: Word) -> str:
        """What a code means in other dialects, as ``; in the dialect 'paper' it means millimetres``, or nothing."""
        others = other_readings(word.code, self.dialect)
        return f"; {others}" if others else ""

    def numbered(self, number: float) -> list[int]:
        """Return the indices of the blocks of the current program with this N number."""
        found = self._numbers.get(id(self.blocks.blocks))
        if found is None:
            found = self._numbers[id(self.blocks.blocks)] = {}
            for place, block in enumerate(self.blocks.blocks):
                if block.number:
                    found.setdefault(float(block.number), []).append(place)
        return found.get(number, [])

    def event(self, kind: EventKind, *, direction: int = 0, tool: int | None = None, text: str = "") -> None:
        """Note something that happens before the next move."""
        self.events.append(Event(kind, self.block.line, len(self.moves), direction, tool, text))

    def warn(self, sentence: str) -> None:
        """Note a warning once."""
        if all(warned.sentence != sentence for warned in self.warnings):
            self.warnings.append(Warned(self.block.line, sentence))

    # ---- motions -----------------------------------------------------------------------------------------------------------------

    def cycle(self) -> bool:
        """Carry out the cycle of the block; say whether there was one."""
        return False

    def run_block(self, block: Block) -> None:
        """Run the steps of a block."""
        raise NotImplementedError

    def motion(self) -> None:
        """The motion of the block, by its own code or by the one in force."""
        modal, block = self.modal, self.block
        meaning = block.of_group(Group.MOTION)
        if (meaning or modal.motion) not in _PLAIN and self.cycle():
            return
        if meaning is not None:
            modal.motion, modal.motion_code = meaning, block.codes[meaning].code
        axes = [letter for letter, _ in self._axes if letter in block.words and letter not in self.used]
        if not axes and not (modal.motion in _ARCS and any(letter in block.words for letter in "IJKR")):
            if self.has(Meaning.MACHINE_COORDINATES):
                raise self.error(f"{block.codes[Meaning.MACHINE_COORDINATES].text} names no axis.", "Add an X or a Z word.")
            if meaning is Meaning.THREAD:
                raise self.error(f"{modal.motion_code} names no end point.", "Add a Z word.")
            if meaning in _ARCS:
                raise self.no_centre()
            return
        if modal.motion is None or modal.motion is Meaning.MOTION_OFF:
            first = block.words[axes[0]].text
            why = "none is set yet" if modal.motion is None else f"{modal.motion_code} has ended the one before"
            raise self.error(f"{first} needs a motion code and {why}.", "Write G0 or G1 in front of it.")
        if Meaning.MACHINE_COORDINATES in block.codes:
            self.check_machine_coordinates(block.codes[Meaning.MACHINE_COORDINATES].text)
        if modal.motion in _ARCS:
            self.arc(bool(axes))
        elif modal.motion is Meaning.RAPID:
            self.add("rapid", self.target())
        elif modal.motion is Meaning.LINE:
            self.check_feed()
            corner = self.own_corner()
            self.add("feed", self.line_end(), feed=modal.feed, per_revolution=modal.per_revolution)
            self.corner = corner
        else:
            self.thread()

    def own_corner(self) -> Corner | None:
        """The chamfer or rounding that the block has between its end and the next move."""
        if ",C" not in self.dialect.letters or self.block.words.keys().isdisjoint(CORNER_LETTERS):
            return None
        words = [word for letter in CORNER_LETTERS if (word := self.take(letter)) is not None]
        if words[0].value == 0.0 or (words[0].letter.startswith(",") and words[0].value < 0.0) or len(words) > 1:
            raise self.error(f"{words[0].text} is no size of a corner, or there are two.", "Give one of ,C and ,R above 0.")
        return corner_of(words[0], self.modal.metres(words[0].value), self.block.place)

    def line_end(self) -> tuple[float, float]:
        """The end point (x, z) of a straight feed [m], which an angle and one of X and Z may tell as well."""
        words = self.block.words
        angle = (self.take(",A") or self.take("A")) if ",A" in self.dialect.letters and (",A" in words or "A" in words) else None
        if angle is None:
            return self.target()
        start = (self.modal.x, self.modal.z)
        given = [axis for axis, letters in (("X", "XU"), ("Z", "ZW")) if any(letter in words for letter in letters)]
        if len(given) != 1:
            raise self.error(f"{angle.text} is the angle of a line whose end is named by X and Z.", "Give one of X and Z beside an angle.")
        end = end_at_angle(start, self.target(), angle.value, x_given=given == ["X"])
        if end is None:
            raise self.error(f"A line at {angle.text} does not get to that {given[0]}.", "Correct the angle: it counts from +Z towards +X.")
        return end

    def target(self, incremental: Mapping[str, str] | None = None) -> tuple[float, float]:
        """Return the end point (x, z) of the block [m], X as a radius; ``incremental`` letters are added to those of the dialect."""
        modal, words = self.modal, self.block.words
        scale = 0.5 if modal.diameter else 1.0
        x, z = modal.x, modal.z
        machine = self.has(Meaning.MACHINE_COORDINATES)
        zero = self.dialect.machine_zero if machine else modal.zero
        for letter, axis in self._axes if incremental is None else (*self._axes, *incremental.items()):
            if letter not in words:
                continue
            self.used.add(letter)
            absolute = letter == axis and (modal.absolute or machine)
            value = modal.metres(words[letter].value) * (scale if axis == "X" else 1.0)
            if axis == "X":
                x = zero[0] + value if absolute else x + value
            else:
                z = zero[1] + value if absolute else z + value
        return x, z

    def arc(self, moves_axes: bool) -> None:
        """G2, G3 by radius or by centre."""
        modal, block = self.modal, self.block
        self.check_plane(modal.motion_code)
        code, clockwise = modal.motion_code, modal.motion is Meaning.ARC_CLOCKWISE
        i, j, k, r = (self.take(letter) for letter in "IJKR")
        if j is not None and j.value != 0.0:
            raise self.error(f"{j.text} is an arc centre along Y, and this lathe has no Y.", "Take it out; I goes along X and K along Z.")
        if r is not None and (i is not None or k is not None):
            other = i or k
            raise self.error(
                f"{code} has both {r.text} and {other.text if other else ''}.", "Give the radius with R, or the centre with I and K."
            )
        if r is None and i is None and k is None:
            raise self.no_centre()
        self.check_feed()
        start = (modal.x, modal.z)
        if r is not None:
            if not moves_axes:
                raise self.error(f"{code} with R names no end point.", "Add X and Z words.")
            end = self.target()
            arc = arc_by_radius(start, end, modal.metres(r.value), clockwise, block.place, code)
        else:
            if modal.arc_absolute and (i is None or k is None):
                raise self.error(f"{code} needs both I and K while arc centres are absolute.", "Add the missing one, or write G91.1.")
            zero = modal.zero if modal.arc_absolute else start
            end = self.target()
            centre = (zero[0] + modal.metres(i.value if i else 0.0), zero[1] + modal.metres(k.value if k else 0.0))
            arc = arc_by_centre(start, end, centre, clockwise, block.place, code)
        self.add("arc", end, feed=modal.feed, per_revolution=modal.per_revolution, arc=arc)

    def check_plane(self, code: str) -> None:
        """Raise :class:`ProgramError` for a code that needs the XZ plane while another plane is in force."""
        if self.modal.plane is not Meaning.PLANE_XZ:
            plane = self.code_for(self.modal.plane)
            raise self.error(f"{code} needs the plane of X and Z, but {plane} is in force.", "Write G18 before it.")

    def no_centre(self) -> ProgramError:
        """The error of an arc without I, K and R."""
        return self.error(
            f"{self.modal.motion_code} needs I and K, or R, and has none of them.", "Give the centre with I and K, or the radius with R."
        )

    def thread(self) -> None:
        """G33: K is the lead along the path."""
        lead, angle = self.lead_along(Meaning.THREAD), self.start_angle()
        self.add("thread", self.target(), feed=lead, per_revolution=True, start_angle=angle)

    def lead_along(self, meaning: Meaning) -> float:
        """Return the lead along the path [m] that K gives G33 and G33.1; the previous lead holds if the code is not repeated."""
        modal = self.modal
        word = self.take("K")
        code = modal.motion_code
        if word is not None:
            if word.value <= 0.0:
                raise self.error(f"{word.text} is no lead.", "Give the lead of the thread above 0, for example K1.5.")
            modal.lead = self.told_lead(word)
        if modal.lead is None or (word is None and self.has(meaning)):
            raise self.error(f"{code} needs a lead and has none.", "Add a K word, for example K1.5.")
        self.check_thread(code)
        return modal.lead

    def told_lead(self, word: Word) -> float:
        """Return the lead of a thread [m] that a word gives; one that looks like a feed per minute is warned of."""
        lead = self.modal.metres(word.value)
        if lead > _LONG_LEAD:
            self.warn(f"{word.text} is a lead of {in_unit(lead, 'mm', '.6g')} per revolution here. Check that it is no feed per minute.")
        return lead

    def check_thread(self, code: str) -> None:
        """A thread needs a turning spindle, and one of constant speed.

        Source: Fanuc 0i-T operator's manual, constant lead threading: G97 for scroll and taper threads.
        """
        if not self.modal.turning:
            raise self.error(f"{code} follows the spindle, and the spindle stands still.", "Turn it on with M3 and an S word.")
        if self.modal.surface:
            self.warn(f"{code} threads at constant surface speed, so the spindle changes its speed with X. Write G97 with S before it.")

    def start_angle(self) -> float:
        """Return the angle [rad] from the index of the spindle to the start of a thread; it holds only for its block."""
        letter, unit = self.dialect.start_angle
        word = self.take(letter)
        if word is None:
            return 0.0
        degrees = abs(word.value) * unit
        half = f"{letter}{180.0 / unit:.0f}"
        if unit < 1.0 and ("." in word.text or word.value < 0.0):
            raise self.error(
                f"{word.text} is not a start angle of a thread.", f"It is an integer in units of {unit:g} degree: {half} is half a turn."
            )
        if degrees > _TURN:
            raise self.error(f"{word.text} is a start angle of {degrees:g} degrees, more than a turn.", f"Write {half} for half a turn.")
        if 0.0 < degrees < 1.0:
            self.warn(f"{word.text} is a start angle of {degrees:g} degrees. Write {half} for half a turn.")
        if word.value < 0.0:
            self.warn(f"The sign of {word.text} is ignored: the thread begins {degrees:g} degrees behind the index.")
        if self.moves and self.moves[-1].kind == "thread":
            self.warn(f"{word.text} changes nothing: the thread continues the previous one.")
        if unit == 1.0:
            self.assumed["start_angle"] = f"{letter} of a thread as in LinuxCNC 2.10; 2.9 refuses it"
        return math.radians(degrees)

    def check_machine_coordinates(self, code: str) -> None:
        """Machine coordinates go with absolute rapids and straight feeds only."""
        if self.modal.motion not in (Meaning.RAPID, Meaning.LINE):
            raise self.error(f"{code} goes with G0 and G1 only, and {self.modal.motion_code} is in force.", "Write G0 or G1 in its block.")
        if not self.modal.absolute:
            raise self.error(f"{code} names machine coordinates and positions are incremental.", "Write G90 before it.")

    def check_feed(self) -> None:
        """A feed move needs a feed, and per revolution a turning spindle."""
        modal = self.modal
        per_revolution = modal.per_revolution
        if not modal.feed:
            mode = self.code_for(Meaning.PER_REVOLUTION if per_revolution else Meaning.PER_MINUTE)
            example = f"Add an F word, for example {'F0.2' if per_revolution else 'F120'} with {mode}."
            why = f"the feed of line {modal.feed_line} is 0" if modal.feed is not None else modal.feed_lost or "none is set yet"
            raise self.error(f"{modal.motion_code} needs a feed and {why}.", example)
        if per_revolution and not modal.turning:
            other = self.code_for(Meaning.PER_MINUTE)
            raise self.error(
                f"{modal.motion_code} feeds per revolution and the spindle stands still.",
                f"Turn it on with {'M3' if modal.speed else 'M3 and an S word'}, or use {other}.",
            )
        if not modal.turning:
            self.warn("The tool feeds while the spindle stands still.")

    def add(
        self,
        kind: MoveKind,
        end: tuple[float, float],
        *,
        feed: float | None = None,
        per_revolution: bool = False,
        seconds: float = 0.0,
        arc: Arc | None = None,
        line: int | None = None,
        cycle: str = "",
        cycle_line: int = 0,
        compensated: bool = True,
        start_angle: float = 0.0,
        spin_back: bool = False,
    ) -> None:
        """Append a move and go to its end (x, z) [m]; only those that are ``compensated`` follow the nose compensation in force."""
        modal = self.modal
        line = self.block.line if line is None else line
        nose = modal.nose if compensated else None
        if nose is not None and kind == "thread":
            self.warn("Nose compensation does not act on threads; the tool point follows them.")
            nose = None
        mode = MoveMode(modal.spindle, per_revolution, seconds, modal.tool, cycle, cycle_line, nose, start_angle, spin_back)
        self.moves.add(kind, line, (modal.x, modal.z), end, feed, arc, mode)
        modal.x, modal.z = end
        corner, self.corner = self.corner, None
        if corner is not None and len(self.moves) > 1:
            self.moves.replace_last(2, broken(self.moves[-2], self.moves[-1], corner))
