"""The blocks that call cycles: their words to the numbers of a cycle, contours looked up and walked, and the moves they expand to."""

from __future__ import annotations

import copy
import itertools
import math
from collections.abc import Iterable
from dataclasses import replace

from lathesim.program.cycles.pecking import pecking
from lathesim.program.cycles.roughing import Roughing
from lathesim.program.cycles.single_pass import facing_pass, lead_along_path, threading_pass, turning_pass
from lathesim.program.cycles.step import Point, Step
from lathesim.program.cycles.threading import Threading, drive_line_threading
from lathesim.program.meanings import Group, Meaning
from lathesim.program.motions import Motions
from lathesim.program.moves import Move
from lathesim.program.words import Word

SINGLE = (Meaning.TURNING_CYCLE_SIMPLE, Meaning.THREADING_CYCLE_SIMPLE, Meaning.FACING_CYCLE_SIMPLE)
_ROUGHING = (Meaning.ROUGHING_CYCLE, Meaning.FACING_CYCLE)
_PECKING = (Meaning.FACE_GROOVING_CYCLE, Meaning.GROOVING_CYCLE)
_RETRACT = 0.5e-3
"""[m] how far a cycle withdraws where the program does not say, assumed: a common setting of controls."""
_MICRON = 1e-6
_TENTH = 2.54e-6
"""[m] one unit of a number without a decimal point, in millimetres and in inches. Source: Fanuc 0i-T, least input increment."""
_MOST_STEPS = 200_000


