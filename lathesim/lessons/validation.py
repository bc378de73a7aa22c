"""Data against the schema, with each fault told as ``file:line:column``, fact, nearest key."""

from __future__ import annotations

import types
import typing
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from lathesim.errors import LessonError, nearest
from lathesim.lessons.yaml_source import Location, YamlFile, kind_of

Model = TypeVar("Model", bound=BaseModel)


def validated(model: type[Model], source: YamlFile) -> Model:
    """Return ``source`` as ``model``, or raise its first fault in the order of the file (:class:`LessonError`)."""
    try:
        return model.model_validate(source.data)
    except ValidationError as error:
        raise _fault(model, source, min(error.errors(include_url=False), key=lambda details: _order(source, details))) from None


def _order(source: YamlFile, details: Any) -> tuple[bool, int, int]:
    """Return the order of telling: by place, what is missing last (a misspelt key tells more than the lack of the right one)."""
    location: Location = tuple(item for item in details["loc"] if item != "[key]")
    missing = details["type"] == "missing"
    line, column = source.place(location[:-1] if missing else location, key=details["type"] == "extra_forbidden").rsplit(":", 2)[-2:]
    return missing, int(line), int(column)


def _fault(model: type[BaseModel], source: YamlFile, details: Any) -> LessonError:
    location: Location = tuple(item for item in details["loc"] if item != "[key]")
    kind = str(details["type"])
    last = location[-1] if location else ""
    found = kind_of(details.get("input"))
    if kind == "extra_forbidden":
        names = _keys(model, location[:-1])
        remedy = nearest(str(last), names) or f"Known here: {', '.join(names)}."
        if " " in str(last):
            remedy = "Put a text that holds a comma or a colon in quotes."
        return LessonError(f"there is no key '{last}' here.", place=source.place(location, key=True), remedy=remedy)
    if kind == "missing":
        return LessonError(f"the key '{last}' is missing.", place=source.place(location[:-1]), remedy=f"Write '{last}: ...'.")
    if kind == "string_pattern_mismatch":
        place = source.place(location, key=details["loc"][-1:] == ("[key]",))
        return LessonError(
            f"'{details['input']}' names no part and item.", place=place, remedy="Write it as part.name, for example x_axis.position."
        )
    place = source.place(location)
    if kind in ("quantity", "text", "insert", "goal", "question", "time", "switch", "tool_point"):
        return LessonError(str(details["msg"]), place=place)
    if kind.startswith(("int_", "greater_than", "less_than")):
        least = 0 if last == "seed" else 1
        return LessonError(f"'{last}' is {found}, and a whole number of {least} or more is expected.", place=place)
    if kind.startswith("float_"):
        return LessonError(f"'{last}' is {found}, and a number is expected.", place=place)
    if kind in ("dict_type", "model_type", "model_attributes_type"):
        return LessonError(
            f"'{last}' is {found}, and keys with values are expected.", place=place, remedy="Write 'key: value' lines, indented."
        )
    if kind == "list_type":
        return LessonError(f"'{last}' is {found}, and a list is expected.", place=place, remedy="Write it as [first, second].")
    if kind == "bool_type":
        return LessonError(f"'{last}' is {found}, and true or false is expected.", place=place)
    if kind == "literal_error":
        return LessonError(f"'{last}' is {found}, and {details['ctx']['expected']} is expected.", place=place)
    return LessonError(f"{details['msg']} (for '{last}').", place=place)


def _keys(model: type[BaseModel], location: Location) -> list[str]:
    """Return the keys a mapping at ``location`` may have."""
    current: Any = model
    for item in location:
        current = _step(current, item)
    current = _unwrapped(current)
    if isinstance(current, type) and issubclass(current, BaseModel):
        return [field.alias or name for name, field in current.model_fields.items()]
    return []


def _step(current: Any, item: str | int) -> Any:
    current = _unwrapped(current)
    if isinstance(current, type) and issubclass(current, BaseModel):
        for name, field in current.model_fields.items():
            if item in (name, field.alias):
                return field.annotation
        return None
    arguments = typing.get_args(current)
    return arguments[-1] if arguments else None


def _unwrapped(annotation: Any) -> Any:
    """Return the annotation without ``Annotated`` and without ``| None``."""
    while True:
        if typing.get_origin(annotation) is typing.Annotated:
            annotation = typing.get_args(annotation)[0]
        elif typing.get_origin(annotation) in (typing.Union, types.UnionType):
            annotation = next(item for item in typing.get_args(annotation) if item is not type(None))
        else:
            return annotation
