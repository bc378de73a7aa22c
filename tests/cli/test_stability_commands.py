"""``tap``, ``modes``, ``couple`` and ``lobes`` together: from the hammer to the map; measured responses, assemblies, bands, milling."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lathesim.stability.frequency_limit import limit_at
from lathesim.stability.response_files import write_response
from lathesim.stability.tool_point import FrequencyResponse, Mode, ToolPoint
from tests.cli.command import call, json_of, refused

Capture = pytest.CaptureFixture[str]
MODES = ToolPoint((Mode(150.0, 0.02, 8e6), Mode(420.0, 0.035, 3e7)), (0.5, 0.5))
HEAD = "lesson: L\nmachine: two_axis_lathe\nprogram: one_pass.nc\ntool_point:\n  cutting_stiffness: 700 N/mm^2\n  force_angle: 60 deg\n"
TWO = (
    "  modes:\n    - {frequency: 150 Hz, damping: 2 %, stiffness: 8e6 N/m}\n    - {frequency: 420 Hz, damping: 3.5 %, stiffness: 3e7 N/m}\n"
)
PARTS = "  - {diameter: 20 mm, length: 100 mm%s}\n  - {width: 30 mm, height: 30 mm, length: 150 mm%s}\n"


def lesson(text: str) -> str:
    Path("mine.yaml").write_text(HEAD + text, encoding="utf-8")
    return "mine.yaml"


def said_json(capsys: Capture, *arguments: str) -> Any:
    return json_of(capsys, *arguments, "--json")


@pytest.mark.slow
def test_tap_fit_and_predict(capsys: Capture) -> None:
    lesson(TWO + "  tap: {length: 0.5 s, double_hits: 40 %}\n")
    tapped = said_json(capsys, "tap", "mine.yaml", "--out", "tap.uff", "--save", "tap.png", "--seed", "4")
    assert sum(hit["kept"] for hit in tapped["hits"]) == 5
    assert all("second pulse" in hit["reason"] for hit in tapped["hits"] if not hit["kept"])
    found = said_json(capsys, "modes", "tap.uff", "--save", "modes.png")
    assert "hits in turn" in found["decided_on"]
    assert [mode["frequency_hz"]["value"] for mode in found["modes"]] == pytest.approx([150.0, 420.0], rel=1e-3)
    assert [mode["stiffness_n_per_m"]["value"] for mode in found["modes"]] == pytest.approx([8e6, 3e7], rel=1e-2)
    lesson("  response: {file: tap.uff}\n")
    predicted = said_json(capsys, "lobes", "mine.yaml", "--speed", "2000..6000:5")
    wanted = [limit_at(MODES, 700e6, row["speed_rpm"]).width for row in predicted["rows"]]
    assert [row["width_m"] for row in predicted["rows"]] == pytest.approx(wanted, rel=0.03)


@pytest.mark.slow
def test_a_measured_response_is_taken_as_it_is(capsys: Capture) -> None:
    frequency = np.linspace(0.5, 1500.0, 3000)
    plain = ToolPoint(MODES.modes, (1.0, 1.0))
    write_response(FrequencyResponse(frequency, plain.receptance(frequency)), Path("frf.csv"))
    lesson("  response: {file: frf.csv}\n  process_damping: 2e4 N/m\n")
    with_drag = [row["width_m"] for row in said_json(capsys, "lobes", "mine.yaml", "--speed", "1000..6000:6")["rows"]]
    wanted = [limit_at(MODES, 700e6, speed, process_damping=2e4, diameter=0.036).width for speed in np.linspace(1000.0, 6000.0, 6)]
    assert with_drag == pytest.approx(wanted, rel=1e-3)
    lesson("  response: {file: frf.csv}\n")
    found = said_json(capsys, "lobes", "mine.yaml", "--speed", "1000..6000:6")
    wanted = [limit_at(MODES, 700e6, speed).width for speed in np.linspace(1000.0, 6000.0, 6)]
    assert [row["width_m"] for row in found["rows"]] == pytest.approx(wanted, rel=1e-3)
    by_modes = said_json(capsys, "lobes", "mine.yaml", "--speed", "2000..4000:2", "--method", "collocation")
    assert "Modes fitted to the response" in by_modes["findings"][0]


def test_a_response_that_ends_below_a_mode_leads_to_modes_that_a_lesson_takes(capsys: Capture) -> None:
    frequency, chance = np.arange(20.0, 1001.0), np.random.default_rng(1)
    tool = ToolPoint((Mode(300.0, 0.03, 2e7), Mode(1500.0, 0.02, 5e7)), (1.0, 1.0))
    noise = 2e-10 * (chance.standard_normal(len(frequency)) + 1j * chance.standard_normal(len(frequency)))
    write_response(FrequencyResponse(frequency, tool.receptance(frequency) + noise), Path("frf.csv"))
    text = HEAD.replace("700 N/mm^2", "1000 N/mm^2").replace("60 deg", "0 deg")
    Path("mine.yaml").write_text(f"{text}  response: {{file: frf.csv}}\n", encoding="utf-8")
    for method in ("frequency", "collocation"):
        found = said_json(capsys, "lobes", "mine.yaml", "--speed", "20000..20000:1", "--method", method)
        assert found["smallest_width_m"] == pytest.approx(1.303e-3, rel=2e-3)
        assert "the response ends at 1000 Hz, below a mode" in found["findings"][0]
    said = call(capsys, "modes", "frf.csv").out
    assert "near 1500 Hz" in said
    modes = said[said.index("  modes:") :]
    Path("mine.yaml").write_text(text + modes, encoding="utf-8")
    (row,) = said_json(capsys, "lobes", "mine.yaml", "--speed", "20000..20000:1")["rows"]
    assert row["width_m"] == pytest.approx(limit_at(ToolPoint(tool.modes[:1], (1.0,)), 1e9, 20000.0).width, rel=2e-3)


def test_what_is_uncertain_gives_a_band_and_cuts_are_shown(capsys: Capture) -> None:
    lesson(TWO + "  speed: 3000 rpm\n  width: 1 mm\nuncertain: {tool_point.cutting_stiffness: 20 %, tool_point.damping_1: 30 %}\n")
    Path("cuts.csv").write_text("speed [rpm],width [mm],stable\n2500,0.5,yes\n3000,3,no\n", encoding="utf-8")
    found = said_json(capsys, "lobes", "mine.yaml", "--speed", "1000..6000:6", "--cuts", "cuts.csv", "--save", "lobes.png")
    assert all(row["low_m"] < row["width_m"] < row["high_m"] for row in found["rows"])
    assert found["band"]["draws"] >= 512 and found["band"]["edges_agree_within"] < 0.03
    assert found["chosen"] == {"speed_rpm": pytest.approx(3000.0), "width_m": pytest.approx(1e-3)}
    assert [cut["stable"] for cut in found["cuts"]] == [True, False]
    assert "draws lie in the band" in call(capsys, "lobes", "mine.yaml", "--speed", "1000..6000:3").out


@pytest.mark.parametrize("method", ["collocation", pytest.param("time", marks=pytest.mark.slow)])
def test_milling_by_two_methods(method: str, capsys: Capture) -> None:
    Path("mill.yaml").write_text(
        "lesson: L\nmachine: two_axis_lathe\nprogram: one_pass.nc\ntool_point:\n"
        "  modes: [{frequency: 922 Hz, damping: 1.1 %, stiffness: 1340029 N/m}]\n"
        "  milling: {teeth: 2, tangential: 600 N/mm^2, normal: 200 N/mm^2}\n",
        encoding="utf-8",
    )
    rows = said_json(capsys, "lobes", "mill.yaml", "--speed", "5000..20000:2", "--method", method)["rows"]
    assert [1e3 * row["width_m"] for row in rows] == pytest.approx([0.4086, 1.4175], rel=2e-3)
    assert [row["kind"] for row in rows] == ["Hopf", "flip"]


def test_a_cut_that_no_width_upsets_tells_how_wide_was_tried(capsys: Capture) -> None:
    Path("mill.yaml").write_text(
        "lesson: L\nmachine: two_axis_lathe\nprogram: one_pass.nc\ntool_point:\n"
        "  modes: [{frequency: 316 Hz, damping: 2 %, stiffness: 8e6 N/m}]\n"
        "  milling: {teeth: 1, tangential: 468 N/mm^2, normal: 294 N/mm^2, entry: 36.6 deg, leave: 47.2 deg}\n",
        encoding="utf-8",
    )
    found = said_json(capsys, "lobes", "mill.yaml", "--speed", "3774..3774:1")
    assert found["rows"][0]["width_m"] is None
    assert found["findings"] == ["'stable' means up to 147.6 mm; wider cuts were not tried."]


def test_milling_with_what_it_does_not_take_is_refused(capsys: Capture) -> None:
    text = "  modes: [{frequency: 922 Hz, damping: 1.1 %, stiffness: 1e6 N/m}]\n  milling: {teeth: 2, tangential: 6e8 Pa, normal: 2e8 Pa}\n"
    for key, word in (("process_damping: 1e5 N/m", "process damping"), ("interrupted: 0.5", "slotted bar")):
        lesson(f"{text}  {key}\n")
        assert f"milling takes no {word}." in refused(capsys, "lobes", "mine.yaml", "--speed", "5000..5000:1").err


def test_the_three_methods_agree_on_an_interrupted_cut(capsys: Capture) -> None:
    lesson("  interrupted: 0.5\n  modes: [{frequency: 75 Hz, damping: 2 %, stiffness: 8e6 N/m}]\n")
    found = {
        method: said_json(capsys, "lobes", "mine.yaml", "--speed", "2500..3500:2", "--method", method)["rows"]
        for method in ("collocation", "time")
    }
    for ours, theirs in zip(*found.values(), strict=True):
        assert ours["width_m"] == pytest.approx(theirs["width_m"], rel=1e-3)
        assert ours["kind"] == theirs["kind"]
        assert ours["frequency_hz"] == pytest.approx(theirs["frequency_hz"], rel=2e-3)


def assembly(base: str = "free", first: str = "", second: str = "") -> str:
    Path("bar.yaml").write_text(f"assembly: A bar\nbase: {base}\nparts:\n{PARTS % (first, second)}", encoding="utf-8")
    return "bar.yaml"


def test_an_assembly_gives_a_tool_point_and_moves_with_its_overhang(capsys: Capture) -> None:
    assembly("wall")
    lesson("  assembly: bar.yaml\n")
    found = said_json(capsys, "lobes", "mine.yaml", "--speed", "4000..8000:3")
    assert 0.0 < found["smallest_width_m"] < 0.1
    rows = said_json(capsys, "couple", "bar.yaml", "--overhang", "80..140:3")["rows"]
    peaks = [row["peak_hz"] for row in rows]
    assert peaks == sorted(peaks, reverse=True)


def test_a_base_is_found_by_inverse_coupling(capsys: Capture) -> None:
    joint = ", joint: {translation: 2e8 N/m, rotation: 1e6 N*m/rad}"
    Path("base.yaml").write_text("assembly: Base\nparts:\n  - {width: 30 mm, height: 30 mm, length: 150 mm}\n", encoding="utf-8")
    base = said_json(capsys, "couple", "base.yaml", "--frequency", "400..2000:9")
    tip = said_json(capsys, "couple", assembly("free", joint), "--frequency", "400..2000:9")
    Path("tip.json").write_text(json.dumps(tip), encoding="utf-8")
    Path("artefact.yaml").write_text(
        f"assembly: Artefact\nbase: wall\nparts:\n  - {{diameter: 20 mm, length: 100 mm{joint}}}\n", encoding="utf-8"
    )
    share = said_json(capsys, "couple", "artefact.yaml", "--inverse", "tip.json")
    for ours, wanted in zip(share["rows"], base["rows"], strict=True):
        assert np.array(ours["receptance"]) == pytest.approx(np.array(wanted["receptance"]), rel=1e-8, abs=1e-14)
    Path("share.json").write_text(json.dumps(share), encoding="utf-8")
    Path("again.yaml").write_text(
        f"assembly: Again\nbase: share.json\nparts:\n  - {{diameter: 20 mm, length: 100 mm{joint}}}\n", encoding="utf-8"
    )
    again = said_json(capsys, "couple", "again.yaml", "--frequency", "400..2000:9")
    assert again["rows"][4]["receptance"][0][0] == pytest.approx(tip["rows"][4]["receptance"][0][0], rel=1e-8)


def test_uncertain_joints_give_a_band(capsys: Capture) -> None:
    assembly("free", ", joint: {translation: 1e8 N/m, rotation: 1e5 N*m/rad, uncertain: 30 %}")
    (row,) = said_json(capsys, "couple", "bar.yaml", "--frequency", "2500")["rows"]
    assert row["low_m_per_n"] < abs(complex(*row["receptance"][0][0])) < row["high_m_per_n"]


@pytest.mark.parametrize(
    ("first", "second", "told"),
    [
        ("", ", start: 120 mm", "bar.yaml:5:5: part 2 starts at 120 mm and the parts before end at 100 mm: the assembly has a gap."),
        ("", ", start: 90 mm", "the assembly has an overlap"),
        (", joint: {translation: 0 N/m, rotation: 1 N*m/rad}", "", "the joint has the translation stiffness 0"),
        (", material: {modulus: 0 GPa}", "", "the modulus of the material is 0"),
        ("", ", joint: {translation: 1e8 N/m, rotation: 1e5 N*m/rad}", "the last part has a joint, and nothing follows"),
    ],
)
def test_an_assembly_that_cannot_be_is_told_in_a_sentence(first: str, second: str, told: str, capsys: Capture) -> None:
    said = refused(capsys, "couple", assembly("free", first, second))
    assert told in said.err
    assert said.err.count("\n") == 1


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("  modes: [{frequency: 100 Hz, damping: -1 %, stiffness: 1e6 N/m}]\n", "a mode has the damping ratio -0.01"),
        ("  modes: [{frequency: 100 Hz, damping: 1 %, stiffness: 0 N/m}]\n", "a mode has the stiffness 0"),
        (TWO + "  interrupted: 1.5\n", "the share of a turn in the cut is 1.5"),
        (TWO + "  response: {file: a.csv}\n", "needs exactly one of 'modes', 'response' and 'assembly'"),
        ("  response: {file: none.csv}\n", "there is no such file"),
        (TWO + "  diameter: 0 mm\n", "the diameter is 0"),
        (TWO + "uncertain: {tool_point.dampin: 3 %}\n", "Did you mean 'damping'?"),
    ],
)
def test_a_tool_point_that_cannot_be_is_told_in_a_sentence(text: str, told: str, capsys: Capture) -> None:
    said = refused(capsys, "lobes", lesson(text), "--speed", "1000..2000:2")
    assert told in said.err
    assert said.err.count("\n") == 1


def test_a_step_too_long_for_the_mode_names_the_largest_good_one(capsys: Capture) -> None:
    text = "lesson: L\nmachine: turning_with_chatter\nduration: 0.1 s\nsample_period: 5 ms\nstep: 5 ms\nwires: {cut.width: 1 mm}\n"
    Path("coarse.yaml").write_text(text, encoding="utf-8")
    said = refused(capsys, "run", "coarse.yaml", "--no-plots")
    assert "The step of 5000 us is too long" in said.err
    assert "Use" in said.err


def test_recorded_hits_are_evaluated(capsys: Capture) -> None:
    from lathesim.stability.tap import TapSettings, tap

    record = tap(ToolPoint(MODES.modes, (1.0, 1.0)), TapSettings(length=0.5, hits=3), 2)
    force, response = record.force.ravel(), record.response.ravel() * 1e6
    table = np.stack([np.arange(len(force)) / record.rate, force, response], axis=1)
    np.savetxt("hits.csv", table, delimiter=",", header="time [s],force [N],displacement [um]", comments="", fmt="%.9g")
    lesson(TWO)
    said_json(capsys, "tap", "mine.yaml", "--recording", "hits.csv", "--out", "tap.csv")
    found = said_json(capsys, "modes", "tap.csv", "--count", "2")
    assert [mode["damping"]["value"] for mode in found["modes"]] == pytest.approx([0.02, 0.035], rel=0.02)
