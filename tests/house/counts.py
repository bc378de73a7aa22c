"""``python -m tests.house.counts [CHECKOUT]``: the size and shape of the diagnosis in numbers, which may only go down.

What was one folder, ``lathesim/diagnosis``, is counted with what was taken out of it, ``identification`` and ``exercises``. Loops of least
squares and texts of places taken apart are counted in all of ``lathesim``.
"""

from __future__ import annotations

import ast
import functools
import sys
from collections.abc import Iterator
from pathlib import Path

from tests.house.descents import own_descents

ROOT = Path(__file__).parents[2]
FOLDERS = ("diagnosis", "identification", "exercises")
PLAIN = (0, 1, 2, 0.5, -1)
"""Numbers that may stand in a comparison: none, one, a pair, a half, a sign."""
COMPARING = {
    # names of limits on log-likelihoods, as they are and as they were before they stood in one place
    "equal", "equal_share", "tie", "tie_share", "margin", "per_parameter", "value_gain", "value_better", "parameter_worth",
    "one_for_two_share", "validation_margin", "held_out_margin", "_EQUAL", "EQUAL_SHARE", "TIE", "TIE_SHARE", "AS_GOOD", "AS_GOOD_SHARE",
    "_AS_GOOD", "_BETTER", "_LEAST",
}  # fmt: skip
SPLITTING = ("partition", "rpartition", "split", "rsplit")
"""Methods of a text that take it apart."""
BRANCHES = (ast.If, ast.For, ast.While, ast.IfExp, ast.ExceptHandler, ast.BoolOp, ast.comprehension)


@functools.cache
def parsed(path: Path) -> ast.Module:
    """Return a module as a tree, which several counts walk."""
    return ast.parse(path.read_text(encoding="utf-8"))


@functools.cache
def nodes(tree: ast.AST) -> tuple[ast.AST, ...]:
    """Return all nodes of a tree; to walk it takes longer than to read it, and ten counts look at each node."""
    return tuple(ast.walk(tree))


def files(root: Path) -> dict[str, ast.Module]:
    """Return the modules of the diagnosis by their dotted names."""
    found = [path for folder in FOLDERS for path in sorted((root / "lathesim" / folder).glob("**/*.py"))]
    return {".".join(path.relative_to(root).with_suffix("").parts): parsed(path) for path in found}


def lines(root: Path) -> int:
    """Return the lines of these modules."""
    found = [path for folder in FOLDERS for path in (root / "lathesim" / folder).glob("**/*.py")]
    return sum(len(path.read_text(encoding="utf-8").splitlines()) for path in found)


def arrows(modules: dict[str, ast.Module]) -> set[tuple[str, str]]:
    """Return the imports between these modules: from, to."""
    pairs = set()
    for name, tree in modules.items():
        for node in nodes(tree):
            if isinstance(node, ast.ImportFrom) and node.module:
                targets = [node.module, *(f"{node.module}.{item.name}" for item in node.names)]
                pairs |= {(name, target) for target in targets if target in modules and target != name}
    return pairs


def floors(pairs: set[tuple[str, str]]) -> int:
    """Return the length of the longest chain of imports; a circle counts as what it is from its first file on."""
    below: dict[str, set[str]] = {}
    for first, second in pairs:
        below.setdefault(first, set()).add(second)

    @functools.cache
    def height(name: str, seen: frozenset[str] = frozenset()) -> int:
        return 1 + max((height(other) for other in below.get(name, ()) if (other, name) not in pairs), default=0)

    return max((height(name) for name in below), default=0)


def circles(pairs: set[tuple[str, str]]) -> int:
    """Return the imports from which one comes back to where one began: those that run up."""
    below: dict[str, set[str]] = {}
    for first, second in pairs:
        below.setdefault(first, set()).add(second)

    def reaches(start: str, goal: str) -> bool:
        queue, seen = [start], set()
        while queue:
            name = queue.pop()
            if name == goal:
                return True
            if name not in seen:
                seen.add(name)
                queue += below.get(name, ())
        return False

    return sum(reaches(second, first) for first, second in pairs)


def is_number(node: ast.expr) -> bool:
    """Return whether an expression is a number, some numbers, or a product of such."""
    inner = list(ast.walk(node))
    arithmetic = (ast.Constant, ast.BinOp, ast.UnaryOp, ast.operator, ast.unaryop, ast.Tuple, ast.Name, ast.Attribute, ast.expr_context)
    numbers = [item.value for item in inner if isinstance(item, ast.Constant)]
    plain = all(isinstance(value, int | float) and not isinstance(value, bool) for value in numbers)
    return bool(numbers) and plain and all(isinstance(item, arithmetic) for item in inner)


def named_numbers(tree: ast.Module) -> Iterator[str]:
    """Return the names of the numbers that a module defines."""
    for node in tree.body:
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
            continue
        target = node.targets[0] if isinstance(node, ast.Assign) else node.target
        if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
            pairs = zip(target.elts, node.value.elts, strict=True)
            yield from (name.id for name, value in pairs if isinstance(name, ast.Name) and is_number(value))
        elif isinstance(target, ast.Name) and is_number(node.value):
            yield target.id


