"""The blocks that call cycles: their words to the numbers of a cycle, and the moves they expand to.

The blocks that call LinuxCNC's contour cycles, G70 to G72.2, expanded to moves; the contour is a subprogram.

Source: LinuxCNC 2.9 manual, G70, G71 and G72. Left out: fillets (A) and chamfers (C) between the moves of a contour.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

from lathesim.program.contour_cycles import RETRACT, ROUGHING, ContourCycles
from lathesim.program.cycles import (
    MOST_PASSES,
    CycleStep,
    DriveLineThreading,
    Point,
    Threading,
    facing_pass,
    lead_along_path,
    pecking,
    threading_pass,
    turning_pass,
)
from lathesim.program.hole_cycles import HoleCycles
from lathesim.program.meanings import HOLES, Group, Meaning
from lathesim.program.moves import LEFT, RIGHT, Move
from lathesim.program.nose_compensation import beside
from lathesim.program.roughing import Cuts, Roughing, air_side, contour_points
from lathesim.program.words import Word
from lathesim.units import in_unit

_CUTS: dict[Meaning, Cuts] = {
    Meaning.POCKETS_LATER: "open", Meaning.FACE_POCKETS_LATER: "open",
    Meaning.POCKETS_ONLY: "pockets", Meaning.FACE_POCKETS_ONLY: "pockets",
}  # fmt: skip
PROFILES = (*ROUGHING, *_CUTS, Meaning.FINISHING_CYCLE)
"""The cycles of LinuxCNC whose contour is a subprogram."""
_SAME = 1e-6
"""Length [m] up to which a move counts as none (assumed: coordinates are rounded to 1 um)."""


class ProfileCycles(ContourCycles):
    """Expands the cycles whose contour is a subprogram."""

    def _profile(self, meaning: Meaning) -> None:
        """Expand LinuxCNC's G70 to G72.2: Q names the subprogram of the contour; I is the depth, R the retract, D the allowance.

        All lengths except X are radii, also in G7. Source: LinuxCNC 2.9, interp_g7x.cc.
        """
        modal, code = self.modal, self.block.codes[meaning].code
        self.check_plane(code)
        if not modal.absolute:
            raise self.error(f"{code} does not go with incremental positions.", f"Write {self.code_for(Meaning.ABSOLUTE)} before it.")
        words = {letter: self.take(letter) for letter in "QDEIPRUW"}
        value = {letter: modal.metres(word.value) for letter, word in words.items() if word is not None}
        if modal.nose is not None and meaning is not Meaning.FINISHING_CYCLE:
            raise self.error(f"{code} does not go with nose compensation.", "Write G40 before it.")
        start = self.target()
        contour = self._subprogram_contour(words["Q"], start, code)
        if meaning is Meaning.FINISHING_CYCLE:
            passes = 1 if words["P"] is None else round(words["P"].value)
            self._check_count(float(passes) * len(contour), code)
            self.check_feed()
            if start != (modal.x, modal.z):
                self.add("rapid", start, cycle=code, cycle_line=self.block.line, compensated=False)
            else:
                self._check_over(start, contour, code)
            self._carry_out(self._profile_passes(start, contour, value.get("D", 0.0), value.get("E", 0.0), passes), code)
            return
        depth = value.get("I", modal.metres(1.0))
        if depth <= 0.0:
            raise self.error(f"{code} needs a depth of cut above 0.", f"Write it as {code} Q100 I1.")
        across = code.startswith("G72")
        allowed = value.get("W" if across else "U", 0.0)
        shifted = beside(contour, _left_or_right(start, contour), value.get("D", 0.0), self.blocks.name)
        side = air_side(start, contour, allowed, across=across)
        self._check_one_way(shifted, code, across)
        self._check_allowance(code, across, side)
        self._carry_out([CycleStep("rapid", start)], code)
        retract = self._told_retract(words["R"], code) if words["R"] is not None else modal.metres(0.5)
        for letter, told in (("I", depth), ("R", retract)):
            if words[letter] is None:
                self.assumed[f"{letter} of {code}"] = f"{in_unit(told, 'mm', 'g')}, as in LinuxCNC"
        if value.get("D", 0.0) < 0.0:
            self.warn(f"D of {code} is below 0 and cuts beyond the contour. Change its sign.")
        cuts = _CUTS.get(meaning, "all")
        allow_x, allow_z = value.get("U", 0.0), value.get("W", 0.0)
        self._rough(Roughing(start, tuple(shifted), allow_x, allow_z, depth, retract, side, across, cuts=cuts, returns=False), code)

    def _subprogram_contour(self, q: Word | None, start: Point, code: str) -> list[Move]:
        """Return the contour in a subprogram after its first move, which approaches it from ``start``; its variables are local."""
        found = self.structure()
        if q is None or f"{q.value:g}" not in found.subs:
            fact = (
                f"{code} needs Q, the number of the subprogram with its contour{self._other_readings()}."
                if q is None
                else f"There is no subprogram O{q.value:g} for {code}."
            )
            raise self.error(fact, f"Write the contour from O100 SUB to O100 ENDSUB, and {code} Q100.")
        first = found.subs[f"{q.value:g}"]
        modal = self.modal
        here = (modal.x, modal.z)
        modal.x, modal.z = start
        self.variables.enter({})
        try:
            moves = self._walked(first + 1, found.partner[first] - 1).moves
        finally:
            self.variables.leave()
        modal.x, modal.z = here
        walked = [move for move in moves if move.length > _SAME]
        if len(walked) < 2:
            raise self.error(f"The contour of {code} cuts nothing.", "Its first block approaches the contour, the others follow it.")
        if modal.nose is None and any(move.nose is not None for move in walked):
            self.warn(f"Nose compensation in the contour of {code} does nothing in LinuxCNC. Write it before G70.")
        return [replace(move, kind="feed" if move.kind == "rapid" else move.kind, nose=None) for move in walked[1:]]

    def _profile_passes(self, start: Point, contour: list[Move], far: float, near: float, passes: int) -> list[CycleStep]:
        """Return the passes of LinuxCNC's G70, the first at the distance ``far`` and the last at ``near`` [m] from the contour."""
        steps: list[CycleStep] = []
        for number in range(passes, 0, -1):
            shifted = beside(contour, _left_or_right(start, contour), (number - 1) * (far - near) / passes + near, self.blocks.name)
            steps += [CycleStep("rapid", start), CycleStep("rapid", (shifted[0].start_x, shifted[0].start_z))]
            steps += [CycleStep("arc" if move.arc is not None else "feed", (move.end_x, move.end_z), arc=move.arc) for move in shifted]
        return steps

    def _check_over(self, start: Point, contour: list[Move], code: str) -> None:
        """Warn of a cycle that begins over its contour, at the end of the previous cycle: its rapid to the first point crosses the part."""
        points = contour_points(contour)
        first, last = points[0], points[-1]
        if min((start[1] - first[1]) * (last[1] - first[1]), (start[0] - first[0]) * (last[0] - first[0])) > _SAME**2:
            x, z = self.modal.here
            self.warn(
                f"{code} begins at X {in_unit(x, 'mm', '.6g')} (radius), Z {in_unit(z, 'mm', '.6g')}, over its contour, and its rapid to "
                "the first point crosses the part. Add X and Z of a point in front of the contour."
            )


