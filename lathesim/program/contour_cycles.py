"""The blocks that call contour cycles: find and run contours, and expand G70 to G73 to moves.

The cycles of LinuxCNC, whose contours are subprograms, are in ``profile_cycles``.
"""

from __future__ import annotations

import copy
import itertools
from collections.abc import Iterable
from dataclasses import dataclass, replace

from lathesim.program.cycles import CycleStep, Point
from lathesim.program.expressions import Variables
from lathesim.program.meanings import Group, Meaning
from lathesim.program.modal import Modal
from lathesim.program.motions import Motions
from lathesim.program.moves import Event, Move, Moves
from lathesim.program.roughing import Roughing, air_side, contour_points
from lathesim.program.statements import Structure
from lathesim.program.words import Word
from lathesim.units import in_unit

ROUGHING = (Meaning.ROUGHING_CYCLE, Meaning.FACING_CYCLE)
RETRACT = 0.5e-3
"""[m] how far a cycle withdraws where the program does not say, assumed: a common setting of controls."""
_NAMED = 8
"""Block numbers that a sentence names."""
_SAME_PLACE = 1e-9
"""Length [m] of a move that goes nowhere: rounding."""
_MICRON = 1e-6
_TENTH = 2.54e-6
"""[m] one unit of a number without a decimal point, in millimetres and in inches. Source: Fanuc 0i-T, least input increment."""
_DEEPEST = 0.1
"""[m] from this on, a depth of a cycle without a decimal point is one in smallest units, assumed: nobody cuts 100 mm deep."""
_SLIGHT = 10e-6
"""[m] below this, a step that a number without a decimal point gives is a slip, assumed: no tool cuts so little."""
_MOST_STEPS = 200_000


@dataclass(frozen=True)
class Walked:
    """A contour as the program would run it: its moves, its events, and the state after its last block."""

    moves: list[Move]
    events: list[Event]
    modal: Modal


