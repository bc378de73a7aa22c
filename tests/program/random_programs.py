"""Random lathe programs with threads, cycles and offsets, in the words of each dialect."""

from __future__ import annotations

import random
from collections.abc import Callable

DIALECTS = ("paper", "linuxcnc", "fanuc", "fanuc-b")


def program(dialect: str, seed: int) -> str:
    """Return the text of a random program; the same seed gives the same text."""
    return {"paper": _Paper, "linuxcnc": _LinuxCnc, "fanuc": _SystemA, "fanuc-b": _SystemB}[dialect](
        random.Random(f"{dialect} {seed}")
    ).text()


class _Writer:
    """Writes the parts of a program one behind the other, from lengths in mm with X as a radius; ``double`` is 2 where X is a diameter."""

    double = 1.0
    feed_per_revolution = "G95"
    feed_per_minute = "G94"
    inch, millimetre = "G20", "G21"

    def __init__(self, chance: random.Random) -> None:
        self.chance, self.lines, self.is_inch, self.next_number = chance, [], False, 10

    def text(self) -> str:
        """Return a program of some of the parts that the dialect has."""
        self.head()
        for part in [self.chance.choice(self.parts()) for _ in range(self.chance.randint(3, 6))]:
            part()
        self.lines.append("M30")
        return "\n".join(self.lines) + "\n"

    def head(self) -> None:
        self.is_inch = self.chance.random() < 0.25
        self.say(f"{self.inch if self.is_inch else self.millimetre} {self.feed_per_revolution} G97 S{self.chance.randint(300, 1500)} M3")
        self.away()

    def parts(self) -> list[Callable[[], None]]:
        return [self.contour, self.contour, self.slow_line]

    # ---- words ----

    def say(self, line: str) -> None:
        self.lines.append(line)

    def number(self, millimetres: float) -> str:
        value = millimetres / 25.4 if self.is_inch else millimetres
        text = f"{value:.6f}".rstrip("0")
        return "0." if text in ("-0.", "0.") else text

    def x(self, radius: float, letter: str = "X") -> str:
        return f"{letter}{self.number(self.double * radius)}"

    def z(self, place: float, letter: str = "Z") -> str:
        return f"{letter}{self.number(place)}"

    def within(self, low: float, high: float) -> float:
        return round(self.chance.uniform(low, high), 3)

    # ---- parts that every dialect has ----

    def away(self) -> None:
        self.at = (self.within(30.0, 40.0), self.within(2.0, 6.0))
        self.say(f"G0 {self.x(self.at[0])} {self.z(self.at[1])}")

    def slow_line(self) -> None:
        self.say(f"{self.feed_per_minute} F{self.number(self.within(60.0, 200.0))}")
        self.say(f"G1 {self.x(self.within(10.0, 30.0))} {self.z(self.within(-20.0, 0.0))}")
        self.say(f"{self.feed_per_revolution} F{self.number(0.2)}")
        self.away()

    def contour(self) -> None:
        """Lines and arcs outwards, absolute."""
        radius, place = self.within(4.0, 8.0), 0.0
        self.say(f"G0 {self.x(radius)} {self.z(self.within(0.5, 2.0))}")
        self.say(f"G1 {self.z(place)} F{self.number(self.within(0.05, 0.3))}")
        for _ in range(self.chance.randint(2, 5)):
            wider, deeper = self.within(0.5, 3.0), self.within(1.0, 6.0)
            shape = self.chance.randrange(4)
            if shape < 2:
                self.say(f"G1 {self.x(radius + wider)} {self.z(place - deeper)}")
            elif shape == 2:
                bow = self.within(1.0, 3.0) * (wider**2 + deeper**2) ** 0.5
                self.say(f"{self.chance.choice(['G2', 'G3'])} {self.x(radius + wider)} {self.z(place - deeper)} R{self.number(bow)}")
            else:
                wider = deeper = self.within(0.5, 3.0)
                self.say(f"G3 {self.x(radius + wider)} {self.z(place - deeper)} I0. K{self.number(-wider)}")
            radius, place = radius + wider, place - deeper
        self.say(f"G1 {self.x(radius + 2.0)}")
        self.away()


