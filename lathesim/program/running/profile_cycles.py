"""The blocks that call LinuxCNC's contour cycles, G70 to G72.2, expanded to moves; the contour is a subprogram.

Source: LinuxCNC 2.9 manual, G70, G71 and G72. Left out: fillets (A) and chamfers (C) between the moves of a contour.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

from lathesim.program.cycles.roughing import Cuts, Roughing, air_side, contour_points
from lathesim.program.cycles.step import Point, Step
from lathesim.program.meanings import Meaning
from lathesim.program.moves import Move
from lathesim.program.nose.compensation import beside
from lathesim.program.nose.tool_nose import LEFT, RIGHT
from lathesim.program.running.contour_cycles import ROUGHING, ContourCycles
from lathesim.program.words import Word

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
        self._carry_out([Step("rapid", start)], code)
        retract = self._told_retract(words["R"], code) if words["R"] is not None else modal.metres(0.5)
        for letter, told in (("I", depth), ("R", retract)):
            if words[letter] is None:
                self.assumed[f"{letter} of {code}"] = f"{1e3 * told:g} mm, as in LinuxCNC"
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

    def _profile_passes(self, start: Point, contour: list[Move], far: float, near: float, passes: int) -> list[Step]:
        """Return the passes of LinuxCNC's G70, the first at the distance ``far`` and the last at ``near`` [m] from the contour."""
        steps: list[Step] = []
        for number in range(passes, 0, -1):
            shifted = beside(contour, _left_or_right(start, contour), (number - 1) * (far - near) / passes + near, self.blocks.name)
            steps += [Step("rapid", start), Step("rapid", (shifted[0].start_x, shifted[0].start_z))]
            steps += [Step("arc" if move.arc is not None else "feed", (move.end_x, move.end_z), arc=move.arc) for move in shifted]
        return steps

    def _check_over(self, start: Point, contour: list[Move], code: str) -> None:
        """Warn of a cycle that begins over its contour, at the end of the previous cycle: its rapid to the first point crosses the part."""
        points = contour_points(contour)
        first, last = points[0], points[-1]
        if min((start[1] - first[1]) * (last[1] - first[1]), (start[0] - first[0]) * (last[0] - first[0])) > _SAME**2:
            x, z = self.modal.here
            self.warn(
                f"{code} begins at X {1e3 * x:.6g} mm (radius), Z {1e3 * z:.6g} mm, over its contour, and its rapid to the "
                "first point crosses the part. Add X and Z of a point in front of the contour."
            )


def _left_or_right(start: Point, contour: list[Move]) -> int:
    """Return the side of a contour, looking along it, on which a tool at ``start`` [m] waits: the sign of the enclosed area decides."""
    points = [start, *contour_points(contour), start]
    area = sum(here[1] * there[0] - there[1] * here[0] for here, there in itertools.pairwise(points))
    return LEFT if area > 0.0 else RIGHT
