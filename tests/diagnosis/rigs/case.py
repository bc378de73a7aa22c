"""A case of a rig, of whichever set, and its folders on disk."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from tests.diagnosis.rigs.faults import write_table


class Machine(Protocol):
    """What a case needs to know of its rig."""

    @property
    def name(self) -> str:
        """The name of the rig."""

    @property
    def calibrating(self) -> bool:
        """Whether a limit may be chosen on it."""


RigOfSet = TypeVar("RigOfSet", bound=Machine)


@dataclass(frozen=True)
class Case(Generic[RigOfSet]):
    """One case of one rig: what kind, what is hidden, the seed of its chance, and the descriptions that it is asked in."""

    rig: RigOfSet
    kind: str
    number: int
    keys: tuple[str, ...]
    fault: str
    seed: int
    descriptions: tuple[str, ...]

    @property
    def name(self) -> str:
        """The name of its folder."""
        return f"{self.rig.name}__{self.kind}_{self.number:02d}"


def write_folders(
    case: Case[Any],
    folder: Path,
    tables: Mapping[str, dict[str, np.ndarray]],
    texts: Callable[[str], dict[str, str]],
    truth: dict[str, Any],
) -> list[Path]:
    """Write a folder for each description of a case and return them: its recordings, texts by file name, and truth."""
    common = {"rig": case.rig.name, "calibrating": case.rig.calibrating, "kind": case.kind, "keys": list(case.keys), "fault": case.fault}
    folders = []
    for description in case.descriptions:
        place = folder / f"{case.name}__{description}"
        place.mkdir(parents=True, exist_ok=True)
        for name, table in tables.items():
            write_table(place / name, table)
        for name, text in texts(description).items():
            (place / name).parent.mkdir(exist_ok=True)
            (place / name).write_text(text, encoding="utf-8")
        (place / "truth.json").write_text(json.dumps(common | truth | {"description": description}, indent=1), encoding="utf-8")
        folders.append(place)
    return folders
