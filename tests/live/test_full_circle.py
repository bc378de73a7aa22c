"""The full circle: what a machine publishes is recorded and diagnosed, with the verdict of the file or a word on why there is none."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from lathesim.record import load
from tests.cli.command import call, done
from tests.live.servo import LESSON, free_port
from tests.live.test_stopping import interrupted, running, says

EFFECT = "CoulombFriction:level=20 N@x_axis"


def recorded(folder: Path, url: str, how: list[object]) -> None:
    """Publish the concealed case of a folder, and record it for 20 s to ``r.h5``."""
    with running(folder, "publish", "lesson.yaml", *how, "--play", "recording.csv") as publisher:
        says(publisher, "Published at")
        with running(folder, "record", url, "--lesson", "lesson.yaml", "--for", "20 s", "--out", "r.h5") as recorder:
            says(recorder, "Next: lathesim diagnose")
        interrupted(publisher)


@pytest.mark.slow
@pytest.mark.timeout(500)
def test_what_is_published_gets_the_verdict_of_the_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("asyncua", reason="OPC UA needs the extra live: python -m pip install 'lathesim[live]'")
    case, port = tmp_path / "case", free_port()
    done(capsys, "conceal", LESSON, "--effect", EFFECT, "--seed", 3, "--out", case)
    recorded(case, f"opc.tcp://127.0.0.1:{port}", ["--opcua", port])
    answers = []
    for lesson, file in (("lesson.yaml", "recording.csv"), ("r_lesson.yaml", "r.h5")):
        answer = tmp_path / f"{file}.json"
        done(capsys, "diagnose", case / lesson, case / file, "--no-report", "--json", answer, "--out", tmp_path / file)
        answers.append(json.loads(answer.read_text(encoding="utf-8")))
    from_file, from_network = answers
    assert from_network["verdict"] == from_file["verdict"] == "named"
    names = [[(entry["effect"], entry["at"]) for entry in answer["effects"]] for answer in answers]
    assert names[0] == names[1] == [("CoulombFriction", "x_axis")]
    sizes = [answer["effects"][0]["parameters"]["level"]["value"] for answer in answers]
    assert sizes[1] == pytest.approx(sizes[0], rel=0.02)
    assert json.loads(str(load(case / "r.h5").meta["recording"]))["lost"] == 0


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_what_is_published_at_10_hz_is_too_slow_for_its_controller_and_not_at_fault(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    case, port = tmp_path / "case", free_port()
    done(capsys, "conceal", LESSON, "--effect", EFFECT, "--seed", 3, "--out", case)
    recorded(case, f"http://127.0.0.1:{port}", ["--mtconnect", port, "--rate", "10 Hz"])
    said = call(capsys, "diagnose", case / "r_lesson.yaml", case / "r.h5", "--out", tmp_path / "out")
    assert "too slow for this question" in said.out
    assert "One sample every 100 ms, and x_controller decides every 1 ms" in said.out
    assert "itself is at fault" not in said.out
