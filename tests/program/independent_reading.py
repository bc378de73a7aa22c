"""A second reading of lathe programs, which shares no code with the program: from the manuals to the cuts of the tool.

It reads well-formed programs of one machine (X a diameter in ``fanuc``, ``fanuc-b`` and G7, else a radius) and returns what cuts: feeds,
arcs and threads, in millimetres with X as a radius. Of roughing cycles it returns the level passes and the pass along the contour.

Source: Fanuc 0i-T operator's manual (threading, canned and multiple repetitive cycles, offsets); LinuxCNC manual, G-Codes (G10, G33, G76,
G81 to G83, G92). Left out: nose compensation, macros, subprograms, and every check of bad input.
"""

from __future__ import annotations

import itertools
import math
import re
from dataclasses import dataclass, field

_WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))")


@dataclass(frozen=True)
class Cut:
    """One cut: where it begins and ends (x, z) [mm], its feed [mm/min or mm/rev] or lead [mm], and the sweep of an arc [rad].

    ``start_angle`` [rad] is where the spindle stands when a thread begins.
    """

    kind: str
    begin: tuple[float, float]
    end: tuple[float, float]
    value: float
    sweep: float = 0.0
    start_angle: float = 0.0


@dataclass
class _Block:
    number: int | None
    codes: list[str]
    words: dict[str, float]
    has_point: dict[str, bool] = field(default_factory=dict)


def _blocks(text: str) -> list[_Block]:
    found = []
    for line in text.splitlines():
        line = re.sub(r"\(.*?\)|;.*", "", line).upper().strip()
        number, codes, words, points = None, [], {}, {}
        for letter, value in _WORD.findall(line):
            if letter == "N":
                number = int(value)
            elif letter in "GM":
                codes.append(f"{letter}{float(value):g}")
            else:
                words[letter], points[letter] = float(value), "." in value
        if codes or words:
            found.append(_Block(number, codes, words, points))
    return found


def cuts_of(text: str, dialect: str) -> list[Cut]:
    """Return the cuts of a program in one of the dialects ``paper``, ``linuxcnc``, ``fanuc`` and ``fanuc-b``."""
    reader = {"paper": _Reader, "linuxcnc": _LinuxCnc, "fanuc": _SystemA, "fanuc-b": _SystemB}[dialect](_blocks(text))
    while reader.at < len(reader.blocks):
        reader.at += 1
        reader.block(reader.blocks[reader.at - 1])
    return reader.cuts


