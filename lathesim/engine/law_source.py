"""The source text of laws, with the helper functions and constants they use, ready to stand in one generated module.

A law is plain Python: floats in, floats out. What it refers to outside itself may be ``math``, numbers, tuples of numbers, and plain
functions of which the same holds; all are copied under names of their own, so the generated module depends on nothing else.
"""

from __future__ import annotations

import ast
import builtins
import inspect
import math
import textwrap
import types
from collections.abc import Callable
from typing import Any

from lathesim.errors import ComponentError

_CALLABLE_BUILT_INS = {"abs", "min", "max", "int", "float", "len", "range", "bool"}


class LawLibrary:
    """Collects laws and what they use; ``text`` is Python source in which each stands once."""

    def __init__(self) -> None:
        self._names: dict[Any, str] = {}
        self._taken: dict[str, int] = {}
        self.blocks: list[str] = []
        self.functions: list[str] = []

    def add(self, function: Callable[..., Any], wished: str) -> str:
        """Copy a function and give the name under which it now stands."""
        if function in self._names:
            return self._names[function]
        name = self._free(wished)
        self._names[function] = name
        tree = _function_tree(function)
        renames = self._references(function, tree)
        tree = _Rename(renames).visit(tree)
        tree.name = name
        tree.decorator_list = []
        tree.returns = None
        for argument in [*tree.args.args, *tree.args.posonlyargs]:
            argument.annotation = None
        if ast.get_docstring(tree):
            tree.body = tree.body[1:] or [ast.Pass()]
        self.blocks.append(ast.unparse(ast.fix_missing_locations(tree)))
        self.functions.append(name)
        return name

    def _free(self, wished: str) -> str:
        count = self._taken.get(wished, 0)
        self._taken[wished] = count + 1
        return wished if count == 0 else f"{wished}_{count + 1}"

    def _references(self, function: Callable[..., Any], tree: ast.FunctionDef) -> dict[str, str]:
        renames: dict[str, str] = {}
        local = _local_names(tree)
        scope = inspect.unwrap(function).__globals__
        closure = inspect.getclosurevars(function).nonlocals
        place = f"{function.__module__}.{function.__qualname__}"
        for node in ast.walk(tree):
            if not isinstance(node, ast.Name) or node.id in local or node.id in renames:
                continue
            name = node.id
            value = closure.get(name, scope.get(name, getattr(builtins, name, None)))
            if value is math or name in _CALLABLE_BUILT_INS or name in ("True", "False"):
                continue
            if isinstance(value, types.FunctionType):
                renames[name] = self.add(value, f"{function.__module__.rpartition('.')[2]}_{name}")
            elif _is_number(value):
                renames[name] = self._constant(name, value, function.__module__)
            else:
                line = getattr(function, "__code__", None)
                where = f" (line {line.co_firstlineno + node.lineno - 1})" if line else ""
                raise ComponentError(
                    f"the law uses '{name}'{where}, which is neither math, a number nor a plain function.",
                    place=place,
                    remedy="Laws take floats and give floats; keep everything else outside.",
                )
        return renames

    def _constant(self, name: str, value: object, module: str) -> str:
        key = (module, name, repr(value))
        if key not in self._names:
            self._names[key] = self._free(f"{module.rpartition('.')[2]}_{name}")
            self.blocks.append(f"{self._names[key]} = {value!r}")
        return self._names[key]


def _is_number(value: object) -> bool:
    if isinstance(value, tuple):
        return bool(value) and all(_is_number(item) for item in value)
    return isinstance(value, (int, float)) and (not isinstance(value, float) or math.isfinite(value))


def _function_tree(function: Callable[..., Any]) -> ast.FunctionDef:
    try:
        text = textwrap.dedent(inspect.getsource(function))
        tree = ast.parse(text).body[0]
    except (OSError, TypeError, SyntaxError) as error:
        raise ComponentError(
            "the source of the law cannot be read.", place=f"{function.__module__}.{function.__qualname__}", remedy="Write it in a file."
        ) from error
    if not isinstance(tree, ast.FunctionDef):
        raise ComponentError(
            "the law is no plain function.", place=f"{function.__module__}.{function.__qualname__}", remedy="Write it with def."
        )
    return tree


def _local_names(tree: ast.FunctionDef) -> set[str]:
    names = {argument.arg for argument in [*tree.args.args, *tree.args.posonlyargs]}
    names |= {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    annotations = [node.annotation for node in ast.walk(tree) if isinstance(node, (ast.arg, ast.AnnAssign)) and node.annotation]
    annotations += [tree.returns] if tree.returns else []
    names |= {node.id for item in annotations for node in ast.walk(item) if isinstance(node, ast.Name)}
    decorators = {node.id for item in tree.decorator_list for node in ast.walk(item) if isinstance(node, ast.Name)}
    return names | decorators


class _Rename(ast.NodeTransformer):
    def __init__(self, names: dict[str, str]) -> None:
        self.names = names

    def visit_Name(self, node: ast.Name) -> ast.Name:
        node.id = self.names.get(node.id, node.id)
        return node

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST:
        self.generic_visit(node)
        if node.value is None:
            return ast.Pass()
        return ast.Assign(targets=[node.target], value=node.value)
