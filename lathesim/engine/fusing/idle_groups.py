"""``grouped``: what idles together is skipped together.

A part that may idle has a branch beside each of its laws (see :mod:`lathesim.engine.fusing.fuse`). A diagnosis puts dozens of them into
a machine, and nearly all of them idle in any one run. Branches that follow each other then have one before them that skips them all::

    if idle_0:                        if a__idle:
        a__outgoing = x                   a__outgoing = x
        b__outgoing = a__outgoing     else:
    else:                                 ...
        if a__idle: ...               if b__idle:
        if b__idle: ...                   ...
"""

from __future__ import annotations

import re

_TEST = re.compile(r"( *)if (\w+__idle):")
_FEWEST = 2
_MOST = 6
"""Branches that are skipped together: with more of them it is rarer that all idle."""


def grouped(lines: list[str]) -> tuple[list[str], list[str]]:
    """Return a function's lines with its idle branches in groups, and the lines that define what they ask, ``idle_0 = a and b ...``."""
    made: list[str] = []
    names: dict[tuple[str, ...], str] = {}
    run: list[list[str]] = []
    depth = ""
    place = 0
    while place < len(lines):
        found = _TEST.fullmatch(lines[place])
        if found is None or found[1] != depth:
            made += _together(run, names, depth)
            run, depth = [], found[1] if found else ""
        if found is None:
            made.append(lines[place])
            place += 1
            continue
        end = place + 1
        while end < len(lines) and (_deeper(lines[end], depth) or lines[end].startswith((f"{depth}else:", f"{depth}elif "))):
            end += 1
        run.append(lines[place:end])
        place = end
    made += _together(run, names, depth)
    return made, [f"{name} = {' and '.join(parts)}" for parts, name in names.items()]


def _together(run: list[list[str]], names: dict[tuple[str, ...], str], depth: str) -> list[str]:
    made: list[str] = []
    for first in range(0, len(run), _MOST):
        branches = run[first : first + _MOST]
        parts = tuple(dict.fromkeys(branch[0].strip()[3:-1] for branch in branches))
        if len(branches) < _FEWEST:
            made += [line for branch in branches for line in branch]
            continue
        name = names.setdefault(parts, f"idle_{len(names)}")
        idle = [line for branch in branches for line in _first_body(branch, depth) if line.strip() != "pass"]
        made += [f"{depth}if {name}:", *(idle or [f"{depth}    pass"]), f"{depth}else:"]
        made += [f"    {line}" for branch in branches for line in branch]
    return made


def _first_body(branch: list[str], depth: str) -> list[str]:
    body = []
    for line in branch[1:]:
        if not _deeper(line, depth):
            break
        body.append(line)
    return body


def _deeper(line: str, depth: str) -> bool:
    return line.startswith(f"{depth}    ")
