"""The compiler's inner passes and intrinsics are used: only versions with which the bits and the lanes were tried are taken."""

from __future__ import annotations

import tomllib
from importlib.metadata import version
from pathlib import Path

TRIED = ("0.63.1", "0.68.1")
"""The oldest and the newest version of numba with which this folder's tests have run; a newer minor one is tried first."""


def test_the_requirement_ends_behind_the_newest_version_that_was_tried() -> None:
    with (Path(__file__).parents[2] / "pyproject.toml").open("rb") as file:
        requirements = tomllib.load(file)["project"]["dependencies"]
    major, minor, _ = TRIED[-1].split(".")
    assert f"numba>={TRIED[0]},<{major}.{int(minor) + 1}" in requirements


def test_the_version_here_is_one_of_those() -> None:
    found, oldest, newest = (tuple(map(int, text.split(".")[:2])) for text in (version("numba"), *TRIED))
    assert oldest <= found <= newest
