"""A part-program file to an interpreted program in one step, in the dialect that it is written in.

Which dialect a program is written in: as its header says, else as its words tell; the reason is always said.

A header is a comment such as ``(dialect: fanuc)`` before the first word. Else the dialects that have, and carry out, every word of the
program are held against each other by words that only one of them uses so.

Part programs made from a few numbers: the taper cut and the straight cut of Liu and Landers' simulator, in the dialect ``paper``.

The tool cuts toward +z, as in the paper: the face of the stock lies at ``face``, the tool starts and ends at X0 Z0 in front of it.
Source: Liu, Landers, A Modular Machine Tool Simulator (2004), section Part program (TAPER CUT, STRAIGHT CUT) and example 2. The paper
does not print the fields of its dialogues beyond naming geometry and process variables; those here are what the cuts need.
Left out: several passes, and what the stock's own size asks for; the depth of cut follows from the stock of the lesson.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from lathesim.errors import ProgramError, UnitError
from lathesim.program.dialects import DIALECTS, TWO_DIGITS, Dialect, dialect_named
from lathesim.program.interpreter import interpret
from lathesim.program.moves import Program, Tool
from lathesim.program.vocabulary import has_shape, without_variants, words_missing
from lathesim.program.words import Block, Blocks, read_program_file
from lathesim.units import quantity, same_dimension, split_quantity

_HEADER = re.compile(r"dialect\s*[:=]\s*([\w-]+)", re.IGNORECASE)
_FIRST_LINES = 20
"""Lines in which a header is looked for."""


@dataclass(frozen=True)
class Detected:
    """A dialect, and why it was taken, as half a sentence."""

    dialect: Dialect
    reason: str


def detect_dialect(blocks: Blocks) -> Detected:
    """Return the dialect of a program; raises :class:`ProgramError` where its header names one that there is not."""
    for block in blocks.blocks:
        if block.line > _FIRST_LINES:
            break
        for comment in block.comments:
            header = _HEADER.search(comment)
            if header is not None:
                return Detected(_named(header[1].lower(), f"{blocks.name}:{block.line}"), f"line {block.line} says so")
    ranked = sorted(DIALECTS.values(), key=lambda dialect: (_missing(blocks, dialect), -_signs(blocks, dialect), _unknown(blocks, dialect)))
    best = ranked[0]
    missing, signs = _missing(blocks, best), _signs(blocks, best)
    rivals = [other for other in ranked[1:] if _missing(blocks, other) == missing]
    equal = [other.name for other in rivals if _signs(blocks, other) == signs]
    if missing:
        return Detected(best, "no dialect carries out all its words, and this one carries out the most")
    if not rivals:
        rarer = [
            f" but its rarer form '{other.name}'" for other in ranked if other.variant_of == best.name and not words_missing(blocks, other)
        ]
        return Detected(best, f"no other dialect has all its words{''.join(rarer)}")
    if not equal:
        return Detected(best, "its words are used as there")
    return Detected(best, f"its words do not distinguish it from {' or '.join(without_variants(equal))}")


def _missing(blocks: Blocks, dialect: Dialect) -> int:
    """Return the number of missing words; a rarer form gets one more unless the common form misses more."""
    common = DIALECTS.get(dialect.variant_of)
    missing = words_missing(blocks, dialect)
    return missing + (common is not None and words_missing(blocks, common) <= missing)


def _unknown(blocks: Blocks, dialect: Dialect) -> int:
    """Return how many codes of the program the dialect does not even have a name for."""
    codes = {word.code for block in blocks.shapes.values() for word in block.words if word.letter == "G" and word.expression is None}
    return len(codes - dialect.codes.keys())


def _named(name: str, place: str) -> Dialect:
    try:
        return dialect_named(name)
    except ProgramError as error:
        raise ProgramError(error.fact, place=place, remedy=error.remedy) from error


def _signs(blocks: Blocks, dialect: Dialect) -> int:
    """Return how many shapes of blocks are written as only this dialect writes them."""
    return sum(_is_sign(block, dialect) and has_shape(block, dialect) for block in blocks.shapes.values())


def _is_sign(block: Block, dialect: Dialect) -> bool:
    if block.statement is not None:
        return block.statement.kind in dialect.program.statements
    codes = {word.code for word in block.words if word.letter in "GM" and word.expression is None}
    letters = {word.letter: word for word in block.words}
    if dialect.tools.change_at_t:
        moves = not letters.keys().isdisjoint("XZUW")
        long_tool = "T" in letters and letters["T"].value >= TWO_DIGITS
        cycle = bool(codes & {"G70", "G71", "G72", "G73", "G75"}) and bool(letters.keys() & {"P", "U", "R"})
        simple = bool(codes & {"G90", "G92", "G94"}) and moves and "F" in letters and not codes & {"G0", "G1", "G2", "G3"}
        own = bool(letters.keys() & {"U", "W", "O"}) or bool(codes & {"G32", "G50", "G99", "G65", "M97", "M98"})
        own = own or ("G33" in codes and "F" in letters and "K" not in letters)
        return long_tool or cycle or simple or own
    if dialect.cycles.thread_drive_line:
        thread = ("G76" in codes and "J" in letters) or ("G33" in codes and "K" in letters)
        return thread or bool(codes & {"G7", "G8", "G64", "G41.1", "G42.1"})
    return bool(codes & {"G70", "G71"}) and not letters.keys() & {"P", "U", "R", "Q"}


def load_program(
    path: str | Path, dialect: str = "paper", *, start: tuple[float, float] | None = None, tools: Mapping[int, Tool] | None = None
) -> Program:
    """Read and interpret the program in the file ``path``; every fault is a :class:`ProgramError` of ``lathesim.errors``.

    ``dialect`` "auto" finds it, see :func:`lathesim.program.loading.detect_dialect`. ``start`` is where the tool stands at first
    (x, z) [m], without it the dialect's. ``tools`` are the tools by number, for nose compensation.
    """
    blocks = read_program_file(path)
    return interpret(blocks, detect_dialect(blocks).dialect if dialect == "auto" else dialect, start=start, tools=tools)


def straight_from_form(*, diameter: str, length: str, face: str, clearance: str, feed: str, speed: str) -> str:
    """Return the text of a straight cut: one pass at ``diameter`` over ``length`` behind the face; raises as :func:`taper_from_form`."""
    return taper_from_form(
        large_diameter=diameter, small_diameter=diameter, length=length, face=face, clearance=clearance, feed=feed, speed=speed
    )


def taper_from_form(*, large_diameter: str, small_diameter: str, length: str, face: str, clearance: str, feed: str, speed: str) -> str:
    """Return the text of a taper cut: one pass from ``small_diameter`` at the face to ``large_diameter`` at ``length`` behind it.

    The tool comes to ``clearance`` in front of the face in rapid traverse, feeds to the face, along the taper, out of the part by
    ``clearance`` and returns to X0 Z0. The unit of the feed, mm/min or mm (mm/rev), and of the speed, rpm or m/min, says which is meant.
    Raises :class:`UnitError`, and :class:`ProgramError` where the numbers make no such cut.
    """
    small, large, long = _length(small_diameter), _length(large_diameter), _length(length)
    begin, gap = _length(face), _length(clearance)
    per_revolution = same_dimension(split_quantity(_with_unit(feed, "mm/min"))[1], "m")
    surface = same_dimension(split_quantity(_with_unit(speed, "rpm"))[1], "m/s")
    fed, turned = quantity(feed, "m" if per_revolution else "m/s"), quantity(speed, "m/s" if surface else "rad/s")
    for name, value in (("diameter", small), ("length", long), ("clearance", gap), ("feed", fed), ("speed", turned)):
        if not (math.isfinite(value) and value > 0.0):
            raise ProgramError(f"The {name} of the cut is {value:g}, and it has to be above 0.", remedy=f"Give a {name} above 0.")
    if large < small:
        fact = f"The large diameter {_mm(large)} mm is below the small one, {_mm(small)} mm."
        raise ProgramError(fact, remedy="The taper widens away from the face; exchange the two.")
    if not math.isfinite(large) or not math.isfinite(begin):
        raise ProgramError("A number of the cut is not finite.", remedy="Give lengths in mm.")
    if begin - gap < 0.0:
        fact = f"The tool would wait at Z{_mm(begin - gap)}, and it starts from Z0 in front of the part."
        raise ProgramError(fact, remedy="Put the face further away or the clearance smaller.")
    straight = small == large
    cut = f"Straight cut: diameter {_mm(large)} mm" if straight else f"Taper cut: diameters {_mm(small)} to {_mm(large)} mm"
    blocks = (
        f"G90 {'G95' if per_revolution else 'G94'} G71",
        f"{'G96' if surface else 'G97'} S{_number(turned * 60.0 / (1.0 if surface else 2.0 * math.pi))} M03",
        f"G00 X{_mm(0.5 * small)} Z{_mm(begin - gap)}",
        f"G01 Z{_mm(begin)} F{_number(fed * (1e3 if per_revolution else 6e4))}",
        f"{'' if straight else f'X{_mm(0.5 * large)} '}Z{_mm(begin + long)}",
        f"X{_mm(0.5 * large + gap)}",
        "G00 Z0.0",
        "X0.0 M05",
        "M30",
    )
    title = f"({cut}, length {_mm(long)} mm, face at Z{_mm(begin)}; X is a radius)"
    return "\n".join([title, *(f"N{10 * number} {block}" for number, block in enumerate(blocks, start=1))]) + "\n"


def _number(value: float) -> str:
    text = f"{value:.6f}".rstrip("0")
    return f"{text}0" if text.endswith(".") else text


def _mm(value: float) -> str:
    return _number(1e3 * value)


def _length(text: str) -> float:
    return quantity(_with_unit(text, "mm"), "m")


def _with_unit(text: str, usual: str) -> str:
    """Return a text that has a unit; where it has none, the remedy names the one that a shop writes."""
    if not split_quantity(text)[1]:
        raise UnitError(f"'{text}' has no unit.", remedy=f"Write it with one, for example '{text.strip()} {usual}'.")
    return text