class _Paper(_Writer):
    inch, millimetre = "G70", "G71"

    def parts(self) -> list[Callable[[], None]]:
        return [*super().parts(), self.increments]

    def increments(self) -> None:
        self.say("G91")
        self.say(f"G1 {self.x(self.within(-8.0, -1.0))} F{self.number(0.15)}")
        self.say(f"G1 {self.x(self.within(-2.0, 2.0))} {self.z(self.within(-9.0, -1.0))}")
        self.say("G90")
        self.away()


class _Shifting(_Writer):
    """Work offsets and shifts, which LinuxCNC and Fanuc share."""

    shift = "G92"

    def parts(self) -> list[Callable[[], None]]:
        return [*super().parts(), self.work_offset, self.origin, self.local_shift, self.home, self.threads, self.threading_cycle]

    def work_offset(self) -> None:
        number = self.chance.randint(1, 6)
        self.say(f"G10 L2 P{number} {self.x(self.within(-2.0, 2.0))} {self.z(self.within(-8.0, 8.0))}")
        self.say(f"G{53 + number}")
        self.away()

    def origin(self) -> None:
        self.away()
        if self.shift == "G50" and self.chance.random() < 0.4:
            self.say(f"G50 {self.x(self.within(-1.0, 1.0), 'U')} {self.z(self.within(-3.0, 3.0), 'W')}")
            self.away()
            return
        self.say(f"{self.shift} {self.x(self.at[0] + self.within(-1.0, 1.0))} {self.z(self.at[1] + self.within(-3.0, 3.0))}")
        self.away()

    def local_shift(self) -> None:
        self.say(f"G52 {self.x(0.0)} {self.z(self.within(-5.0, 5.0))}")
        self.contour()
        self.say(f"G52 {self.x(0.0)} {self.z(0.0)}")
        self.away()

    def home(self) -> None:
        axes = self.chance.choice([f"{self.x(45.0)} {self.z(10.0)}", self.x(42.0), self.z(12.0)])
        self.say(f"G28 {axes}")
        self.away()

    def threads(self) -> None:
        raise NotImplementedError

    def threading_cycle(self) -> None:
        raise NotImplementedError


