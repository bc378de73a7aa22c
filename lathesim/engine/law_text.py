"""The source text of laws: as it stands in a generated module, and in the place of its call, with the helpers and constants it uses.

A law is plain Python: floats in, floats out. What it refers to outside itself may be ``math``, numbers, tuples of numbers, and plain
functions of which the same holds; all are copied under names of their own, so the generated module depends on nothing else. A function is
copied without docstring, annotations and decorators.

Reading and parsing the sources of a machine takes a tenth of a second, so the text is kept on disk under the digest of the function's
byte code and defaults: what Python would run. A changed law has other byte code, so what is found there is never stale; and it is kept
only while the file compiles to the byte code at hand, so that an edit while the program runs is not taken for the law it replaces.
"""

from __future__ import annotations

import ast
import builtins
import copy
import functools
import hashlib
import inspect
import json
import linecache
import math
import re
import textwrap
import types
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from lathesim import elementary
from lathesim.cache_folder import keep_sealed, kept_sealed
from lathesim.errors import ComponentError


class NotInPlaceError(Exception):
    """A law has to be called as it is: because of ``line`` of the function ``law``, counted from its ``def``."""

    law = ""

    def __init__(self, line: int = 0) -> None:
        super().__init__()
        self.line = line


FOREIGN: dict[str, Callable[..., Any]] = {}
"""Laws of which no text can be copied, as they call a library, by a name of their own. A generated module takes them from here."""


def in_place(law: ast.FunctionDef, arguments: Sequence[ast.expr], targets: Sequence[str], prefix: str) -> list[ast.stmt]:
    """Return the statements that assign to ``targets`` what a law returns.

    Variables of its own get ``prefix`` before their names. Raises :class:`NotInPlaceError`.
    """
    stored = stored_names(*law.body)
    names = {name: prefix + name for name in stored}
    begin: list[ast.stmt] = []
    for argument, value in zip(law.args.args, arguments, strict=True):
        if isinstance(value, ast.Name) and argument.arg not in stored:
            names[argument.arg] = value.id
        else:
            names[argument.arg] = prefix + argument.arg
            begin += _assigned([prefix + argument.arg], value)
    return [*begin, *_to_the_end([Renamed(names).visit(copy.deepcopy(statement)) for statement in law.body], targets)]


def read_names(*trees: ast.AST) -> list[str]:
    """Return the variables that trees read."""
    every = [node for tree in trees for node in ast.walk(tree)]
    found = [node.id for node in every if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)]
    return found + [node.target.id for node in every if isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name)]


def stored_names(*trees: ast.AST) -> list[str]:
    """Return the variables that trees assign."""
    if len(trees) == 1 and isinstance(tree := trees[0], ast.Assign) and isinstance(tree.targets[0], ast.Name):
        return [tree.targets[0].id]  # most are of this kind, and to walk through their values takes most of the time of writing for lanes
    every = [node for tree in trees for node in ast.walk(tree)]
    return [node.id for node in every if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)]


class Renamed(ast.NodeTransformer):
    """Gives variables other names."""

    def __init__(self, names: Mapping[str, str]) -> None:
        self.names = names

    def visit_Name(self, node: ast.Name) -> ast.AST:
        """Return the variable under its new name."""
        return ast.Name(self.names.get(node.id, node.id), node.ctx)


def _to_the_end(statements: Sequence[ast.stmt], targets: Sequence[str]) -> list[ast.stmt]:
    for place, statement in enumerate(statements):
        before, rest = list(statements[:place]), statements[place + 1 :]
        match statement:
            case ast.Return(value=value):
                return [*before, *_assigned(targets, value, statement.lineno)]
            case ast.If(test=test, body=body, orelse=other) if _returns(statement):
                sides = [_to_the_end(side if _always_returns(side) else [*side, *rest], targets) for side in (body, other)]
                return [*before, ast.copy_location(ast.If(test, sides[0] or [ast.Pass()], sides[1]), statement)]
            case _ if _returns(statement):
                raise NotInPlaceError(statement.lineno)
    if targets:
        raise NotInPlaceError
    return list(statements)


def _assigned(targets: Sequence[str], value: ast.expr | None, line: int = 0) -> list[ast.stmt]:
    """Return one assignment for each target, one for all where a value reads what another replaces."""
    names: list[ast.expr] = [ast.Name(target, ast.Store()) for target in targets]
    if len(targets) == 1 and not isinstance(value, ast.Tuple):
        return [ast.Assign(names, value or ast.Constant(None), lineno=line)]
    if isinstance(value, ast.Tuple) and _independent(targets, value.elts):
        return [ast.Assign([name], item, lineno=line) for name, item in zip(names, value.elts, strict=True)]
    return [ast.Assign([ast.Tuple(names, ast.Store())], value or ast.Tuple([], ast.Load()), lineno=line)]


def _independent(targets: Collection[str], values: Sequence[ast.expr]) -> bool:
    return len(targets) == len(values) and set(targets).isdisjoint(read_names(*values))


