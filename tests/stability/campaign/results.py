"""Results of a campaign as lines of JSON, appended one by one, so that a stop loses nothing and a second start goes on."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

Case = tuple[str, int]
"""A group of cases and a number in it."""


def collected(path: Path, cases: Iterable[Case], measure: Callable[[str, int], dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the results of all cases; those that the file holds already are not measured again."""
    asked = list(cases)
    found: dict[Case, dict[str, Any]] = {}
    if path.exists():
        for line in path.read_text(encoding="utf-8").splitlines():
            row = json.loads(line)
            found[row["group"], row["case"]] = row
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a", encoding="utf-8") as file:
        for group, number in asked:
            if (group, number) in found:
                continue
            begun = time.process_time()
            row = {"group": group, "case": number, **measure(group, number), "cpu_s": round(time.process_time() - begun, 2)}
            file.write(json.dumps(row) + "\n")
            file.flush()
            found[group, number] = row
    return [found[case] for case in asked]
