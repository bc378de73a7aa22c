"""Cycles for holes: drilling, tapping and boring, from their words to their steps.

The drilling cycles along Z: rapid to the R plane, in by feed or on a lead, out to the start of the cycle or to the R plane.

Source: Haas lathe operator's manual, canned cycles for drilling; Fanuc 0i-T operator's manual, canned cycle for drilling; LinuxCNC 2.9,
canned cycles of the interpreter. Left out: drilling from the side, back boring, tapping in pecks.

The blocks that drill, bore and tap along Z, expanded hole by hole to moves.

Source: Fanuc 0i-T operator's manual, canned cycle for drilling; Haas lathe operator's manual, G81 to G85; LinuxCNC 2.9, G33.1 and the
canned cycles of the interpreter (interp_cycles.cc). Left out: drilling from the side, tapping in pecks, a second spindle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from lathesim.program.contour_cycles import ContourCycles
from lathesim.program.cycles import CycleStep, Point
from lathesim.program.meanings import HOLES, Meaning
from lathesim.units import in_unit

_EPSILON = 1e-9
CLEAR = 0.5e-3
"""[m] how far in front of the last depth a peck begins to feed, assumed: a common setting of controls."""


def drilling(
    start: Point, place: Point, *, plane: float, back: float, peck: float = 0.0, dwell: float = 0.0, feed_out: bool = False
) -> list[CycleStep]:
    """Return one hole from ``start`` to ``place`` (x, z of the bottom).

    ``plane`` and ``back`` are places along Z [m]: where the feed begins, and where the cycle ends. Behind each ``peck`` [m] the drill comes
    out to the plane.
    """
    x, bottom = place
    toward = -1.0 if bottom < plane else 1.0
    steps = [CycleStep("rapid", (x, start[1])), CycleStep("rapid", (x, plane))]
    depth = plane
    while toward * (bottom - depth) > _EPSILON:
        deeper = bottom if peck <= 0.0 or toward * (bottom - depth) <= peck + _EPSILON else depth + toward * peck
        if depth != plane:
            steps += [CycleStep("rapid", (x, plane)), CycleStep("rapid", (x, depth - toward * min(CLEAR, peck)))]
        steps.append(CycleStep("feed", (x, deeper)))
        depth = deeper
    if dwell > 0.0:
        steps.append(CycleStep("dwell", (x, bottom), seconds=dwell))
    if feed_out:
        steps.append(CycleStep("feed", (x, plane)))
    return [*steps, CycleStep("rapid", (x, back))]


def tapping(start: Point, place: Point, *, plane: float, back: float, lead: float) -> list[CycleStep]:
    """Return one tapped hole: in with the ``lead`` [m] from the R plane, out with the spindle reversed; see :func:`drilling`."""
    x, bottom = place
    return [
        CycleStep("rapid", (x, start[1])),
        CycleStep("rapid", (x, plane)),
        CycleStep("thread", (x, bottom), lead=lead),
        CycleStep("thread", (x, plane), lead=lead, spin=-1.0),
        CycleStep("rapid", (x, back)),
    ]


@dataclass(frozen=True)
class Hole:
    """One hole of LinuxCNC's cycles, from the R ``plane`` down to the ``bottom`` and out to ``clear``, all positions along Z [m].

    After each ``peck`` [m] the drill retracts to the plane; with ``breaks_chips`` only by ``lift`` [m]. The feed starts again ``lift`` in
    front of the last depth. ``dwell`` [s] is at the bottom. With ``feeds_out`` the tool leaves by feed, with ``out_to_plane`` only as far
    as the plane. ``spin`` is the spindle speed on the way out over the programmed one: 0 means stopped, -1 reversed.
    """

    plane: float
    bottom: float
    clear: float
    peck: float = 0.0
    lift: float = 0.0
    breaks_chips: bool = False
    dwell: float = 0.0
    feeds_out: bool = False
    out_to_plane: bool = False
    spin: float = 1.0

    def steps(self, x: float) -> list[CycleStep]:
        """Return the steps of the hole at ``x`` [m]; the tool stands on the R plane."""
        steps: list[CycleStep] = []
        count = 1
        while self.peck > 0.0 and self.plane - count * self.peck > self.bottom + _EPSILON:
            depth = self.plane - count * self.peck
            steps.append(CycleStep("feed", (x, depth)))
            if not self.breaks_chips:
                steps.append(CycleStep("rapid", (x, self.plane)))
            steps.append(CycleStep("rapid", (x, depth + self.lift)))
            count += 1
        steps.append(CycleStep("feed", (x, self.bottom)))
        if self.dwell > 0.0:
            steps.append(CycleStep("dwell", (x, self.bottom), seconds=self.dwell, spin=min(self.spin, 1.0) or 1.0))
        if self.feeds_out:
            steps.append(CycleStep("feed", (x, self.plane if self.out_to_plane else self.clear), spin=self.spin))
        return steps if self.feeds_out and not self.out_to_plane else [*steps, CycleStep("rapid", (x, self.clear), spin=self.spin)]


_PECKS = (Meaning.PECK_DRILLING, Meaning.CHIP_BREAKING)
_DWELLS = (Meaning.DRILLING_WITH_DWELL, Meaning.BORING_STOPPED, Meaning.BORING_WITH_DWELL)
_FEEDS_OUT = (Meaning.BORING, Meaning.BORING_WITH_DWELL, Meaning.TAPPING, Meaning.TAPPING_LEFT)
_TURNS = {Meaning.TAPPING: 1, Meaning.TAPPING_LEFT: -1}
_SPIN = {Meaning.TAPPING: -1.0, Meaning.TAPPING_LEFT: -1.0, Meaning.BORING_STOPPED: 0.0}
_LIFT = 0.254e-3
"""Distance [m] in front of the last depth at which LinuxCNC begins to feed again. Source: interp_cycles.cc, 0.01 inch."""


class HoleCycles(ContourCycles):
    """Expands the cycles along Z; ``modal.level`` is the start of the first one [m], ``modal.cycle_words`` holds the modal words."""

    def _hole(self, meaning: Meaning) -> None:
        if self.dialect.drills_in_xy:
            self._canned(meaning)
        else:
            self._drilling(meaning)

    def _drilling(self, meaning: Meaning) -> None:
        """Expand G81 to G85: Z is the bottom, R the plane in front of the hole, Q the peck; all are modal until G80."""
        modal = self.modal
        if meaning in self.block.codes:
            modal.motion, modal.motion_code = meaning, self.block.codes[meaning].code
            modal.cycle_words, modal.level = {}, modal.z
        letters = "R" if meaning is Meaning.TAPPING else "RQP"
        words = {letter: word for letter in letters if (word := self.take(letter)) is not None}
        values = {letter: self._told_length(word) if letter == "Q" else word.value for letter, word in words.items()}
        if "P" in words:
            values["P"] = words["P"].value * (1.0 if "." in words["P"].text else 1e-3)
        start, level = (modal.x, modal.z), modal.z if modal.level is None else modal.level
        below = "W" in self.block.words or ("Z" in self.block.words and not modal.absolute)
        place = self.target()
        modal.cycle_words.update(values)
        given = modal.cycle_words
        plane = self._plane(given.get("R"), level)
        if below:
            given["Z"] = plane + place[1] - start[1]
            self.assumed["drilling_depth"] = "an incremental depth is counted from the R plane, as on Fanuc"
        elif "Z" in self.block.words:
            given["Z"] = place[1]
        if "Z" not in given:
            raise self.error(f"{modal.motion_code} names no bottom of the hole.", f"Write it as {modal.motion_code} Z-20. R2. F0.1.")
        if (given["Z"] - level) * (given["Z"] - plane) < 0.0:
            raise self.error(f"The R plane of {modal.motion_code} lies beyond the bottom of its hole.", "R is where the feed begins.")
        if meaning is Meaning.TAPPING:
            self._tapping(start, (place[0], given["Z"]), plane, plane if self._returns_to_plane() else level)
            return
        self.check_feed()
        if meaning is Meaning.PECK_DRILLING and given.get("Q", 0.0) > 0.0:
            self._check_count(abs(given["Z"] - plane) / given["Q"], modal.motion_code)
            self.assumed["peck_clearance"] = f"{in_unit(CLEAR, 'mm', 'g')} in front of the last depth, never more than one peck"
        elif meaning is Meaning.PECK_DRILLING:
            self.warn(f"{modal.motion_code} has no peck and drills in one stroke. Add Q.")
        steps = drilling(
            start,
            (place[0], given["Z"]),
            plane=plane,
            back=plane if self._returns_to_plane() else level,
            peck=given.get("Q", 0.0) if meaning is Meaning.PECK_DRILLING else 0.0,
            dwell=given.get("P", 0.0),
            feed_out=meaning is Meaning.BORING,
        )
        self._carry_out(steps, modal.motion_code, compensated=False)

    def _returns_to_plane(self) -> bool:
        """Return whether holes end at the R plane; the default of a dialect is noted as an assumption."""
        if self.modal.returns_to_plane is None and self.dialect.returns_to_plane:
            self.assumed["cycle_return"] = "to the R plane, as G99 does"
        return self.dialect.returns_to_plane if self.modal.returns_to_plane is None else self.modal.returns_to_plane

    def _plane(self, r: float | None, level: float) -> float:
        """Return the Z of the R plane [m]: R is a position, as on Haas; a negative R counts from the start of the cycle, as on Fanuc."""
        if r is None:
            return level
        if r < 0.0:
            self.assumed["drilling_plane"] = "R below 0 counts from the start of the cycle"
            return level + self.modal.metres(r)
        self.assumed["drilling_plane"] = "R from 0 up is a position, as on Haas; Fanuc counts it from where the cycle began"
        return self.modal.zero[1] + self.modal.metres(r)

    def _tapping(self, start: Point, place: Point, plane: float, back: float) -> None:
        """Expand G84 of Fanuc and Haas: in with the lead that F gives per revolution or per minute, out with the spindle reversed."""
        modal, code = self.modal, self.modal.motion_code
        self._ignored_word("P", code)
        if modal.surface or not modal.speed:
            fact = "constant surface speed is in force" if modal.surface else "no speed is set"
            raise self.error(f"{code} follows the spindle, and {fact}.", "Write G97 and an S word before it.")
        self.assumed["tapping_depth"] = "deeper than Z while the spindle reverses"
        if modal.direction < 0:
            self.warn(f"{code} cuts a left-hand thread, because M4 turns the spindle. Write M3 for a right-hand one.")
        standing = modal.direction == 0
        if standing:
            modal.direction = 1
            self.assumed["tapping"] = f"{code} starts the standing spindle clockwise and stops it after the hole"
            self.event("spindle", direction=1)
        self.check_feed()
        lead = (modal.feed or 0.0) if modal.per_revolution else (modal.feed or 0.0) * 2.0 * math.pi / modal.speed
        self._carry_out(tapping(start, place, plane=plane, back=back, lead=lead), code, compensated=False)
        if standing:
            modal.direction = 0
            self.event("spindle")

    def _rigid_tapping(self) -> None:
        """Expand G33.1: in with the lead K, and out to the start with the spindle reversed, I times as fast."""
        modal, start = self.modal, (self.modal.x, self.modal.z)
        if Meaning.RIGID_TAPPING in self.block.codes:
            modal.motion, modal.motion_code = Meaning.RIGID_TAPPING, self.block.codes[Meaning.RIGID_TAPPING].code
        code = modal.motion_code
        lead, faster = self.lead_along(Meaning.RIGID_TAPPING), self.take("I")
        end = self.target()
        if end == start:
            raise self.error(f"{code} names no end point.", "Add a Z word.")
        if faster is not None and faster.value <= 0.0:
            raise self.error(f"{faster.text} is not a factor of the speed on the way out.", "Give it above 0, or take it out.")
        spin = -1.0 if faster is None else -faster.value
        self._carry_out([CycleStep("thread", end, lead=lead), CycleStep("thread", start, lead=lead, spin=spin)], code)

    # ---- LinuxCNC ----------------------------------------------------------------------------------------------------------------

    def _canned(self, meaning: Meaning) -> None:
        """Expand G73, G74 and G81 to G89 of LinuxCNC, along Z in the XY plane: R, Z, Q and P are modal, L repeats."""
        modal = self.modal
        repeated = modal.motion is meaning
        if modal.motion not in HOLES:
            modal.level = modal.z
        if meaning in self.block.codes:
            modal.motion, modal.motion_code = meaning, self.block.codes[meaning].code
        code = modal.motion_code
        if modal.plane is not Meaning.PLANE_XY:
            plane, own = self.code_for(Meaning.PLANE_XY), self.code_for(Meaning.PLANE_XZ)
            raise self.error(
                f"{code} drills along Z only in {plane}; in {own} it drills along Y.", f"Write {plane} before it and {own} after it."
            )
        if modal.nose is not None:
            raise self.error(f"{code} does not go with nose compensation.", "Write G40 before it.")
        if not repeated:
            modal.cycle_words = {}
        modal.cycle_words.update({letter: word.value for letter in "RQPZ" if (word := self.take(letter)) is not None})
        self._check_canned(meaning, code)
        self.check_feed()
        if meaning in _SPIN and modal.direction != _TURNS.get(meaning, modal.direction or 1):
            turn = "M4" if meaning is Meaning.TAPPING_LEFT else "M3"
            raise self.error(f"{code} needs a spindle that turns by {turn}.", f"Write {turn} before it.")
        self._drill_holes(meaning, code)

    def _check_canned(self, meaning: Meaning, code: str) -> None:
        """Raise :class:`ProgramError` for missing words, or words that contradict each other."""
        given, example = self.modal.cycle_words, f"Write it as {self.modal.motion_code} R2 Z-20"
        needed = [*"RZ", *("Q" if meaning in _PECKS else ""), *("P" if meaning in _DWELLS else "")]
        missing = [letter for letter in needed if letter not in given]
        if missing:
            example += " Q5" if meaning in _PECKS else " P0.5" if meaning in _DWELLS else ""
            raise self.error(f"{code} needs {' and '.join(missing)}.", f"{example}.")
        if meaning in _PECKS and given["Q"] <= 0.0:
            raise self.error(f"The peck Q of {code} is not above 0.", "Give the depth of one peck without a sign.")
        if given.get("P", 0.0) < 0.0:
            raise self.error(f"P of {code} is below 0.", "Give it without a sign.")
        if (given["Z"] > 0.0) if not self.modal.absolute else (given["Z"] > given["R"]):
            raise self.error(f"The bottom Z of {code} lies above its R plane.", "Give a Z below R: the feed begins at R and ends at Z.")

    def _drill_holes(self, meaning: Meaning, code: str) -> None:
        """Drill the hole L times: at the same place, or with G91 each one further along X."""
        modal, given = self.modal, {letter: self.modal.metres(value) for letter, value in self.modal.cycle_words.items()}
        count = self.take("L")
        repeats = 1 if count is None else int(count.value)
        if count is not None and (count.value != repeats or repeats < 1):
            raise self.error(f"{count.text} of {code} is not a number of holes.", "Give a whole number above 0.")
        level = modal.z if modal.level is None else modal.level
        plane = given["R"] + (modal.zero[1] if modal.absolute else level)
        bottom = given["Z"] + (modal.zero[1] if modal.absolute else plane)
        x = self.target()[0]
        along = 0.0 if modal.absolute else x - modal.x
        steps = [CycleStep("rapid", (modal.x, plane))] if level < plane else []
        here, level = (plane, plane) if level < plane else (modal.z, level)
        clear = plane if self._returns_to_plane() else level
        if given.get("Q", 0.0) > 0.0 and meaning in _PECKS:
            self._check_count(repeats * (plane - bottom) / given["Q"], code)
        self._check_count(float(repeats), code)
        hole = Hole(
            plane,
            bottom,
            clear,
            peck=given["Q"] if meaning in _PECKS else 0.0,
            lift=given.get("P", _LIFT),
            breaks_chips=meaning is Meaning.CHIP_BREAKING,
            dwell=0.0 if meaning in (*_PECKS, Meaning.DRILLING, Meaning.BORING) else modal.cycle_words.get("P", 0.0),
            feeds_out=meaning in _FEEDS_OUT,
            out_to_plane=meaning is Meaning.BORING,
            spin=_SPIN.get(meaning, 1.0),
        )
        for number in range(repeats):
            place = x + number * along
            first = number == 0 and here > plane
            steps.append(CycleStep("rapid", (place, here if first else clear)))
            if first or clear > plane:
                steps.append(CycleStep("rapid", (place, plane)))
            steps += hole.steps(place)
        self._carry_out(steps, code, keep=True)
