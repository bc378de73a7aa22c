"""Text files by pieces of whole lines, in whatever encoding and with whatever line ends, so that no file has to fit the memory."""

from __future__ import annotations

import codecs
from collections.abc import Iterator
from pathlib import Path

CHUNK = 1 << 23
"""Bytes of text that are parsed at a time."""
_HEAD = 1 << 17
_WIDE = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))


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
    if encoding == "utf-8" and "\ufffd" in text[:-4]:
        text = head.decode("latin-1")
    if sum(letter < " " and letter not in "\t\r\n\f\x1a" for letter in text[:4000]) > 3:
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
