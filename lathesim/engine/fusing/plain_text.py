"""The text of ``run_block`` rewritten once for plain Python: the same operations on the same numbers, so the same bits, with fewer of
Python's own steps around them.

Machine code is made of the text as it stands, and gains nothing here; plain Python pays for each call, each look-up and each number put
away. So ``run_block`` is given its laws in place of their calls, numbers in place of the names of constants, functions of ``math`` and
what every sample would compute alike bound once, and a record written in one call. Its step stands as
:mod:`lathesim.engine.fusing.plain_step` writes it. A law with a ``while`` is still called, so that it can be named when it does not end.
"""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterable

from lathesim.engine.fusing.law_in_place import body_in_place
from lathesim.engine.fusing.plain_step import plain_step, stage_table
from lathesim.engine.fusing.step_text import is_safe, without_unread
from lathesim.engine.fusing.text_tree import copied, nodes, read_names, stored_names, target_of, written

PLAIN_FORMAT = 3
"""Rises with every change of what this module or ``plain_step`` writes, so that no older text is taken from the cache."""
_LONGEST_BODY = 40
"""Lines of a law that may stand in place of its call."""
_REACHED = 256
"""Variables of a function that Python reaches by their number in one byte; those beyond cost another step each time."""
_OF_MATH = re.compile(r"\bmath\.(\w+)")
_NAME = re.compile(r"\b[A-Za-z_]\w*")


def plain_text(source: str) -> str:
    """Return ``run_block`` of a fused module, and what it calls, as plain Python runs it fastest."""
    module = _Module(source)
    block = module.functions["run_block"]
    sizes: list[int] = []
    place = next((place for place, statement in enumerate(block.body) if isinstance(statement, ast.For)), len(block.body))
    for samples in block.body[place : place + 1]:
        assert isinstance(samples, ast.For)
        samples.body = [copied(statement, module.constants) for statement in module.in_place(samples.body)]
        for statement in samples.body:
            plain_step(statement, stage_table(block))
        sizes = [size for statement in samples.body if (size := _written_at_once(statement))]
        _drop_unread(samples, block)
        block.body[place:place] = _taken_out(samples, block)
    head, *lines = ast.unparse(block).splitlines()
    bound = sorted(set(_OF_MATH.findall("\n".join(lines))))
    lines = [*(f"    math_{name} = math.{name}" for name in bound), *(_OF_MATH.sub(r"math_\1", line) for line in lines)]
    called = [module.functions[name] for name in module.called(block)]
    for law in called:
        law.body = module.in_place(law.body)
    laws = [written([copied(law, module.constants)]) for law in called]
    made = [module.others, "from struct import Struct", *(f"keep_{size} = Struct('{size}d').pack_into" for size in sorted(set(sizes)))]
    return "\n\n\n".join(["\n".join(made), *laws, "\n".join([head, *_named_first(block, lines), *lines, ""])])


class _Module:
    """A fused module taken apart: its numbers by name (``constants``), its ``functions`` by name, and the text of all ``others``."""

    def __init__(self, source: str) -> None:
        tree, self._lines = ast.parse(source), source.splitlines()
        self.constants = {target_of(item): item.value for item in tree.body if isinstance(item, ast.Assign) and _is_number(item.value)}
        self.functions = {item.name: item for item in tree.body if isinstance(item, ast.FunctionDef)}
        self.others = written(
            item for item in tree.body if not isinstance(item, (ast.FunctionDef, ast.Expr)) and target_of(item) not in self.constants
        )
        self._called: dict[str, list[str]] = {}
        self._count = 0

    def called(self, function: ast.FunctionDef) -> list[str]:
        """Return the functions that one calls and that these call, each after those it calls."""
        if function.name not in self._called:
            names = [name for name in dict.fromkeys(read_names(function)) if name in self.functions]
            found = [item for name in names for item in [*self.called(self.functions[name]), name]]
            self._called[function.name] = list(dict.fromkeys(found))
        return self._called[function.name]

    def in_place(self, statements: Iterable[ast.stmt]) -> list[ast.stmt]:
        """Return statements with the bodies of laws in the place of their calls."""
        found: list[ast.stmt] = []
        for statement in statements:
            if isinstance(statement, (ast.If, ast.For, ast.While)):
                statement.body, statement.orelse = self.in_place(statement.body), self.in_place(statement.orelse)
            found += self._body(statement) or [statement]
        return found

    def _body(self, statement: ast.stmt) -> list[ast.stmt] | None:
        match statement:
            case ast.Assign(targets=[target], value=ast.Call(func=ast.Name(id=name), args=given)) if name in self.functions:
                law = self.functions[name]
            case _:
                return None
        names = [argument.arg for argument in law.args.args]
        if len(names) != len(given) or any(self._has_while(item) for item in (name, *self.called(law))):
            return None
        self._count += 1
        targets = [ast.unparse(item) for item in (target.elts if isinstance(target, ast.Tuple) else [target])]
        arguments, before = {}, []
        for name, value in zip(names, given, strict=True):
            arguments[name] = ast.unparse(value) if isinstance(value, (ast.Name, ast.Subscript)) else f"law_{self._count}__given_{name}"
            before += [] if isinstance(value, (ast.Name, ast.Subscript)) else [f"{arguments[name]} = {ast.unparse(value)}"]
        lines = body_in_place(self._text(law), arguments, targets, f"law_{self._count}__")
        return ast.parse("\n".join([*before, *lines])).body if lines is not None and len(lines) <= _LONGEST_BODY else None

    def _has_while(self, name: str) -> bool:
        return any(isinstance(node, ast.While) for node in nodes(self.functions[name]))

    def _text(self, law: ast.FunctionDef) -> str:
        return "\n".join(self._lines[law.lineno - 1 : law.end_lineno])


