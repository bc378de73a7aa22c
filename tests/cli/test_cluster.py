"""``--cluster``: two workers on this computer give the answers of one process, and one that is killed loses nothing."""

import json
import os
import re
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from lathesim.cluster import Cluster
from lathesim.errors import LatheSimError, LessonError
from lathesim.manual.chapters import chapter
from tests.cli.command import call, done, json_of, refused

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("default")]
Capture = pytest.CaptureFixture[str]
PLAY = "Backlash:width=62 um@x_encoder"


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        yield cluster.scheduler_address


@pytest.fixture(autouse=True)
def in_a_folder_with_an_axis() -> None:
    program, lesson, *_ = re.findall(r"```\w*\n(.*?)```", chapter("backlash").text, re.S)
    Path("backlash.nc").write_text(program, encoding="utf-8")
    Path("backlash.yaml").write_text(lesson, encoding="utf-8")


def recorded(capsys: Capture, name: str, effect: str, seed: int) -> str:
    done(capsys, "conceal", "backlash.yaml", "--effect", effect, "--seed", str(seed), "--out", name)
    return str(Path(name, "recording.csv").rename(f"{name}.csv"))


def test_a_worker_that_is_killed_loses_nothing_and_is_said_once(address: str) -> None:
    def slowly(shared: str, call: int) -> tuple[str, int]:
        time.sleep(0.1)
        return f"{shared} {call}", os.getpid()

    said: list[str] = []
    found, killed = {}, []
    with Cluster(address, (), said.append) as cluster:
        for number, (text, worker) in cluster.results(slowly, "call", range(40)):
            found[number] = text
            if len(found) in (5, 15) and worker not in killed:
                os.kill(worker, signal.SIGKILL)
                killed.append(worker)
    assert found == {number: f"call {number}" for number in range(40)}
    assert killed
    assert said == ["A worker stopped: its work is made again by the others."]


def test_an_error_of_a_call_is_the_error_here(address: str) -> None:
    def refused(shared: None, call: str) -> None:
        raise LessonError(f"{call} is wrong.", remedy="Mend it.")

    with Cluster(address) as cluster, pytest.raises(LatheSimError, match=r"it is wrong\. Mend it\."):
        cluster.in_order(refused, None, ["it"])


def test_another_version_is_refused(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lathesim.cluster._version", lambda: "lathesim 0 with Python 3.0")
    with Cluster(address) as cluster, pytest.raises(LatheSimError, match="Install the same versions on all workers"):
        cluster.in_order(max, 1, [2])


def test_recordings_that_judge_are_diagnosed_by_the_workers(address: str, capsys: Capture) -> None:
    first, *others = [recorded(capsys, f"r{seed}", PLAY, seed) for seed in (1, 2, 3)]
    further = [word for other in others for word in ("--with", "backlash.yaml", other)]

    def answer(*options: str) -> dict[str, Any]:
        said = json_of(capsys, "diagnose", "backlash.yaml", first, *further, "--json", "-", "--no-report", *options)
        return {name: value for name, value in said.items() if "time" not in name}

    there = answer("--cluster", address, "--at-most", "5 min")
    assert there == answer()
    assert [item["effect"] for item in there["effects"]] == ["Backlash"]
    alone = call(capsys, "diagnose", "backlash.yaml", first, "--cluster", address)
    assert (alone.code, "--cluster shares out the recordings of --with: give some." in alone.err) == (2, True)


def test_windows_of_recordings_are_diagnosed_by_a_worker(address: str, capsys: Capture) -> None:
    files = [recorded(capsys, f"s{seed}", "none", seed) for seed in (1, 2, 3)]
    files += [recorded(capsys, f"p{seed}", PLAY, seed) for seed in (1, 2)]
    said = done(capsys, "watch", "backlash.yaml", *files, "--learn", "40 s", "--json-lines", "--out", "w", "--cluster", address)
    (verdict,) = [line for line in map(json.loads, said.out.splitlines()) if line["event"] == "verdict"]
    assert "Backlash at x_encoder" in verdict["sentence"]
    assert json.loads(Path("w/watch_1.json").read_text())["schema"] == "lathesim-diagnosis/1"


def test_a_cluster_that_is_none_is_refused(capsys: Capture) -> None:
    wrong = call(capsys, "watch", "backlash.yaml", "r.csv", "--cluster", "spark://x")
    assert (wrong.code, "--cluster spark://x: write it as tcp://host:port." in wrong.err) == (2, True)
    Path("class").mkdir()
    refused(capsys, "class", "grade", "class", "--cluster", "tcp://127.0.0.1:9")