class _Reader:
    """G0 to G3 with the words of the 2004 paper: inches by G70, increments by G91, feed by G94 and G95."""

    inch_code, millimetre_code = "G70", "G71"
    home = (0.0, 0.0)
    offset_codes: tuple[str, ...] = ()

    def __init__(self, blocks: list[_Block]) -> None:
        self.blocks, self.at, self.cuts = blocks, 0, []
        self.here = self.home
        self.inch = self.diameter = self.incremental = False
        self.feed, self.lead, self.motion = 0.0, 0.0, ""
        self.offsets: dict[int, tuple[float, float]] = {}
        self.active, self.shift, self.local = 1, (0.0, 0.0), (0.0, 0.0)
        self.tools: dict[int, tuple[float, float]] = {}
        self.tool = 0

    # ---- lengths and places ----

    def mm(self, value: float) -> float:
        return value * 25.4 if self.inch else value

    def across(self, value: float) -> float:
        return self.mm(value) * (0.5 if self.diameter else 1.0)

    @property
    def zero(self) -> tuple[float, float]:
        x, z = self.offsets.get(self.active, (0.0, 0.0))
        tool = self.tools.get(self.tool, (0.0, 0.0))
        return x + self.shift[0] + self.local[0] + tool[0], z + self.shift[1] + self.local[1] + tool[1]

    def target(self, words: dict[str, float]) -> tuple[float, float]:
        x, z = self.here
        if "X" in words:
            x = self.across(words["X"]) + (x if self.incremental else self.zero[0])
        if "Z" in words:
            z = self.mm(words["Z"]) + (z if self.incremental else self.zero[1])
        return x, z

    # ---- one block ----

    def block(self, block: _Block) -> None:
        codes, words = set(block.codes), block.words
        self.modes(codes, words)
        if "F" in words and not self.f_is_lead(codes):
            self.feed = self.mm(words["F"])
        if self.once(codes, words):
            return
        own = next((code for code in block.codes if code in self.motions), None)
        self.motion = own or self.motion
        if own or {"X", "Z", "U", "W"} & set(words):
            self.motions[self.motion](self, block)

    def modes(self, codes: set[str], words: dict[str, float]) -> None:
        if self.inch_code in codes:
            self.inch = True
        if self.millimetre_code in codes:
            self.inch = False
        if codes & {"G90"}:
            self.incremental = False
        if codes & {"G91"}:
            self.incremental = True
        for number, code in enumerate(self.offset_codes, 1):
            if code in codes:
                self.active = number

    def f_is_lead(self, codes: set[str]) -> bool:
        return False

    def once(self, codes: set[str], words: dict[str, float]) -> bool:
        return False

    # ---- motions ----

    def to(self, end: tuple[float, float]) -> None:
        self.here = end

    def cut(self, end: tuple[float, float], kind: str = "feed", value: float | None = None, sweep: float = 0.0, angle: float = 0.0) -> None:
        if math.dist(end, self.here) > 1e-9 or sweep:
            self.cuts.append(Cut(kind, self.here, end, self.feed if value is None else value, sweep, angle))
        self.here = end

    def rapid(self, block: _Block) -> None:
        self.to(self.target(block.words))

    def line(self, block: _Block) -> None:
        self.cut(self.target(block.words))

    def arc(self, block: _Block) -> None:
        begin, end = self.here, self.target(block.words)
        clockwise = self.motion == "G2"
        if "R" in block.words:
            radius = self.mm(block.words["R"])
            half = 0.5 * math.dist(begin, end)
            middle = (0.5 * (begin[0] + end[0]), 0.5 * (begin[1] + end[1]))
            away = math.sqrt(max(0.0, radius * radius - half * half)) * (1.0 if clockwise == (radius > 0.0) else -1.0)
            # seen with +Z to the right and +X up, the centre of a short clockwise arc lies to the right of the way
            way = ((end[1] - begin[1]) / (2.0 * half), (end[0] - begin[0]) / (2.0 * half))
            centre = (middle[0] - away * way[0], middle[1] + away * way[1])
        else:
            centre = (begin[0] + self.mm(block.words.get("I", 0.0)), begin[1] + self.mm(block.words.get("K", 0.0)))
        first = math.atan2(begin[0] - centre[0], begin[1] - centre[1])
        last = math.atan2(end[0] - centre[0], end[1] - centre[1])
        sweep = (last - first) % math.tau
        sweep = sweep - math.tau if clockwise and sweep > 1e-12 else sweep
        self.cut(end, "arc", sweep=sweep or (-math.tau if clockwise else math.tau))

    def thread(self, end: tuple[float, float], lead_on_longer_axis: float, angle: float = 0.0) -> None:
        across, along = abs(end[0] - self.here[0]), abs(end[1] - self.here[1])
        self.cut(end, "thread", lead_on_longer_axis * math.hypot(across, along) / max(across, along), angle=angle)

    motions = {"G0": rapid, "G1": line, "G2": arc, "G3": arc}


