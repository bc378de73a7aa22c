"""Text of a part program to blocks of words, each with its physical line.

``%`` lines, ends of programs, CRLF and a byte order mark are read here, the lines themselves in ``lexing``. The meaning of words is
decided later (dialects, interpreter). The text before the ``%`` that opens a program is a leader and not read. Reading ends at the next
``%`` or behind a block with M2 or M30.

Source: EIA RS-274-D; NIST RS274NGC Interpreter version 3 (Kramer, Proctor, Messina 2000), section 3.2 (program delimiters); Fanuc 0i-T
operator's manual, configuration of a program (tape start, leader section).
"""

from __future__ import annotations

import re
from array import array
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import overload

from lathesim.errors import Fault, ProgramError, SeveralFaultsError, nearest
from lathesim.program.lexing import Block, Word, block_of_line, shape_of
from lathesim.program.meanings import SINUMERIK, foreign_control, foreign_program
from lathesim.program.statements import Keyword, opens

__all__ = ["Block", "Blocks", "Lines", "Warned", "Word", "read_program", "read_program_file"]

MOST_LOCALS = 500  # N numbers behind the end that may be called, assumed: programs have a handful
MOST_KEPT = 5_000  # blocks with expressions or statements to cache (assumed: loops repeat few of them often)
MOST_FAULTS = 20  # lines at fault that are told, assumed: whoever wrote more has to look at the file anyway

_LINE_END = re.compile(r"\r\n|\n|\r")
_PERCENT = re.compile(r"(?:\A|[\r\n])[ \t]*%")
_END = re.compile(r"M\s*0*(?:2|30|99)(?![0-9.])", re.IGNORECASE)
_MOVES = re.compile(r"[XZUW]\s*[-+.0-9#\[]", re.IGNORECASE)
_REMARK = re.compile(r"\([^()]*\)|;.*")
_PROGRAM_NUMBER = re.compile(r"\s*[Oo]\s*([0-9]{1,8})(?![0-9.])")
_BLOCK_NUMBER = re.compile(r"N([0-9]+\.?[0-9]*)")

Shape = tuple[str, ...]
"""The codes and letters of a block, without numbers: the words that a dialect must have."""


@dataclass(frozen=True)
class Warned:
    """A warning on a program: physical line and sentence."""

    line: int
    sentence: str


class Lines(Sequence[Block]):
    """Blocks of a text, read again on each use, so that a long program needs about its own length of memory.

    ``starts`` are the positions of the lines in ``text`` and of its end, ``lines`` the physical lines of the blocks, ``faults`` the errors
    of unreadable lines.
    """

    def __init__(self, text: str, block_delete: bool) -> None:
        self.text = text
        self.starts = array("I", [0, *(found.end() for found in _LINE_END.finditer(text)), len(text) + 1])
        self.lines = array("I")
        self.faults: dict[int, Fault] = {}
        self._block_delete = block_delete
        self._kept: dict[int, Block] = {}

    def raw(self, line: int) -> str:
        """Return a physical line, counted from 1, with its end."""
        return self.text[self.starts[line - 1] : self.starts[line]]

    def parsed(self, line: int) -> Block | None:
        """Return the block of a physical line, or None if it is blank or deleted. Raises :class:`Fault`."""
        return block_of_line(self.raw(line), line, self._block_delete)

    def __len__(self) -> int:
        return len(self.lines)

    @overload
    def __getitem__(self, index: int) -> Block: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[Block, ...]: ...

    def __getitem__(self, index: int | slice) -> Block | tuple[Block, ...]:
        if isinstance(index, slice):
            return tuple([self[place] for place in range(*index.indices(len(self)))])
        line = self.lines[index]
        if line in self._kept:
            return self._kept[line]
        if line in self.faults:
            return Block(line, (), fault=self.faults[line])
        block = block_of_line(self.text[self.starts[line - 1] : self.starts[line]], line, self._block_delete) or Block(line, ())
        if (block.computed or block.statement is not None or block.assignments) and len(self._kept) < MOST_KEPT:
            self._kept[line] = block
        return block

    def matching(self, pattern: re.Pattern[str]) -> Iterator[Block]:
        """Yield the blocks of the lines that contain a pattern."""
        for line in dict.fromkeys(bisect_right(self.starts, found.start()) for found in pattern.finditer(self.text)):
            place = bisect_left(self.lines, line)
            if self.lines[place : place + 1] == array("I", [line]):
                yield self[place]


