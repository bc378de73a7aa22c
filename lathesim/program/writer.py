"""A program written out as canonical moves: plain LinuxCNC blocks in millimetres, X as a radius, that read back to the same moves."""

from __future__ import annotations

import math

from lathesim.program.moves import Event, Move, Program, Spindle

_SAME = 1e-10
_RPM = 60.0 / (2.0 * math.pi)


def linuxcnc_text(program: Program) -> str:
    """Return the moves of a program as text in the dialect ``linuxcnc``; cycles stand as the moves they expand to.

    Numbers have seven decimals of a millimetre. Left out: the comments, the lines the moves came from, and rapids without a length.
    """
    lines = ["(dialect: linuxcnc)", f"(moves of {_plain(program.name)})", "G21 G18 G90 G91.1 G8 G40"]
    written = _Written()
    events = sorted(program.events, key=lambda event: event.before_move)
    place = 0
    for index, move in enumerate(program.moves):
        while place < len(events) and events[place].before_move <= index:
            lines += written.event(events[place])
            place += 1
        if move.spin_back or (move.kind == "rapid" and move.length < _SAME):
            continue
        lines += written.spindle(move.spindle)
        following = program.moves[index + 1] if index + 1 < len(program.moves) else None
        lines += written.tap(move, following) if following is not None and following.spin_back else written.move(move)
    for event in events[place:]:
        lines += written.event(event)
    if not lines[-1].startswith("M2"):
        lines.append("M2")
    return "\n".join(lines) + "\n"


class _Written:
    """What stands in force in the text so far."""

    def __init__(self) -> None:
        self._spindle: Spindle | None = None
        self._per_revolution: bool | None = None
        self._feed: float | None = None

    def spindle(self, spindle: Spindle) -> list[str]:
        """Return the block that brings the spindle to what a move needs; none where it is so."""
        if spindle == self._spindle:
            return []
        self._spindle = spindle
        if spindle.direction == 0:
            return ["M5"]
        turn = "M3" if spindle.direction > 0 else "M4"
        if spindle.surface:
            limit = f" D{_number(spindle.limit * _RPM)}" if spindle.limit else ""
            return [f"G96 S{_number(spindle.speed * 60.0)}{limit} {turn}"]
        return [f"G97 S{_number(spindle.speed * _RPM)} {turn}"]

    def move(self, move: Move) -> list[str]:
        """Return the blocks of a move."""
        end = f"X{_number(1e3 * move.end_x)} Z{_number(1e3 * move.end_z)}"
        if move.kind == "dwell":
            return [f"G4 P{_number(move.seconds)}"]
        if move.kind == "rapid":
            return [f"G0 {end}"]
        if move.kind == "thread":
            angle = f" D{_number(math.degrees(move.start_angle))}" if move.start_angle else ""
            return [f"G33 {end} K{_number(1e3 * (move.feed or 0.0))}{angle}"]
        lines = []
        if move.per_revolution != self._per_revolution:
            self._per_revolution, self._feed = move.per_revolution, None
            lines.append("G95" if move.per_revolution else "G94")
        feed = ""
        if move.feed is not None and move.feed != self._feed:
            self._feed = move.feed
            feed = f" F{_number(move.feed * (1e3 if move.per_revolution else 6e4))}"
        if move.arc is None:
            return [*lines, f"G1 {end}{feed}"]
        arc = move.arc
        centre = f"I{_number(1e3 * (arc.centre_x - move.start_x))} K{_number(1e3 * (arc.centre_z - move.start_z))}"
        return [*lines, f"{'G2' if arc.clockwise else 'G3'} {end} {centre}{feed}"]

    def tap(self, move: Move, back: Move) -> list[str]:
        """Return the block for both ways of a tapped hole."""
        faster = back.spindle.speed / move.spindle.speed
        factor = "" if math.isclose(faster, 1.0) else f" I{_number(faster)}"
        return [f"G33.1 X{_number(1e3 * move.end_x)} Z{_number(1e3 * move.end_z)} K{_number(1e3 * (move.feed or 0.0))}{factor}"]

    def event(self, event: Event) -> list[str]:
        """Return the block of an event; the spindle stands with the moves."""
        words = {
            "flood_on": "M8", "flood_off": "M9", "mist_on": "M7", "mist_off": "M9", "program_stop": "M0", "optional_program_stop": "M1",
            "program_end": "M2",
        }  # fmt: skip
        if event.kind == "tool":
            self._spindle = None  # LinuxCNC stops the spindle to change the tool
            return [f"T{event.tool} M6"] if event.tool else []
        if event.kind == "message":
            return [f"(MSG, {_plain(event.text)})"]
        return [words[event.kind]] if event.kind in words else []


def _number(value: float) -> str:
    text = f"{value:.7f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def _plain(text: str) -> str:
    return text.replace("(", "[").replace(")", "]")
