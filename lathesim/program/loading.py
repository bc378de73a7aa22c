"""A part-program file to an interpreted program in one step."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from lathesim.program.interpreter import interpret
from lathesim.program.moves import Program
from lathesim.program.nose.tool_nose import Tool
from lathesim.program.reading.detect import detect_dialect
from lathesim.program.words import read_program_file


def load_program(
    path: str | Path,
    dialect: str = "paper",
    *,
    block_delete: bool = True,
    start: tuple[float, float] | None = None,
    tools: Mapping[int, Tool] | None = None,
) -> Program:
    """Read and interpret the program in the file ``path``; every fault is a :class:`ProgramError` of ``lathesim.errors``.

    ``dialect`` "auto" finds it, see :func:`lathesim.program.reading.detect.detect_dialect`. ``start`` is where the tool stands at first
    (x, z) [m], without it the dialect's. ``tools`` are the tools by number, for nose compensation.
    """
    blocks = read_program_file(path, block_delete=block_delete)
    return interpret(blocks, detect_dialect(blocks).dialect if dialect == "auto" else dialect, start=start, tools=tools)