@dataclass(frozen=True)
class Blocks:
    """A program in blocks; ``ending`` is its last word: ``M2``, ``M30``, ``%`` or nothing.

    ``shapes`` has one block of each shape, ``branches`` says whether statements choose the next block. ``deleted`` counts the lines of the
    main program that begin with / and are left out.
    """

    name: str
    blocks: Sequence[Block]
    ending: str
    last_line: int
    warnings: tuple[Warned, ...] = field(default=())
    subprograms: Mapping[int, tuple[Block, ...]] = field(default_factory=dict)
    """Programs behind the end of the main one, by their O number."""
    locals: Mapping[int, tuple[Block, ...]] = field(default_factory=dict)
    """Blocks behind the end of the main program from an N number to M99, by that number."""
    shapes: Mapping[Shape, Block] = field(default_factory=dict)
    branches: bool = False
    deleted: int = 0

    def matching(self, pattern: re.Pattern[str]) -> Iterator[Block]:
        """Yield the blocks of the main program whose lines contain a pattern."""
        return self.blocks.matching(pattern) if isinstance(self.blocks, Lines) else iter(())


def read_program_file(path: str | Path, *, block_delete: bool = True) -> Blocks:
    """Return the blocks of the part program in the file ``path``; a missing or unreadable file is a :class:`ProgramError`."""
    path = Path(path)
    try:
        content = path.read_bytes()
    except FileNotFoundError as error:
        near = nearest(path.name, [file.name for file in path.parent.glob("*.n*c*")] if path.parent.is_dir() else [])
        raise ProgramError(f"There is no part program '{path}'.", remedy=near) from error
    except OSError as error:
        raise ProgramError(f"The part program '{path}' cannot be read: {error.strerror}.") from error
    return read_program(content, str(path), block_delete=block_delete)


def read_program(source: str | bytes, name: str = "program", *, block_delete: bool = True) -> Blocks:
    """Return the blocks of a program text.

    ``name`` stands in front of the line in every message; with ``block_delete`` lines that begin with ``/`` are left out.
    Raises :class:`ProgramError` for all unreadable lines at once, with place, fact and remedy. If statements may skip such a line, its
    block keeps the error until it runs.
    """
    text = source if isinstance(source, str) else _decoded(source, name)
    lines = Lines(text.removeprefix("\ufeff").rstrip("\x00\x03\x04\x1a"), block_delete)
    reader = _Reader(lines)
    try:
        reader.read_main()
    except Fault as fault:
        raise fault.at(name, reader.line) from None
    reader.raise_faults(name)
    if reader.opened and not reader.ending:
        fact = f"The % of line {reader.opened} opens the program, but no second % closes it."
        raise ProgramError(fact, place=f"{name}:{reader.count}", remedy="The file may be cut short. End it with M30 and %.")
    subprograms, own = reader.further() if reader.ending in ("M2", "M30") else ({}, {})
    own = {**_by_number(lines[reader.main :]), **own} if reader.jumps and reader.main else own
    rest = next((line for line in range(reader.line + 1, reader.count + 1) if lines.raw(line).strip() not in ("", "%")), None)
    if reader.ending and rest is not None and not subprograms and not own:
        reader.warnings.append(Warned(rest, f"All lines after {reader.ending} of line {reader.line} are ignored, from here on."))
    if not any(block.words for block in reader.shapes.values()):
        reader.warnings.append(Warned(1, "The program is empty."))
    last = reader.line if reader.ending else max(lines.lines, default=1)
    return Blocks(
        name, lines, reader.ending, last, tuple(reader.warnings), subprograms, own, reader.shapes, reader.branches, reader.deleted
    )


