"""A law's body in place of its call: the same values, early returns, names that do not meet, and what has to be called."""

from __future__ import annotations

import ast
import itertools
import textwrap

import pytest

from lathesim.engine.law_text import NotInPlaceError, in_place

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


def written(source: str, targets: list[str], *arguments: str) -> str:
    law = ast.parse(textwrap.dedent(source)).body[0]
    assert isinstance(law, ast.FunctionDef)
    given = [ast.parse(argument, mode="eval").body for argument in arguments]
    return "\n".join(ast.unparse(statement) for statement in in_place(law, given, targets, "part__"))


def test_a_body_in_place_gives_what_the_call_gives() -> None:
    text = written(LAW, ["feed", "power"], "d", "s + 0.0")
    law = executed(LAW)["law"]
    assert callable(law)
    for depth, speed in itertools.product((-1.0, 0.0, 0.5), (0.5, 1.0, 3.0)):
        found = executed(text, d=depth, s=speed)
        assert (found["feed"], found["power"]) == law(depth, speed)
        assert (found["d"], found["s"]) == (depth, speed)


def test_targets_that_a_law_still_reads_are_assigned_at_once() -> None:
    source = """
    def law(a, b):
        if a > 0.0:
            return (b, a)
        return (a, a)
    """
    found = executed(written(source, ["a", "b"], "a", "b"), a=3.0, b=8.0)
    assert (found["a"], found["b"]) == (8.0, 3.0)


@pytest.mark.parametrize("body", ["for _ in range(3):\n    if x > 1.0:\n        return 1.0\nreturn x", "if x > 0.0:\n    return 1.0"])
def test_what_has_to_be_called(body: str) -> None:
    with pytest.raises(NotInPlaceError):
        written("def law(x):\n" + textwrap.indent(body, "    "), ["y"], "v")
