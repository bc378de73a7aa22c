"""A law's body in place of its call: the same values, early returns, names that do not meet, and what has to be called."""

from __future__ import annotations

import itertools
import textwrap

import pytest

from lathesim.engine.fusing.law_in_place import body_in_place

LAW = """
def law(depth, speed):
    slow = speed < 1.0
    if depth <= 0.0:
        return (0.0, 1.0 if slow else 2.0)
    if slow:
        speed = 1.0
        feed = depth / speed
    else:
        feed = depth
        for _ in range(2):
            feed = feed + speed
    return (feed, feed * speed)
"""


def executed(source: str, **variables: object) -> dict[str, object]:
    exec(source, variables)  # noqa: S102 - the text of these tests
    return variables


def in_place(source: str, targets: list[str], **arguments: str) -> list[str] | None:
    return body_in_place(textwrap.dedent(source), arguments, targets, "part__output__")


def test_a_body_in_place_gives_what_the_call_gives() -> None:
    lines = in_place(LAW, ["part__feed", "part__power"], depth="d", speed="s")
    assert lines is not None
    law = executed(LAW)["law"]
    assert callable(law)
    for depth, speed in itertools.product((-1.0, 0.0, 0.5), (0.5, 1.0, 3.0)):
        found = executed("\n".join(lines), d=depth, s=speed)
        assert (found["part__feed"], found["part__power"]) == law(depth, speed)
        assert (found["d"], found["s"]) == (depth, speed)


def test_what_follows_an_early_return_stands_in_an_else_and_results_take_the_names_of_their_targets() -> None:
    source = """
    def law(depth):
        if depth < 0.0:
            return (0.0, 0.0)
        root = math.sqrt(depth)
        area = root * depth
        return (area, 1.0)
    """
    assert in_place(source, ["cut__area", "cut__touching"], depth="axis__depth") == [
        "if axis__depth < 0.0:",
        "    cut__area = 0.0",
        "    cut__touching = 0.0",
        "else:",
        "    part__output__root = math.sqrt(axis__depth)",
        "    cut__area = part__output__root * axis__depth",
        "    cut__touching = 1.0",
    ]


def test_targets_that_read_one_another_are_assigned_at_once() -> None:
    source = """
    def law(x):
        first = x + 1.0
        if x > 0.0:
            return (0.0, first * 2.0)
        return (first, 1.0)
    """
    lines = in_place(source, ["a", "b"], x="x")
    assert lines is not None
    found = executed("\n".join(lines), x=3.0)
    assert (found["a"], found["b"]) == (0.0, 8.0)


@pytest.mark.parametrize(
    "body",
    [
        "while x > 1.0:\n    x = x - 1.0\nreturn x",
        "for _ in range(3):\n    if x > 1.0:\n        return 1.0\nreturn x",
        "return float(f'{x}')",
        "return max([item for item in (x, 1.0)])",
        "if x > 0.0:\n    return 1.0",
    ],
    ids=["may run on", "returns from a loop", "text", "a list", "no return at the end"],
)
def test_what_has_to_be_called(body: str) -> None:
    assert in_place("def law(x):\n" + textwrap.indent(body, "    "), ["part__y"], x="v") is None
