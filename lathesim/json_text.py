"""JSON that people hand in: what cannot be read is a ValueError, whatever Python makes of it."""

from __future__ import annotations

import json
from typing import Any


def parsed_json(text: str | bytes) -> Any:
    """Return what a JSON text holds. Raises ValueError where it is no JSON, or is nested deeper than Python can follow."""
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError("the JSON text is nested too deeply") from None
