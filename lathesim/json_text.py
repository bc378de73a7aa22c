"""Read JSON from users: every text that cannot be read raises ValueError."""

from __future__ import annotations

import json
from typing import Any


def parsed_json(text: str | bytes) -> Any:
    """Return the value of a JSON text. Raises ValueError if it is no JSON or is nested deeper than the recursion limit of Python."""
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError("the JSON text is nested too deeply") from None