def _returns(statement: ast.stmt) -> bool:
    return any(isinstance(node, ast.Return) for node in ast.walk(statement))


def _always_returns(statements: list[ast.stmt]) -> bool:
    last = statements[-1] if statements else None
    return isinstance(last, ast.Return) or (isinstance(last, ast.If) and _always_returns(last.body) and _always_returns(last.orelse))


_FORMAT = 5
_MARK = "⟨{}⟩"
_MARKED = re.compile("⟨([^⟩]*)⟩")


IN_PLACE_OF = {
    f"math.{function.__name__}": function
    for function in (elementary.exp, elementary.exp2, elementary.log, elementary.log2, elementary.tanh)
}
"""Functions of the mathematical library -> those that are computed in their place, with the same bits in vectors."""


@dataclass(frozen=True)
class LawText:
    """A function's text with marks for its own name and the names it takes from outside (``free``: name and line of the first use)."""

    marked: str
    free: tuple[tuple[str, int], ...]

    def named(self, name: str, renames: Mapping[str, str]) -> str:
        """Return the text of the function under ``name``, with outside names replaced; those without a new name stay."""
        return _MARKED.sub(lambda match: renames.get(match[1], match[1]) if match[1] else name, self.marked)


@functools.lru_cache(maxsize=4096)
def law_text(function: Callable[..., Any]) -> LawText:
    """Return the text of a function, from the cache where it is known.

    Raises :class:`ComponentError` where its source cannot be read or is no ``def``.
    """
    name = f"text_{_fingerprint(function)}.json"
    kept = _kept(name)
    if kept is None:
        kept = _written(function)
        if _is_on_disk(function):
            keep_sealed(name, json.dumps(asdict(kept)).encode())
    return kept


def _kept(name: str) -> LawText | None:
    try:
        found = json.loads(kept_sealed(name) or b"")
        return LawText(str(found["marked"]), tuple((str(item), int(line)) for item, line in found["free"]))
    except (ValueError, KeyError, TypeError):
        return None


def _fingerprint(function: Callable[..., Any]) -> str:
    defaults = (function.__defaults__, function.__kwdefaults__)
    return hashlib.sha256(repr((_FORMAT, _code(function.__code__), defaults)).encode()).hexdigest()[:32]


def _code(code: types.CodeType) -> tuple[object, ...]:
    constants = tuple(_code(item) if isinstance(item, types.CodeType) else repr(item) for item in code.co_consts)
    counts = (code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount, code.co_flags)
    return code.co_code, code.co_exceptiontable, constants, counts, code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars


def _is_on_disk(function: Callable[..., Any]) -> bool:
    """Return whether the file of a function, compiled again, still holds its byte code."""
    try:
        file = inspect.getsourcefile(function) or ""
        return _code(function.__code__) in _codes_of(file, Path(file).stat().st_mtime_ns)
    except (OSError, TypeError, SyntaxError, ValueError):
        return False


@functools.lru_cache(maxsize=256)
def _codes_of(file: str, changed: int) -> frozenset[tuple[object, ...]]:
    found, rest = set(), [compile(Path(file).read_bytes(), file, "exec", dont_inherit=True)]
    while rest:
        code = rest.pop()
        found.add(_code(code))
        rest += [item for item in code.co_consts if isinstance(item, types.CodeType)]
    return frozenset(found)


def _written(function: Callable[..., Any]) -> LawText:
    tree = _function_tree(function)
    local = _local_names(tree)
    free: dict[str, int] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and node.id not in local:
            free.setdefault(node.id, node.lineno)
        elif isinstance(node, ast.Attribute) and ast.unparse(node) in IN_PLACE_OF:
            free.setdefault(ast.unparse(node), node.lineno)
    tree.decorator_list = []
    tree.returns = None
    for argument in [*tree.args.args, *tree.args.posonlyargs]:
        argument.annotation = None
    tree = _Mark(free).visit(_without_docstring(tree))
    tree.name = _MARK.format("")
    return LawText(ast.unparse(ast.fix_missing_locations(tree)), tuple(free.items()))


def _function_tree(function: Callable[..., Any]) -> ast.FunctionDef:
    place = f"{function.__module__}.{function.__qualname__}"
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
    except (OSError, TypeError, SyntaxError) as error:
        raise ComponentError("the source of the law cannot be read.", place=place, remedy="Write it in a file.") from error
    if not isinstance(tree, ast.FunctionDef):
        raise ComponentError("the law is no plain function.", place=place, remedy="Write it with def.")
    return tree


def source_line(function: Callable[..., Any], line: int) -> str:
    """Return ``file:line: text`` of the source of a statement, given by its line in the function's text after the ``def``."""
    written, source = ast.parse(law_text(function).named("law", {})), _without_docstring(_function_tree(function))
    pairs = zip(*([node for node in ast.walk(tree) if isinstance(node, ast.stmt)] for tree in (written.body[0], source)), strict=True)
    found = next((there.lineno for here, there in pairs if here.lineno == line + 1), 1) + function.__code__.co_firstlineno - 1
    file = inspect.getsourcefile(function) or ""
    return f"{file}:{found}: {linecache.getline(file, found).strip()}"


