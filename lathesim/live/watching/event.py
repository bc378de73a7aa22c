"""What a watch tells."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Event:
    """Something to tell: ``kind`` (learnt, change, drift, recording, values, range, verdict, continued, growth, forecast, end), ``time``
    [s], a sentence, and the same as plain data."""

    kind: str
    time: float
    sentence: str
    data: Mapping[str, Any]
