"""The threading cycle G76, as Fanuc and Haas have it and as LinuxCNC has it.

Of Fanuc: passes of equal chip area down one flank. Pass n stands at the depth d_n = d_1 sqrt(n), at least ``smallest`` deeper than the one
before, down to the height less the finishing allowance; then come the finishing passes at full depth. The tool is fed along the flank:
pass n begins d_n tan(angle/2) further along. Of LinuxCNC: see :class:`DriveLineThreading`.

Source: Fanuc 0i-T operator's manual, multiple threading cycle; LinuxCNC 2.9 manual, G76. Left out: other ways of feeding in.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from lathesim.errors import Fault
from lathesim.program.cycles import EPSILON, CycleStep, carry_out, in_steps, length, rapids, thread_with_run_out
from lathesim.program.dialects import Dialect
from lathesim.program.meanings import Meaning
from lathesim.program.modal import Modal, Point
from lathesim.program.motions import check_plane, check_thread, lead_of, start_angle, target
from lathesim.program.moves import Made
from lathesim.program.vocabulary import AXES, Sorted
from lathesim.program.words import Word

MOST_PASSES = 1000
_TAPERS = {0.0: (False, False), 1.0: (True, False), 2.0: (False, True), 3.0: (True, True)}
"""L of LinuxCNC's G76 -> whether a taper leads into the thread, and out of it."""


def threading_cycle(block: Sorted, modal: Modal, dialect: Dialect, meaning: Meaning) -> Made:
    """G76: of LinuxCNC (P is the pitch), of Fanuc in two blocks, or of Haas in one (K and D)."""
    code = block.codes[meaning].code
    if dialect.cycles.thread_drive_line:
        return _drive_line_threading(block, modal, dialect, code)
    if block.words.keys().isdisjoint(AXES):
        _first_block(block, modal, code)
        return ()
    check_thread(block, modal, code)
    words, one_block = modal.thread, "K" in block.words
    if one_block:  # P is the way of feeding in
        block.take("P")
    height, first, taper = (block.take(letter) for letter in ("KDI" if one_block else "PQR"))
    angle = block.take("A")
    if height is None or first is None:
        raise Fault(f"{code} needs the height of the thread and the first depth.", f"Write it as {code} X18.16 Z-17. P920 Q300 F1.5.")
    lead = lead_of(block, modal, "FE")
    if one_block:
        block.assume("thread_run_out", f"none at the end of {code} in one block")
    elif not words.given:
        block.assume("thread_passes", f"no first block of {code}: one finishing pass, no run-out, an angle and an allowance of 0")
    threading = Threading(
        modal.place,
        target(block, modal, dialect),
        in_steps(height, modal),
        in_steps(first, modal),
        lead,
        smallest=words.smallest,
        allowance=words.allowance,
        finishing=0 if one_block else words.finishing,
        chamfer=0.0 if one_block else words.chamfer * lead,
        angle=math.radians(angle.value) if angle is not None else words.angle,
        taper=length(block, modal, taper) if taper is not None else 0.0,
    )
    if not 0.0 < threading.first_depth <= threading.height:
        raise Fault(f"The first depth of {code} must be above 0 and at most the height of the thread.", "Correct P and Q.")
    if not 0.0 <= threading.allowance < threading.height:
        raise Fault(f"The finishing allowance of {code} must be below the height of the thread.", f"Correct R of the first {code}.")
    if threading.begins_inside:
        block.warn(f"{code} begins below the crest of its thread; its rapid moves cross the thread. Begin it further out.")
    _check_passes(2.0 * math.log(threading.height / threading.first_depth), threading.finishing, code)
    angle_of_start = start_angle(block, dialect) if one_block else 0.0
    return carry_out(block, modal, threading.steps(), code, compensated=False, start_angle=angle_of_start)


