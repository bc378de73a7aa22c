"""Whether a file is whole, by what its ending promises."""

from __future__ import annotations

import ast
import csv
import json
from pathlib import Path

import yaml


def half_files(folder: Path) -> list[str]:
    """Return a sentence for each file of a folder that is not whole; parts of a process that was killed do not count."""
    found = []
    for path in sorted(folder.rglob("*")):
        if path.is_file() and not path.name.endswith(".part"):
            try:
                _read(path)
            except Exception as error:
                found.append(f"{path.relative_to(folder)}: {type(error).__name__}: {error}"[:200])
    return found


def left_parts(folder: Path) -> list[str]:
    """Return the parts that lie in a folder."""
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*.part"))


def _read(path: Path) -> None:
    kind = path.suffix
    if kind == ".h5":
        from lathesim.record import load

        load(path)
    elif kind == ".json":
        json.loads(path.read_text(encoding="utf-8"))
    elif kind == ".mat":
        import scipy.io

        scipy.io.loadmat(path)
    elif kind == ".png":
        import matplotlib.image

        matplotlib.image.imread(path)
    elif kind == ".csv":
        _read_rows(path)
    else:
        _read_text(path, path.read_text(encoding="utf-8"))


def _read_rows(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    _ends(text, "\n")
    lengths = {len(row) for row in csv.reader(line for line in text.splitlines() if not line.startswith("#"))}
    if len(lengths) != 1:
        raise ValueError(f"rows of {sorted(lengths)} cells")


def _read_text(path: Path, text: str) -> None:
    if path.suffix in (".yaml", ".yml"):
        _ends(text, "\n")
        yaml.safe_load(text)
    elif path.suffix == ".html":
        _ends(text.rstrip(), "</html>")
    elif path.suffix == ".svg":
        _ends(text.rstrip(), "</svg>")
    elif path.suffix == ".py":
        ast.parse(text)
    elif text:
        _ends(text, "\n")


def _ends(text: str, ending: str) -> None:
    if not text.endswith(ending):
        raise ValueError(f"it does not end with {ending!r}")
