"""The text of a part program, for reading."""

from __future__ import annotations

from pathlib import Path

_MOST_BYTES = 20_000_000


def program_lines(path: Path | None) -> list[str]:
    """Return the lines of a part program; one sentence where it cannot be read."""
    if path is None:
        return ["This lesson has no part program."]
    try:
        with path.open("rb") as file:
            data = file.read(_MOST_BYTES + 1)
    except OSError as error:
        return [f"{path}: {error.strerror}."]
    lines = data[:_MOST_BYTES].decode("utf-8", errors="replace").replace("\t", "    ").splitlines()
    if len(data) > _MOST_BYTES:
        lines.append(f"Only the first {_MOST_BYTES // 1_000_000} MB are shown.")
    return ["".join(character if character.isprintable() else "�" for character in line) for line in lines]