class _LinuxCnc(_Shifting):
    def head(self) -> None:
        self.double = self.chance.choice([1.0, 2.0])
        self.say("G7" if self.double == 2.0 else "G8")
        super().head()

    def parts(self) -> list[Callable[[], None]]:
        return [*super().parts(), self.holes, self.tap, self.origin_here, self.further_holes]

    def origin_here(self) -> None:
        """G10 L20: the work offset that gives this place the coordinates."""
        self.away()
        self.say(f"G10 L20 P{self.chance.choice([0, 2])} {self.x(self.at[0] + self.within(-1.0, 1.0))} {self.z(self.within(2.0, 6.0))}")
        self.away()

    def further_holes(self) -> None:
        """G91: R from here, Z from R; or modal blocks whose X and Z change."""
        self.say(f"G0 {self.x(2.0)} {self.z(9.0)}")
        code = self.chance.choice(["G81", "G83 Q" + self.number(self.within(2.0, 5.0))])
        if self.chance.random() < 0.5:
            self.say(f"G17 G91 G99 {code} R{self.number(-4.0)} {self.z(-self.within(6.0, 12.0))} F{self.number(0.1)}")
            self.say(f"{self.x(1.0)}")
            self.say("G80 G18 G90")
        else:
            self.say(f"G17 G98 {code} R{self.number(3.0)} {self.z(-self.within(6.0, 12.0))} F{self.number(0.1)}")
            self.say(f"{self.x(0.5)} {self.z(-self.within(2.0, 5.0))}")
            self.say("G80 G18")
        self.away()

    def tap(self) -> None:
        self.say(f"G0 {self.x(0.0)} {self.z(3.0)}")
        self.say(f"G33.1 {self.z(-self.within(5.0, 12.0))} K{self.number(self.within(0.5, 1.5))}")
        self.away()

    def threads(self) -> None:
        """Chained G33, the last one running out; K is the lead along the way."""
        radius = self.within(5.0, 12.0)
        self.say(f"G0 {self.x(radius)} {self.z(3.0)}")
        self.say(f"G33 {self.z(-10.0)} K{self.number(self.within(0.5, 2.0))}")
        if self.chance.random() < 0.5:
            self.say(f"{self.x(radius + self.within(0.0, 1.0))} {self.z(-20.0)}")
        self.say(f"G33 {self.x(radius + 2.0)} {self.z(-22.0)} K{self.number(1.0)}")
        self.away()

    def threading_cycle(self) -> None:
        drive = self.within(10.0, 14.0)
        first = self.within(0.1, 0.3)
        self.say(f"G0 {self.x(drive)} {self.z(4.0)}")
        extra = self.chance.choice(["", f" R{self.chance.choice([1.0, 1.5, 2.0])} H{self.chance.randint(0, 2)}", " Q29.5 R2. H1"])
        self.say(
            f"G76 P{self.number(self.within(0.8, 2.0))} {self.z(self.within(-25.0, -10.0))} {self.x(-self.within(0.5, 2.0), 'I')} "
            f"{self.x(first, 'J')} {self.x(first + self.within(0.2, 1.0), 'K')}{extra}"
        )
        self.away()

    def holes(self) -> None:
        self.say(f"G0 {self.x(0.0)} {self.z(8.0)}")
        code = self.chance.choice(["G81", "G82", "G83"])
        further = {"G81": "", "G82": " P0.2", "G83": f" Q{self.number(self.within(1.0, 6.0))}"}[code]
        self.say(
            f"G17 {self.chance.choice(['G98', 'G99'])} {code} {self.z(-self.within(8.0, 25.0))} R{self.number(2.0)}{further} "
            f"F{self.number(0.1)}"
        )
        self.say("G80 G18")
        self.away()


