"""Own loops of least squares: loops that solve for a step again and again until it gains nothing, apart from the one in identification."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

SOLVES = {"cho_solve", "inv", "lsq_linear", "lstsq", "nnls", "pinv", "solve", "solve_triangular"}
"""Functions that solve a linear system or a linear problem of least squares."""
FITS = {"descend", "fit", "least_squares"}
"""Functions that descend: a loop around them is none of its own."""
NO_DESCENTS = {
    "diagnosis/discovery/sparse_regression._draft": "takes one term after the other into a linear model",
    "diagnosis/explanations/flexible._grown": "takes one term after the other into a linear model",
    "diagnosis/explanations/flexible._learned": "learns the colour of the noise in two turns",
    "diagnosis/explanations/flexible._posterior": "sets the strengths of the terms of a linear model by its evidence",
    "diagnosis/location/order_spectrum.lines_of": "takes one line after the other out of a signal",
    "experiments/design/optimality.d_optimal": "multiplies the weights of a design",
    "live/watching/changes/change_test._within": "looks for the values that stand at a bound of one linear problem",
    "live/watching/courses/value_course._solved": "looks for the values that stand at a bound of one linear problem",
}
"""Loops that solve linear systems in turn and are no descent, with what they do."""


def own_descents(root: Path) -> list[str]:
    """Return the functions of a checkout, ``folder/module.name``, with a loop of least squares of their own."""
    found = []
    for path in sorted((root / "lathesim").glob("**/*.py")):
        text, place = path.read_text(encoding="utf-8"), path.relative_to(root / "lathesim").with_suffix("").as_posix()
        if any(f"{name}(" in text for name in SOLVES):
            found += [f"{place}.{name}" for name in _descending(ast.parse(text))]
    return [name for name in dict.fromkeys(found) if name not in NO_DESCENTS]


def _descending(tree: ast.Module) -> Iterator[str]:
    """Yield the functions of a module with a loop that solves, ends early, and goes on from what it made in its last turn."""
    functions = {node.name: node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
    for function in functions.values():
        for loop in ast.walk(function):
            if isinstance(loop, ast.For | ast.While) and _ends_early(loop) and _carried(loop):
                calls = _calls(loop, functions)
                if calls & SOLVES and not calls & FITS - {function.name}:
                    yield function.name


def _ends_early(loop: ast.For | ast.While) -> bool:
    return isinstance(loop, ast.While) or any(isinstance(node, ast.Break) for node in ast.walk(loop))


def _calls(loop: ast.AST, functions: dict[str, ast.FunctionDef]) -> set[str]:
    """Return the names that are called in a loop, and in the functions of its module that it calls."""
    found: set[str] = set()
    waiting: list[ast.AST] = [loop]
    while waiting:
        for node in ast.walk(waiting.pop()):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name | ast.Attribute):
                name = node.func.id if isinstance(node.func, ast.Name) else node.func.attr
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