def bare_numbers(tree: ast.Module) -> Iterator[int]:
    """Return the lines of comparisons with a number that has no name."""
    for node in nodes(tree):
        if isinstance(node, ast.Compare):
            for item in nodes(node):
                number = isinstance(item, ast.Constant) and isinstance(item.value, int | float) and not isinstance(item.value, bool)
                if number and item.value not in PLAIN:  # type: ignore[attr-defined]
                    yield node.lineno


def limits(tree: ast.Module) -> Iterator[str]:
    """Return the basis of each limit of a module."""
    for node in nodes(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Limit" and len(node.args) >= 3:
            basis = node.args[3] if len(node.args) > 3 else None
            yield str(basis.value) if isinstance(basis, ast.Constant) else "assumed"


def decisions_on_names(tree: ast.Module) -> Iterator[int]:
    """Return the lines that decide by the text of a name: how it begins or ends, what is in it, or what family it is called."""
    for node in nodes(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in ("startswith", "endswith"):
            yield node.lineno
        elif isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            text = any(isinstance(side, ast.Constant) and isinstance(side.value, str) and side.value for side in sides)
            named = any(isinstance(side, ast.Attribute) and side.attr in ("name", "family", "__name__") for side in sides)
            within = isinstance(node.ops[0], ast.In | ast.NotIn) and isinstance(node.left, ast.Constant)
            searched = within and isinstance(node.comparators[0], ast.Name) and node.comparators[0].id in ("name", "item", "variable", "at")
            if text and (named or searched):
                yield node.lineno


def text_splits(root: Path) -> list[str]:
    """Return where ``lathesim`` takes the text of a place, ``part.port``, apart; the names of modules are no places."""
    found = []
    for path in sorted((root / "lathesim").rglob("*.py")):
        for node in nodes(parsed(path)):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in SPLITTING and node.args:
                at_point = isinstance(node.args[0], ast.Constant) and node.args[0].value == "."
                if at_point and not (isinstance(node.func.value, ast.Attribute) and node.func.value.attr in ("__module__", "__name__")):
                    found.append(f"{path.relative_to(root).as_posix()}:{node.lineno}")
    return found


def functions(modules: dict[str, ast.Module]) -> Iterator[tuple[str, ast.FunctionDef]]:
    """Return every function with its place."""
    for name, tree in modules.items():
        for node in nodes(tree):
            if isinstance(node, ast.FunctionDef):
                yield f"{name}.{node.name}", node


def branches(function: ast.FunctionDef) -> int:
    """Return how many branches a function has."""
    return sum(isinstance(node, BRANCHES) for node in ast.walk(function))


def compares_models(function: ast.FunctionDef) -> bool:
    """Return whether a function compares models by limits of its own on their likelihoods."""
    inner = list(ast.walk(function))
    named = any(getattr(node, "attr", None) in COMPARING or getattr(node, "id", None) in COMPARING for node in inner)
    return named and any(isinstance(node, ast.Compare) for node in inner)


@functools.cache
def counts(root: Path = ROOT) -> dict[str, int]:
    """Return the numbers of a checkout."""
    modules = files(root)
    pairs = arrows(modules)
    outside = {name: tree for name, tree in modules.items() if ".diagnosis.method" not in name}
    every = list(functions(modules))
    branched = [branches(node) for _, node in every]
    decides = [basis for tree in modules.values() for basis in limits(tree)]
    folders = {name.rpartition(".")[0] for name in modules}
    return {
        "files": len(modules),
        "most files in a folder": max(sum(name.rpartition(".")[0] == folder for name in modules) for folder in folders),
        "floors": floors(pairs),
        "arrows": len(pairs),
        "arrows that run up": circles(pairs),
        "named numbers outside method": sum(1 for tree in outside.values() for _ in named_numbers(tree)),
        "bare numbers in comparisons": sum(1 for tree in outside.values() for _ in bare_numbers(tree)),
        "limits": len(decides),
        "limits that are assumed": decides.count("assumed"),
        "decisions on the text of names": sum(1 for name, tree in modules.items() if "roles" not in name for _ in decisions_on_names(tree)),
        "lines of the longest function": max((node.end_lineno or 0) - node.lineno + 1 for _, node in every),
        "functions above 60 lines": sum((node.end_lineno or 0) - node.lineno + 1 > 60 for _, node in every),
        "branches of the most branched function": max(branched),
        "functions above 15 branches": sum(number > 15 for number in branched),
        "functions that compare models": sum(compares_models(node) for _, node in every),
        "own loops of least squares": len(own_descents(root)),
        "texts of places taken apart": len(text_splits(root)),
        "lines": lines(root),
    }


if __name__ == "__main__":
    for label, number in counts(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT).items():
        print(f"{number:7d}  {label}")
