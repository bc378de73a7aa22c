"""Read JSON from users, where every text that cannot be read raises ValueError, and write results as JSON."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from lathesim.errors import LatheSimError, RecordingError


def parsed_json(text: str | bytes) -> Any:
    """Return the value of a JSON text. Raises ValueError if it is no JSON or is nested deeper than the recursion limit of Python."""
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError("the JSON text is nested too deeply") from None


def read_json(
    path: Path, schema: str, what: str, key: str = "schema", remedy: str = "Give the file as it was made.",
    fault: type[LatheSimError] = RecordingError,
) -> dict[str, Any]:  # fmt: skip
    """Read a JSON file of a schema that has a ``key``; a ``fault`` with the name of ``what`` it is not where it is something else."""
    try:
        data = parsed_json(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise fault(f"the {what} cannot be read: {error.strerror}.", place=str(path)) from None
    except ValueError:
        raise fault(f"the {what} is no JSON file.", place=str(path), remedy=remedy) from None
    found = data.get("schema") if isinstance(data, dict) else None
    if found != schema or key not in data:
        told = f"has the schema '{found}'" if isinstance(found, str) else "has no schema"
        raise fault(f"the file {told}, and the {what} has the schema {schema}.", place=str(path), remedy=remedy)
    return dict(data)


def written_json(value: Any) -> str:
    """Return a value as the JSON text of a result, indented by two."""
    return json.dumps(plain(value), indent=2)


def digest_of(value: Any) -> str:
    """Return the SHA-256 of a value as JSON with sorted keys, without white space, in ASCII. Source: FIPS 180-4."""
    return hashlib.sha256(json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=True).encode()).hexdigest()


def plain(value: Any, number: Callable[[float], float] = float) -> Any:
    """Return a value as JSON has it: dataclasses by their fields, arrays as lists, and nothing for what is no finite ``number``."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    elif hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): plain(item, number) for key, item in value.items()}
    if isinstance(value, str):
        return value
    if isinstance(value, Sequence):
        return [plain(item, number) for item in value]
    if isinstance(value, float):
        return number(value) if math.isfinite(value) else None
    return str(value) if isinstance(value, Path) else value


def eight_digits(value: Any) -> Any:
    """Return a value as :func:`plain` does, its numbers with eight digits, which are enough for a program that reads a result."""
    return plain(value, lambda number: float(f"{number:.8g}"))