def _without_docstring(tree: ast.FunctionDef) -> ast.FunctionDef:
    if ast.get_docstring(tree):
        tree.body = tree.body[1:] or [ast.Pass()]
    return tree


def _local_names(tree: ast.FunctionDef) -> set[str]:
    names = {argument.arg for argument in [*tree.args.args, *tree.args.posonlyargs]}
    names |= {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    annotations = [node.annotation for node in ast.walk(tree) if isinstance(node, (ast.arg, ast.AnnAssign)) and node.annotation]
    annotations += [tree.returns] if tree.returns else []
    names |= {node.id for item in annotations for node in ast.walk(item) if isinstance(node, ast.Name)}
    return names | {node.id for item in tree.decorator_list for node in ast.walk(item) if isinstance(node, ast.Name)}


class _Mark(ast.NodeTransformer):
    def __init__(self, names: Mapping[str, int]) -> None:
        self.names = names

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        name = ast.unparse(node)
        return ast.Name(_MARK.format(name), ast.Load()) if name in IN_PLACE_OF else node

    def visit_Name(self, node: ast.Name) -> ast.Name:
        if node.id in self.names:
            node.id = _MARK.format(node.id)
        return node

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST:
        self.generic_visit(node)
        if node.value is None:
            return ast.Pass()
        return ast.Assign(targets=[node.target], value=node.value)


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


Lines = tuple[str, ...]


@functools.lru_cache(maxsize=4096)
def _lines_in_place(law: str, given: tuple[str, ...], targets: tuple[str, ...], prefix: str) -> Lines | None:
    """Return the lines of a law's text written where it is called; a diagnosis writes one machine dozens of times."""
    tree = ast.parse(law).body[0]
    assert isinstance(tree, ast.FunctionDef)
    nodes = [node for statement in tree.body for node in ast.walk(statement)]
    if any(isinstance(node, (ast.stmt, ast.expr)) and not isinstance(node, _IN_PLACE) for node in nodes):
        return None
    try:
        made = in_place(tree, [ast.parse(value, mode="eval").body for value in given], targets, prefix)
    except NotInPlaceError:
        return None
    return tuple(line for statement in made for line in ast.unparse(statement).splitlines())


class LawLibrary:
    """Collects laws and what they use; ``blocks`` is Python source in which each stands once, ``pieces`` the functions one by one."""

    def __init__(self) -> None:
        self._names: dict[Any, str] = {}
        self._taken: dict[str, int] = {}
        self._constants: dict[str, str] = {}
        self.blocks: list[str] = []
        self.foreign: list[str] = []
        self.pieces: dict[str, Piece] = {}

    @property
    def functions(self) -> list[str]:
        """The names of the functions, each after those it calls."""
        return list(self.pieces)

    def add(self, function: Callable[..., Any], wished: str) -> str:
        """Copy a function and give the name under which it now stands."""
        if function in self._names:
            return self._names[function]
        name = self._free(re.sub(r"\W", "_", wished))
        self._names[function] = name
        foreign = getattr(function, "foreign", "")
        if foreign:
            FOREIGN[foreign] = function
            self.blocks.append(f"from lathesim.engine.law_text import FOREIGN\n\n{name} = FOREIGN[{foreign!r}]\n")
            self.foreign.append(foreign)
            return name
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

    def lines_in_place(self, function: Callable[..., Any], given: Sequence[str], targets: Sequence[str], prefix: str) -> Lines | None:
        """Return the lines of a law written where it is called; none where it has to be called, so that it can be named when it fails."""
        renames = self._references(function)
        if any("while " in self.pieces[name].text for name in self.with_theirs(renames.values())):
            return None
        return _lines_in_place(law_text(function).named("law", renames), tuple(given), tuple(targets), prefix)

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
                renames[name] = self._constant(name, value, function)
            else:
                raise ComponentError(
                    f"the law uses '{name}' (line {function.__code__.co_firstlineno + line - 1}), which is neither math, a number nor a "
                    "plain function.",
                    place=place,
                    remedy="Laws take floats and give floats; keep everything else outside.",
                )
        return renames

    def _constant(self, name: str, value: object, law: Callable[..., Any]) -> str:
        key = (law.__module__, name, repr(value))
        if key not in self._names:
            self._names[key] = self._free(f"{law.__module__.rpartition('.')[2]}_{name}")
            self._constants[self._names[key]] = f"{self._names[key]} = {value!r}"
            self.blocks.append(self._constants[self._names[key]])
        return self._names[key]


def _is_number(value: object) -> bool:
    if isinstance(value, tuple):
        return bool(value) and all(_is_number(item) for item in value)
    return isinstance(value, (int, float)) and (not isinstance(value, float) or math.isfinite(value))
