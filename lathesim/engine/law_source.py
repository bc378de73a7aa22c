"""The source text of laws, with the helper functions and constants they use, ready to stand in one generated module.

A law is plain Python: floats in, floats out. What it refers to outside itself may be ``math``, numbers, tuples of numbers, and plain
functions of which the same holds; all are copied under names of their own, so the generated module depends on nothing else.
"""

from __future__ import annotations

import ast
import builtins
import hashlib
import inspect
import math
import types
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from lathesim.engine.law_text import IN_PLACE_OF, NotInPlaceError, in_place, law_text
from lathesim.errors import ComponentError

_IN_PLACE = (
    *(ast.Assign, ast.AugAssign, ast.If, ast.Pass, ast.Return),
    *(ast.Name, ast.Constant, ast.BinOp, ast.UnaryOp, ast.BoolOp, ast.Compare, ast.IfExp, ast.Call, ast.Attribute, ast.Tuple),
)
"""What any compiler takes: a law with anything else is called."""
_CALLABLE_BUILT_INS = {"abs", "min", "max", "int", "float", "len", "range", "bool"}


@dataclass(frozen=True)
class Piece:
    """One function with the constants it uses: compiled on its own, so that a changed part compiles only itself and the wiring.

    ``uses`` are the names of the functions it calls; the ``digest`` holds theirs too.
    """

    name: str
    text: str
    uses: tuple[str, ...]
    digest: str


class LawLibrary:
    """Collects laws and what they use; ``blocks`` is Python source in which each stands once, ``pieces`` the functions one by one."""

    def __init__(self) -> None:
        self._names: dict[Any, str] = {}
        self._taken: dict[str, int] = {}
        self._constants: dict[str, str] = {}
        self.blocks: list[str] = []
        self.pieces: dict[str, Piece] = {}

    @property
    def functions(self) -> list[str]:
        """The names of the functions, each after those it calls."""
        return list(self.pieces)

    def add(self, function: Callable[..., Any], wished: str) -> str:
        """Copy a function and give the name under which it now stands."""
        if function in self._names:
            return self._names[function]
        name = self._free(wished)
        self._names[function] = name
        renames = self._references(function)
        text = law_text(function).named(name, renames)
        self.blocks.append(text)
        self._keep_piece(name, text, list(renames.values()))
        return name

    def function(self, name: str) -> Callable[..., Any]:
        """Return the function that stands under a name."""
        found: Callable[..., Any] = next(item for item, taken in self._names.items() if taken == name)
        return found

    def with_theirs(self, names: Iterable[str]) -> set[str]:
        """Return the functions among names, and those that they call in turn."""
        found = self.pieces.keys() & set(names)
        return found | {other for name in found for other in self.with_theirs(self.pieces[name].uses)}

    def lines_in_place(self, function: Callable[..., Any], given: Sequence[str], targets: Sequence[str], prefix: str) -> list[str] | None:
        """Return the lines of a law written where it is called; none where it has to be called, so that it can be named when it fails."""
        if any("while " in self.pieces[name].text for name in self.with_theirs(self._references(function).values())):
            return None
        tree = ast.parse(law_text(function).named("law", self._references(function))).body[0]
        assert isinstance(tree, ast.FunctionDef)
        nodes = [node for statement in tree.body for node in ast.walk(statement)]
        if any(isinstance(node, (ast.stmt, ast.expr)) and not isinstance(node, _IN_PLACE) for node in nodes):
            return None
        try:
            made = in_place(tree, [ast.parse(value, mode="eval").body for value in given], targets, prefix)
        except NotInPlaceError:
            return None
        return [line for statement in made for line in ast.unparse(statement).splitlines()]

    def _keep_piece(self, name: str, text: str, used: list[str]) -> None:
        constants = [self._constants[item] for item in used if item in self._constants]
        uses = tuple(item for item in used if item in self.pieces)
        whole = "\n".join(["import math", *constants, text, ""])
        inside = "\n".join([whole, *(f"{item} {self.pieces[item].digest}" for item in uses)])
        self.pieces[name] = Piece(name, whole, uses, hashlib.sha256(inside.encode()).hexdigest()[:32])

    def _free(self, wished: str) -> str:
        count = self._taken.get(wished, 0)
        self._taken[wished] = count + 1
        return wished if count == 0 else f"{wished}_{count + 1}"

    def _references(self, function: Callable[..., Any]) -> dict[str, str]:
        renames: dict[str, str] = {}
        scope = inspect.unwrap(function).__globals__
        closure = inspect.getclosurevars(function).nonlocals if function.__closure__ else {}
        place = f"{function.__module__}.{function.__qualname__}"
        for name, line in law_text(function).free:
            value = IN_PLACE_OF.get(name) or closure.get(name, scope.get(name, getattr(builtins, name, None)))
            if value is math or (name in _CALLABLE_BUILT_INS and value is getattr(builtins, name)):
                continue
            if isinstance(value, types.FunctionType):
                renames[name] = self.add(value, f"{value.__module__.rpartition('.')[2]}_{value.__name__}")
            elif _is_number(value):
                renames[name] = self._constant(name, value, function.__module__)
            else:
                raise ComponentError(
                    f"the law uses '{name}' (line {function.__code__.co_firstlineno + line - 1}), which is neither math, a number nor a "
                    "plain function.",
                    place=place,
                    remedy="Laws take floats and give floats; keep everything else outside.",
                )
        return renames

    def _constant(self, name: str, value: object, module: str) -> str:
        key = (module, name, repr(value))
        if key not in self._names:
            self._names[key] = self._free(f"{module.rpartition('.')[2]}_{name}")
            self._constants[self._names[key]] = f"{self._names[key]} = {value!r}"
            self.blocks.append(self._constants[self._names[key]])
        return self._names[key]


def _is_number(value: object) -> bool:
    if isinstance(value, tuple):
        return bool(value) and all(_is_number(item) for item in value)
    return isinstance(value, (int, float)) and (not isinstance(value, float) or math.isfinite(value))
