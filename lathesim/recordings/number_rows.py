"""Text files by pieces of whole lines, and rows of numbers in them, parsed by numpy."""

from __future__ import annotations

import codecs
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.record import FloatArray
from lathesim.recordings.raw_table import refuse_size
from lathesim.recordings.recording_thresholds import READING

CHUNK = 1 << 23
"""Bytes of text that are parsed at a time."""
_HEAD = 1 << 17
_WIDE = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))


_LOOKED_AT = 4000
"""Letters among which control characters are looked for."""


def head_lines(path: Path) -> list[str]:
    """Return the first lines of a text file without line ends, or an empty list where the file is no text; a cut last line is left out."""
    with path.open("rb") as file:
        head = file.read(_HEAD)
    encoding = _encoding(head)
    if encoding == "utf-16":
        head = head[: len(head) // 2 * 2]
    elif b"\x00" in head:
        return []
    text = head.decode(encoding, errors="replace")
    whole = text[:-4]  # the last letter may be cut
    if encoding == "utf-8" and "\ufffd" in whole:
        text = head.decode("latin-1")
    if sum(letter < " " and letter not in "\t\r\n\f\x1a" for letter in text[:_LOOKED_AT]) > READING.controls:
        return []
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if len(head) == _HEAD and len(lines) > 1:
        lines.pop()
    return lines[:-1] if lines and not lines[-1] else lines


def chunks(path: Path, skip: int = 0) -> Iterator[bytes]:
    """Return the text after ``skip`` lines in pieces of whole lines, as bytes with ``\\n`` at every line's end.

    Numbers are the same bytes in every encoding that is read; names were taken from the head.
    """
    rest = b""
    for piece in _pieces(path):
        text = rest + piece
        while skip and b"\n" in text:
            text = text[text.index(b"\n") + 1 :]
            skip -= 1
        end = text.rfind(b"\n") + 1
        rest = text[end:]
        if end and not skip:
            yield text[:end]
    if rest.strip(b"\x00\x1a \t") and not skip:
        yield rest.rstrip(b"\x00\x1a") + b"\n"


def count_lines(path: Path) -> int:
    """Return the number of lines."""
    return sum(piece.count(b"\n") for piece in chunks(path))


def _pieces(path: Path) -> Iterator[bytes]:
    with path.open("rb") as file:
        encoding = _encoding(file.read(4))
    if encoding == "utf-16":
        with path.open(encoding=encoding, errors="replace") as text:
            while letters := text.read(CHUNK):
                yield letters.encode()
        return
    with path.open("rb") as file:
        ended = False
        while piece := file.read(CHUNK):
            if ended and piece.startswith(b"\n"):
                piece = piece[1:]
            ended = piece.endswith(b"\r")
            yield piece.replace(b"\r\n", b"\n").replace(b"\r", b"\n")


def _encoding(head: bytes) -> str:
    return next((name for mark, name in _WIDE if head.startswith(mark)), "utf-8")


NUMBER = r"[-+]?(?:\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?|nan|NaN|NAN|[Ii]nf(?:inity)?|INF)"
STAMP = rb"\d{4}-\d\d-\d\d[T ]\d\d:\d\d:\d\d(?:\.\d+)?"


@dataclass(frozen=True)
class RowFormat:
    """How a row is written: ``delimiter`` (empty for white space), whether numbers have a decimal comma, the number of cells of a row."""

    delimiter: str
    decimal_comma: bool
    width: int
    stamps: int | None = None
    """The cell that holds date and time, read as seconds since the first row."""
    ends: frozenset[int] = frozenset()
    """Numbers of cells to which rows may shrink for good, as faster channels go on alone; the cells behind count as missing."""
    end_mark: bytes = b""
    """A line that ends the table and is no row."""


@dataclass(frozen=True, eq=False)
class NumberRows:
    """``values`` (columns, rows), and how many rows had another number of cells than the format says; ``texts`` (columns,) cells."""

    values: FloatArray
    odd_rows: int
    first_odd: int
    cut_row: bool
    texts: tuple[int, ...]


def read_rows(path: Path, form: RowFormat, columns: Sequence[int], skip: int) -> NumberRows:
    """Read the cells ``columns`` of every row after ``skip`` lines. Lines that begin with # or % are left out.

    A row with another number of cells becomes a row of NaN, so that a file without a time column keeps its clock; a last row that was cut
    off is dropped. Raises :class:`RecordingError` where the file is too large.
    """
    rows = count_lines(path) - skip
    refuse_size(path, rows, len(columns))
    values = np.empty((len(columns), max(rows, 0)))
    texts = np.zeros(len(columns), dtype=np.int64)
    filled = odd_rows = first_odd = 0
    cut = False
    parser = RowParser(form, columns)
    for piece in chunks(path, skip):
        block, counted, odd, cut = parser.parse(piece)
        if len(odd) and not odd_rows:
            first_odd = skip + 1 + filled + odd[0]
        odd_rows += len(odd)
        texts += counted
        values[:, filled : filled + len(block)] = block.T
        filled += len(block)
    values = values[:, :filled]
    if cut:
        values, odd_rows = values[:, :-1], odd_rows - 1
    return NumberRows(values, odd_rows, first_odd, cut, tuple(int(count) for count in texts))


class RowParser:
    """Parses pieces of text of one format."""

    def __init__(self, form: RowFormat, columns: Sequence[int]) -> None:
        self.form = form
        self.columns = list(columns)
        self._mark = form.delimiter.encode()
        inside = rb"\s" if not self._mark else re.escape(self._mark) + rb"\n"
        ending = rb"(?=[" + inside + rb"]|$)"
        begin = rb"(?:(?<=[" + inside + rb"])|(?<![\s\S]))"
        blank = b"" if not self._mark else rb" *"
        content = rb"[^\s]+" if not self._mark else rb"[^" + inside + rb"]*"
        self._no_number = re.compile(begin + rb"(?!" + blank + NUMBER.encode() + blank + ending + rb")" + content)
        self._bits = [(re.compile(begin + blank + rb"(?i:" + word + rb")" + blank + ending), value) for word, value in _BITS]
        self._quoted = re.compile(rb'"([^"\n]*)"')
        self._start: np.datetime64 | None = None

    def parse(self, piece: bytes) -> tuple[FloatArray, np.ndarray[Any, Any], list[int], bool]:
        """Return the block (rows, columns), the number of texts a column, the odd rows and whether the last row is cut off."""
        text = piece
        if b'"' in text:
            text = self._quoted.sub(self._unquoted, text)
        if self.form.decimal_comma:
            text = text.replace(b",", b".")
        none = np.zeros(len(self.columns), dtype=np.int64)
        if self.form.stamps is None:
            try:
                return self._loaded(text), none, [], False
            except ValueError:
                pass
        return self._mended(text)

    def _mended(self, text: bytes) -> tuple[FloatArray, np.ndarray[Any, Any], list[int], bool]:
        lines = [line for line in text.split(b"\n") if line.strip() and line[:1] not in b"#%" and line.strip() != self.form.end_mark]
        counts = [len(line.split()) for line in lines] if not self._mark else [line.count(self._mark) + 1 for line in lines]
        width = self.form.width
        if self.form.ends:
            longest = np.maximum.accumulate(counts[::-1])[::-1]
            for row in np.flatnonzero(np.isin(counts, list(self.form.ends)) & (longest == counts)).tolist():
                lines[row] += (self._mark or b" nan") * (width - counts[row])
                counts[row] = width
        odd = [row for row, count in enumerate(counts) if count != width]
        empty = (self._mark or b" ").join([b"nan"] * width)
        cut = bool(odd) and odd[-1] == len(lines) - 1 and counts[-1] < width
        for row in odd:
            lines[row] = empty
        stamped = self._seconds(lines) if self.form.stamps is not None else None
        text = b"\n".join(lines)
        for pattern, value in self._bits:
            text = pattern.sub(value, text)
        text = self._no_number.sub(b"nan", text)
        block = self._loaded(text)
        if stamped is not None and self.form.stamps in self.columns:
            block[:, self.columns.index(self.form.stamps)] = stamped
        missing = np.isnan(block)
        missing[odd] = False
        return block, np.count_nonzero(missing, axis=0), odd, cut

    def _loaded(self, text: bytes) -> FloatArray:
        everything = len(self.columns) == self.form.width
        loaded: FloatArray = np.loadtxt(
            io.BytesIO(text),
            delimiter=self.form.delimiter or None,
            comments="#",
            usecols=None if everything else self.columns,
            ndmin=2,
            encoding="latin-1",
        )
        if everything and loaded.size and loaded.shape[1] != self.form.width:
            raise ValueError("another number of cells")
        return loaded.reshape(-1, len(self.columns))

    def _unquoted(self, match: re.Match[bytes]) -> bytes:
        inner = match.group(1)
        return inner.replace(b",", b".") if self.form.delimiter == "," else inner

    def _seconds(self, lines: list[bytes]) -> FloatArray:
        cell = self.form.stamps or 0
        mark = self._mark or None
        texts = [line.split(mark, cell + 1)[cell].strip() for line in lines]
        found = [match.group() if (match := re.match(STAMP, text)) else b"NaT" for text in texts]
        moments = np.array([moment.decode() for moment in found], dtype="datetime64[ns]")
        if self._start is None:
            known = moments[~np.isnat(moments)]
            self._start = known[0] if len(known) else None
        if self._start is None:
            return np.full(len(lines), np.nan)
        seconds: FloatArray = (moments - self._start) / np.timedelta64(1, "s")
        return seconds


_BITS = ((rb"true", b"1"), (rb"false", b"0"))
