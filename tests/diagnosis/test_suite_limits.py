"""How near right and wrong answers come to each limit: noted by a diagnosis, kept beside its answer, told as a table."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lathesim.diagnosis.diagnose import ask, diagnose
from lathesim.diagnosis.method import STANDARD
from lathesim.diagnosis.records.diagnosis import as_json
from lathesim.identification.replay.loading import Recorded
from tests.diagnosis.pushed_table import EFFECTS, Hidden, machine, recording
from tests.diagnosis.suite.limits import Near, near, table
from tests.diagnosis.suite.runner import answer_file, margins_file
from tests.diagnosis.suite.traced import traced


def test_a_traced_limit_decides_as_the_limit_does_and_notes_the_margin() -> None:
    method, noted = traced(STANDARD)
    limit = method.shared.larger_part
    values = np.array([0.2, 0.8])
    assert (limit > 0.3, np.float64(0.3) < limit, limit < 0.3, 2.0 * limit < 1.2) == (True, True, False, True)
    assert list(values > limit) == [False, True]
    assert limit == STANDARD.shared.larger_part
    found = noted["shared.larger_part"]
    assert (found.below, found.above) == (pytest.approx(0.6), pytest.approx(1.2))
    assert noted["shared.nearly_all"].times_below == 0


@pytest.mark.slow
def test_a_traced_diagnosis_gives_the_same_answer() -> None:
    recordings = tuple(Recorded(f"{seed}.csv", recording(Hidden(dry=8.0), seed=seed), ()) for seed in (1, 2))
    question = ask("A table", machine(), recordings, EFFECTS)
    method, noted = traced(question.method)
    plain, told = (as_json(diagnose(one)) for one in (question, replace(question, method=method)))
    for answer in (plain, told):
        answer["wall_time_s"] = None
    assert plain == told
    asked = {name for name, one in noted.items() if one.times_below or one.times_above}
    assert {"explaining.errors", "largest_size", "share_of_all", "verdict.within_laws"} <= asked


def case_of(folder: Path, name: str, statistic: float, verdict: str) -> Path:
    """Write a case in which nothing is hidden, and an answer with the margin of one limit."""
    case, answers = folder / "cases" / name, folder / "answers"
    case.mkdir(parents=True)
    answers.mkdir(exist_ok=True)
    truth = {"rig": "axis", "category": "control", "poor": "", "effects": [], "fault": None, "recordings": []}
    (case / "truth.json").write_text(json.dumps(truth), encoding="utf-8")
    margins = margins_file(answers, name)
    margins.parent.mkdir(exist_ok=True)
    noted = statistic / STANDARD.shared.larger_part
    margins.write_text(json.dumps({"shared.larger_part": [noted, None] if noted <= 1.0 else [None, noted]}), encoding="utf-8")
    effects = [{"effect": "CoulombFriction", "at": "x", "probability": 1.0, "tied_with": [], "parameters": {}, "family": "friction"}]
    named = effects if verdict == "named" else []
    answer = {"verdict": verdict, "effects": named, "removed_share": 0.0, "location": {"components": []}}
    answer_file(answers, name).write_text(json.dumps({"seconds": 1.0, "answer": answer, "error": ""}), encoding="utf-8")
    return case


def test_the_table_tells_how_near_right_and_wrong_cases_come(tmp_path: Path) -> None:
    folders = [case_of(tmp_path, "case_000", 0.25, "no_mismatch"), case_of(tmp_path, "case_001", 1.0, "named")]
    found = near(folders, tmp_path / "answers")
    assert found["shared.larger_part"] == Near({True: [0.5], False: []}, {True: [], False: [2.0]})
    first = table(found)[2]
    assert first == "| shared.larger_part | 0.5 share | derived | 0.5 (1) | - | - | 2 (1) | 1 right, 1 wrong |"
