"""The JSON Schema for editors and the program's own validation say the same of every lesson, machine template and mutant of them."""

from __future__ import annotations

import copy
import dataclasses
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from lathesim.errors import LessonError
from lathesim.lessons.schema import LessonSettings, MachineSettings, json_schema
from lathesim.lessons.validation import validated
from lathesim.lessons.yaml_source import YamlFile, read_source, source_of
from lathesim.shipped import shipped_files

MODELS = {"lesson": LessonSettings, "machine": MachineSettings}
EVERY_KEY = read_source(Path(__file__).with_name("every_key.yaml"))
SHIPPED = [
    *[("lesson", read_source(path)) for path in shipped_files("lesson_configs", "*.yaml")],
    *[("machine", read_source(path)) for path in shipped_files("lesson_configs/machines", "*.yaml")],
]
VALUES: list[Any] = [None, True, 0, -1, 5, 1.5, "text", "5 ms", "1", "", [], {}, ["a"], {"a": "b"}, {"a.b": 1}, [{}]]
KEYS = [
    *["extra", "a.b", "part.", "effect", "remedy", "resolution", "above", "value", "until_below", "lasting", "column", "rate"],
    *["at_most", "at_least", "modes", "response", "cutting_stiffness", "milling", "speed", "width"],
]


@pytest.fixture(scope="module")
def schemas() -> dict[str, jsonschema.Draft202012Validator]:
    return {kind: jsonschema.Draft202012Validator(json_schema(kind)) for kind in MODELS}


def taken(kind: str, source: YamlFile) -> bool:
    """Return whether the program takes a source."""
    try:
        validated(MODELS[kind], source)
    except LessonError:
        return False
    return True


def places(data: Any, at: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the location of everything in some data."""
    inner = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in inner:
        yield (*at, key)
        yield from places(value, (*at, key))


def mutant(data: dict[str, Any], rng: random.Random) -> dict[str, Any]:
    """Return the data with one thing replaced, removed, renamed or added."""
    result = copy.deepcopy(data)
    *way, last = rng.choice(list(places(result)))
    host: Any = result
    for key in way:
        host = host[key]
    change = rng.choice(["replace", "remove", "rename", "add"])
    if change == "remove":
        del host[last]
    elif change == "rename" and isinstance(host, dict):
        host[rng.choice([f"{last}x", *KEYS])] = host.pop(last)
    elif change == "add" and isinstance(host, dict):
        host[rng.choice(KEYS)] = rng.choice(VALUES)
    else:
        host[last] = rng.choice(VALUES)
    return result


def test_the_schema_accepts_all_that_ships(schemas: dict[str, jsonschema.Draft202012Validator]) -> None:
    for kind, source in [*SHIPPED, ("lesson", EVERY_KEY)]:
        schemas[kind].validate(source.data)
        assert taken(kind, source)


@pytest.mark.parametrize("count", [300, pytest.param(3000, marks=pytest.mark.slow)])
def test_schema_and_program_say_the_same_of_mutants(schemas: dict[str, jsonschema.Draft202012Validator], count: int) -> None:
    rng = random.Random(count)
    for _ in range(count):
        kind, source = rng.choice([*SHIPPED, *[("lesson", EVERY_KEY)] * 10])
        data = mutant(source.data, rng)
        fault = next(schemas[kind].iter_errors(data), None)
        assert taken(kind, dataclasses.replace(source, data=data)) == (fault is None), (source.name, fault and fault.message)


def test_an_entry_is_an_effect_or_a_remedy() -> None:
    text = "lesson: L\nmachine: two_axis_lathe\ninsert: [{effect: CoulombFriction, remedy: LearnedCorrection, at: x_axis}]\n"
    with pytest.raises(LessonError) as caught:
        validated(LessonSettings, source_of(text, "mine.yaml"))
    assert str(caught.value) == "mine.yaml:3:10: 'effect' and 'remedy' exclude each other. Write one of them."
