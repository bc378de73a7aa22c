"""The sentences of all errors, read from the source text: what is wrong, and what to do about it, by the room of the program.

A value that a sentence takes in stands there as the name that the program has for it, ``{part}``.
"""

from __future__ import annotations

import ast
import functools
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

SOURCE = Path(__file__).parents[1]
ROOMS = {
    "lessons": "Lessons",
    "program": "Part programs",
    "units": "Quantities and units",
    "recordings": "Recordings",
    "diagnosis": "Diagnosis",
    "identification": "Fits",
    "exercises": "Concealed cases",
    "classroom": "Classes",
    "compensation": "Remedies and learning",
    "experiments": "Experiments",
    "stability": "Stability",
    "live": "Live machines",
    "motion": "Set-points",
    "component": "Parts of your own",
    "engine": "Machines and runs",
    "record": "Records and files",
}
"""Headings by the folder or module of an error, in the order of the page; whatever else there is stands at the end."""
_OTHER = "Everything else"
_POSITIONS = {"Fault": ("fact", "remedy"), "PydanticCustomError": ("kind", "fact")}
"""What the arguments of an error are, where the first one is not the fact alone."""
_WHOLE = ("PydanticCustomError",)
"""Errors whose fact holds the remedy too."""
_NO_VALUES = {"strip", "join", "min", "max", "len", "str", "name", "sorted", "map", "else", "for", "in", "if", "text", "lower", "parent"}
"""Names in an expression that do not say what the value is, unless there is no other."""
Texts = Mapping[str, tuple[str, ...]]


@functools.cache
def error_sentences() -> dict[str, dict[str, str]]:
    """Return by heading the sentences of all errors, each with its remedy; an empty one where the program works it out as it runs."""
    found: dict[str, dict[str, str]] = {heading: {} for heading in (*ROOMS.values(), _OTHER)}
    for file in sorted(SOURCE.rglob("*.py")):
        source = file.read_text(encoding="utf-8")
        if "Error(" in source or "Fault(" in source:
            heading = ROOMS.get(file.relative_to(SOURCE).parts[0].removesuffix(".py"), _OTHER)
            for fact, remedy in _of_module(ast.parse(source)):
                found[heading][fact] = found[heading].get(fact) or remedy
    return {heading: dict(sorted(sentences.items())) for heading, sentences in found.items() if sentences}


def _of_module(tree: ast.Module) -> Iterator[tuple[str, str]]:
    """Yield fact and remedy of each error that a module makes."""
    constants = _assigned(tree.body)
    for scope in (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)):
        known = {**constants, **_assigned(ast.walk(scope))}
        for call in (node for node in ast.walk(scope) if isinstance(node, ast.Call) and node.args):
            name = call.func.id if isinstance(call.func, ast.Name) else ""
            if not re.fullmatch(r"[A-Z]\w*Error|Fault", name):
                continue
            given = {item.arg: item.value for item in call.keywords} | dict(zip(_POSITIONS.get(name, ("fact",)), call.args, strict=False))
            remedies = _texts(given["remedy"], known) if "remedy" in given else ()
            for fact in _texts(given["fact"], known) if "fact" in given else ():
                if re.search(r"[a-z]{2}.*[a-z]{2}.*\.$", fact):
                    first, stop, rest = fact.partition(". ") if name in _WHOLE else (fact, "", "")
                    yield f"{first}{stop}".strip(), (*remedies, rest)[0]


def _assigned(nodes: Iterator[ast.AST] | list[ast.stmt]) -> dict[str, tuple[str, ...]]:
    """Return the texts that names are given, also two at once."""
    found: dict[str, tuple[str, ...]] = {}
    for node in nodes:
        if isinstance(node, ast.Assign) and len(node.targets) == 1:
            target, value = node.targets[0], node.value
            pairs = zip(target.elts, value.elts, strict=False) if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple) else ()
            for name, text in (*pairs, (target, value)):
                if isinstance(name, ast.Name):
                    found[name.id] = (*found.get(name.id, ()), *_texts(text, {}))
    return found


def _texts(node: ast.expr, known: Texts) -> tuple[str, ...]:
    """Return the texts that an expression may be; none where it is no text that stands in the source."""
    if isinstance(node, ast.Constant):
        return (node.value,) if isinstance(node.value, str) else ()
    if isinstance(node, ast.JoinedStr):
        return ("".join(str(part.value) if isinstance(part, ast.Constant) else _placeholder(part, known) for part in node.values),)
    if isinstance(node, ast.BoolOp):
        return tuple(text for value in node.values for text in _texts(value, known))
    if isinstance(node, ast.IfExp):
        return (*_texts(node.body, known), *_texts(node.orelse, known))
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "nearest":
        return ("Did you mean '{nearest name}'?",)
    return known.get(node.id, ()) if isinstance(node, ast.Name) else ()


def _placeholder(part: ast.expr, known: Texts) -> str:
    """Return what stands for a value in a sentence: the last name in its expression, or the text that it is known to be."""
    value = part.value if isinstance(part, ast.FormattedValue) else part
    texts: tuple[str, ...] = known.get(value.id, ()) if isinstance(value, ast.Name) else ()
    if len(texts) == 1 and texts[0]:
        return texts[0]
    names = [name.strip("_") for name in re.findall(r"[A-Za-z_]\w*", re.sub(r"'[^']*'|\"[^\"]*\"", "", ast.unparse(value)))]
    telling: list[str] = [name for name in names if name not in _NO_VALUES] or names or ["value"]
    return "{" + telling[-1].replace("_", " ").lower() + "}"
