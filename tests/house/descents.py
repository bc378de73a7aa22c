"""Own loops of least squares: loops that solve for a step again and again until it gains nothing, apart from the one in identification."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

SOLVES = {"cho_solve", "inv", "lsq_linear", "lstsq", "nnls", "pinv", "solve", "solve_triangular"}
"""Functions that solve a linear system or a linear problem of least squares."""
FITS = {"descend", "fit", "least_squares"}
"""Functions that descend: a loop around them is none of its own."""
SLOPES = ("slope", "jacobian", "derivative")
"""Words for what a step is solved from: a loop without any of them chooses terms, weights or bounds of a linear problem."""


def own_descents(root: Path) -> list[str]:
    """Return the functions of a checkout, ``folder/module.name``, with a loop of least squares of their own."""
    found = []
    for path in sorted((root / "lathesim").glob("**/*.py")):
        text, place = path.read_text(encoding="utf-8"), path.relative_to(root / "lathesim").with_suffix("").as_posix()
        if any(f"{name}(" in text for name in SOLVES):
            found += [f"{place}.{name}" for name in _descending(ast.parse(text))]
    return list(dict.fromkeys(found))


def _descending(tree: ast.Module) -> Iterator[str]:
    """Yield the functions of a module with a loop that solves, ends early, and goes on from what it made in its last turn."""
    functions = {node.name: node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
    for function in functions.values():
        for loop in ast.walk(function):
            if isinstance(loop, ast.For | ast.While) and _ends_early(loop) and _carried(loop):
                names = _reached(loop, functions)
                sloped = any(word in name.lower() for name in names for word in SLOPES)
                if sloped and names & SOLVES and not names & FITS - {function.name}:
                    yield function.name


def _ends_early(loop: ast.For | ast.While) -> bool:
    return isinstance(loop, ast.While) or any(isinstance(node, ast.Break) for node in ast.walk(loop))


def _reached(loop: ast.AST, functions: dict[str, ast.FunctionDef]) -> set[str]:
    """Return the names in a loop, and in the functions of its module that it calls."""
    found: set[str] = set()
    waiting: list[ast.AST] = [loop]
    while waiting:
        for node in ast.walk(waiting.pop()):
            name = node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else ""
            if name in functions and name not in found:
                waiting.append(functions[name])
            found.add(name)
    return found


def _carried(loop: ast.For | ast.While) -> set[str]:
    """Return the names that a turn of a loop reads before it sets them, and sets for the next one."""
    read = _names(loop.test, ast.Load) if isinstance(loop, ast.While) else set()
    written: set[str] = set()
    for line in _lines(loop.body):
        read |= _names(line, ast.Load) - written
        written |= _names(line, ast.Store)
    return read & written - (_names(loop.target, ast.Store) if isinstance(loop, ast.For) else set())


def _lines(body: list[ast.stmt]) -> Iterator[ast.AST]:
    """Yield the lines of a body in their order, those of its branches and inner loops among them."""
    for line in body:
        inner = [part for name in ("body", "orelse", "finalbody") for part in getattr(line, name, [])]
        if inner:
            yield from (getattr(line, name) for name in ("test", "iter", "target") if hasattr(line, name))
            yield from _lines(inner)
        else:
            yield line


def _names(node: ast.AST, context: type[ast.expr_context]) -> set[str]:
    return {item.id for item in ast.walk(node) if isinstance(item, ast.Name) and isinstance(item.ctx, context)}
