"""The suite against an older checkout: CPU times in turn, and what is answered otherwise."""

import json
from pathlib import Path
from typing import Any

import pytest

from tests.diagnosis.suite import against
from tests.diagnosis.suite.__main__ import main


def test_the_ratio_of_medians_is_told_and_nothing_is_measured_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[str, str]] = []
    folders, other = [tmp_path / f"case_{number}" for number in range(3)], tmp_path / "older"

    def seconds(folder: Path, checkout: Path) -> float:
        asked.append((folder.name, checkout.name))
        return {"case_0": 10.0, "case_1": 30.0, "case_2": 20.0}[folder.name] * (0.5 if checkout == against.HERE else 1.0)

    monkeypatch.setattr(against, "computed_seconds", seconds)
    said: list[str] = []
    for _ in range(2):
        assert against.speed(folders, other, tmp_path / "kept" / "speed.jsonl", said.append) == pytest.approx(0.5)
    assert len(asked) == 6
    assert [checkout for _, checkout in asked[:4]] == [against.HERE.name, "older", "older", against.HERE.name]
    assert said[-1] == "median of 3 cases: 10.0 s, 20.0 s in older; ratio 0.500"


def answered(folder: Path, case: str, verdict: str, *effects: dict[str, Any]) -> None:
    folder.mkdir(exist_ok=True)
    (folder / f"{case}.json").write_text(json.dumps({"answer": {"verdict": verdict, "effects": effects}}), encoding="utf-8")


def test_other_verdicts_and_names_are_listed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lag, delay = {"effect": "Lag", "at": "x", "size": 1.0}, {"effect": "Delay", "at": "x", "tied_with": ["Lag"]}
    for case, before, after in (("case_0", [lag], [{**lag, "size": 1.1}]), ("case_1", [lag], [delay])):
        (tmp_path / "cases" / case).mkdir(parents=True)
        (tmp_path / "cases" / case / "truth.json").write_text("{}", encoding="utf-8")
        answered(tmp_path / "before", case, "named", *before)
        answered(tmp_path / "after", case, "tied" if after == [delay] else "named", *after)
    words = ["differences", "--cases", tmp_path / "cases", "--answers", tmp_path / "after", "--against", tmp_path / "before"]
    assert main([str(word) for word in words]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "case_1: named, Lag at x -> tied, Delay at x | Lag",
        "1 of 2 cases have the same verdict and effects",
    ]


def test_without_another_checkout_nothing_is_compared(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["speed"])
    assert "speed needs --against PATH" in capsys.readouterr().err