class Cycles(Motions):
    """Expands cycles; ``position`` is the place of the present block, ``passed`` are the places of contours that are not executed again."""

    position = 0

    def cycle(self) -> bool:
        """Carry out the cycle of the block, by its own code or a single-pass cycle in force; say whether there was one."""
        meaning = self.block.of_group(Group.MOTION)
        if meaning is None and self.modal.motion in SINGLE:
            named = any(letter in self.block.words and letter not in self.used for letter in ("X", "Z", "U", "W"))
            meaning = self.modal.motion if named else None
        if meaning is None:
            return False
        if meaning in SINGLE:
            self._single(meaning)
        elif meaning in _ROUGHING:
            self._roughing(meaning)
        elif meaning is Meaning.FINISHING_CYCLE:
            self._finishing()
        elif meaning is Meaning.REPEATING_CYCLE:
            self._repeating()
        elif meaning in _PECKING:
            self._pecking(meaning)
        elif meaning is Meaning.THREADING_CYCLE:
            self._threading()
        elif meaning is Meaning.THREAD_BY_FEED:
            self._thread_by_feed()
        else:
            return False
        return True

    # ---- single passes -----------------------------------------------------------------------------------------------------------

    def _single(self, meaning: Meaning) -> None:
        modal, start = self.modal, (self.modal.x, self.modal.z)
        if meaning in self.block.codes:
            modal.motion, modal.motion_code = meaning, self.block.codes[meaning].code
            modal.taper, modal.cycle_end = 0.0, start
        word = self.take("R")
        modal.taper = modal.metres(word.value) if word is not None else modal.taper
        here = (modal.x, modal.z)
        modal.x, modal.z = modal.cycle_end if modal.cycle_end is not None else here
        named = {letter for letter in ("X", "Z", "U", "W") if letter in self.block.words}
        modal.x = here[0] if "U" in named else modal.x
        modal.z = here[1] if "W" in named else modal.z
        end = self.target()
        modal.x, modal.z = here
        modal.cycle_end = end
        if meaning is Meaning.THREADING_CYCLE_SIMPLE:
            self._check_turning()
            lead = self._lead()
            steps = threading_pass(start, end, modal.taper, lead)
        else:
            self.check_feed()
            steps = (turning_pass if meaning is Meaning.TURNING_CYCLE_SIMPLE else facing_pass)(start, end, modal.taper)
        self._carry_out(steps, modal.motion_code)

    def _lead(self) -> float:
        """Return the lead of a thread [m], which the word F gives (it is no feed); the one before stays in force."""
        word = self.take("F")
        modal = self.modal
        if word is not None:
            if word.value <= 0.0:
                raise self.error(f"{word.text} is no lead.", "Give the lead of the thread above 0, for example F1.5.")
            modal.lead = modal.metres(word.value)
        if modal.lead is None:
            raise self.error(f"{self._code()} needs a lead and has none.", "Add an F word, for example F1.5.")
        return modal.lead

    def _thread_by_feed(self) -> None:
        """G32: one thread move, its lead in F counted along the longer axis."""
        modal = self.modal
        if Meaning.THREAD_BY_FEED in self.block.codes:
            modal.motion, modal.motion_code = Meaning.THREAD_BY_FEED, self.block.codes[Meaning.THREAD_BY_FEED].code
        self._check_turning()
        lead = self._lead()
        begin = (modal.x, modal.z)
        end = self.target()
        if end == begin:
            raise self.error(f"{modal.motion_code} names no end point.", "Add a Z word.")
        self.add("thread", end, feed=lead_along_path(begin, end, lead), per_revolution=True)

    # ---- contours ----------------------------------------------------------------------------------------------------------------

    def _roughing(self, meaning: Meaning) -> None:
        """G71 and G72 in one block (D) or in two (the first with U or W and R)."""
        modal, code = self.modal, self.block.codes[meaning].code
        across = meaning is Meaning.FACING_CYCLE
        if not {"P", "Q"} & set(self.block.words):
            depth, retract = self.take("W" if across else "U"), self.take("R")
            modal.cycle_depth = modal.metres(depth.value) if depth is not None else modal.cycle_depth
            modal.cycle_retract = modal.metres(retract.value) if retract is not None else modal.cycle_retract
            return
        first, last = self._contour_ends(code)
        word = self.take("D")
        if word is not None:
            modal.cycle_depth = self._length(word)
        if modal.cycle_depth is None or modal.cycle_depth <= 0.0:
            raise self.error(
                f"{code} needs a depth of cut above 0 and has none.",
                f"Write {code} {'W' if across else 'U'}2. R0.5 in a block before it, or add D.",
            )
        allow_x, allow_z = self._allowances()
        start = (modal.x, modal.z)
        contour = [move for move in self._walked(first, last) if move.kind in ("feed", "arc")]
        if not contour:
            raise self.error(f"The contour of {code} cuts nothing.", "Write it with G1, G2 and G3 behind its first block.")
        retract_by = _RETRACT if modal.cycle_retract is None else modal.cycle_retract
        if modal.cycle_retract is None:
            self.assumed["cycle_retract"] = f"{1e3 * _RETRACT:g} mm where a cycle does not say"
        self._check_one_way(contour, code, across)
        roughing = Roughing(start, tuple(contour), allow_x, allow_z, modal.cycle_depth, retract_by, across)
        extent = max(abs((move.end_z if across else move.end_x) - (start[1] if across else start[0])) for move in contour)
        self._check_count(extent / modal.cycle_depth * len(contour), code)
        self.check_feed()
        self._carry_out(roughing.steps(), code)
        self.passed |= set(range(first, last + 1))

    def _finishing(self) -> None:
        """G70: the contour once along itself, with its own feeds, and back to the start."""
        code = self.block.codes[Meaning.FINISHING_CYCLE].code
        first, last = self._contour_ends(code)
        line, start = self.block.line, (self.modal.x, self.modal.z)
        for move in self._walked(first, last):
            self.add(
                move.kind, (move.end_x, move.end_z), feed=move.feed, per_revolution=move.per_revolution, seconds=move.seconds, arc=move.arc,
                line=move.line, cycle=code, cycle_line=line,
            )  # fmt: skip
        self.add("rapid", start, cycle=code, cycle_line=line)

    def _repeating(self) -> None:
        """G73: the whole contour again and again, nearer each time."""
        modal, code = self.modal, self.block.codes[Meaning.REPEATING_CYCLE].code
        if not {"P", "Q"} & set(self.block.words):
            relief_x, relief_z, count = self.take("U"), self.take("W"), self.take("R")
            modal.relief = (modal.metres(relief_x.value) if relief_x else 0.0, modal.metres(relief_z.value) if relief_z else 0.0)
            modal.repeats = max(1, round(count.value)) if count is not None else 1
            self._check_count(float(modal.repeats), code)
            return
        first, last = self._contour_ends(code)
        allow_x, allow_z = self._allowances()
        start = (modal.x, modal.z)
        contour = self._walked(first, last)
        self.check_feed()
        steps: list[Step] = []
        for number in range(modal.repeats):
            share = 1.0 - (number / (modal.repeats - 1) if modal.repeats > 1 else 1.0)
            dx, dz = allow_x + share * modal.relief[0], allow_z + share * modal.relief[1]
            for move in contour:
                end = (move.end_x + dx, move.end_z + dz)
                if move.arc is not None:
                    arc = replace(move.arc, centre_x=move.arc.centre_x + dx, centre_z=move.arc.centre_z + dz)
                    steps.append(Step("arc", end, arc=arc))
                else:
                    steps.append(Step("rapid" if move.kind == "rapid" else "feed", end))
            steps += [Step("rapid", (start[0] + dx, steps[-1].end[1])), Step("rapid", (start[0] + dx, start[1] + dz))]
        self._carry_out([*steps, Step("rapid", start)], code)
        self.passed |= set(range(first, last + 1))

    def _allowances(self) -> Point:
        modal = self.modal
        x, z = self.take("U"), self.take("W")
        return (
            modal.metres(x.value) * (0.5 if modal.diameter else 1.0) if x is not None else 0.0,
            modal.metres(z.value) if z is not None else 0.0,
        )

    def _contour_ends(self, code: str) -> tuple[int, int]:
        """Return the places of the blocks that P and Q name, looked for from the cycle on, else from the beginning."""
        p, q = self.take("P"), self.take("Q")
        if p is None or q is None:
            raise self.error(f"{code} needs P and Q, the first and the last block of its contour.", f"Write it as {code} P10 Q20.")
        if self.block_number and self.block_number == str(round(p.value)):
            raise self.error(
                f"{p.text} of {code} names the block it stands in.", "P names the first block of the contour, behind the cycle."
            )
        first = self._numbered(p, range(self.position + 1, len(self.blocks.blocks)), range(self.position), code)
        last = self._numbered(q, range(first, len(self.blocks.blocks)), range(0), code)
        return first, last

    def _numbered(self, word: Word, nearer: Iterable[int], further: Iterable[int], code: str) -> int:
        for places in (nearer, further):
            for place in places:
                number = self.blocks.blocks[place].number
                if number and float(number) == word.value:
                    return place
        known = [block.number for block in self.blocks.blocks if block.number]
        names = f"It has N{', N'.join(known[:8])}{' and more' if len(known) > 8 else ''}." if known else "It has no N numbers."
        raise self.error(f"{word.text} of {code} names a block N{round(word.value)} that is not there.", names)

    def _walked(self, first: int, last: int) -> list[Move]:
        """Return the moves of a contour from the present point, as the program would make them, and leave everything else as it is."""
        if self.walking:
            raise self.error("A cycle stands in the contour of a cycle.", "Write the contour with G0 to G3 only.")
        kept = (self.modal, self.moves, self.events, self.block, self.used, self.position, self.block_number)
        self.modal, self.moves, self.events, self.walking = copy.copy(self.modal), [], [], True
        self.modal.motion = None
        try:
            for place in range(first, last + 1):
                self.position = place
                self.run_block(self.blocks.blocks[place])
            return self.moves
        finally:
            self.walking = False
            self.modal, self.moves, self.events, self.block, self.used, self.position, self.block_number = kept

    def _check_one_way(self, contour: list[Move], code: str, across: bool) -> None:
        """Warn of a contour that goes back: no turning tool follows it."""
        places = [contour[0].start_x if across else contour[0].start_z, *((move.end_x if across else move.end_z) for move in contour)]
        ways = [there - here for here, there in itertools.pairwise(places) if abs(there - here) > 1e-9]
        if any(way * ways[0] < 0.0 for way in ways):
            self.warn(f"The contour of {code} goes back along {'X' if across else 'Z'}; a tool may not reach what lies behind.")

    # ---- grooving, threading -----------------------------------------------------------------------------------------------------

    def _pecking(self, meaning: Meaning) -> None:
        """G74 and G75, in two blocks (R alone, then the cycle with P and Q) or in one (I and K)."""
        modal, code, across = self.modal, self.block.codes[meaning].code, meaning is Meaning.GROOVING_CYCLE
        if not any(letter in self.block.words for letter in ("X", "Z", "U", "W")):
            word = self.take("R")
            modal.peck_retract = modal.metres(word.value) if word is not None else modal.peck_retract
            return
        p, q, i, k = (self.take(letter) for letter in "PQIK")
        step_x = self._length(p) if p is not None else modal.metres(i.value) if i is not None else 0.0
        step_z = self._length(q) if q is not None else modal.metres(k.value) if k is not None else 0.0
        self.take("R")
        start, end = (modal.x, modal.z), self.target()
        if (step_x if across else step_z) < 0.0 or (step_z if across else step_x) < 0.0:
            raise self.error(f"{code} has a step below 0.", "Give steps without a sign; the end point says the direction.")
        self.check_feed()
        step, aside = (step_x, step_z) if across else (step_z, step_x)
        retract = _RETRACT if modal.peck_retract is None else modal.peck_retract
        ways = (abs(end[0] - start[0]), abs(end[1] - start[1]))
        deep, wide = ways if across else ways[::-1]
        self._check_count((deep / step if step else 1.0) * (wide / aside + 1.0 if aside else 2.0), code)
        if modal.peck_retract is None:
            self.assumed["cycle_retract"] = f"{1e3 * _RETRACT:g} mm where a cycle does not say"
        self._carry_out(pecking(start, end, across=across, step=step, aside=aside, retract=retract), code)

    def _threading(self) -> None:
        """G76: of LinuxCNC (P is the pitch), of Fanuc in two blocks, or of Haas in one (K and D)."""
        if self.dialect.thread_drive_line:
            self._drive_line_threading()
            return
        modal, code = self.modal, self.block.codes[Meaning.THREADING_CYCLE].code
        if not any(letter in self.block.words for letter in ("X", "Z", "U", "W")):
            p, q, r = (self.take(letter) for letter in "PQR")
            if p is not None:
                digits = int(p.value)
                modal.thread_finishing, modal.thread_angle = max(1, digits // 10000), math.radians(digits % 100)
            modal.thread_smallest = self._length(q) if q is not None else modal.thread_smallest
            modal.thread_allowance = modal.metres(r.value) if r is not None else modal.thread_allowance
            return
        self._check_turning()
        height, first, taper = self.take("P") or self.take("K"), self.take("Q") or self.take("D"), self.take("R") or self.take("I")
        angle = self.take("A")
        if height is None or first is None:
            raise self.error(
                f"{code} needs the height of the thread and the first depth.", f"Write it as {code} X18.16 Z-17. P920 Q300 F1.5."
            )
        lead = self._lead()
        start, end = (modal.x, modal.z), self.target()
        threading = Threading(
            start=start,
            end=end,
            height=self._length(height),
            first_depth=self._length(first),
            lead=lead,
            smallest=modal.thread_smallest,
            allowance=modal.thread_allowance,
            finishing=modal.thread_finishing,
            angle=math.radians(angle.value) if angle is not None else modal.thread_angle,
            taper=modal.metres(taper.value) if taper is not None else 0.0,
        )
        if not 0.0 < threading.first_depth <= threading.height:
            raise self.error(f"The first depth of {code} must be above 0 and at most the height of the thread.", "Correct P and Q.")
        self._carry_out(threading.steps(), code)

    def _drive_line_threading(self) -> None:
        """LinuxCNC's G76: P pitch, Z end, I crest, J first depth, K full depth, R degression, Q slide angle, H spring passes."""
        modal, code = self.modal, self.block.codes[Meaning.THREADING_CYCLE].code
        self._check_turning()
        words = {letter: self.take(letter) for letter in "PIJKRQHEL"}
        missing = [letter for letter in "PIJK" if words[letter] is None]
        if missing or "Z" not in self.block.words:
            wanted = ", ".join([*missing, *(["Z"] if "Z" not in self.block.words else [])])
            raise self.error(f"{code} needs {wanted}.", f"Write it as {code} P1.5 Z-20 I-2 J0.3 K0.92.")
        values = {letter: word.value if word is not None else 0.0 for letter, word in words.items()}
        if values["E"] or values["L"]:
            raise self.error(f"{code} with E and L tapers its ends, and that is not interpreted here.", "Leave E and L out.")
        if values["P"] <= 0.0 or values["J"] <= 0.0 or values["K"] < values["J"]:
            raise self.error(f"{code} needs P and J above 0 and K of at least J.", "Correct P, J and K.")
        if words["R"] is not None and values["R"] < 1.0:
            raise self.error(f"R of {code} is below 1.", "Write R1 for passes of equal depth, R2 for passes of equal area.")
        start = (modal.x, modal.z)
        end = self.target()
        self._check_count((values["K"] / values["J"]) ** (values["R"] or 1.0) + values["H"], code)
        steps = drive_line_threading(
            start,
            end[1],
            pitch=modal.metres(values["P"]),
            peak=modal.metres(values["I"]),
            first=modal.metres(values["J"]),
            full=modal.metres(values["K"]),
            degression=values["R"] or 1.0,
            slide=math.radians(values["Q"]),
            spring=max(0, round(values["H"])),
        )
        self._carry_out(steps, code)

    # ---- small tools -------------------------------------------------------------------------------------------------------------

    def _code(self) -> str:
        return self.modal.motion_code

    def _length(self, word: Word) -> float:
        """Return a length of a cycle [m]: without a decimal point it counts in the smallest unit of the control."""
        if "." in word.text:
            return self.modal.metres(word.value)
        return word.value * (_TENTH if self.modal.inch else _MICRON)

    def _check_turning(self) -> None:
        if not self.modal.turning:
            raise self.error("A thread follows the spindle, and the spindle stands still.", "Turn it on with M3 and an S word.")

    def _check_count(self, count: float, code: str) -> None:
        if not count < _MOST_STEPS:
            raise self.error(f"{code} would make more than {_MOST_STEPS} passes.", "Take a larger depth of cut.")

    def _carry_out(self, steps: Iterable[Step], code: str) -> None:
        """Append the moves of a cycle; those of no length are left out."""
        modal = self.modal
        for step in steps:
            if step.arc is None and step.end == (modal.x, modal.z):
                continue
            if step.kind == "rapid":
                self.add("rapid", step.end, cycle=code, cycle_line=self.block.line)
            elif step.kind == "thread":
                self.add("thread", step.end, feed=step.lead, per_revolution=True, cycle=code, cycle_line=self.block.line)
            else:
                feed = modal.feed if step.feed is None else step.feed
                line = self.block.line
                self.add(step.kind, step.end, feed=feed, per_revolution=modal.per_revolution, arc=step.arc, cycle=code, cycle_line=line)