class _Offsets(_Reader):
    """What LinuxCNC and Fanuc share: G20 and G21, G54 to G59, G10 L2, G52, G28."""

    inch_code, millimetre_code = "G20", "G21"
    offset_codes = ("G54", "G55", "G56", "G57", "G58", "G59")

    def once(self, codes: set[str], words: dict[str, float]) -> bool:
        if "G10" in codes and words.get("L") == 20.0:  # the offset with which the tool stands at the given coordinates
            number = int(words["P"]) or self.active
            own = self.offsets.get(self.active, (0.0, 0.0))
            here = (self.here[0] - self.zero[0] + own[0], self.here[1] - self.zero[1] + own[1])
            self.offsets[number] = (here[0] - self.across(words["X"]), here[1] - self.mm(words["Z"]))
            return True
        if "G10" in codes and "L" not in words:
            self.tools[int(words["P"])] = (self.across(words["X"]), self.mm(words["Z"]))
            return True
        if "G10" in codes:
            number = int(words["P"]) or self.active
            x, z = self.offsets.get(number, (0.0, 0.0))
            x, z = (self.across(words["X"]) if "X" in words else x), (self.mm(words["Z"]) if "Z" in words else z)
            self.offsets[number] = (x + self.across(words.get("U", 0.0)), z + self.mm(words.get("W", 0.0)))
            return True
        if "G28" in codes:
            x, z = self.target(words)
            self.to((self.home[0] if {"X", "U"} & set(words) else x, self.home[1] if {"Z", "W"} & set(words) else z))
            return True
        return bool(codes & {"G4"})

    def shift_to(self, words: dict[str, float]) -> None:
        x, z = self.here[0] - self.zero[0], self.here[1] - self.zero[1]
        dx = x - self.across(words["X"]) if "X" in words else 0.0
        dz = z - self.mm(words["Z"]) if "Z" in words else 0.0
        self.shift = (self.shift[0] + dx, self.shift[1] + dz)


class _LinuxCnc(_Offsets):
    """G7 and G8, G33, G76 and the drilling cycles of G17."""

    def modes(self, codes: set[str], words: dict[str, float]) -> None:
        super().modes(codes, words)
        self.diameter = (self.diameter or "G7" in codes) and "G8" not in codes
        self.to_plane = (getattr(self, "to_plane", False) or "G99" in codes) and "G98" not in codes

    def once(self, codes: set[str], words: dict[str, float]) -> bool:
        if "G92" in codes:
            self.shift_to(words)
            return True
        if "G52" in codes:  # G52 and G92 share one shift
            self.shift = (
                self.across(words["X"]) if "X" in words else self.shift[0], self.mm(words["Z"]) if "Z" in words else self.shift[1],
            )  # fmt: skip
            return True
        return super().once(codes, words)

    def tapping(self, block: _Block) -> None:
        """G33.1: in on the lead K and out to where it began, the spindle reversing at the bottom."""
        began = self.here
        lead = self.mm(block.words["K"])
        self.cut(self.target(block.words), "thread", lead)
        self.cut(began, "thread", lead)
        self.motion = "G0"

    def synchronous(self, block: _Block) -> None:
        self.lead = self.mm(block.words["K"]) if "K" in block.words else self.lead
        self.cut(self.target(block.words), "thread", self.lead)

    def threading(self, block: _Block) -> None:
        """G76: in diameter mode I, J and K are diameters; pass n stands at J n^(1/R)."""
        words = block.words
        drive, begin_z = self.here
        end_z = self.target({"Z": words["Z"]})[1]
        pitch, crest, first, full = self.mm(words["P"]), self.across(words["I"]), self.across(words["J"]), self.across(words["K"])
        inward = 1.0 if crest > 0.0 else -1.0  # the crest lies beyond the drive line, the root further
        toward = math.copysign(1.0, end_z - begin_z)
        tangent = math.tan(math.radians(words.get("Q", 0.0)))
        depths, number = [], 1
        while first * number ** (1.0 / words.get("R", 1.0)) < full - 1e-6:
            depths.append(first * number ** (1.0 / words.get("R", 1.0)))
            number += 1
        for depth in [*depths, *[full] * (1 + int(words.get("H", 0)))]:
            x = drive + crest + inward * depth
            self.to((x, begin_z + toward * depth * tangent))
            self.cut((x, end_z - toward * (full - depth) * tangent), "thread", pitch)
        self.to((drive, end_z))

    def hole(self, block: _Block) -> None:
        """G81 to G83: R is the plane, Z the bottom; with G99 the drill stays at the plane, else at the higher one."""
        words = block.words
        if block.codes and self.motion in block.codes:
            self.kept, self.level = {}, self.here[1]  # a block without the code counts from the level of the first
        began = self.level
        self.kept = {**self.kept, **{letter: words[letter] for letter in "RZQ" if letter in words}}
        x = self.target({letter: words[letter] for letter in "X" if letter in words})[0]
        if self.incremental:
            plane = began + self.mm(self.kept["R"])
            bottom = plane + self.mm(self.kept["Z"])
        else:
            plane, bottom = self.zero[1] + self.mm(self.kept["R"]), self.zero[1] + self.mm(self.kept["Z"])
        self.to((x, plane))
        self.pecks(x, plane, bottom, self.mm(self.kept["Q"]) if self.motion == "G83" else 0.0)
        self.to((x, plane if self.to_plane else max(began, plane)))

    def pecks(self, x: float, plane: float, bottom: float, peck: float) -> None:
        depth = plane
        while depth - bottom > 1e-6:
            depth = max(bottom, depth - peck) if peck else bottom
            self.cuts.append(Cut("bottom", (x, plane), (x, depth), self.feed))
            self.here = (x, depth)

    motions = {
        **_Reader.motions,
        "G33": synchronous,
        "G33.1": tapping,
        "G76": threading,
        "G81": hole,
        "G82": hole,
        "G83": hole,
        "G80": lambda *_: None,
    }


