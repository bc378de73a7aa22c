"""The map that learns: limits of one mode, what cuts teach, the next cut, contradictions, what one mode does not explain."""

from __future__ import annotations

import io
import json
import math
from pathlib import Path

import numpy as np
import pytest

from lathesim.stability.belief import Prior, TriedCut, begin, chatter_places, learn, learn_all, log_limit
from lathesim.stability.frequency_limit import limit_at
from lathesim.stability.learned_map import adequacy, contradictions
from lathesim.stability.next_cut import CutRange, best_stable, next_cut
from lathesim.stability.tool_point import Mode, ToolPoint
from tests.cli.command import call, done, json_of, refused

GIVEN = Prior(np.log([100.0, 0.05, 0.01]), np.array([0.1, 0.3, 0.28]))
INSIDE = CutRange(np.linspace(1000.0, 4000.0, 121), 6e-3)
KS = 1e9


def machine(frequency: float = 100.0, damping: float = 0.05, stiffness: float = 1e7) -> ToolPoint:
    return ToolPoint((Mode(frequency, damping, stiffness),), (1.0,))


def tried(tool: ToolPoint, speed: float, width: float, *, heard: bool = True) -> TriedCut:
    """Make a cut on a concealed machine."""
    limit = limit_at(tool, KS, speed)
    stable = width < limit.width
    return TriedCut(speed, width, stable, limit.frequency if heard and not stable else math.nan)


@pytest.mark.parametrize("speed", [700.0, 1000.0, 1777.0, 2500.0, 4000.0, 6000.0])
def test_limits_of_one_mode_are_those_of_the_frequency_domain(speed: float) -> None:
    wanted = limit_at(machine(), KS, speed)
    rate = np.array([speed / 6000.0])
    assert 0.01 * math.exp(log_limit(np.log(rate), np.log([0.05]))[0]) == pytest.approx(wanted.width, rel=1e-3)
    at_limit, _ = chatter_places(rate, np.array([0.05]), np.array([1.2 * wanted.width / 0.01]))
    assert 100.0 * at_limit[0] == pytest.approx(wanted.frequency, rel=1e-6)


def test_a_width_under_a_stable_one_is_stable() -> None:
    belief = learn(begin(GIVEN), TriedCut(3000.0, 2.5e-3, True))
    widths = np.linspace(0.1e-3, 2.4e-3, 12)
    chance = belief.stable_probability(np.full(12, 3000.0), widths)
    assert (np.diff(chance) <= 1e-12).all()
    assert chance[-1] > 0.98


@pytest.mark.slow
@pytest.mark.parametrize("heard", [True, False])
def test_ten_cuts_come_close_to_the_best(heard: bool) -> None:
    tool = machine(108.0, 0.04, 1.2e7)
    best = max(speed * min(limit_at(tool, KS, speed).width, INSIDE.widest) for speed in INSIDE.speeds.tolist())
    belief = begin(GIVEN, 3)
    for _ in range(10):
        proposal = next_cut(belief, INSIDE)
        assert 0.0 < proposal.width <= INSIDE.widest
        belief = learn(belief, tried(tool, proposal.speed, proposal.width, heard=heard))
    assert best_stable(belief.cuts) > 0.85 * best


def test_a_risk_and_a_price_make_the_next_cut_safer() -> None:
    belief = begin(GIVEN, 3)
    bold, careful = next_cut(belief, INSIDE), next_cut(belief, INSIDE, risk=0.05)
    assert careful.stable >= 0.95 > bold.stable
    assert next_cut(belief, INSIDE, price=20.0).stable > bold.stable


def test_cuts_that_one_mode_cannot_have_made_are_told() -> None:
    tool = machine()
    cuts = [tried(tool, speed, width) for speed, width in ((2000.0, 2e-3), (3000.0, 2e-3), (3500.0, 3e-3), (1500.0, 1e-3))]
    assert adequacy(learn_all(GIVEN, cuts)).good
    strange = [*cuts, TriedCut(2500.0, 3e-3, False, 260.0)]
    found = adequacy(learn_all(GIVEN, strange))
    assert not found.good
    assert "cut 5 (2500 rpm, 3.00 mm) chattered at 260.0 Hz" in found.reason


def test_contradictions_are_pairs_at_one_speed() -> None:
    cuts = [TriedCut(2000.0, 2e-3, True), TriedCut(3000.0, 1e-3, False), TriedCut(2000.0, 1e-3, False)]
    assert contradictions(cuts) == [(1, 3)]


