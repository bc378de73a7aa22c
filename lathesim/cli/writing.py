"""How every command writes its result: as JSON for programs, as lines and tables for a person, as CSV for a spreadsheet."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import click

Command = TypeVar("Command", bound=Callable[..., Any])

STOPPED = 130
"""Exit code of work that Ctrl-C ended."""


@dataclass(frozen=True)
class Result:
    """What a command found: ``data`` for programs, ``lines`` for a person, and the figure that was drawn of it.

    Values of ``data`` may be numbers, texts, paths, arrays, dataclasses, and mappings and sequences of them. ``lines`` are only made where
    a person reads them. ``code`` is the exit code.
    """

    schema: str
    data: Mapping[str, Any]
    lines: Iterable[str]
    drawn: Path | None = None
    code: int = 0


def json_option(schema: str) -> Callable[[Command], Command]:
    """Return the option ``--json`` of a command that writes a result of a schema."""
    return click.option("--json", "as_json", is_flag=True, help=f"Write the result as JSON (schema {schema}) and nothing else.")


def write(result: Result, as_json: bool) -> int:
    """Write a result to the output and return its exit code."""
    if as_json:
        click.echo(json.dumps(plain({"schema": result.schema, **result.data}), indent=2))
    else:
        for line in result.lines:
            click.echo(line)
        if result.drawn is not None:
            click.echo(f"See {result.drawn}")
    return result.code


def plain(value: Any) -> Any:
    """Return a value as JSON has it: dataclasses by their fields, arrays as lists, and nothing for what is no finite number."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    elif hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, str):
        return value
    if isinstance(value, Sequence):
        return [plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return str(value) if isinstance(value, Path) else value
