"""What answers to cases of known truth are worth, the table made of them, and how answers are asked for and kept."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import pytest

from tests.diagnosis import asking
from tests.diagnosis.asking import Answer
from tests.diagnosis.scoring import marks, show, table, wilson

TRUTH = {"case": "a", "column": "table side", "half": "held out", "fault": "", "words": "", "beside": [], "right": {}, "kind": "sound"}
FRICTION = {"effect": "CoulombFriction", "at": "x_axis", "tied_with": ["PreslidingFriction at x_axis"]}
PLAY = {"effect": "Backlash", "at": "x_scale", "tied_with": []}
COULOMB, BRISTLES = {"coulomb": ["CoulombFriction"]}, {"bristles": ["PreslidingFriction"]}
FAULT = {"kind": "fault", "fault": "frozen", "words": "frozen|stuck"}


def answer(verdict: str, *effects: dict[str, Any], **more: Any) -> Answer:
    return Answer({"verdict": verdict, "effects": list(effects), "adequate": True, **more}, 1.0)


@pytest.mark.parametrize(
    ("truth", "told", "right"),
    [
        ({"kind": "sound"}, answer("parameters_only"), [True]),
        ({"kind": "sound"}, answer("unknown"), [False]),
        ({"kind": "sound"}, answer("named", PLAY), [False]),
        ({"kind": "values"}, answer("no_mismatch"), [False]),
        ({"kind": "single", "right": COULOMB}, answer("named", FRICTION), [True, True]),
        ({"kind": "single", "right": BRISTLES}, answer("tied", FRICTION), [True, False]),
        ({"kind": "single", "right": COULOMB}, answer("named", FRICTION, PLAY), [False, False]),
        ({"kind": "single", "right": {"play": ["Backlash"]}, "beside": ["CoulombFriction"]}, answer("named", FRICTION, PLAY), [True, True]),
        ({"kind": "single", "right": COULOMB}, answer("unknown", FRICTION), [False, False]),
        ({"kind": "single", "right": COULOMB}, Answer({}), [False, False]),
        ({"kind": "single", "right": COULOMB, "answerable": False}, answer("unknown"), []),
        ({"kind": "pair", "right": COULOMB | {"play": ["Backlash"]}}, answer("named", PLAY, FRICTION), [True]),
        ({"kind": "pair", "right": COULOMB | {"play": ["Backlash"]}}, answer("named", FRICTION), [False]),
        ({"kind": "outside"}, answer("named", FRICTION), [False, True]),
        ({"kind": "outside"}, answer("named", FRICTION, adequate=False), [True, True]),
        ({"kind": "outside"}, answer("no_mismatch"), [True, False]),
        (FAULT, answer("recording_fault", sentence="x_encoder.position is stuck."), [True]),
        (FAULT, answer("recording_fault", sentence="x_encoder.position is late."), [False]),
        (FAULT, answer("unknown", sentence="x_encoder.position is stuck."), [False]),
        (FAULT | {"fault": "rows"}, answer("named", {"effect": "ChannelTimeShift", "at": "x_encoder"}), [True]),
        ({"kind": "input", "fault": "sine"}, answer("unknown", sentence="a sine", location={"components": ["x_dac"]}), [True]),
        ({"kind": "input", "fault": "sine"}, answer("unknown", sentence="a step", location={"components": ["x_dac"]}), [False]),
    ],
)
def test_what_an_answer_is_worth(truth: dict[str, Any], told: Answer, right: list[bool]) -> None:
    assert list(marks(TRUTH | truth, told).values()) == right


def test_the_table_counts_answers_and_cases_that_are_right_in_every_description() -> None:
    quiet, doubted = (TRUTH, answer("no_mismatch")), (TRUTH | {"column": "motor side"}, answer("unknown"))
    rows = table([quiet, doubted]).splitlines()
    assert rows[0] == "| asked | table side | motor side |"
    assert rows[2] == "| sound called sound | 1/1 (21 to 100 %) | 0/1 (0 to 79 %) |"
    assert "| sound called sound | 0/1 (0 to 79 %) |" in rows
    assert "Same verdict and names in every description: 0 of 1 cases." in rows
    assert "Sound machines: no_mismatch 1, unknown 1." in rows
    assert rows[-2:] == ["Misses: 1", "- a motor side sound - | unknown: - | WRONG sound called sound | 1 s"]


def test_the_interval_of_a_share() -> None:
    """E. B. Wilson's interval; 8 of 10 as in Brown, Cai, DasGupta, Statistical Science 16 (2001)."""
    assert wilson(8, 10) == pytest.approx((0.490, 0.943), abs=1e-3)
    assert wilson(0, 0) == (0.0, 1.0)


def test_each_case_is_asked_once_and_two_runs_are_compared(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    parser = argparse.ArgumentParser()
    asking.options(parser)
    folders = [tmp_path / name for name in ("a", "b")]
    for folder in folders:
        folder.mkdir()
        (folder / "truth.json").write_text(json.dumps(TRUTH | {"case": folder.name}), encoding="utf-8")
    before = {"a": answer("no_mismatch"), "b": answer("no_mismatch")}
    now = before | {"b": answer("named", PLAY)}
    for name, answers in (("before", before), ("now", now), ("now", {})):
        monkeypatch.setattr(asking, "ask_case", lambda folder, answers=answers, **_: answers[folder.name])
        asked = parser.parse_args(["--kept-as", name, "--against", "before"])
        asking.ask_all(folders, asked, lambda folder, one: folder.name)
    show(folders, asked)
    assert capsys.readouterr().out.splitlines()[-2:] == [
        "b: no_mismatch: - -> named: Backlash at x_scale",
        "1 of 2 cases have the same verdict and effects; processor time 2 s, 2 s before",
    ]
