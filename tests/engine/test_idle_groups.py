"""Branches of parts that idle are skipped together, and what they give stays what it was."""

from __future__ import annotations

from typing import Any

from lathesim.engine.fuse import grouped


def branch(part: str, source: str) -> list[str]:
    """A part that passes on its source where it idles, and adds one where it does not."""
    return [f"if {part}__idle:", f"    {part} = {source}", "else:", f"    {part} = {source} + 1.0"]


CHAIN = [*branch("a", "x"), *branch("b", "a"), *branch("c", "b")]


def run(lines: list[str], idle: dict[str, bool]) -> float:
    """Return what a chain makes of 10 (the text is this file's own)."""
    text = "\n".join(["def chain(x, a__idle, b__idle, c__idle):", *[f"    {line}" for line in lines], "    return c"])
    variables: dict[str, Any] = {}
    exec(text, variables)  # noqa: S102 - the text of this file
    return float(variables["chain"](10.0, *(idle[part] for part in "abc")))


def test_a_chain_gives_the_same_whoever_idles() -> None:
    made, asked = grouped(CHAIN)
    assert asked == ["idle_0 = a__idle and b__idle and c__idle"]
    for number in range(8):
        idle = {part: bool(number >> place & 1) for place, part in enumerate("abc")}
        assert run([*asked, *made], idle) == run(CHAIN, idle)


def test_what_idles_together_is_one_branch() -> None:
    made, _ = grouped(CHAIN)
    assert made[:5] == ["if idle_0:", "    a = x", "    b = a", "    c = b", "else:"]


def test_a_branch_by_itself_and_other_lines_stay_as_they_are() -> None:
    lines = [*branch("a", "x"), "y = a * 2.0", *branch("b", "y"), "for k in range(3):", *[f"    {line}" for line in branch("c", "b")]]
    assert grouped(lines) == (lines, [])


def test_a_long_chain_is_cut_into_pieces() -> None:
    parts = "abcdefgh"
    lines = [line for part, source in zip(parts, "x" + parts, strict=False) for line in branch(part, source)]
    _, asked = grouped(lines)
    assert [len(line.split(" and ")) for line in asked] == [6, 2]


def test_the_same_parts_are_asked_about_once() -> None:
    again = [line.replace("a =", "aa =").replace("b =", "bb =").replace("c =", "cc =") for line in CHAIN]
    assert len(grouped([*CHAIN, "y = 1.0", *again])[1]) == 1
