"""An RK4 step written for plain Python: what becomes of its text, line by line."""

from __future__ import annotations

import ast

from lathesim.engine.fusing.plain_step import plain_step, stage_table

STEP = """
for substep in range(steps):
    x__speed__stage = x__speed
    x__travel__stage = x__travel
    x__speed__sum = -0.0
    x__travel__sum = -0.0
    for weight, reach in stages:
        {laws}
        x__speed__sum = x__speed__sum + weight * x__speed__rate
        x__travel__sum = x__travel__sum + weight * x__speed__stage
        x__travel__stage = x__travel + reach * x__speed__stage
        x__speed__stage = x__speed + reach * x__speed__rate
    x__speed = x__speed + sixth * x__speed__sum
    x__travel = x__travel + sixth * x__travel__sum
"""


RK4 = "stages = ((1.0, half), (2.0, half), (2.0, step), (1.0, half))"
HEUN = "stages = ((1.0, step), (1.0, step))"


def step(*laws: str, table: str = RK4) -> list[str]:
    """Return the lines of a step with these laws in its stages."""
    loop = ast.parse(STEP.format(laws="\n        ".join(laws))).body[0]
    block = ast.parse(f"def run_block():\n    {table}").body[0]
    assert isinstance(block, ast.FunctionDef)
    plain_step(loop, stage_table(block))
    return [line.strip() for line in ast.unparse(loop).splitlines()[1:]]


def test_four_stages_stand_one_after_the_other() -> None:
    assert step("x__speed__rate = force - x__speed__stage * x__travel__stage") == [
        "x__speed__rate_1 = force - x__speed * x__travel",
        "x__travel__stage_2 = x__travel + half * x__speed",
        "x__speed__stage_2 = x__speed + half * x__speed__rate_1",
        "x__speed__rate_2 = force - x__speed__stage_2 * x__travel__stage_2",
        "x__travel__stage_3 = x__travel + half * x__speed__stage_2",
        "x__speed__stage_3 = x__speed + half * x__speed__rate_2",
        "x__speed__rate_3 = force - x__speed__stage_3 * x__travel__stage_3",
        "x__travel__stage_4 = x__travel + step * x__speed__stage_3",
        "x__speed__stage_4 = x__speed + step * x__speed__rate_3",
        "x__speed__rate_4 = force - x__speed__stage_4 * x__travel__stage_4",
        "x__travel = x__travel + sixth * (x__speed + 2.0 * x__speed__stage_2 + 2.0 * x__speed__stage_3 + x__speed__stage_4)",
        "x__speed = x__speed + sixth * (x__speed__rate_1 + 2.0 * x__speed__rate_2 + 2.0 * x__speed__rate_3 + x__speed__rate_4)",
    ]


def test_another_table_is_another_method() -> None:
    assert step("x__speed__rate = force - x__speed__stage", table=HEUN) == [
        "x__speed__rate_1 = force - x__speed",
        "x__travel__stage_2 = x__travel + step * x__speed",
        "x__speed__stage_2 = x__speed + step * x__speed__rate_1",
        "x__speed__rate_2 = force - x__speed__stage_2",
        "x__travel = x__travel + sixth * (x__speed + x__speed__stage_2)",
        "x__speed = x__speed + sixth * (x__speed__rate_1 + x__speed__rate_2)",
    ]
    assert "for weight, reach in stages:" in step("x__speed__rate = force - x__speed__stage", table="stages = some_method")


def test_a_long_stage_stays_a_loop() -> None:
    laws = [f"if x__speed__stage > {number}.0: force = {number}.0" for number in range(120)]
    assert "for weight, reach in stages:" in step("force = 0.0", *laws, "x__speed__rate = force - x__speed__stage")


def test_what_is_read_once_stands_where_it_is_read() -> None:
    laws = ["drag = k * x__speed__stage", "touching = a > b or c", "if not touching:", "    drag = 0.0", "x__speed__rate = drag"]
    assert step(*laws)[:4] == ["drag = k * x__speed", "if not (a > b or c):", "drag = 0.0", "x__speed__rate_1 = drag"]
    assert step("force = k * x__travel__stage", "force = force - x__speed__stage", "x__speed__rate = force / mass")[:1] == [
        "x__speed__rate_1 = (k * x__travel - x__speed) / mass"
    ]


def test_what_might_raise_does_not_move_into_a_branch() -> None:
    lines = step("share = k / x__travel__stage", "x__speed__rate = share if touching else 0.0")
    assert lines[:2] == ["share = k / x__travel", "x__speed__rate_1 = share if touching else 0.0"]


def test_an_if_that_a_branch_decides_stands_inside_the_branches() -> None:
    lines = step(
        "if x__travel__stage > stock:", "    engaged = 0.0", "else:", "    depth = stock - x__travel__stage", "    engaged = 1.0",
        "if engaged < 0.5 or depth <= 0.0:", "    force = 0.0", "else:", "    force = k * depth",
        "x__speed__rate = force - x__speed__stage",
    )  # fmt: skip
    assert lines[:9] == [
        "if x__travel > stock:", "force = 0.0", "else:", "depth = stock - x__travel",
        "if depth <= 0.0:", "force = 0.0", "else:", "force = k * depth", "x__speed__rate_1 = force - x__speed",
    ]  # fmt: skip


def test_what_is_written_twice_is_computed_once_where_it_is_computed_in_any_case() -> None:
    square = "x__speed__stage * x__speed__stage"
    lines = step(f"x__speed__rate = {square} + math.sqrt({square} + small)")
    assert lines[:2] == ["common_1 = x__speed * x__speed", "x__speed__rate_1 = common_1 + math.sqrt(common_1 + small)"]
    assert not any("common" in line for line in step(f"x__speed__rate = {square} if a > 0.0 else {square}"))


def test_the_magnitude_of_a_state_is_a_choice_that_gives_the_bits_of_abs() -> None:
    lines = step("x__speed__rate = abs(x__speed__stage) - abs(force)")
    assert lines[0] == "x__speed__rate_1 = (x__speed if x__speed > 0.0 else 0.0 - x__speed) - abs(force)"
    for speed in (-1.5, -0.0, 0.0, 2.5, float("-inf"), 5e-324):
        assert (speed if speed > 0.0 else 0.0 - speed).hex() == abs(speed).hex()