LESSON = """lesson: L
machine: two_axis_lathe
program: one_pass.nc
tool_point:
  cutting_stiffness: 1000 N/mm^2
  modes: [{frequency: 100 Hz, damping: 5 %, stiffness: 1e7 N/m}]
"""
UNCERTAIN = "uncertain: {tool_point.frequency: 10 %, tool_point.damping: 30 %, tool_point.stiffness: 20 %}\n"


def test_the_command_learns_and_proposes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    Path("l.yaml").write_text(LESSON + UNCERTAIN, encoding="utf-8")
    Path("c.csv").write_text("speed [rpm],width [mm],stable,frequency [Hz]\n3000,1.5,yes,\n3500,3,no,112.3\n", encoding="utf-8")
    found = json_of(capsys, "cuts", "l.yaml", "c.csv", "--json", "--save", "map.png", "--compare")
    assert found["adequate"]
    assert found["best_stable"]["width_m"] == pytest.approx(1.5e-3)
    (proposal,) = found["next"]
    assert proposal["speed_rpm"] * proposal["width_m"] > 4.5
    assert found["rows"][0]["low_m"] < found["rows"][0]["width_m"] < found["rows"][0]["high_m"]
    assert Path("map.png").stat().st_size > 20_000


def test_what_one_overhang_taught_is_where_another_begins(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("long.yaml").write_text(LESSON + UNCERTAIN, encoding="utf-8")
    Path("short.yaml").write_text(LESSON.replace("100 Hz", "140 Hz").replace("1e7", "2e7"), encoding="utf-8")
    Path("c.csv").write_text("speed [rpm],width [mm],stable,frequency [Hz]\n3500,3,no,118.0\n2500,2,no,117.0\n", encoding="utf-8")
    Path("map.json").write_text(call(capsys, "cuts", "long.yaml", "c.csv", "--json").out, encoding="utf-8")
    taught = json.loads(Path("map.json").read_text(encoding="utf-8"))["parameters"]["frequency"]["value"]
    found = json_of(capsys, "cuts", "short.yaml", "--prior", "map.json", "--json")["parameters"]["frequency"]
    assert found["value"] == pytest.approx(1.4 * taught, rel=0.01)
    assert found["high"] / found["low"] < 1.25
    assert "there is no such file" in call(capsys, "cuts", "short.yaml", "--prior", "none.json").err


@pytest.mark.slow
def test_the_game_answers_cuts_and_plays_beside(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("l.yaml").write_text(LESSON + UNCERTAIN, encoding="utf-8")
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(b"2500 0.3\nfast\n9000 1\n2500 7\n3000, 5.9\n"), encoding="utf-8"))
    said = done(capsys, "cuts", "l.yaml", "--play", "4", "--seed", "7")
    assert "stable; 750 rpm*mm so far, 0 tools broken" in said.out
    assert "'fast' is no cut" in said.out
    assert "Choose one from 1000 to 4000 rpm" in said.out
    assert "Choose one up to 6 mm" in said.out
    you, program = (line.split() for line in said.out.splitlines() if line.startswith(("you", "program")))
    assert you[1] == program[1] == "2"
    assert "possible were" in said.out


@pytest.mark.parametrize(
    ("lesson", "cuts", "told"),
    [
        (LESSON, "speed,width,stable\n2000,1,yes\n", "nothing of the tool point is uncertain"),
        (LESSON + UNCERTAIN, "speed,width,stable\n2000,2,yes\n2000,1,no\n", "at 2000 rpm and 2 mm, and cut 2 chattered there at 1 mm"),
        (LESSON + UNCERTAIN, "speed,width,stable\n0,2,yes\n", "c.csv:2: the speed is 0 rpm"),
        (LESSON + UNCERTAIN, "speed,width\n2000,2\n", "the column 'stable' is missing"),
        (LESSON + UNCERTAIN, "speed,width,stable\n2000,2,perhaps\n", "'perhaps' does not say whether the cut was stable"),
        (LESSON + "uncertain: {tool_point.dampin: 5 %}\n", "speed,width,stable\n", "Did you mean 'damping'?"),
    ],
)  # fmt: skip
def test_what_cannot_be_learned_from_is_told_in_a_sentence(
    lesson: str, cuts: str, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("l.yaml").write_text(lesson, encoding="utf-8")
    Path("c.csv").write_text(cuts, encoding="utf-8")
    said = refused(capsys, "cuts", "l.yaml", "c.csv")
    assert told in said.err
    assert said.err.count("\n") == 1