def _left_or_right(start: Point, contour: list[Move]) -> int:
    """Return the side of a contour, looking along it, on which a tool at ``start`` [m] waits: the sign of the enclosed area decides."""
    points = [start, *contour_points(contour), start]
    area = sum(here[1] * there[0] - there[1] * here[0] for here, there in itertools.pairwise(points))
    return LEFT if area > 0.0 else RIGHT


SINGLE = (Meaning.TURNING_CYCLE_SIMPLE, Meaning.THREADING_CYCLE_SIMPLE, Meaning.FACING_CYCLE_SIMPLE)
_PECKING = (Meaning.FACE_GROOVING_CYCLE, Meaning.GROOVING_CYCLE)

_GO_ON = frozenset({*SINGLE, *HOLES, Meaning.RIGID_TAPPING, Meaning.THREAD_BY_FEED})
"""The cycles that a block with an axis word repeats."""


class Cycles(HoleCycles, ProfileCycles):
    """Expands cycles; ``position`` is the place of the present block, ``passed`` are the places of contours that are not executed again."""

    def cycle(self) -> bool:
        """Carry out the cycle of the block, by its own code or a single-pass cycle in force; say whether there was one."""
        meaning = self.block.of_group(Group.MOTION)
        if meaning is None and self.modal.motion in _GO_ON:
            named = any(letter in self.block.words and letter not in self.used for letter in ("X", "Z", "U", "W"))
            meaning = self.modal.motion if named else None
        if meaning is None:
            return False
        if self.dialect.contour_in_subprogram and meaning in PROFILES:
            self._profile(meaning)
        elif meaning in SINGLE:
            self._single(meaning)
        elif meaning in ROUGHING:
            self._roughing(meaning)
        elif meaning is Meaning.FINISHING_CYCLE:
            self._finishing()
        elif meaning is Meaning.REPEATING_CYCLE:
            self._repeating()
        elif meaning in _PECKING:
            self._pecking(meaning)
        elif meaning is Meaning.THREADING_CYCLE:
            self._threading()
        elif meaning in HOLES:
            self._hole(meaning)
        elif meaning is Meaning.RIGID_TAPPING:
            self._rigid_tapping()
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
        if not {"X", "Z", "U", "W"} & set(self.block.words):
            raise self.error(
                f"{modal.motion_code} is a cycle here and names no end point{self._other_readings()}.", "Add X and Z words, or take it out."
            )
        word = self.take("R") or self.take("K" if meaning is Meaning.FACING_CYCLE_SIMPLE else "I")
        modal.taper = self._told_length(word) if word is not None else modal.taper
        here = (modal.x, modal.z)
        modal.x, modal.z = modal.cycle_end if modal.cycle_end is not None else here
        from_start = {letter for letter in ("UW" if modal.absolute else "UWXZ") if letter in self.block.words}
        modal.x = here[0] if from_start & {"U", "X"} else modal.x
        modal.z = here[1] if from_start & {"W", "Z"} else modal.z
        end = self.target()
        modal.x, modal.z = here
        modal.cycle_end = end
        cut = start[0] - end[0] if meaning is Meaning.FACING_CYCLE_SIMPLE else start[1] - end[1]
        if cut == 0.0 and modal.taper == 0.0:
            axis = "X" if meaning is Meaning.FACING_CYCLE_SIMPLE else "Z"
            self.warn(f"{modal.motion_code} ends at the {axis} where it begins, and cuts nothing. Add {axis}.")
        if meaning is Meaning.THREADING_CYCLE_SIMPLE:
            self.check_thread(modal.motion_code)
            lead = self._lead()
            if modal.thread_chamfer == 0.0:
                self.assumed["thread_run_out"] = f"none at the end of {modal.motion_code}, because no block of G76 sets one"
            self._carry_out(
                threading_pass(start, end, modal.taper, lead, modal.thread_chamfer * lead),
                modal.motion_code,
                compensated=False,
                start_angle=self.start_angle(),
            )
            return
        self.check_feed()
        steps = (turning_pass if meaning is Meaning.TURNING_CYCLE_SIMPLE else facing_pass)(start, end, modal.taper)
        self._carry_out(steps, modal.motion_code)

    def _lead(self) -> float:
        """Return the lead of a thread [m], which the word F gives (it is no feed); the one before stays in force."""
        word = self.take("F") or self.take("E")
        modal = self.modal
        if word is not None:
            if word.value <= 0.0:
                raise self.error(f"{word.text} is no lead.", "Give the lead of the thread above 0, for example F1.5.")
            modal.lead = self.told_lead(word)
        if modal.lead is None:
            raise self.error(f"{self._code()} needs a lead and has none.", "Add an F word, for example F1.5.")
        return modal.lead

    def _thread_by_feed(self) -> None:
        """G32: one thread move, its lead in F counted along the longer axis."""
        modal = self.modal
        if Meaning.THREAD_BY_FEED in self.block.codes:
            modal.motion, modal.motion_code = Meaning.THREAD_BY_FEED, self.block.codes[Meaning.THREAD_BY_FEED].code
        self.check_thread(modal.motion_code)
        lead, angle = self._lead(), self.start_angle()
        begin = (modal.x, modal.z)
        end = self.target()
        if end == begin:
            raise self.error(f"{modal.motion_code} names no end point.", "Add a Z word.")
        self.add("thread", end, feed=lead_along_path(begin, end, lead), per_revolution=True, start_angle=angle)

    # ---- grooving, threading -----------------------------------------------------------------------------------------------------

    def _pecking(self, meaning: Meaning) -> None:
        """G74 and G75, in two blocks (R alone, then the cycle with P and Q) or in one (I and K)."""
        modal, code, across = self.modal, self.block.codes[meaning].code, meaning is Meaning.GROOVING_CYCLE
        if not any(letter in self.block.words for letter in ("X", "Z", "U", "W")):
            word = self.take("R")
            modal.peck_retract = self._told_retract(word, code) if word is not None else modal.peck_retract
            return
        p, q, i, k = (self.take(letter) for letter in "PQIK")
        step_x = self._step(p, code) if p is not None else modal.metres(i.value) if i is not None else 0.0
        step_z = self._step(q, code) if q is not None else modal.metres(k.value) if k is not None else 0.0
        self._ignored_word("R", code)
        start, end = (modal.x, modal.z), self.target()
        if (step_x if across else step_z) < 0.0 or (step_z if across else step_x) < 0.0:
            raise self.error(f"{code} has a step below 0.", "Give steps without a sign; the end point says the direction.")
        self.check_feed()
        step, aside = (step_x, step_z) if across else (step_z, step_x)
        retract = self._retract(modal.peck_retract, step or RETRACT)
        ways = (abs(end[0] - start[0]), abs(end[1] - start[1]))
        deep, wide = ways if across else ways[::-1]
        if wide > 1e-6 and not aside:
            letters = ("Q", "K") if across else ("P", "I")
            self.warn(f"{code} has no step to the side and cuts at both ends only. Add {letters[0]} or {letters[1]}.")
        self._check_count((deep / step if step else 1.0) * (wide / aside + 1.0 if aside else 2.0), code)
        self._carry_out(pecking(start, end, across=across, step=step, aside=aside, retract=retract), code, compensated=False)

    def _threading(self) -> None:
        """G76: of LinuxCNC (P is the pitch), of Fanuc in two blocks, or of Haas in one (K and D)."""
        if self.dialect.thread_drive_line:
            self._drive_line_threading()
            return
        modal, code = self.modal, self.block.codes[Meaning.THREADING_CYCLE].code
        if not any(letter in self.block.words for letter in ("X", "Z", "U", "W")):
            p, q, r = (self.take(letter) for letter in "PQR")
            if p is not None:
                if "." in p.text or p.value < 0.0:
                    raise self.error(f"{p.text} of {code} is no number of six digits.", "Write passes, run-out and angle: P010060.")
                digits = int(p.value)
                modal.thread_finishing, modal.thread_angle = max(1, digits // 10000), math.radians(digits % 100)
                modal.thread_chamfer = 0.1 * (digits // 100 % 100)
            modal.has_thread_values = True
            modal.thread_smallest = self._length(q) if q is not None else modal.thread_smallest
            modal.thread_allowance = self._length(r) if r is not None else modal.thread_allowance
            return
        self.check_thread(code)
        one_block = "K" in self.block.words
        if one_block:  # P is the way of feeding in
            self.take("P")
        height, first = (self.take("K"), self.take("D")) if one_block else (self.take("P"), self.take("Q"))
        taper = self.take("I") if one_block else self.take("R")
        angle = self.take("A")
        if height is None or first is None:
            raise self.error(
                f"{code} needs the height of the thread and the first depth.", f"Write it as {code} X18.16 Z-17. P920 Q300 F1.5."
            )
        lead = self._lead()
        if one_block:
            self.assumed["thread_run_out"] = f"none at the end of {code} in one block"
        elif not modal.has_thread_values:
            self.assumed["thread_passes"] = f"no first block of {code}: one finishing pass, no run-out, an angle and an allowance of 0"
        start, end = (modal.x, modal.z), self.target()
        threading = Threading(
            start=start,
            end=end,
            height=self._length(height),
            first_depth=self._length(first),
            lead=lead,
            smallest=modal.thread_smallest,
            allowance=modal.thread_allowance,
            finishing=0 if one_block else modal.thread_finishing,
            chamfer=0.0 if one_block else modal.thread_chamfer * lead,
            angle=math.radians(angle.value) if angle is not None else modal.thread_angle,
            taper=self._told_length(taper) if taper is not None else 0.0,
        )
        if not 0.0 < threading.first_depth <= threading.height:
            raise self.error(f"The first depth of {code} must be above 0 and at most the height of the thread.", "Correct P and Q.")
        if not 0.0 <= threading.allowance < threading.height:
            fact = f"The finishing allowance of {code} must be below the height of the thread."
            raise self.error(fact, f"Correct R of the first {code}.")
        if threading.begins_inside:
            self.warn(f"{code} begins below the crest of its thread; its rapid moves cross the thread. Begin it further out.")
        self._check_passes(2.0 * math.log(threading.height / threading.first_depth), threading.finishing, code)
        angle_of_start = self.start_angle() if one_block else 0.0
        self._carry_out(threading.steps(), code, compensated=False, start_angle=angle_of_start)

    def _check_passes(self, logarithm: float, further: float, code: str) -> None:
        """Refuse a thread of more passes than are laid out; ``logarithm`` is that of how many come down to the full depth."""
        if logarithm > math.log(MOST_PASSES) or further > MOST_PASSES:
            raise self.error(f"{code} would make more than {MOST_PASSES} passes.", "Take a larger first depth, or fewer further passes.")

    def _drive_line_threading(self) -> None:
        """Expand LinuxCNC's G76: P pitch, Z end, I crest, J first depth, K full depth, R degression, Q slide angle, H spring passes.

        I, J and K are diameters in G7 and radii in G8. Source: LinuxCNC 2.9 manual, G76.
        """
        modal, code = self.modal, self.block.codes[Meaning.THREADING_CYCLE].code
        self.check_plane(code)
        self.check_thread(code)
        words = {letter: self.take(letter) for letter in "PIJKRQHEL"}
        missing = [letter for letter in "PIJK" if words[letter] is None]
        if missing or "Z" not in self.block.words:
            wanted = ", ".join([*missing, *(["Z"] if "Z" not in self.block.words else [])])
            raise self.error(f"{code} needs {wanted}.", f"Write it as {code} P1.5 Z-20 I-2 J0.3 K0.92.")
        values = {letter: word.value if word is not None else 0.0 for letter, word in words.items()}
        if values["L"] not in (0.0, 1.0, 2.0, 3.0) or values["E"] < 0.0 or (values["L"] and not values["E"]):
            raise self.error(
                f"{code} needs L from 0 to 3, and with it E above 0.", "L1 tapers the entry over the length E, L2 the exit, L3 both."
            )
        if values["P"] <= 0.0 or values["J"] <= 0.0 or values["K"] <= values["J"]:
            raise self.error(f"{code} needs P and J above 0 and K above J.", "Correct P, J and K.")
        if words["R"] is not None and values["R"] < 1.0:
            raise self.error(f"R of {code} is below 1.", "Write R1 for passes of equal depth, R2 for passes of equal area.")
        if values["I"] == 0.0:
            raise self.error(f"I of {code} is 0 and says no side.", "Write it below 0 for an outer thread, above 0 for an inner one.")
        if "X" in self.block.words:
            fact = f"{code} cuts along the X of its start, and its block names another X."
            raise self.error(fact, "Take the X word out; I says where the crest is.")
        start = (modal.x, modal.z)
        end = self.target()
        if modal.metres(values["E"]) > 0.5 * abs(end[1] - start[1]):
            raise self.error(f"The taper E of {code} is longer than half of the thread.", "Make E shorter.")
        self._check_passes((values["R"] or 1.0) * math.log(values["K"] / values["J"]), values["H"], code)
        threading = DriveLineThreading(
            start,
            end[1],
            pitch=modal.metres(values["P"]),
            peak=modal.across(values["I"]),
            first=modal.across(values["J"]),
            full=modal.across(values["K"]),
            degression=values["R"] or 1.0,
            slide=math.radians(values["Q"]),
            spring=max(0, round(values["H"])),
            taper=modal.metres(values["E"]),
            tapers_in=values["L"] in (1.0, 3.0),
            tapers_out=values["L"] in (2.0, 3.0),
        )
        self._carry_out(threading.steps(), code, compensated=False, start_angle=self.start_angle())
