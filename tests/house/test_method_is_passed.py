"""The numbers that decide are passed down: a function that has a method hands it on, and no other one than it was given decides."""

import ast
from collections.abc import Iterator

import pytest

from tests.house.counts import ROOT, files

DEFAULT = "STANDARD"
"""Name of the method that holds where nobody passes another one."""

Callables = dict[str, ast.FunctionDef | ast.ClassDef]
"""Functions and data classes by name."""


def arguments(called: ast.FunctionDef | ast.ClassDef) -> list[str]:
    """Return the names of the arguments of a function, in order, those by name only last, or the fields of a data class."""
    if isinstance(called, ast.ClassDef):
        return [item.target.id for item in called.body if isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name)]
    return [item.arg for item in (*called.args.args, *called.args.kwonlyargs)]


def defined(modules: dict[str, ast.Module]) -> Callables:
    """Return the functions and data classes of modules that take a method, by their dotted names."""
    return {
        f"{module}.{node.name}": node
        for module, tree in modules.items()
        for node in tree.body
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and "method" in arguments(node)
    }


def known_in(module: str, tree: ast.Module, functions: Callables) -> Callables:
    """Return those that take a method and that a module defines or imports, by the name under which it knows them."""
    here = {name.rpartition(".")[2]: node for name, node in functions.items() if name.rpartition(".")[0] == module}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            names = {item.asname or item.name: f"{node.module}.{item.name}" for item in node.names}
            here |= {name: functions[dotted] for name, dotted in names.items() if dotted in functions}
    return here


def name_of(call: ast.Call) -> str:
    """Return the name that is called; empty for what is no plain name."""
    return call.func.id if isinstance(call.func, ast.Name) else ""


def passes(call: ast.Call, called: ast.FunctionDef | ast.ClassDef) -> bool:
    """Return whether a call passes a method, by name or by place."""
    by_name = any(item.arg in ("method", None) for item in call.keywords)
    by_place = len(call.args) > arguments(called).index("method") or any(isinstance(item, ast.Starred) for item in call.args)
    return by_name or by_place


def left_to_the_default(modules: dict[str, ast.Module]) -> Iterator[str]:
    """Return the places where a function reads the default method, or calls without a method what takes one."""
    functions = defined(modules)
    for module, tree in modules.items():
        known = known_in(module, tree, functions)
        for function in (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)):
            for node in (node for statement in function.body for node in ast.walk(statement)):
                if isinstance(node, ast.Name) and node.id == DEFAULT:
                    yield f"{module}:{node.lineno}: {function.name} reads {DEFAULT}"
                elif isinstance(node, ast.Call) and (called := name_of(node)) in known and not passes(node, known[called]):
                    yield f"{module}:{node.lineno}: {function.name} calls {called} without its method"


def test_every_function_of_the_diagnosis_passes_its_method_on() -> None:
    assert sorted(left_to_the_default(files(ROOT))) == []


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("def inner(x, method=STANDARD): ...\ndef outer(x, method):\n    inner(x)\n", ["one:3: outer calls inner without its method"]),
        ("def inner(x, method=STANDARD): ...\ndef outer(x, method):\n    inner(x, method)\n    inner(x, method=method)\n", []),
        ("class Inner:\n    x: int\n    method: Method\ndef outer(x):\n    Inner(x)\n", ["one:5: outer calls Inner without its method"]),
        ("def outer(method):\n    return STANDARD.margin\n", ["one:2: outer reads STANDARD"]),
    ],
    ids=["not passed", "passed", "not passed to a data class", "read"],
)
def test_a_method_that_is_not_passed_on_is_found(text: str, found: list[str]) -> None:
    assert list(left_to_the_default({"one": ast.parse(text)})) == found
