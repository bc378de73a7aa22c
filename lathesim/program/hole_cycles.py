"""Cycles for holes along Z, drilled, tapped or bored: rapid to the R plane, in by feed or on a lead, out to the start or to the R plane.

Source: Haas lathe operator's manual, canned cycles for drilling, G81 to G85; Fanuc 0i-T operator's manual, canned cycle for drilling;
LinuxCNC 2.9, G33.1 and the canned cycles of the interpreter (interp_cycles.cc). Left out: drilling from the side, back boring, tapping in
pecks, a second spindle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from lathesim.errors import Fault
from lathesim.program.cycles import EPSILON, CycleStep, begun, carry_out, check_count, feeds, ignored_word, length, rapids
from lathesim.program.dialects import Dialect
from lathesim.program.meanings import HOLES, Meaning
from lathesim.program.modal import Modal, Point
from lathesim.program.motions import check_feed, lead_along, target
from lathesim.program.moves import Event, Made
from lathesim.program.vocabulary import Sorted
from lathesim.units import in_unit

_PECKS = (Meaning.PECK_DRILLING, Meaning.CHIP_BREAKING)
_DWELLS = (Meaning.DRILLING_WITH_DWELL, Meaning.BORING_STOPPED, Meaning.BORING_WITH_DWELL)
_NO_DWELL = (*_PECKS, Meaning.DRILLING, Meaning.BORING)
_FEEDS_OUT = (Meaning.BORING, Meaning.BORING_WITH_DWELL, Meaning.TAPPING, Meaning.TAPPING_LEFT)
_TURNS = {Meaning.TAPPING: 1, Meaning.TAPPING_LEFT: -1}
_SPIN = {Meaning.TAPPING: -1.0, Meaning.TAPPING_LEFT: -1.0, Meaning.BORING_STOPPED: 0.0}
_CLEAR = 0.5e-3
"""[m] how far in front of the last depth a peck begins to feed, assumed: a common setting of controls."""
_LIFT = 0.254e-3
"""[m] the same in LinuxCNC. Source: interp_cycles.cc, 0.01 inch."""


def hole(block: Sorted, modal: Modal, dialect: Dialect, meaning: Meaning) -> Made:
    """Expand a cycle for holes as the dialect has it."""
    return (_canned if dialect.cycles.drills_in_xy else _drilling)(block, modal, dialect, meaning)


def _returns_to_plane(block: Sorted, modal: Modal, dialect: Dialect) -> bool:
    """Return whether holes end at the R plane; the default of a dialect is noted as an assumption."""
    if modal.hole.returns_to_plane is not None:
        return modal.hole.returns_to_plane
    if dialect.cycles.returns_to_plane:
        block.assume("cycle_return", "to the R plane, as G99 does")
    return dialect.cycles.returns_to_plane


# ---- Fanuc and Haas ------------------------------------------------------------------------------------------------------------------


def _drilling(block: Sorted, modal: Modal, dialect: Dialect, meaning: Meaning) -> Made:
    """Expand G81 to G85: Z is the bottom, R the plane in front of the hole, Q the peck; all are modal until G80."""
    start, hole = modal.place, modal.hole
    if begun(block, modal, meaning):
        hole.words, hole.level = {}, modal.z
    code, level, given = modal.modes.motion_code, modal.z if hole.level is None else hole.level, hole.words
    for letter, word in block.takes("R" if meaning is Meaning.TAPPING else "RQP").items():
        in_milliseconds = letter == "P" and "." not in word.text
        given[letter] = length(block, modal, word) if letter == "Q" else word.value * (1e-3 if in_milliseconds else 1.0)
    below = "W" in block.words or ("Z" in block.words and not modal.modes.absolute)
    x, bottom = target(block, modal, dialect)
    plane = _plane(block, modal, given.get("R"), level)
    if below:
        given["Z"] = plane + bottom - start[1]
        block.assume("drilling_depth", "an incremental depth is counted from the R plane, as on Fanuc")
    elif "Z" in block.words:
        given["Z"] = bottom
    if "Z" not in given:
        raise Fault(f"{code} names no bottom of the hole.", f"Write it as {code} Z-20. R2. F0.1.")
    bottom = given["Z"]
    if (bottom - level) * (bottom - plane) < 0.0:
        raise Fault(f"The R plane of {code} lies beyond the bottom of its hole.", "R is where the feed begins.")
    if meaning is Meaning.TAPPING:
        return _tapping(block, modal, dialect, (x, bottom), plane, level)
    check_feed(block, modal, dialect)
    peck = given.get("Q", 0.0) if meaning is Meaning.PECK_DRILLING else 0.0
    if peck > 0.0:
        check_count(abs(bottom - plane) / peck, code)
        block.assume("peck_clearance", f"{in_unit(_CLEAR, 'mm', 'g')} in front of the last depth, never more than one peck")
    elif meaning is Meaning.PECK_DRILLING:
        block.warn(f"{code} has no peck and drills in one stroke. Add Q.")
    steps = rapids((x, start[1]), (x, plane)) + _strokes(x, plane, bottom, peck)
    if given.get("P", 0.0) > 0.0:
        steps.append(CycleStep("dwell", (x, bottom), seconds=given["P"]))
    steps += feeds((x, plane)) if meaning is Meaning.BORING else []
    steps += rapids((x, plane if _returns_to_plane(block, modal, dialect) else level))
    return carry_out(block, modal, steps, code, compensated=False)


def _strokes(x: float, plane: float, bottom: float, peck: float) -> list[CycleStep]:
    """Return the feeds from the R plane to the bottom [m]; behind each ``peck`` the drill comes out to the plane."""
    toward = -1.0 if bottom < plane else 1.0
    steps: list[CycleStep] = []
    depth = plane
    while toward * (bottom - depth) > EPSILON:
        deeper = bottom if peck <= 0.0 or toward * (bottom - depth) <= peck + EPSILON else depth + toward * peck
        if depth != plane:
            steps += rapids((x, plane), (x, depth - toward * min(_CLEAR, peck)))
        steps += feeds((x, deeper))
        depth = deeper
    return steps


def _plane(block: Sorted, modal: Modal, r: float | None, level: float) -> float:
    """Return the Z of the R plane [m]: R is a position, as on Haas; a negative R counts from the start of the cycle, as on Fanuc."""
    if r is None:
        return level
    if r < 0.0:
        block.assume("drilling_plane", "R below 0 counts from the start of the cycle")
        return level + modal.metres(r)
    block.assume("drilling_plane", "R from 0 up is a position, as on Haas; Fanuc counts it from where the cycle began")
    return modal.origin.zero[1] + modal.metres(r)


def _tapping(block: Sorted, modal: Modal, dialect: Dialect, place: Point, plane: float, level: float) -> Made:
    """Expand G84 of Fanuc and Haas: in with the lead that F gives per revolution or per minute, out with the spindle reversed."""
    spindle, code, feed, (x, bottom) = modal.spindle, modal.modes.motion_code, modal.feed, place
    back = plane if _returns_to_plane(block, modal, dialect) else level
    ignored_word(block, "P", code)
    if spindle.surface or not spindle.speed:
        fact = "constant surface speed is in force" if spindle.surface else "no speed is set"
        raise Fault(f"{code} follows the spindle, and {fact}.", "Write G97 and an S word before it.")
    block.assume("tapping_depth", "deeper than Z while the spindle reverses")
    if spindle.direction < 0:
        block.warn(f"{code} cuts a left-hand thread, because M4 turns the spindle. Write M3 for a right-hand one.")
    starts = spindle.direction == 0
    if starts:
        spindle.direction = 1
        block.assume("tapping", f"{code} starts the standing spindle clockwise and stops it after the hole")
    check_feed(block, modal, dialect)
    lead = (feed.value or 0.0) if feed.per_revolution else (feed.value or 0.0) * 2.0 * math.pi / spindle.speed
    threads = [CycleStep("thread", (x, bottom), lead=lead), CycleStep("thread", (x, plane), lead=lead, spin=-1.0)]
    made = carry_out(block, modal, [*rapids((x, modal.z), (x, plane)), *threads, *rapids((x, back))], code, compensated=False)
    if not starts:
        return made
    spindle.direction = 0
    return [Event("spindle", block.line, direction=1), *made, Event("spindle", block.line)]


# ---- LinuxCNC ------------------------------------------------------------------------------------------------------------------------


def rigid_tapping(block: Sorted, modal: Modal, dialect: Dialect, meaning: Meaning) -> Made:
    """Expand G33.1: in with the lead K, and out to the start with the spindle reversed, I times as fast."""
    begun(block, modal, meaning)
    code, start = modal.modes.motion_code, modal.place
    lead, faster = lead_along(block, modal, meaning), block.take("I")
    end = target(block, modal, dialect)
    if end == start:
        raise Fault(f"{code} names no end point.", "Add a Z word.")
    if faster is not None and faster.value <= 0.0:
        raise Fault(f"{faster.text} is not a factor of the speed on the way out.", "Give it above 0, or take it out.")
    spin = -1.0 if faster is None else -faster.value
    return carry_out(block, modal, [CycleStep("thread", end, lead=lead), CycleStep("thread", start, lead=lead, spin=spin)], code)


def _canned(block: Sorted, modal: Modal, dialect: Dialect, meaning: Meaning) -> Made:
    """Expand G73, G74 and G81 to G89 of LinuxCNC, along Z in the XY plane: R, Z, Q and P are modal, L repeats."""
    words, repeated = modal.hole, modal.modes.motion is meaning
    if modal.modes.motion not in HOLES:
        words.level = modal.z
    begun(block, modal, meaning)
    code = modal.modes.motion_code
    if modal.modes.plane is not Meaning.PLANE_XY:
        plane, own = dialect.code_for(Meaning.PLANE_XY), dialect.code_for(Meaning.PLANE_XZ)
        raise Fault(f"{code} drills along Z only in {plane}; in {own} it drills along Y.", f"Write {plane} before it and {own} after it.")
    if modal.turret.nose is not None:
        raise Fault(f"{code} does not go with nose compensation.", "Write G40 before it.")
    if not repeated:
        words.words = {}
    words.words.update({letter: word.value for letter, word in block.takes("RQPZ").items()})
    _check_canned(modal, meaning, code)
    check_feed(block, modal, dialect)
    if meaning in _SPIN and modal.spindle.direction != _TURNS.get(meaning, modal.spindle.direction or 1):
        turn = "M4" if meaning is Meaning.TAPPING_LEFT else "M3"
        raise Fault(f"{code} needs a spindle that turns by {turn}.", f"Write {turn} before it.")
    return _drill_holes(block, modal, dialect, meaning, code)


def _check_canned(modal: Modal, meaning: Meaning, code: str) -> None:
    """Raise :class:`Fault` for missing words, or words that contradict each other."""
    given = modal.hole.words
    pecks, dwells = meaning in _PECKS, meaning in _DWELLS
    missing = [letter for letter in ("R", "Z", *("Q" * pecks), *("P" * dwells)) if letter not in given]
    if missing:
        raise Fault(f"{code} needs {' and '.join(missing)}.", f"Write it as {code} R2 Z-20{' Q5' * pecks}{' P0.5' * dwells}.")
    if pecks and given["Q"] <= 0.0:
        raise Fault(f"The peck Q of {code} is not above 0.", "Give the depth of one peck without a sign.")
    if given.get("P", 0.0) < 0.0:
        raise Fault(f"P of {code} is below 0.", "Give it without a sign.")
    if given["Z"] > (given["R"] if modal.modes.absolute else 0.0):
        raise Fault(f"The bottom Z of {code} lies above its R plane.", "Give a Z below R: the feed begins at R and ends at Z.")


def _drill_holes(block: Sorted, modal: Modal, dialect: Dialect, meaning: Meaning, code: str) -> Made:
    """Drill the hole L times: at the same place, or with G91 each one further along X."""
    given, seconds = {letter: modal.metres(value) for letter, value in modal.hole.words.items()}, modal.hole.words.get("P", 0.0)
    count = block.take("L")
    repeats = 1 if count is None else int(count.value)
    if count is not None and (count.value != repeats or repeats < 1):
        raise Fault(f"{count.text} of {code} is not a number of holes.", "Give a whole number above 0.")
    level = modal.z if modal.hole.level is None else modal.hole.level
    plane = given["R"] + (modal.origin.zero[1] if modal.modes.absolute else level)
    bottom = given["Z"] + (modal.origin.zero[1] if modal.modes.absolute else plane)
    x = target(block, modal, dialect)[0]
    along = 0.0 if modal.modes.absolute else x - modal.x
    steps = rapids((modal.x, plane)) if level < plane else []
    here, level = (plane, plane) if level < plane else (modal.z, level)
    clear = plane if _returns_to_plane(block, modal, dialect) else level
    peck = given["Q"] if meaning in _PECKS else 0.0
    if peck > 0.0:
        check_count(repeats * (plane - bottom) / peck, code)
    check_count(float(repeats), code)
    one = Hole(plane, bottom, clear, meaning, peck, given.get("P", _LIFT), 0.0 if meaning in _NO_DWELL else seconds)
    for number in range(repeats):
        place = x + number * along
        first = number == 0 and here > plane
        steps += rapids((place, here if first else clear))
        if first or clear > plane:
            steps += rapids((place, plane))
        steps += one.steps(place)
    return carry_out(block, modal, steps, code, keep=True)


@dataclass(frozen=True)
class Hole:
    """One hole of LinuxCNC's cycles, from the R ``plane`` down to the ``bottom`` and out to ``clear``, all positions along Z [m].

    After each ``peck`` [m] the drill retracts to the plane, where chips are broken only by ``lift`` [m]. The feed starts again ``lift`` in
    front of the last depth. ``dwell`` [s] is at the bottom. The spindle on the way out may stand or turn back.
    """

    plane: float
    bottom: float
    clear: float
    cycle: Meaning
    peck: float
    lift: float
    dwell: float

    def steps(self, x: float) -> list[CycleStep]:
        """Return the steps of the hole at ``x`` [m]; the tool stands on the R plane."""
        steps: list[CycleStep] = []
        count, spin = 1, _SPIN.get(self.cycle, 1.0)
        while self.peck > 0.0 and self.plane - count * self.peck > self.bottom + EPSILON:
            depth = self.plane - count * self.peck
            steps += feeds((x, depth))
            if self.cycle is not Meaning.CHIP_BREAKING:
                steps += rapids((x, self.plane))
            steps += rapids((x, depth + self.lift))
            count += 1
        steps += feeds((x, self.bottom))
        if self.dwell > 0.0:
            steps.append(CycleStep("dwell", (x, self.bottom), seconds=self.dwell, spin=min(spin, 1.0) or 1.0))
        if self.cycle is Meaning.BORING:
            return [*steps, *feeds((x, self.plane)), *rapids((x, self.clear))]
        return [*steps, CycleStep("feed" if self.cycle in _FEEDS_OUT else "rapid", (x, self.clear), spin=spin)]