class _SystemA(_Offsets):
    """Fanuc's system A: U and W, G32, G50, G90, G92, G94 and the repetitive cycles."""

    home = (100.0, 200.0)
    thread_code, shift_code, single = "G32", "G50", {"turn": "G90", "thread": "G92", "face": "G94"}

    def __init__(self, blocks: list[_Block]) -> None:
        super().__init__(blocks)
        self.diameter, self.told, self.skipped, self.inside = True, {}, set(), False

    def modes(self, codes: set[str], words: dict[str, float]) -> None:
        incremental = self.incremental
        super().modes(codes, words)
        self.incremental = incremental

    def target(self, words: dict[str, float]) -> tuple[float, float]:
        x, z = super().target(words)
        return x + self.across(words.get("U", 0.0)), z + self.mm(words.get("W", 0.0))

    def f_is_lead(self, codes: set[str]) -> bool:
        threads = {self.thread_code, self.single["thread"], "G76"}
        own = codes & set(self.motions)
        return bool(own & threads) or (not own and self.motion in threads)

    def block(self, block: _Block) -> None:
        if self.at - 1 in self.skipped and not self.inside:
            return
        self.tool = int(block.words["T"]) % 100 if "T" in block.words else self.tool
        super().block(block)

    def once(self, codes: set[str], words: dict[str, float]) -> bool:
        if self.shift_code in codes:
            self.shift_to(words)
            self.shift = (self.shift[0] - self.across(words.get("U", 0.0)), self.shift[1] - self.mm(words.get("W", 0.0)))
            return True
        if "G52" in codes:
            self.local = (
                self.across(words["X"]) if "X" in words else self.local[0],
                self.mm(words["Z"]) if "Z" in words else self.local[1],
            )
            return True
        return super().once(codes, words)

    def synchronous(self, block: _Block) -> None:
        """G32: F is the lead along the longer axis, Q the angle of its start in thousandths of a degree."""
        words = block.words
        self.lead = self.mm(words["F"]) if "F" in words else self.lead
        self.thread(self.target(words), self.lead, math.radians(1e-3 * words.get("Q", 0.0)))

    # ---- single passes: R is a radius ----

    def single_pass(self, block: _Block) -> None:
        kind = next(name for name, code in self.single.items() if code == self.motion)
        words, start = block.words, self.here
        if self.motion in block.codes:
            self.taper, self.corner = 0.0, start
        self.taper = self.mm(words["R"]) if "R" in words else self.taper
        ends = self.target({letter: words[letter] for letter in "XZUW" if letter in words})
        end = (ends[0] if {"X", "U"} & set(words) else self.corner[0], ends[1] if {"Z", "W"} & set(words) else self.corner[1])
        self.corner = end
        if kind == "face":
            self.to((start[0], end[1] + self.taper))
            self.cut(end)
            self.cut((end[0], start[1]))
        else:
            self.to((end[0] + self.taper, start[1]))
            if kind == "turn":
                self.cut(end)
                self.cut((start[0], end[1]))
            else:
                self.lead = self.mm(words["F"]) if "F" in words else self.lead
                chamfer = self.told["thread"][1] if "thread" in self.told else 0.0  # G76 sets the parameter of both cycles
                self.thread_pass(end, start[0], self.lead, chamfer * self.lead, math.radians(1e-3 * words.get("Q", 0.0)))
        self.to(start)

    def thread_pass(self, end: tuple[float, float], clear: float, lead: float, run_out: float, angle: float = 0.0) -> None:
        """Cut a thread whose last ``run_out`` along Z leads out at 45 degrees towards ``clear``."""
        if run_out > 0.0:
            toward, outside = math.copysign(1.0, end[1] - self.here[1]), math.copysign(1.0, clear - end[0])
            share = 1.0 - run_out / abs(end[1] - self.here[1])
            self.thread((self.here[0] + share * (end[0] - self.here[0]), end[1] - toward * run_out), lead, angle)
            end = (self.here[0] + outside * run_out, end[1])
        self.thread(end, lead, angle)

    # ---- repetitive cycles in two blocks ----

    def small(self, letter: str, block: _Block) -> float:
        """A length of a cycle: without a decimal point it counts in thousandths of a millimetre, or ten-thousandths of an inch."""
        value = block.words[letter]
        return self.mm(value) if block.has_point[letter] else value * (0.00254 if self.inch else 0.001)

    def contour(self, block: _Block) -> tuple[list[Cut], tuple[float, float], int]:
        """Return the cuts of the contour that P and Q name, the point its first block goes to, and the place behind it."""
        first = next(place for place in range(self.at, len(self.blocks)) if self.blocks[place].number == int(block.words["P"])) \
            if any(self.blocks[place].number == int(block.words["P"]) for place in range(self.at, len(self.blocks))) \
            else next(place for place, other in enumerate(self.blocks) if other.number == int(block.words["P"]))  # fmt: skip
        last = next(place for place in range(first, len(self.blocks)) if self.blocks[place].number == int(block.words["Q"]))
        kept = (self.cuts, self.here, self.feed, self.motion, self.at, self.inside)
        self.cuts, self.inside = [], True
        self.block(self.blocks[first])
        self.cuts, came = [], self.here
        for place in range(first + 1, last + 1):
            self.block(self.blocks[place])
        found = self.cuts
        self.cuts, self.here, self.feed, self.motion, self.at, self.inside = kept
        self.passes_over = set(range(first, last + 1))
        return found, came, last

    def roughing(self, block: _Block) -> None:
        """G71 and G72: level passes of the depth, beginning at the start moved by the allowances, then once along the contour."""
        words, across = block.words, self.motion == "G72"
        if "P" not in words:
            self.told["depth"] = self.small_or_whole("W" if across else "U", block)
            return
        contour, first, _ = self.contour(block)
        left = (self.across(words.get("U", 0.0)), self.mm(words.get("W", 0.0)))
        start, depth = self.here, self.told["depth"]
        walls = _polyline(first, contour, left)
        deep = 1 if across else 0
        outside = 1.0 if start[deep] >= max(point[deep] for point in walls) - left[deep] - 1e-9 else -1.0
        level = start[deep] + left[deep] - outside * depth
        deepest = min(outside * point[deep] for point in walls)
        while outside * level > deepest + 1e-6:
            reached = _reach(level, walls, deep, outside)
            begin = (level, start[1] + left[1]) if not across else (start[0] + left[0], level)
            end = (level, reached) if not across else (reached, level)
            if math.dist(begin, end) > 1e-6:
                self.cuts.append(Cut("level", begin, end, self.feed))
            level -= outside * depth
        self.along(contour, first, left, None)
        self.here = start
        self.skipped |= self.passes_over

    def small_or_whole(self, letter: str, block: _Block) -> float:
        return self.mm(block.words[letter])

    def along(self, contour: list[Cut], first: tuple[float, float], left: tuple[float, float], own_feed: bool | None) -> None:
        """Cut along the contour, moved by ``left``: with its own feeds (finishing) or with that of the cycle."""
        self.here = (first[0] + left[0], first[1] + left[1])
        for cut in contour:
            end = (cut.end[0] + left[0], cut.end[1] + left[1])
            begin = (cut.begin[0] + left[0], cut.begin[1] + left[1])
            self.to(begin)
            self.cut(end, cut.kind, cut.value if own_feed else self.feed, cut.sweep)

    def finishing(self, block: _Block) -> None:
        contour, first, _ = self.contour(block)
        start = self.here
        self.along(contour, first, (0.0, 0.0), True)
        self.here = start

    def repeating(self, block: _Block) -> None:
        """G73: the contour so many times, from the relief down to the allowances in equal steps."""
        words = block.words
        if "P" not in words:
            self.told["relief"] = (self.mm(words["U"]), self.mm(words["W"]), int(words["R"]))
            return
        contour, first, _ = self.contour(block)
        start = self.here
        i, k, count = self.told["relief"]
        for number in range(count):
            share = 1.0 - number / (count - 1) if count > 1 else 0.0
            self.along(contour, first, (self.across(words.get("U", 0.0)) + share * i, self.mm(words.get("W", 0.0)) + share * k), False)
        self.here = start
        self.skipped |= self.passes_over

    def pecking(self, block: _Block) -> None:
        """G74 along Z and G75 across: in by steps, beside itself by further steps."""
        words, across = block.words, self.motion == "G75"
        if not {"X", "Z", "U", "W"} & set(words):
            return
        start, end = self.here, self.target(words)
        step = self.small("P" if across else "Q", block)
        aside = self.small("Q" if across else "P", block) if ("Q" if across else "P") in words else 0.0
        deep, wide = (0, 1) if across else (1, 0)
        for place in _grid(start[wide], end[wide], aside):
            for depth in _grid(start[deep], end[deep], step)[1:]:
                point = (depth, place) if across else (place, depth)
                self.cuts.append(Cut("bottom", start, point, self.feed))
        self.here = start

    def threading(self, block: _Block) -> None:
        """G76: pass n stands at Q sqrt(n), at least the smallest depth deeper than the last; then the finishing passes."""
        words = block.words
        if not {"X", "Z", "U", "W"} & set(words):
            digits = f"{int(words['P']):06d}"
            self.told["thread"] = (
                int(digits[:2]),
                0.1 * int(digits[2:4]),
                math.radians(int(digits[4:])),
                self.small("Q", block),
                self.small("R", block),
            )
            return
        one_block = "K" in words  # as Haas: K is the height, D the first depth, I the taper, Q the start angle
        finishing, chamfer, angle, smallest, allowance = (
            (0, 0.0, math.radians(words.get("A", math.degrees(self.told["thread"][2]) if "thread" in self.told else 0.0)), *(
                self.told["thread"][3:] if "thread" in self.told else (0.0, 0.0)))
            if one_block else self.told["thread"]
        )  # fmt: skip
        start, end = self.here, self.target(words)
        height, first = (self.mm(words["K"]), self.mm(words["D"])) if one_block else (self.small("P", block), self.small("Q", block))
        lead, taper = self.mm(words["F"]), self.mm(words.get("I" if one_block else "R", 0.0))
        turned = math.radians(1e-3 * words.get("Q", 0.0)) if one_block else 0.0
        outside, toward = math.copysign(1.0, start[0] - end[0]), math.copysign(1.0, end[1] - start[1])
        depths, depth, number = [], 0.0, 0
        while depth < height - allowance - 1e-9:
            number += 1
            depth = min(height - allowance, max(first * math.sqrt(number), depth + smallest))
            depths.append(depth)
        for depth in [*depths, *[height] * max(finishing, 1 if allowance else 0)]:
            above = outside * (height - depth)
            self.to((end[0] + taper + above, start[1] + toward * depth * math.tan(0.5 * angle)))
            self.thread_pass((end[0] + above, end[1]), start[0], lead, chamfer * lead, turned)
        self.here = start

    def tapping(self, block: _Block) -> None:
        """G84: in on the lead F with the spindle, out on it while the spindle reverses."""
        words, began = block.words, self.here[1]
        plane, bottom, x = self.zero[1] + self.mm(words["R"]), self.target({"Z": words["Z"]})[1], self.here[0]
        self.feed = self.mm(words["F"])
        self.to((x, plane))
        self.cut((x, bottom), "thread", self.feed)
        self.cut((x, plane), "thread", self.feed)
        self.to((x, began))

    def hole(self, block: _Block) -> None:
        words, began = block.words, self.here[1]
        plane = self.mm(words["R"]) + (self.zero[1] if words["R"] >= 0.0 else began)
        depth = words.get("W", words["Z"] if self.incremental else None) if "Z" in words or "W" in words else None
        bottom = plane + self.mm(depth) if depth is not None else self.target({"Z": words["Z"]})[1]
        x, peck = self.here[0], self.small("Q", block) if self.motion == "G83" else 0.0
        depth = plane
        while depth - bottom > 1e-6:
            depth = max(bottom, depth - peck) if peck else bottom
            self.cuts.append(Cut("bottom", (x, plane), (x, depth), self.feed))
        self.here = (x, began)

    motions = {
        **_Reader.motions, "G32": synchronous, "G90": single_pass, "G92": single_pass, "G94": single_pass, "G70": finishing,
        "G71": roughing, "G72": roughing, "G73": repeating, "G74": pecking, "G75": pecking, "G76": threading, "G81": hole, "G83": hole,
        "G84": tapping, "G80": lambda *_: None,
    }  # fmt: skip