class _SystemA(_Shifting):
    double = 2.0
    feed_per_revolution, feed_per_minute = "G99", "G98"
    shift, thread, turn, thread_pass, face = "G50", "G32", "G90", "G92", "G94"

    def head(self) -> None:
        self.say("T0101")
        super().head()

    def parts(self) -> list[Callable[[], None]]:
        return [
            *super().parts(), self.increments, self.turning, self.facing, self.thread_passes, self.roughed, self.roughed, self.repeated,
            self.bored, self.groove, self.face_groove, self.hole, self.hole, self.tap, self.in_increments, self.thread_in_one_block,
            self.tool_offset,
        ]  # fmt: skip

    def increments(self) -> None:
        self.say(f"G1 {self.x(self.within(-8.0, -1.0), 'U')} F{self.number(0.15)}")
        self.say(f"{self.z(self.within(-9.0, -1.0), 'W')}")
        self.say(f"{self.x(self.within(0.5, 3.0), 'U')} {self.z(self.within(-5.0, 0.0), 'W')}")
        self.away()

    def threads(self) -> None:
        radius = self.within(5.0, 12.0)
        start = f" Q{self.chance.choice([90000, 180000, 240000])}" if self.chance.random() < 0.3 else ""
        self.say(f"G0 {self.x(radius)} {self.z(3.0)}")
        self.say(f"{self.thread} {self.z(-10.0)} F{self.number(self.within(0.5, 2.0))}{start}")
        if self.chance.random() < 0.5:
            self.say(f"{self.x(radius + self.within(0.1, 1.0))} {self.z(-20.0)}")
        self.say(f"{self.thread} {self.x(radius + 2.0)} {self.z(-22.0)}")
        self.away()

    def thread_passes(self) -> None:
        radius = self.within(8.0, 12.0)
        taper = f" R{self.number(-self.within(0.1, 0.6))}" if self.chance.random() < 0.4 else ""
        self.say(f"G0 {self.x(radius + 4.0)} {self.z(4.0)}")
        start = f" Q{self.chance.choice([120000, 180000])}" if self.chance.random() < 0.3 else ""
        self.say(
            f"{self.thread_pass} {self.x(radius)} {self.z(-self.within(10.0, 20.0))}{taper} F{self.number(self.within(0.8, 2.0))}{start}"
        )
        for number in range(1, 3):
            self.say(self.x(radius - 0.2 * number))
        self.away()

    def threading_cycle(self) -> None:
        radius, height = self.within(6.0, 10.0), self.within(0.5, 1.2)
        outside = self.chance.choice([1.0, 1.0, -1.0])
        self.say(f"G0 {self.x(radius + outside * 4.0)} {self.z(4.0)}")
        self.say(
            f"G76 P{self.chance.randint(1, 2):02d}{self.chance.choice(['00', '05', '10'])}{self.chance.choice(['00', '29', '60'])} "
            f"Q{self.chance.choice([20, 50])} R{self.number(self.chance.choice([0.0, 0.05]))}"
        )
        taper = f" R{self.number(-0.2)}" if self.chance.random() < 0.3 else ""
        self.say(
            f"G76 {self.x(radius)} {self.z(-self.within(12.0, 20.0))} P{self.micro(height)} "
            f"Q{self.micro(self.within(0.15, 0.35))}{taper} F{self.number(self.within(0.8, 2.0))}"
        )
        self.away()

    def micro(self, millimetres: float) -> int:
        """The number that a length has without a decimal point."""
        return round(millimetres / (0.00254 if self.is_inch else 0.001))

    def turning(self) -> None:
        taper = f" R{self.number(-self.within(0.1, 1.0))}" if self.chance.random() < 0.4 else ""
        self.say(f"G0 {self.x(25.0)} {self.z(2.0)}")
        self.say(f"{self.turn} {self.x(22.0)} {self.z(-self.within(5.0, 20.0))}{taper} F{self.number(0.2)}")
        self.say(self.x(20.5))
        self.away()

    def facing(self) -> None:
        taper = f" R{self.number(-self.within(0.1, 1.0))}" if self.chance.random() < 0.3 else ""
        self.say(f"G0 {self.x(25.0)} {self.z(6.0)}")
        self.say(f"{self.face} {self.x(self.within(2.0, 10.0))} {self.z(3.0)}{taper} F{self.number(0.2)}")
        self.say(self.z(1.5))
        self.away()

    def relative(self, axis: str) -> str:
        """The letter of an increment of an axis."""
        return {"X": "U", "Z": "W"}[axis]

    def relative_begins(self) -> None:
        """Say that positions are increments from here on, where a code does."""

    def relative_ends(self) -> None:
        """Say that positions are absolute again."""

    def in_increments(self) -> None:
        """Single passes inside and outside by increments, with tapers of both signs."""
        outside = self.chance.choice([1.0, -1.0])
        self.say(f"G0 {self.x(18.0)} {self.z(self.within(2.0, 5.0))}")
        self.relative_begins()
        code = self.chance.choice([self.turn, self.face, self.thread_pass])
        deeper = self.x(-outside * self.within(1.5, 3.0), self.relative("X"))
        along = self.z(-self.within(8.0, 15.0), self.relative("Z"))
        taper = f" R{self.number(self.within(-1.0, 1.0))}" if self.chance.random() < 0.7 else ""
        self.say(f"{code} {deeper} {along}{taper} F{self.number(self.within(0.5, 1.5))}")
        further = self.relative("Z" if code == self.face else "X")
        self.say(self.z(-10.0, further) if code == self.face else self.x(-outside * 3.5, further))
        self.relative_ends()
        self.away()

    def thread_in_one_block(self) -> None:
        """G76 as Haas writes it."""
        radius, height = self.within(6.0, 10.0), self.within(0.5, 1.2)
        outside = self.chance.choice([1.0, -1.0])
        self.say(f"G0 {self.x(radius + outside * 4.0)} {self.z(4.0)}")
        angle = self.chance.choice(["", " A60", " A29.", " A0"])
        taper = f" I{self.number(self.within(-0.5, 0.5))}" if self.chance.random() < 0.4 else ""
        start = f" Q{self.chance.choice([90000, 180000])}" if self.chance.random() < 0.3 else ""
        self.say(
            f"G76 {self.x(radius)} {self.z(-self.within(12.0, 20.0))}{taper} K{self.number(height)} "
            f"D{self.number(self.within(0.15, 0.35))}{angle} F{self.number(self.within(0.8, 2.0))}{start}"
        )
        self.away()

    def tool_offset(self) -> None:
        """A geometry offset of a tool, a contour with it, and its end."""
        number = self.chance.randint(2, 9)
        self.say(f"G10 P{number} {self.x(self.within(-1.0, 1.0))} {self.z(self.within(-2.0, 2.0))}")
        self.say(f"T{number:02d}{number:02d}")
        self.away()
        self.contour()

    def block_numbers(self) -> tuple[int, int]:
        self.next_number += 20
        return self.next_number, self.next_number + 10

    def steps_outwards(self) -> list[tuple[float, float]]:
        radius, place, found = self.within(5.0, 8.0), 0.0, []
        for _ in range(self.chance.randint(2, 4)):
            place -= self.within(2.0, 6.0)
            found.append((radius, place))
            if self.chance.random() < 0.5:
                place -= self.within(0.5, 3.0)
            radius += self.within(1.0, 3.0)
            found.append((radius, place))
        return found

    def roughed(self) -> None:
        """G71 or G72 with its contour of straight lines, and G70 behind it."""
        first, last = self.block_numbers()
        points = self.steps_outwards()
        widest, deepest = max(x for x, _ in points), min(z for _, z in points)
        self.say(f"G0 {self.x(widest + 2.0)} {self.z(2.0)}")
        left = f"{self.x(self.chance.choice([0.0, 0.2]), 'U')} {self.z(self.chance.choice([0.0, 0.1]), 'W')}"
        if self.chance.random() < 0.65:
            self.say(f"G71 U{self.number(self.within(0.5, 2.0))} R{self.number(0.5)}")
            self.say(f"G71 P{first} Q{last} {left} F{self.number(0.3)}")
            self.say(f"N{first} G0 {self.x(points[0][0])}")
            self.say(f"G1 {self.z(0.0)} F{self.number(0.1)}")
            ways = points
        else:
            self.say(f"G72 W{self.number(self.within(0.5, 2.0))} R{self.number(0.5)}")
            self.say(f"G72 P{first} Q{last} {left} F{self.number(0.3)}")
            self.say(f"N{first} G0 {self.z(deepest)}")
            self.say(f"G1 {self.x(widest)} F{self.number(0.1)}")
            ways = points[::-1]
        for x, z in ways:
            self.say(f"{self.x(x)} {self.z(z)}")
        self.say(f"N{last} " + (f"{self.x(widest + 1.0)}" if ways is points else f"{self.z(1.0)}"))
        self.say(f"G70 P{first} Q{last}")
        self.away()

    def bored(self) -> None:
        """G71 inside a bore, with a fillet."""
        first, last = self.block_numbers()
        wide, narrow = self.within(14.0, 16.0), self.within(8.0, 10.0)
        fillet, deep = self.within(0.5, 1.5), -self.within(6.0, 12.0)
        self.say(f"G0 {self.x(narrow - 2.0)} {self.z(2.0)}")
        self.say(f"G71 U{self.number(self.within(0.5, 1.5))} R{self.number(0.3)}")
        self.say(f"G71 P{first} Q{last} {self.x(-0.2, 'U')} {self.z(0.1, 'W')} F{self.number(0.25)}")
        self.say(f"N{first} G0 {self.x(wide)}")
        self.say(f"G1 {self.z(deep)} F{self.number(0.1)}")
        self.say(f"G3 {self.x(wide - fillet)} {self.z(deep - fillet)} R{self.number(fillet)}")
        self.say(f"G1 {self.x(narrow)}")
        self.say(f"{self.z(-20.0)}")
        self.say(f"N{last} {self.x(narrow - 1.0)}")
        self.say(f"G70 P{first} Q{last}")
        self.away()

    def tap(self) -> None:
        self.say(f"G0 {self.x(0.0)} {self.z(6.0)}")
        self.say(f"G84 {self.z(-self.within(6.0, 12.0))} R{self.number(3.0)} F{self.number(self.within(0.5, 1.5))}")
        self.say("G80")
        self.away()

    def repeated(self) -> None:
        first, last = self.block_numbers()
        points = self.steps_outwards()
        self.say(f"G0 {self.x(max(x for x, _ in points) + 6.0)} {self.z(8.0)}")
        self.say(f"G73 U{self.number(self.within(1.0, 3.0))} W{self.number(self.within(0.5, 2.0))} R{self.chance.randint(1, 4)}")
        self.say(f"G73 P{first} Q{last} {self.x(0.2, 'U')} {self.z(0.1, 'W')} F{self.number(0.25)}")
        self.say(f"N{first} G0 {self.x(points[0][0])} {self.z(1.0)}")
        for x, z in points[:-1]:
            self.say(f"G1 {self.x(x)} {self.z(z)}")
        self.say(f"N{last} {self.x(points[-1][0])} {self.z(points[-1][1])}")
        self.say(f"G70 P{first} Q{last}")
        self.away()

    def groove(self) -> None:
        self.say(f"G0 {self.x(20.0)} {self.z(-self.within(4.0, 6.0))}")
        self.say(f"G75 R{self.number(0.3)}")
        self.say(
            f"G75 {self.x(self.within(12.0, 17.0))} {self.z(-self.within(8.0, 14.0))} P{self.micro(self.within(0.8, 2.5))} "
            f"Q{self.micro(self.within(1.0, 2.5))} F{self.number(0.08)}"
        )
        self.away()

    def face_groove(self) -> None:
        self.say(f"G0 {self.x(12.0)} {self.z(1.0)}")
        self.say(f"G74 R{self.number(0.3)}")
        self.say(
            f"G74 {self.x(self.within(6.0, 10.0))} {self.z(-self.within(3.0, 8.0))} P{self.micro(self.within(1.0, 2.5))} "
            f"Q{self.micro(self.within(0.8, 2.5))} F{self.number(0.08)}"
        )
        self.away()

    def hole(self) -> None:
        self.say(f"G0 {self.x(0.0)} {self.z(6.0)}")
        peck = f" Q{self.micro(self.within(2.0, 6.0))}" if self.chance.random() < 0.6 else ""
        by_increment = self.chance.random() < 0.4
        if by_increment:
            self.relative_begins()
        bottom = self.z(-self.within(8.0, 25.0), self.relative("Z") if by_increment else "Z")
        plane = self.number(self.chance.choice([2.0, -3.0]))
        self.say(f"{'G83' if peck else 'G81'} {bottom} R{plane}{peck} F{self.number(0.1)}")
        self.say("G80")
        self.relative_ends()
        self.away()


class _SystemB(_SystemA):
    feed_per_revolution, feed_per_minute = "G95", "G94"
    shift, thread, turn, thread_pass, face = "G92", "G33", "G77", "G78", "G79"

    def relative(self, axis: str) -> str:
        return axis

    def relative_begins(self) -> None:
        self.say("G91")

    def relative_ends(self) -> None:
        self.say("G90")

    def increments(self) -> None:
        self.say("G91")
        self.say(f"G1 {self.x(self.within(-8.0, -1.0))} F{self.number(0.15)}")
        self.say(f"{self.x(self.within(0.5, 3.0))} {self.z(self.within(-5.0, -1.0))}")
        self.say("G90")
        self.away()