def _first_block(block: Sorted, modal: Modal, code: str) -> None:
    """Keep the words of the first of two blocks: P has two digits each for finishing passes, run-out and angle."""
    words, (p, q, r) = modal.thread, (block.take(letter) for letter in "PQR")
    if p is not None:
        if "." in p.text or p.value < 0.0:
            raise Fault(f"{p.text} of {code} is no number of six digits.", "Write passes, run-out and angle: P010060.")
        digits = int(p.value)
        words.finishing, words.angle = max(1, digits // 10000), math.radians(digits % 100)
        words.chamfer = 0.1 * (digits // 100 % 100)
    words.given = True
    words.smallest = in_steps(q, modal) if q is not None else words.smallest
    words.allowance = in_steps(r, modal) if r is not None else words.allowance


def _check_passes(logarithm: float, further: float, code: str) -> None:
    """Refuse a thread of more passes than are laid out; ``logarithm`` is that of how many come down to the full depth."""
    if logarithm > math.log(MOST_PASSES) or further > MOST_PASSES:
        raise Fault(f"{code} would make more than {MOST_PASSES} passes.", "Take a larger first depth, or fewer further passes.")


def _drive_line_threading(block: Sorted, modal: Modal, dialect: Dialect, code: str) -> Made:
    """Expand LinuxCNC's G76: P pitch, Z end, I crest, J first depth, K full depth, R degression, Q slide angle, H spring passes.

    I, J and K are diameters in G7 and radii in G8. Source: LinuxCNC 2.9 manual, G76.
    """
    check_plane(modal, dialect, code)
    check_thread(block, modal, code)
    words = block.takes("PIJKRQHEL")
    missing = [letter for letter in "PIJK" if letter not in words] + ["Z"] * ("Z" not in block.words)
    if missing:
        raise Fault(f"{code} needs {', '.join(missing)}.", f"Write it as {code} P1.5 Z-20 I-2 J0.3 K0.92.")
    _check_drive_line(words, code)
    if "X" in block.words:
        fact = f"{code} cuts along the X of its start, and its block names another X."
        raise Fault(fact, "Take the X word out; I says where the crest is.")
    values = {letter: words[letter].value if letter in words else 0.0 for letter in "PIJKRQHEL"}
    start, end = modal.place, target(block, modal, dialect)
    if modal.metres(values["E"]) > 0.5 * abs(end[1] - start[1]):
        raise Fault(f"The taper E of {code} is longer than half of the thread.", "Make E shorter.")
    _check_passes((values["R"] or 1.0) * math.log(values["K"] / values["J"]), values["H"], code)
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
        tapers_in=_TAPERS[values["L"]][0],
        tapers_out=_TAPERS[values["L"]][1],
    )
    return carry_out(block, modal, threading.steps(), code, compensated=False, start_angle=start_angle(block, dialect))


def _check_drive_line(words: dict[str, Word], code: str) -> None:
    """Refuse numbers of LinuxCNC's G76 that make no thread."""
    p, i, j, k = (words[letter].value for letter in "PIJK")
    ends, taper = (words[letter].value if letter in words else 0.0 for letter in "LE")
    if ends not in _TAPERS or taper < 0.0 or (ends and not taper):
        raise Fault(f"{code} needs L from 0 to 3, and with it E above 0.", "L1 tapers the entry over the length E, L2 the exit, L3 both.")
    if p <= 0.0 or j <= 0.0 or k <= j:
        raise Fault(f"{code} needs P and J above 0 and K above J.", "Correct P, J and K.")
    if "R" in words and words["R"].value < 1.0:
        raise Fault(f"R of {code} is below 1.", "Write R1 for passes of equal depth, R2 for passes of equal area.")
    if i == 0.0:
        raise Fault(f"I of {code} is 0 and says no side.", "Write it below 0 for an outer thread, above 0 for an inner one.")


@dataclass(frozen=True)
class Threading:
    """Fanuc's G76: the root at the end of the thread, height and depths [m] as radii, ``taper`` as R, ``angle`` [rad], lead [m].

    Over the last ``chamfer`` [m] along Z the thread runs out at 45 degrees.
    """

    start: Point
    end: Point
    height: float
    first_depth: float
    lead: float
    smallest: float = 0.0
    allowance: float = 0.0
    finishing: int = 1
    angle: float = 0.0
    taper: float = 0.0
    chamfer: float = 0.0

    @property
    def outside(self) -> float:
        """1 for a thread that is cut from larger X, -1 for one from smaller X."""
        return 1.0 if self.start[0] >= self.end[0] else -1.0

    @property
    def begins_inside(self) -> bool:
        """Whether the start lies deeper than the crest at one end of the thread, where the tool comes back in rapid."""
        outside = self.outside
        crest = max(outside * self.end[0], outside * (self.end[0] + self.taper)) + self.height
        return outside * self.start[0] < crest - EPSILON

    def depths(self) -> list[float]:
        """Return the depth of each pass below the crest [m], the last ones at full height."""
        rough = self.height - self.allowance
        found: list[float] = []
        depth = 0.0
        for number in range(1, MOST_PASSES + 1):
            depth = min(rough, max(self.first_depth * math.sqrt(number), depth + self.smallest))
            if found and depth - found[-1] < EPSILON:
                break
            found.append(depth)
            if rough - depth < EPSILON:
                break
        return [*found, *[self.height] * max(1 if self.allowance > EPSILON else 0, self.finishing)]

    def steps(self) -> list[CycleStep]:
        """Return the whole cycle, from the start point and back to it."""
        way = -1.0 if self.end[1] < self.start[1] else 1.0
        steps: list[CycleStep] = []
        for depth in self.depths():
            above = self.outside * (self.height - depth)
            begin = (self.end[0] + self.taper + above, self.start[1] + way * depth * math.tan(0.5 * self.angle))
            end = (self.end[0] + above, self.end[1])
            steps += rapids((self.start[0], begin[1]), begin)
            steps += thread_with_run_out(begin, end, self.lead, self.chamfer, self.outside)
            steps += rapids((self.start[0], end[1]), self.start)
        return steps


@dataclass(frozen=True)
class DriveLineThreading:
    """LinuxCNC's G76: the drive line is the X of ``start``, ``peak`` its distance to the crest (below zero outside) [m].

    Pass n stands at d_n = first n^(1/degression); ``slide`` [rad] feeds along the flank, at the beginning and at the end of a pass alike.
    A taper of the length ``taper`` along Z leads into the thread (``tapers_in``) or out of it from the full height.
    Source: LinuxCNC 2.9 manual, G76.
    """

    start: Point
    end_z: float
    pitch: float
    peak: float
    first: float
    full: float
    degression: float
    slide: float
    spring: int
    taper: float
    tapers_in: bool
    tapers_out: bool

    def depths(self) -> list[float]:
        """Return the depth of each pass below the crest [m]."""
        depths: list[float] = []
        for number in range(1, MOST_PASSES + 1):
            depth = self.first * float(number) ** (1.0 / self.degression)
            if depth >= self.full - EPSILON:
                break
            depths.append(depth)
        return depths + [self.full] * (1 + self.spring)

    def steps(self) -> list[CycleStep]:
        """Return the whole cycle, from the drive line and back to it."""
        outside = -1.0 if self.peak < 0.0 else 1.0
        toward = -1.0 if self.end_z < self.start[1] else 1.0
        steep = self.pitch * math.hypot(self.taper, self.full) / self.taper if self.taper > 0.0 else self.pitch
        steps: list[CycleStep] = []
        for depth in self.depths():
            clear = self.start[0] - outside * (self.full - depth)
            begin = self.start[1] + toward * depth * math.tan(self.slide)
            finish = self.end_z - toward * (self.full - depth) * math.tan(self.slide)
            x = self.start[0] + self.peak + outside * depth
            above = x - outside * self.full
            steps += rapids((clear, begin))
            if self.tapers_in:
                steps += [CycleStep("thread", end, lead=steep) for end in ((above, begin), (x, begin + toward * self.taper))]
            else:
                steps += rapids((x, begin))
            steps.append(CycleStep("thread", (x, finish - toward * self.taper if self.tapers_out else finish), lead=self.pitch))
            if self.tapers_out:
                steps.append(CycleStep("thread", (above, finish), lead=steep))
            steps += rapids((clear, finish))
        return [*steps, *rapids((self.start[0], self.end_z))]
