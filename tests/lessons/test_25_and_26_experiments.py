"""Lessons 25 and 26: the program that tells, scored in seconds."""

import pytest

from lathesim.analysis.metric import measure
from lathesim.lessons.grading import judge
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import simulate
from lathesim.plugins import load_registry

MET = {
    ("25_which_program_next", "one_way"): [False, False, False],
    ("25_which_program_next", "exercise"): [True, True, False],
    ("25_which_program_next", "designed"): [True, False, False],
    ("26_two_suspects_one_run", "yours"): [False, False, False],
    ("26_two_suspects_one_run", "exercise"): [True, True, False],
    ("26_two_suspects_one_run", "theirs"): [True, True, False],
}
"""Case -> whether it turns round often enough, is fast enough, and is short enough."""


@pytest.mark.parametrize("case", MET, ids=" ".join)
def test_the_designed_program_turns_round_often_enough_and_a_shorter_one_is_asked_for(case: tuple[str, str]) -> None:
    lesson, registry = load_lesson(case[0]), load_registry(installed=False)
    record = simulate(lesson, registry, case[1], engine="compiled")
    measured = measure(record, registry.metrics)
    assert [result.met for result in judge(lesson.settings.goals, measured.values, measured.skipped)] == MET[case]
