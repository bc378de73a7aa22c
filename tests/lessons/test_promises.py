"""Goals, published values, uncertainties and recordings are held against the machine and the metrics before anything runs."""

from pathlib import Path

import pytest

from lathesim.analysis.metric import Metric
from lathesim.errors import LatheSimError
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare
from tests.lessons.small_machine import small_registry, write_lesson

RECORDED = "recordings:\n  time: {rate: 10 Hz}\n"
WRONG = {
    "goal of no metric": (
        "goals: [{metric: largest_errr, at_most: 1 mm}]",
        "4:18: there is no metric 'largest_errr'. Did you mean 'largest_error'?",
    ),
    "goal in another unit": (
        "goals: [{metric: largest_error, at_most: 1 s}]",
        "4:42: '1 s' is given in s, but m is wanted. Use a unit like m.",
    ),
    "published value of no metric": ("published: {error: 1 mm}", "4:13: there is no metric 'error'. There are largest_error."),
    "published value without unit": (
        "variants: {I: {published: {largest_error: 1}}}",
        "4:43: '1' has no unit. Write it with one, for example '1 m'.",
    ),
    "uncertain name": ("uncertain: {table.mas: 5 %}", "4:13: table has no parameter 'mas'. Did you mean 'mass'?"),
    "uncertain output": ("uncertain: {table.position: 5 %}", "4:13: table.position is an output, not a parameter."),
    "uncertain in another unit": ("uncertain: {table.mass: 5 mm}", "4:25: '5 mm' is given in mm, but kg is wanted. Use a unit like kg."),
    "compared with no output": (
        f"{RECORDED}  compare: {{table.positon: {{column: q, unit: m}}}}",
        "6:13: table has no output 'positon'. Did you mean 'position'?",
    ),
    "compared in another unit": (
        f"{RECORDED}  compare: {{table.position: {{column: q, unit: V}}}}",
        "6:47: the column is given in V, and m is wanted. Use a unit like m.",
    ),
    "resolution in another unit": (
        f"{RECORDED}  compare: {{table.position: {{column: q, unit: m, resolution: 1 s}}}}",
        "6:62: '1 s' is given in s, but m is wanted. Use a unit like m.",
    ),
    "driven where there is no part": (
        f"{RECORDED}  drive: {{tabel.force: {{column: f, unit: N}}}}",
        "6:11: there is no part 'tabel'. Did you mean 'table'?",
    ),
    "rate without unit": ("recordings: {time: {rate: 10}}", "4:27: '10' has no unit. Write it with one, for example '10 Hz'."),
    "time by nothing": ("recordings: {time: {unit: s}}", "4:20: the time needs exactly one of 'column' and 'rate'."),
}


@pytest.mark.parametrize("kind", WRONG)
def test_a_promise_nothing_can_keep_is_refused(kind: str, tmp_path: Path) -> None:
    body, sentence = WRONG[kind]
    path = write_lesson(tmp_path, body)
    with pytest.raises(LatheSimError) as refused:
        prepare(load_lesson(path), registry())
    assert str(refused.value) == f"{path}:{sentence}"


def test_promises_that_can_be_kept_pass(tmp_path: Path) -> None:
    body = f"""\
goals: [{{metric: largest_error, at_most: 1 mm, at_least: 0 mm, hint: Push harder.}}]
published: {{largest_error: 0.5 mm}}
uncertain: {{table.mass: 5 %, table.viscous: 20 N*s/m}}
{RECORDED}  drive: {{table.force: {{column: f, unit: kN}}}}
  compare: {{table.position: {{column: q, unit: mm, resolution: 1 um}}}}
"""
    assert prepare(load_lesson(write_lesson(tmp_path, body)), registry()).duration == 0.1


def registry():  # type: ignore[no-untyped-def]
    found = small_registry()
    found.__dict__["metrics"] = {"largest_error": Metric("largest_error", "m", "largest error", lambda record: 0.0)}
    return found