def _is_number(node: ast.expr) -> bool:
    value = node.operand if isinstance(node, ast.UnaryOp) else node
    return isinstance(value, ast.Constant) and isinstance(value.value, (int, float))


def _written_at_once(statement: ast.stmt) -> int:
    """Let a portion of the record be written by a function made for as many numbers as it has, and give how many; 0 for any other line."""
    match statement:
        case ast.Expr(value=ast.Call(func=ast.Name(id="keep"), args=[record, first, ast.Tuple(elts=values)]) as call):
            call.func = ast.Name(f"keep_{len(values)}", ast.Load())
            call.args = [record, ast.BinOp(ast.Constant(8), ast.Mult(), first), *values]
            return len(values)
    return 0


def _drop_unread(samples: ast.For, block: ast.FunctionDef) -> None:
    """Take away the assignments that nobody reads, where computing them cannot raise."""
    around = read_names(*(statement for statement in block.body if statement is not samples))
    while without_unread(samples, {*around, *read_names(samples)}, is_safe):
        pass


def _taken_out(samples: ast.For, block: ast.FunctionDef) -> list[ast.stmt]:
    """Take what is the same in every sample out of their loop, and give it: what is computed in any case, of what no sample changes."""
    once = {name for name, count in Counter(stored_names(block)).items() if count == 1}
    varying = set(stored_names(samples))
    taken: list[ast.stmt] = []
    for statement in samples.body:
        if isinstance(statement, ast.If) and any(isinstance(node, ast.Break) for node in nodes(statement)):
            once &= {name for name in once if name.startswith("held_")}  # after the last sample, nothing else is to be computed
        name = target_of(statement)
        alike = name in once and varying.isdisjoint(read_names(statement))
        if alike and isinstance(statement, ast.Assign) and _is_arithmetic(statement.value):
            taken.append(statement)
            varying.discard(name)
    samples.body = [statement for statement in samples.body if statement not in taken]
    return taken


def _is_arithmetic(value: ast.expr) -> bool:
    """Return whether an expression is made of numbers, variables, operators and functions of ``math``."""
    made = (ast.Name, ast.Constant, ast.BinOp, ast.UnaryOp, ast.Compare, ast.Call, ast.Attribute)
    every = nodes(value)
    return all(isinstance(node, made) for node in every) and all(
        isinstance(node.func, ast.Attribute) for node in every if isinstance(node, ast.Call)
    )


def _named_first(block: ast.FunctionDef, lines: list[str]) -> list[str]:
    """Return lines that name the variables of a step, then those met most often, before all others, where there are more than Python
    reaches directly.

    They are never run, and leave nothing in the byte code but the order of the variables.
    """
    text = "\n".join(lines)
    met = Counter(_NAME.findall(text))
    own = {*stored_names(block), *(name for name in met if name.startswith("math_"))}
    left = _REACHED - len(block.args.args)
    if len(own) <= left:
        return []
    of_steps = Counter(_NAME.findall(text[text.find("for substep in ") :]))
    names = [name for name in dict.fromkeys([*of_steps, *(name for name, _ in met.most_common())]) if name in own][:left]
    chains = [" = ".join(names[first : first + 4]) for first in range(0, len(names), 4)]
    return ["    if False:", *[f"        {chain} = 0.0" for chain in chains]]
