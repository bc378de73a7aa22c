"""YAML text to plain data that remembers where everything stood.

The loader is safe (it builds texts, numbers, true/false, lists and mappings and nothing else), knows that ``1e-3`` is a number and
``on`` is not true, and refuses what YAML lets pass in silence: a key given twice, aliases, tags.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from lathesim.errors import LessonError

Location = tuple[str | int, ...]
"""Where something stands in the data: keys and list positions from the top."""


class _LineLoader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """A safe loader with the few implicit types of JSON."""

    yaml_implicit_resolvers: dict[str, list[tuple[str, re.Pattern[str]]]] = {}


_SUFFIXES = (".yaml", ".yml")
_NUMBER = re.compile(r"^[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?$")
_LineLoader.add_implicit_resolver("tag:yaml.org,2002:bool", re.compile(r"^(true|false)$"), list("tf"))
_LineLoader.add_implicit_resolver("tag:yaml.org,2002:null", re.compile(r"^(null|~|)$"), ["n", "~", ""])
_LineLoader.add_implicit_resolver("tag:yaml.org,2002:float", _NUMBER, list("-+.0123456789"))


@dataclass(frozen=True)
class YamlFile:
    """A YAML file: its name as shown to people, its text, its data, and the line and column (from 1) of every key and value."""

    name: str
    text: str
    data: dict[str, Any]
    keys: dict[Location, tuple[int, int]] = field(repr=False)
    values: dict[Location, tuple[int, int]] = field(repr=False)

    def place(self, location: Location, *, key: bool = False) -> str:
        """Return ``file:line:column`` of a value, or of its key; of the nearest thing around it where it is not in the file."""
        if key and location in self.keys:
            return "{}:{}:{}".format(self.name, *self.keys[location])
        while location and location not in self.values:
            location = location[:-1]
        return "{}:{}:{}".format(self.name, *self.values.get(location, (1, 1)))


def read_source(path: Path, *, what: str = "lesson") -> YamlFile:
    """Return the source of a YAML file, or refuse it (:class:`LessonError`)."""
    name = str(path)
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise LessonError(f"there is no {what} '{name}'.", remedy="See 'lathesim lessons'.") from None
    except UnicodeDecodeError as error:
        raise LessonError(f"byte {error.start} is not UTF-8 text.", place=name, remedy="Save the file as UTF-8.") from None
    except OSError as error:
        raise LessonError(f"the file cannot be read: {error.strerror}.", place=name) from None
    try:
        return source_of(text, name)
    except LessonError:
        if what != "lesson" or path.suffix.lower() in _SUFFIXES:
            raise
        remedy = f"A lesson names its part program in a line 'program: {path.name}': give the lesson."
        raise LessonError("the file is no lesson, which is YAML.", place=name, remedy=remedy) from None


def source_of(text: str, name: str) -> YamlFile:
    """Return the source of YAML ``text``; ``name`` is what errors call the file."""
    try:
        root = yaml.compose(text, Loader=_LineLoader)
    except yaml.YAMLError as error:
        raise _not_yaml(error, text, name) from None
    if root is None:
        raise LessonError("the file is empty.", place=name, remedy="Begin with 'lesson: a title'.")
    reader = _NodeReader(name)
    data = reader.read(root, ())
    if not isinstance(data, dict):
        raise LessonError(
            f"the file holds {kind_of(data)} where keys and values are expected.", place=f"{name}:1:1", remedy="Write 'key: value' lines."
        )
    return YamlFile(name, text, data, reader.keys, reader.values)


def kind_of(value: Any) -> str:
    """Return in words what a piece of data is."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "keys and values"
    if isinstance(value, list):
        return "a list"
    return f"the number {value:g}" if isinstance(value, (int, float)) else f"the text '{value}'"


def _not_yaml(error: yaml.YAMLError, text: str, name: str) -> LessonError:
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    if mark is None:
        return LessonError("this is not YAML text.", place=name, remedy="Save the file as plain UTF-8 text.")
    lines = text.splitlines()
    line = lines[mark.line] if mark.line < len(lines) else ""
    place = f"{name}:{mark.line + 1}:{mark.column + 1}"
    if "\t" in line[: len(line) - len(line.lstrip())]:
        return LessonError("the line is indented with a tab.", place=place, remedy="Indent with spaces.")
    problem = getattr(error, "problem", None) or "it cannot be read"
    return LessonError(f"this is not YAML: {problem}.", place=place, remedy="Check the indentation, colons and quotes there.")


class _NodeReader:
    """Turns YAML nodes into data and notes positions on the way."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.keys: dict[Location, tuple[int, int]] = {}
        self.values: dict[Location, tuple[int, int]] = {}
        self._seen: set[int] = set()

    def read(self, node: yaml.Node, location: Location) -> Any:
        self.values[location] = _position(node)
        if id(node) in self._seen:
            raise self._error(node, "an alias (*name) stands here, and lessons have none.", "Write the value out.")
        self._seen.add(id(node))
        if isinstance(node, yaml.MappingNode) and node.tag == "tag:yaml.org,2002:map":
            return self._mapping(node, location)
        if isinstance(node, yaml.SequenceNode) and node.tag == "tag:yaml.org,2002:seq":
            return [self.read(item, (*location, position)) for position, item in enumerate(node.value)]
        if isinstance(node, yaml.ScalarNode):
            return self._scalar(node)
        raise self._error(node, f"the tag '{node.tag}' stands here, and lessons have none.", "Take it away.")

    def _mapping(self, node: yaml.MappingNode, location: Location) -> dict[str, Any]:
        data: dict[str, Any] = {}
        for key_node, value_node in node.value:
            if not isinstance(key_node, yaml.ScalarNode):
                raise self._error(key_node, "a key is not plain text.", "Write 'key: value'.")
            key = str(key_node.value)
            here = (*location, key)
            if key in data:
                first = self.keys[here][0]
                raise self._error(key_node, f"the key '{key}' is given a second time (first in line {first}).", "Take one of them away.")
            self.keys[here] = _position(key_node)
            data[key] = self.read(value_node, here)
        return data

    def _scalar(self, node: yaml.ScalarNode) -> Any:
        kind = node.tag.rpartition(":")[2]
        text = str(node.value)
        if kind == "str":
            return text
        if kind == "null":
            return None
        if kind == "bool":
            return text == "true"
        if kind == "float" and _NUMBER.match(text):
            return float(text) if re.search(r"[.eE]", text) else int(text)
        raise self._error(node, f"the tag '{node.tag}' stands here, and lessons have none.", "Take it away.")

    def _error(self, node: yaml.Node, fact: str, remedy: str) -> LessonError:
        line, column = _position(node)
        return LessonError(fact, place=f"{self.name}:{line}:{column}", remedy=remedy)


def _position(node: yaml.Node) -> tuple[int, int]:
    return node.start_mark.line + 1, node.start_mark.column + 1
