"""The text of an RK4 step, made shorter: what nobody reads goes, and what is held through the sample is computed once before the steps.

Only sums, differences, products and comparisons are taken out of the loop, and sine and cosine of parameters: they give the same bits
there, and raise nothing where a branch would have passed them by.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Collection, Sequence

_SAFE = (ast.Add, ast.Sub, ast.Mult)
_SAFE_FUNCTIONS = ("math.sin", "math.cos")


def shortened(
    lines: Sequence[str], read_after: Collection[str], also_varying: Collection[str] = (), parameters: Collection[str] = ()
) -> tuple[list[str], list[str]]:
    """Return the lines that compute what is held through the sample, and the given ones without it and without what nobody reads.

    Read is what these lines read, or what comes after them (``read_after``). Held is what is made of variables that these lines do not
    assign and that are not ``also_varying``.
    """
    tree = ast.parse("\n".join(lines))
    while without_unread(tree, _read(tree) | set(read_after)):
        pass
    names = [node for node in ast.walk(tree) if isinstance(node, ast.Name)]
    varying = {node.id for node in names if isinstance(node.ctx, ast.Store)}
    taker = _Held(varying | set(also_varying), set(parameters))
    taker.visit(tree)
    return [f"{name} = {text}" for text, name in taker.found.items()], ast.unparse(tree).splitlines()


def without_unread(tree: ast.AST, read: Collection[str], may_go: Callable[[ast.expr], bool] = lambda value: True) -> bool:
    """Take away the assignments to variables that are not ``read``, where their value ``may_go``; say whether there were any."""
    cleaner = _Unread(set(read), may_go)
    cleaner.visit(tree)
    return cleaner.found


def is_safe(node: ast.AST) -> bool:
    """Return whether computing an expression raises nothing and changes nothing: sums, differences, products and comparisons."""
    match node:
        case ast.Constant() | ast.Name():
            return True
        case ast.BinOp():
            return isinstance(node.op, _SAFE) and is_safe(node.left) and is_safe(node.right)
        case ast.UnaryOp():
            return is_safe(node.operand)
        case ast.Compare():
            return is_safe(node.left) and all(is_safe(item) for item in node.comparators)
        case ast.BoolOp():
            return all(is_safe(item) for item in node.values)
        case ast.IfExp():
            return is_safe(node.test) and is_safe(node.body) and is_safe(node.orelse)
    return False


def _read(tree: ast.AST) -> set[str]:
    read = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)}
    return read | {node.target.id for node in ast.walk(tree) if isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name)}


class _Unread(ast.NodeTransformer):
    """Takes assignments away; ``found`` says whether there were any."""

    def __init__(self, read: set[str], may_go: Callable[[ast.expr], bool]) -> None:
        self.read = read
        self.may_go = may_go
        self.found = False

    def visit_Assign(self, node: ast.Assign) -> ast.AST | None:
        targets = [name for target in node.targets for name in (target.elts if isinstance(target, ast.Tuple) else [target])]
        if any(not isinstance(name, ast.Name) or name.id in self.read for name in targets) or not self.may_go(node.value):
            return node
        self.found = True
        return None

    def visit_If(self, node: ast.If) -> ast.AST | None:
        self.generic_visit(node)
        if not all(isinstance(item, ast.Pass) for item in [*node.body, *node.orelse]):
            node.body = node.body or [ast.Pass()]
            return node
        self.found = True
        return None

    def visit_For(self, node: ast.For) -> ast.AST:
        self.generic_visit(node)
        node.body = node.body or [ast.Pass()]
        return node


class _Held(ast.NodeTransformer):
    """Puts a variable in the place of each held expression; ``found`` maps the expressions to the variables."""

    def __init__(self, varying: set[str], parameters: set[str]) -> None:
        self.varying = varying
        self.parameters = parameters
        self.found: dict[str, str] = {}

    def visit(self, node: ast.AST) -> ast.AST:
        if isinstance(node, (ast.BinOp, ast.Compare, ast.Call)) and self._is_held(node):
            text = ast.unparse(node)
            return ast.Name(self.found.setdefault(text, f"held_{len(self.found) + 1}"), ast.Load())
        return self.generic_visit(node)

    def _is_held(self, node: ast.AST) -> bool:
        match node:
            case ast.Constant():
                return isinstance(node.value, (int, float))
            case ast.Name():
                return node.id not in self.varying
            case ast.Attribute():
                return ast.unparse(node) == "math.pi"
            case ast.BinOp():
                return isinstance(node.op, _SAFE) and self._is_held(node.left) and self._is_held(node.right)
            case ast.UnaryOp():
                return isinstance(node.op, ast.USub) and self._is_held(node.operand)
            case ast.Compare():
                return self._is_held(node.left) and all(self._is_held(item) for item in node.comparators)
            case ast.Call():
                (argument,) = node.args if len(node.args) == 1 else (None,)
                return ast.unparse(node.func) in _SAFE_FUNCTIONS and isinstance(argument, ast.Name) and argument.id in self.parameters
        return False
