"""Codes and programs of other controls, named where they are refused.

Codes of other controls that no dialect here has, with their meanings, so that a refusal names them.

Source: Fanuc 0i-T and 0i-M operator's manuals, lists of G codes; Haas lathe and mill operator's manuals, G and M codes; LinuxCNC 2.9
manual, chapters G-Codes and M-Codes; grblHAL, list of supported codes; Siemens, Sinumerik 828D programming manual, G functions.

Whether a program is written for a control that is not supported here, told by words that only that control has.

Source: Siemens, Sinumerik 828D turning programming manual; Okuma, OSP programming manual for lathes; Heidenhain, TNC user's manual.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from lathesim.errors import ProgramError

SINUMERIK = "Sinumerik"
"""The control whose programs are recognised by their codes alone."""

CODES_ELSEWHERE: dict[str, str] = {
    "G5": "a cubic spline (LinuxCNC, grblHAL) or high-speed cutting (Fanuc)",
    "G5.1": "a quadratic spline (LinuxCNC, grblHAL) or contour control (Fanuc)",
    "G5.2": "a NURBS curve (LinuxCNC)", "G5.3": "the end of a NURBS curve (LinuxCNC)", "G6.2": "a NURBS curve (Fanuc)",
    "G7.1": "cylindrical interpolation (Fanuc)", "G107": "cylindrical interpolation (Fanuc, Haas)",
    "G9": "exact stop in one block (Fanuc, Haas)", "G11": "the end of setting offsets (Fanuc)",
    "G12": "circular pocket milling (Haas)", "G13": "circular pocket milling (Haas)",
    "G12.1": "polar coordinate interpolation (Fanuc, Haas)", "G13.1": "the end of polar coordinate interpolation (Fanuc, Haas)",
    "G112": "polar coordinate interpolation (Fanuc, Haas)", "G113": "the end of polar coordinate interpolation (Fanuc, Haas)",
    "G15": "the end of polar coordinates (Fanuc)", "G16": "polar coordinates (Fanuc)", "G17.1": "the plane of U and V (LinuxCNC)",
    "G18.1": "the plane of W and U (LinuxCNC)", "G19.1": "the plane of V and W (LinuxCNC)",
    "G22": "the stored stroke check (Fanuc)", "G26": "the spindle speed check (Fanuc) or a spindle speed limit (Sinumerik)",
    "G27": "the reference point check (Fanuc)", "G29": "the return from the reference point (Fanuc, Haas)",
    "G31": "skip, which is probing (Fanuc, Haas)", "G34": "a thread of variable lead (Fanuc, Haas)",
    "G35": "a clockwise arc thread (Fanuc)",
    "G36": "automatic tool offset or an arc thread (Fanuc)", "G37": "automatic tool offset (Fanuc)", "G38": "probing",
    "G43.3": "a tool length offset (Fanuc)", "G43.4": "tool centre point control (Fanuc)", "G44": "a negative tool length (Fanuc, Haas)",
    "G45": "a tool offset (Fanuc)", "G46": "a tool offset (Fanuc)", "G47": "text engraving (Haas) or a tool offset (Fanuc)",
    "G48": "a tool offset (Fanuc)",
    "G50.1": "the end of mirroring (Fanuc)", "G51.1": "mirroring (Fanuc)", "G50.2": "the end of polygon turning (Fanuc)",
    "G51.2": "polygon turning (Fanuc)", "G250": "the end of polygon turning (Fanuc)", "G251": "polygon turning (Fanuc)",
    "G50.3": "the preset of the work coordinates (Fanuc)", "G51": "scaling (Fanuc mills, Haas, grblHAL)",
    "G60": "positioning from one side (Fanuc)", "G62": "the corner override (Fanuc)", "G63": "the tapping mode (Fanuc)",
    "G66": "a modal macro call (Fanuc)", "G66.1": "a modal macro call (Fanuc)", "G67": "the end of a modal macro call (Fanuc)",
    "G68": "mirroring for double turrets, or rotated coordinates (Fanuc, Haas)",
    "G69": "the end of mirroring or of rotated coordinates (Fanuc, Haas)",
    "G87": "a cross drilling cycle (Fanuc)", "G88": "a cross tapping cycle (Fanuc)",
    "G100": "the end of mirroring (Haas)", "G101": "mirroring (Haas)",
    "G105": "the bar feeder (Haas)", **{f"G{number}": "a further work offset (Haas)" for number in (110, 111, *range(114, 130))},
    "G150": "pocket milling (Haas)", "G184": "the left-hand tapping cycle (Haas)", "G186": "tapping with a driven tool (Haas)",
    "G195": "tapping with a driven tool (Haas)", "G196": "tapping with a driven tool (Haas)",
    "G198": "the end of two spindles in step (Haas)", "G199": "two spindles in step (Haas)", "G200": "a tool change while moving (Haas)",
    "G241": "a radial drilling cycle (Haas)", "G242": "a radial drilling cycle (Haas)", "G243": "a radial drilling cycle (Haas)",
    "G245": "a radial boring cycle (Haas)", "G266": "moving an axis by its letter (Haas)",
    **{f"G{number}": SINUMERIK for number in (74.1, 75.1, 147, 148, 153, 247, 248, 340, 341, 347, 348, 450, 451, 460, *range(500, 600))},
    **{f"G{number}": SINUMERIK for number in (601, 602, 603, 621, 641, 642, 643, 644, 645, 810, 820, 961, 962, 971, 972, 973)},
    "M17": "the return from a subprogram (Sinumerik)", "M50": "the feed override switch (LinuxCNC)",
    "M51": "the speed override switch (LinuxCNC)", "M52": "adaptive feed (LinuxCNC)", "M53": "the feed stop switch (LinuxCNC)",
    "M56": "the parking override (GRBL)", "M60": "a pallet change", "M61": "setting the tool number (LinuxCNC)",
    **{f"M{number}": "an output of the control (LinuxCNC)" for number in (62, 63, 64, 65, 67, 68)},
    "M66": "waiting for an input (LinuxCNC)",
    "M70": "keeping the modal state (LinuxCNC)", "M71": "dropping the modal state (LinuxCNC)",
    "M72": "restoring the modal state (LinuxCNC)", "M73": "keeping the modal state of a subprogram (LinuxCNC)",
    **{f"M{number}": "a command of the user (LinuxCNC) or of the builder (Fanuc)" for number in range(100, 200)},
}  # fmt: skip


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
