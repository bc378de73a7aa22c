"""The lessons there are: one's own first, then those that came along."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from lathesim.shipped import shipped_folder


def lesson_files(folder: Path | None = None) -> Iterator[Path]:
    """Return the lesson files in ``./lesson_configs`` and those that came with lathesim, or those in a folder; each name once."""
    seen: set[str] = set()
    for place in [folder] if folder is not None else [Path("lesson_configs"), shipped_folder("lesson_configs")]:
        for path in sorted([*place.glob("*.yaml"), *place.glob("*.yml")]):
            if path.name not in seen:
                seen.add(path.name)
                yield path