class _Reader:
    """Reads the lines of a text once: ``line`` is the last line read, ``main`` the number of blocks up to the first end."""

    def __init__(self, lines: Lines) -> None:
        self.lines = lines
        self.count = len(lines.starts) - 1
        self.line = self.opened = self.main = self.deleted = 0
        self.ending = ""
        self.inside, self.jumps, self.branches = 0, False, False  # number of open statements, whether one may jump, whether there are any
        self.warnings: list[Warned] = []
        self.shapes: dict[Shape, Block] = {}
        self._certain = False

    def read_main(self) -> None:
        """Read up to the end of the main program."""
        ends: dict[Shape, str] = {}  # shape -> the code by which it ends a program, or empty
        text, starts, kept = self.lines.text, self.lines.starts, self.lines.lines
        for line in range(self._leader() + 1, self.count + 1):
            raw = text[starts[line - 1] : starts[line]]
            if self.ending and _PROGRAM_NUMBER.match(raw):
                return
            self.line = line
            shape = shape_of(raw)
            if shape is None:
                if raw.lstrip().startswith("%"):
                    if self._closes(raw):
                        return
                    continue
                shape = self._read_line(line)
                if shape is None:
                    continue
            elif shape not in ends:
                self.shapes[shape] = self.lines.parsed(line) or Block(line, ())
            kept.append(line)
            if shape not in ends:
                ends[shape] = next((word.code for word in self.shapes[shape].words if word.code in ("M2", "M30")), "")
            if ends[shape]:
                self.ending, self.main = ends[shape], self.main or len(kept)
                if self.inside <= 0 and not self.jumps:
                    return

    def _read_line(self, line: int) -> Shape | None:
        """Read a line with more than words and return its shape, or None without a block or for a faulty line."""
        try:
            block = self.lines.parsed(line)
        except Fault as fault:
            self.lines.faults[line] = fault
            self._certain = self._certain or self.inside <= 0
            self.lines.lines.append(line)
            return None
        if block is None:
            self.deleted += self.lines.raw(line).lstrip().startswith("/")
            return None
        if block.statement is not None:
            self.branches = True
            self.inside += opens(block.statement)
            self.jumps = self.jumps or block.statement.kind is Keyword.GO_TO
        return self._keep_shape(block)

    def _keep_shape(self, block: Block) -> Shape:
        words = [word.code if word.letter in "GMT" and word.expression is None else word.letter for word in block.words]
        computed = ["#"] if block.assignments or block.computed else []
        shape = (*words, *computed, *([] if block.statement is None else [block.statement.kind]))
        self.shapes.setdefault(shape, block)
        return shape

    def _closes(self, raw: str) -> bool:
        """Return whether a line with % ends the program; a % before the first block opens it."""
        if raw.lstrip().upper().startswith("%_N_"):  # the header of a program file of Sinumerik
            raise foreign_program(SINUMERIK, raw.strip(), self.line)
        if raw.strip() != "%":
            self.warnings.append(Warned(self.line, f"The text '{raw.strip()[1:].strip()[:40]}' behind % is ignored."))
        if not self.opened and not self.lines.lines:
            self.opened = self.line
            return False
        self.ending = "%"
        return True

    def _leader(self) -> int:
        """Return the number of lines before the % that opens the program; they are not read.

        A % opens a program if no end stands before it and a second % follows. A single % opens if an end follows and no move precedes it.
        """
        marks = [found.end() for found in _PERCENT.finditer(self.lines.text)]
        before, behind = (self.lines.text[: marks[0] - 1], self.lines.text[marks[0] :]) if marks else ("", "")
        bare = _REMARK.sub("", before)
        if not before.strip() or _END.search(bare) or (len(marks) == 1 and (_MOVES.search(bare) or not _END.search(behind))):
            return 0
        count = len(_LINE_END.findall(before))
        shown = " ".join(before.split())[:40]
        self.warnings.append(Warned(1, f"'{shown}' stands before the % of line {count + 1}: a leader, which is not read."))
        return count

    def raise_faults(self, name: str) -> None:
        """Raise the errors of faulty lines, if they belong to another control or surely run."""
        faults = [fault.at(name, line) for line, fault in self.lines.faults.items()]
        if not faults:
            return
        foreign = foreign_control(self.lines.text, self.lines.faults)
        if foreign is not None:
            raise foreign.at(name, 0)
        if self._certain and not self.jumps:
            raise faults[0] if len(faults) == 1 else SeveralFaultsError(faults[:MOST_FAULTS], max(0, len(faults) - MOST_FAULTS))

    def further(self) -> tuple[dict[int, tuple[Block, ...]], dict[int, tuple[Block, ...]]]:
        """Return the subprograms after the end by O number, and those called by N number; each ends with M99.

        Return nothing if the lines do not begin with a number.
        """
        found: dict[int, list[Block]] = {}
        behind: list[Block] = []
        number: int | None = None
        for line in range(self.line + 1, self.count + 1):
            raw = self.lines.raw(line)
            if raw.strip() in ("", "%"):
                continue
            begins = _PROGRAM_NUMBER.match(raw)
            if begins is not None:
                number = int(begins[1])
                found[number] = []
            elif not behind and not found and _BLOCK_NUMBER.match(raw.lstrip().upper()) is None:
                return {}, {}
            try:
                block = self.lines.parsed(line)
            except Fault as fault:
                block = Block(line, (), fault=fault)
            if block is not None:
                behind.append(block)
                self.branches = self.branches or block.statement is not None
                self._keep_shape(block)
                if number is not None:
                    found[number].append(block)
        return {key: tuple(blocks) for key, blocks in found.items()}, _by_number(behind)


def _by_number(blocks: Sequence[Block]) -> dict[int, tuple[Block, ...]]:
    """The blocks from each whole N number up to the next M99, by that number."""
    ends = [place for place, block in enumerate(blocks) if any(word.code == "M99" for word in block.words)]
    found: dict[int, tuple[Block, ...]] = {}
    for place, block in enumerate(blocks):
        end = next((end for end in ends if end >= place), None)
        if end is not None and block.number.isdigit() and len(found) < MOST_LOCALS:
            found.setdefault(int(block.number), tuple(blocks[place : end + 1]))
    return found


def _decoded(content: bytes, name: str) -> str:
    """Text of the bytes: UTF-8, UTF-16 with its mark, else the western code page that old editors write comments in."""
    marked = content[:2] in (b"\xff\xfe", b"\xfe\xff")
    for encoding in ["utf-16"] if marked else ["utf-8-sig", "cp1252", "latin-1"]:
        try:
            return content.decode(encoding)
        except UnicodeDecodeError:
            continue
    raise ProgramError(f"'{name}' is no text.", remedy="A part program is a plain text file.")