class ContourCycles(Motions):
    """Expands the cycles of contours; ``position`` is the place of the present block, ``passed`` the contours that are not run again."""

    position = 0

    # ---- contours ----------------------------------------------------------------------------------------------------------------

    def _roughing(self, meaning: Meaning) -> None:
        """G71 and G72 in one block (D) or in two (the first with U or W and R)."""
        modal, code = self.modal, self.block.codes[meaning].code
        across = meaning is Meaning.FACING_CYCLE
        if not {"P", "Q"} & set(self.block.words):
            depth, retract = self.take("W" if across else "U"), self.take("R")
            modal.cycle_depth = self._told_length(depth) if depth is not None else modal.cycle_depth
            modal.cycle_retract = self._told_retract(retract, code) if retract is not None else modal.cycle_retract
            return
        first, last = self._contour_ends(code)
        word = self.take("D")
        if word is not None:
            modal.cycle_depth = self._told_length(word)
            retract = self.take("R")
            for letter in "IKR" if retract is None or retract.value == 1.0 else "IK":
                self._ignored_word(letter, code)
            if retract is not None and retract.value != 1.0:
                modal.cycle_retract = self._told_retract(retract, code)
        if modal.cycle_depth is None or modal.cycle_depth <= 0.0:
            raise self.error(
                f"{code} needs a depth of cut above 0 and has none.",
                f"Write {code} {'W' if across else 'U'}2. R0.5 in a block before it, or add D.",
            )
        allow_x, allow_z = self._allowances()
        start = (modal.x, modal.z)
        walked = self._walked(first, last).moves
        contour = [move for move in walked if move.kind in ("feed", "arc")]
        ways = (abs(walked[0].end_z - walked[0].start_z), abs(walked[0].end_x - walked[0].start_x)) if walked else (0.0, 0.0)
        feeds_in = len(contour) > 1 and walked[0] is contour[0] and contour[0].kind == "feed" and ways[1 if across else 0] < _MICRON
        contour = contour[1:] if feeds_in else contour
        if not contour:
            raise self.error(f"The contour of {code} cuts nothing.", "Write it with G1, G2 and G3 behind its first block.")
        retract_by = self._retract(modal.cycle_retract)
        side = air_side(start, contour, allow_z if across else allow_x, across=across)
        self._check_one_way(contour, code, across)
        self._check_start(contour, code, across, side)
        self._without_nose(walked)
        roughing = Roughing(start, tuple(contour), allow_x, allow_z, modal.cycle_depth, retract_by, side, across, feeds_in)
        self._rough(roughing, code)
        self._pass_over(first, last, code)

    def _rough(self, roughing: Roughing, code: str) -> None:
        """Carry out a roughing cycle whose words have been read."""
        start, across = roughing.start, roughing.across
        extent = max(abs((move.end_z if across else move.end_x) - (start[1] if across else start[0])) for move in roughing.contour)
        self._check_count(extent / roughing.depth * len(roughing.contour), code)
        self.check_feed()
        self._carry_out(roughing.steps(), code, compensated=False)

    def _retract(self, programmed: float | None, cut: float = RETRACT) -> float:
        """Return the retract of a cycle [m]: the programmed one, or an assumed one that is never longer than one ``cut`` [m]."""
        if programmed is None:
            self.assumed["cycle_retract"] = f"{in_unit(RETRACT, 'mm', 'g')} if a cycle does not say, never more than one peck"
            return min(RETRACT, cut)
        return programmed

    def _without_nose(self, contour: Iterable[Move] = ()) -> None:
        """Note that a cycle does not follow the nose compensation, in force or in its contour."""
        if self.modal.nose is not None or any(move.nose is not None for move in contour):
            self.assumed["nose_in_cycles"] = "G70 and single passes follow it; all other cycles run without it"

    def _pass_over(self, first: int, last: int, code: str) -> None:
        """Skip the contour after a roughing cycle; blocks between the cycle and the contour run, and a warning names them."""
        between = [block.line for block in self.blocks.blocks[self.position + 1 : first] if block.words or block.statement is not None]
        if between:
            lines = f"Line {between[0]}" if len(between) == 1 else f"Lines {between[0]} to {between[-1]}"
            stands = "stands" if len(between) == 1 else "stand"
            self.warn(
                f"{lines} {stands} between {code} and its contour. Here they run after the cycle; controls that continue after the contour "
                "skip them. Move them before the cycle or after the contour."
            )
        self.passed |= set(range(first, last + 1))

    def _ignored_word(self, letter: str, code: str) -> None:
        """Warn that a word of a cycle changes nothing here."""
        word = self.block.words.get(letter)
        if word is not None and (self.take(letter) is not None):
            self.warn(f"{word.text} of {code} changes nothing in the simulation.")

    def _finishing(self) -> None:
        """G70: the contour once along itself, with its own feeds, and back to the start."""
        code = self.block.codes[Meaning.FINISHING_CYCLE].code
        first, last = self._contour_ends(code)
        line, modal = self.block.line, self.modal
        self._finishing_allowances(code)
        walked = self._walked(first, last)
        self.events += [replace(event, before_move=event.before_move + len(self.moves)) for event in walked.events]
        self.moves.extend(replace(move, cycle=code, cycle_line=line) for move in walked.moves)
        start = (modal.x, modal.z)
        self.modal = replace(walked.modal, motion=modal.motion, motion_code=modal.motion_code)
        self.add("rapid", start, cycle=code, cycle_line=line)

    def _finishing_allowances(self, code: str) -> None:
        """U and W of Haas's G70, which programs copy from G71: the finishing cycle cuts the contour itself."""
        for word in (self.take("U"), self.take("W")):
            if word is not None and word.value != 0.0:
                self.warn(f"{word.text} of {code} leaves no allowance; the finishing cycle cuts the contour itself.")

    def _repeating(self) -> None:
        """G73: the whole contour again and again, nearer each time."""
        modal, code = self.modal, self.block.codes[Meaning.REPEATING_CYCLE].code
        if not {"P", "Q"} & set(self.block.words):
            relief_x, relief_z, count = self.take("U"), self.take("W"), self.take("R")
            modal.relief = (self._told_length(relief_x) if relief_x else 0.0, self._told_length(relief_z) if relief_z else 0.0)
            modal.repeats = max(1, round(count.value)) if count is not None else 1
            self._check_count(float(modal.repeats), code)
            return
        first, last = self._contour_ends(code)
        allow_x, allow_z = self._allowances()
        i, k, d = (self.take(letter) for letter in "IKD")
        if i is not None or k is not None:
            modal.relief = (modal.metres(i.value) if i else 0.0, modal.metres(k.value) if k else 0.0)
        if d is not None:
            modal.repeats = max(1, round(d.value))
            self._check_count(float(modal.repeats), code)
        if modal.relief == (0.0, 0.0):
            self.warn(
                f"{code} has no distance from the contour to begin at, and cuts all in one pass. Write U, W and R in a {code} before it."
            )
        start = (modal.x, modal.z)
        contour = self._walked(first, last).moves
        self._without_nose(contour)
        self.check_feed()
        out = start[0]
        if contour:
            side = air_side(start, contour, allow_x or modal.relief[0], across=False)
            if modal.relief[0] * side < 0.0:
                self.warn(f"The relief of {code} goes into the part, so its first pass cuts too deep. Change the sign of U or I.")
            out = side * max(side * start[0], *(side * point[0] for point in contour_points(contour)[1:]))
        steps: list[CycleStep] = []
        for number in range(modal.repeats):
            share = 1.0 - (number / (modal.repeats - 1) if modal.repeats > 1 else 1.0)
            dx, dz = allow_x + share * modal.relief[0], allow_z + share * modal.relief[1]
            for move in contour:
                end = (move.end_x + dx, move.end_z + dz)
                if move.arc is not None:
                    arc = replace(move.arc, centre_x=move.arc.centre_x + dx, centre_z=move.arc.centre_z + dz)
                    steps.append(CycleStep("arc", end, arc=arc))
                else:
                    steps.append(CycleStep("rapid" if move.kind == "rapid" else "feed", end))
            steps += [CycleStep("rapid", (out + dx, steps[-1].end[1])), CycleStep("rapid", (out + dx, start[1] + dz))]
            steps.append(CycleStep("rapid", (start[0] + dx, start[1] + dz)))
        self._carry_out([*steps, CycleStep("rapid", start)], code, compensated=False)
        self._pass_over(first, last, code)

    def _allowances(self) -> Point:
        modal = self.modal
        x, z = self.take("U"), self.take("W")
        return (
            modal.across(x.value) if x is not None else 0.0,
            modal.metres(z.value) if z is not None else 0.0,
        )

    def _contour_ends(self, code: str) -> tuple[int, int]:
        """Return the places of the blocks that P and Q name, looked for from the cycle on, else from the beginning."""
        p, q = self.take("P"), self.take("Q")
        if p is None or q is None:
            raise self.error(
                f"{code} needs P and Q, the first and the last block of its contour{self._other_readings()}.",
                f"Write it as {code} P10 Q20.",
            )
        if self.block_number and self.block_number == str(round(p.value)):
            raise self.error(
                f"{p.text} of {code} names the block it stands in.", "P names the first block of the contour, behind the cycle."
            )
        first = self._numbered(p, range(self.position + 1, len(self.blocks.blocks)), range(self.position), code)
        if q.value != p.value and self.numbered(q.value) and max(self.numbered(q.value)) < first:
            raise self.error(f"The last block of the contour, {q.text} of {code}, stands before the first, {p.text}.", "Swap P and Q.")
        last = self._numbered(q, range(first, len(self.blocks.blocks)), range(0), code)
        return first, last

    def _other_readings(self) -> str:
        meaning = self.block.of_group(Group.MOTION)
        return "" if meaning is None else self.readings(self.block.codes[meaning])

    def _numbered(self, word: Word, nearer: range, further: range, code: str) -> int:
        for places in (nearer, further):
            for place in self.numbered(word.value):
                if place in places:
                    return place
        known = [block.number for block in self.blocks.blocks if block.number]
        names = f"It has N{', N'.join(known[:_NAMED])}{' and more' if len(known) > _NAMED else ''}." if known else "It has no N numbers."
        raise self.error(f"{word.text} of {code} names a block N{round(word.value)} that is not there.", names)

    def _walked(self, first: int, last: int) -> Walked:
        """Return a contour as the program would run it from the current point; the state of the program does not change."""
        if self.walking:
            raise self.error("A cycle stands in the contour of a cycle.", "Write the contour with G0 to G3 only.")
        kept = (self.modal, self.moves, self.events, self.block, self.used, self.position, self.block_number, self.passed)
        self.modal, self.moves, self.events, self.walking = copy.copy(self.modal), Moves(), [], True
        self.modal.motion = None
        self.passed, self.corner = set(), None
        try:
            self.run_blocks(first, last + 1)
            self.contours.setdefault(first, tuple(self.moves))
            return Walked(list(self.moves), self.events, self.modal)
        finally:
            self.walking = False
            self.modal, self.moves, self.events, self.block, self.used, self.position, self.block_number, self.passed = kept

    def _check_start(self, contour: list[Move], code: str, across: bool, side: float) -> None:
        """Warn of a cycle that begins inside the depths of its contour, or whose allowance cuts into the contour."""
        depths = [depth for move in contour for depth in ((move.start_z, move.end_z) if across else (move.start_x, move.end_x))]
        start = self.modal.z if across else self.modal.x
        self._check_allowance(code, across, side)
        if min(depths) + _MICRON < start < max(depths) - _MICRON:
            axis, double = ("Z", 1.0) if across else ("X", 2.0 if self.modal.diameter else 1.0)
            self.warn(
                f"{code} begins at {axis} {1e3 * double * start:.6g} mm, inside its contour from {1e3 * double * min(depths):.6g} to "
                f"{1e3 * double * max(depths):.6g} mm. Begin it outside; its rapid moves return there."
            )

    def _check_allowance(self, code: str, across: bool, side: float) -> None:
        """Warn of an allowance that is taken off the part."""
        allowance = self.block.words.get("W" if across else "U")
        if allowance is not None and allowance.value * side < 0.0:
            self.warn(
                f"{allowance.text} of {code} cuts into the contour, because the tool works towards {'+' if side < 0.0 else '-'}"
                f"{'Z' if across else 'X'}. Change its sign."
            )

    @property
    def variables(self) -> Variables:
        """The variables of the program."""
        raise NotImplementedError

    def structure(self) -> Structure:
        """Return what belongs together among the statements of the program."""
        raise NotImplementedError

    def run_blocks(self, begin: int = 0, end: int | None = None) -> None:
        """Run the blocks of the program from ``begin`` to before ``end``."""
        raise NotImplementedError

    def _check_one_way(self, contour: list[Move], code: str, across: bool) -> None:
        """Warn of a contour that goes back: no turning tool follows it."""
        places = [contour[0].start_x if across else contour[0].start_z, *((move.end_x if across else move.end_z) for move in contour)]
        ways = [there - here for here, there in itertools.pairwise(places) if abs(there - here) > _SAME_PLACE]
        if any(way * ways[0] < 0.0 for way in ways):
            self.warn(f"The contour of {code} goes back along {'X' if across else 'Z'}; a tool may not reach what lies behind.")

    # ---- small tools -------------------------------------------------------------------------------------------------------------

    def _code(self) -> str:
        return self.modal.motion_code

    def _length(self, word: Word) -> float:
        """Return a length of a cycle [m]: without a decimal point it counts in the smallest unit of the control."""
        if "." in word.text:
            return self.modal.metres(word.value)
        return word.value * (_TENTH if self.modal.inch else _MICRON)

    def _told_length(self, word: Word) -> float:
        """Return a length of a cycle that is written with and without a point [m]: a large one without counts in the smallest unit."""
        whole = self.modal.metres(word.value)
        if "." in word.text or abs(whole) < _DEEPEST:
            return whole
        told = self.assumed.get("numbers_without_point", "").split(" of ")[0].split(", ")
        words = ", ".join(dict.fromkeys([*filter(None, told), word.text]))
        self.assumed["numbers_without_point"] = f"{words} of a cycle, in the smallest unit of the control"
        return self._length(word)

    def _told_retract(self, word: Word, code: str) -> float:
        """Return how far a cycle withdraws [m], which has no sign."""
        length = self._told_length(word)
        if length < 0.0:
            raise self.error(f"{word.text} of {code} is a retract below 0, which goes into the part.", "Give it without a sign.")
        return length

    def _step(self, word: Word, code: str) -> float:
        """Return a step of a cycle [m], in the smallest unit without a point; one that is too small to be meant is warned of."""
        length = self._length(word)
        if "." not in word.text and 0.0 < length < _SLIGHT:
            units = 1.0 / (_TENTH / 0.0254 if self.modal.inch else _MICRON / 1e-3)
            meant = f"{word.letter}{word.value * units:.0f} for {word.value:g} {'inch' if self.modal.inch else 'mm'}"
            self.warn(f"{word.text} of {code} is a step of {in_unit(length, 'mm', 'g')}, as it has no point. Write {meant}.")
        return length

    def _check_count(self, count: float, code: str) -> None:
        if not count < _MOST_STEPS:
            raise self.error(f"{code} would make more than {_MOST_STEPS} passes.", "Take a larger depth of cut.")

    def _carry_out(
        self, steps: Iterable[CycleStep], code: str, *, compensated: bool = True, start_angle: float = 0.0, keep: bool = False
    ) -> None:
        """Append the moves of a cycle, with nose compensation if ``compensated``; moves without length are left out unless ``keep``.

        Its threads begin at ``start_angle`` [rad].
        """
        modal = self.modal
        if not compensated:
            self._without_nose()
        direction, speed = modal.direction, modal.speed
        for step in steps:
            if step.arc is None and step.kind != "dwell" and step.end == (modal.x, modal.z) and not keep:
                continue
            self._spin(step.spin, direction, speed)
            feed, per_revolution = modal.feed if step.feed is None else step.feed, modal.per_revolution
            if step.kind in ("rapid", "dwell"):
                feed, per_revolution = None, False
            elif step.kind == "thread":
                feed, per_revolution = step.lead, True
            self.add(
                step.kind, step.end, feed=feed, per_revolution=per_revolution, seconds=step.seconds, arc=step.arc,
                cycle=code, cycle_line=self.block.line, compensated=compensated, start_angle=start_angle if step.kind == "thread" else 0.0,
                spin_back=step.kind == "thread" and step.spin < 0.0,
            )  # fmt: skip
        self._spin(1.0, direction, speed)

    def _spin(self, share: float, direction: int, speed: float | None) -> None:
        """Turn the spindle at a ``share`` of a speed; a negative share reverses it."""
        wanted = direction if share > 0.0 else -direction if share < 0.0 else 0
        if wanted != self.modal.direction:
            self.modal.direction = wanted
            self.event("spindle", direction=wanted)
        self.modal.speed = speed if speed is None or abs(share) in (0.0, 1.0) else abs(share) * speed