class _SystemB(_SystemA):
    """System B: G77 to G79 for the single passes, G33 for threads, G92 for the shift, G90 and G91 for the distance mode."""

    thread_code, shift_code, single = "G33", "G92", {"turn": "G77", "thread": "G78", "face": "G79"}

    def modes(self, codes: set[str], words: dict[str, float]) -> None:
        _Reader.modes(self, codes, words)

    def target(self, words: dict[str, float]) -> tuple[float, float]:
        return _Reader.target(self, words)

    motions = {
        **{code: law for code, law in _SystemA.motions.items() if code not in ("G32", "G90", "G92", "G94")},
        "G33": _SystemA.synchronous, "G77": _SystemA.single_pass, "G78": _SystemA.single_pass, "G79": _SystemA.single_pass,
    }  # fmt: skip


def _polyline(first: tuple[float, float], contour: list[Cut], left: tuple[float, float]) -> list[tuple[float, float]]:
    """Return the corners of a contour moved by ``left``, with points on its arcs; their chords are 1e-9 of the radius off."""
    points = [first]
    for cut in contour:
        if cut.kind == "arc":
            half = 0.5 * math.dist(cut.begin, cut.end)
            radius = half / math.sin(0.5 * abs(cut.sweep))
            middle = (0.5 * (cut.begin[0] + cut.end[0]), 0.5 * (cut.begin[1] + cut.end[1]))
            away = math.copysign(math.sqrt(radius * radius - half * half), cut.sweep * (math.pi - abs(cut.sweep)))
            way = ((cut.end[0] - cut.begin[0]) / (2.0 * half), (cut.end[1] - cut.begin[1]) / (2.0 * half))
            centre = (middle[0] + away * way[1], middle[1] - away * way[0])
            begin = math.atan2(cut.begin[0] - centre[0], cut.begin[1] - centre[1])
            count = math.ceil(abs(cut.sweep) / 1e-4)
            angles = [begin + cut.sweep * place / count for place in range(1, count)]
            points += [(centre[0] + radius * math.sin(angle), centre[1] + radius * math.cos(angle)) for angle in angles]
        points.append(cut.end)
    return [(x + left[0], z + left[1]) for x, z in points]


def _reach(level: float, walls: list[tuple[float, float]], deep: int, outside: float) -> float:
    """Return how far along a pass goes at a level before it meets the contour."""
    for here, there in itertools.pairwise(walls):
        if outside * there[deep] >= outside * level - 1e-9 and outside * here[deep] < outside * level - 1e-9:
            share = (level - here[deep]) / (there[deep] - here[deep])
            return here[1 - deep] + share * (there[1 - deep] - here[1 - deep])
    return walls[-1][1 - deep]


def _grid(begin: float, end: float, step: float) -> list[float]:
    """Return the places from begin to end, ``step`` apart, the last at the end; without a step both ends."""
    if abs(end - begin) < 1e-9:
        return [begin]
    count = max(1, math.ceil(abs(end - begin) / step - 1e-9)) if step else 1
    return [begin, *(begin + math.copysign(step * number, end - begin) for number in range(1, count)), end]
