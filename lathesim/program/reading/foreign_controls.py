"""Whether a program is written for a control that is not supported here, told by words that only that control has.

Source: Siemens, Sinumerik 828D turning programming manual; Okuma, OSP programming manual for lathes; Heidenhain, TNC user's manual.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from lathesim.errors import ProgramError


@dataclass(frozen=True)
class _Control:
    name: str
    words: re.Pattern[str]


_CONTROLS = (
    _Control(
        "Sinumerik",
        re.compile(
            r"\b(CYCLE\d{2,3}|MCALL|DIAM(?:ON|OF|90)|LIMS\s*=|CR\s*=|RND\s*=|CHF\s*=|CHR\s*=|AC\s*\(|IC\s*\(|TRANS\b|ATRANS\b|G500\b|GOTO[BFC]\b|SUPA\b|STOPRE\b|SPOS\s*=|T\s*=\s*\"|^[A-Z_]{2}\w*:|"
            r"SETMS|\bSF\s*=|\b[SM]\d\s*=|WORKPIECE\s*\(|MSG\s*\(|\$[A-Z]+_|R\d+\s*=|[XZ]\d*\s*=\s*[-+.\dA-Z])"
        ),
    ),
    _Control(
        "Okuma OSP",
        re.compile(r"\b(NLAP\d|NOEX|VZOF[XZ]|VC\d+\s*=|V\d+\s*=|G1[34]0?\b(?![.\d])|G8[0-9]\s+N[A-Z]+\d*|CALL\s+O[A-Z]|NAT\d+|RTS\b|SB\s*=|LAP\d)"),
    ),
    _Control("Heidenhain", re.compile(r"^\s*\d+\s+(BEGIN PGM|BLK FORM|TOOL CALL|L\s+[XYZ][+-]|CYCL DEF)|\bFMAX\b|\bLBL\s+\d")),
)  # fmt: skip


def foreign_control(text: str, name: str, lines: Iterable[int]) -> ProgramError | None:
    """Return the error that names the control of another maker, where one of the ``lines`` (from 1) has a word of it; else None."""
    rows = re.split(r"\r\n|\n|\r", text)
    for line in lines:
        row = rows[line - 1].upper() if 0 < line <= len(rows) else ""
        code = re.sub(r"\([^()]*\)|;.*", "", row)
        for control in _CONTROLS:
            found = control.words.search(code) or control.words.search(row)
            if found is not None:
                return foreign_program(control.name, " ".join(found.group().split()), f"{name}:{line}")
    return None


def foreign_program(control: str, word: str, place: str) -> ProgramError:
    """Return the error for a program of another control, recognised by a ``word``."""
    return ProgramError(
        f"This is a program for {control} ({word}), and that control is not supported here.",
        place=place,
        remedy="Write it for Fanuc or LinuxCNC, or have the program system post it so.",
    )
