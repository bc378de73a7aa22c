"""Diagnosis of recorded cuts, by a generator that shares no code with the program."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from lathesim.stability.diagnose_cut import CutDiagnosis, RecordedCut, cutting_stretch, diagnose_cut, turning_of
from lathesim.stability.signal_lines import departure_from_gaussian, refined_speed
from tests.cli.command import call, json_of
from tests.shared_data import SHARED, needs_shared
from tests.stability.campaign.chatter import as_recorded, measured
from tests.stability.campaign.rig_cuts import KINDS, Recording, recording


def told(made: Recording) -> CutDiagnosis:
    """Return what is told of a cut whose modes are known."""
    return diagnose_cut(as_recorded(made), tuple(mode[0] for mode in made.rig.modes))


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_is_named(kind: str) -> None:
    assert told(recording(kind, 0, "tuning")).judged.kind == kind


@pytest.mark.slow
@pytest.mark.parametrize("half", ["tuning", "test"])
def test_seventy_seven_cuts_of_rigs(half: str) -> None:
    rows = [measured(half, number) for number in range(77)]
    right = sum(row["kind"] == row["known"] for row in rows)
    alarms = sum(row["known"] in ("hopf", "flip") for row in rows if row["kind"] not in ("hopf", "flip"))
    assert right >= 0.96 * len(rows)
    assert alarms <= 2


def test_chatter_is_told_early_with_its_mode_and_speeds_worth_trying() -> None:
    made = recording("hopf", 0, "tuning")
    natural, found = made.rig.modes[0][0], told(made)
    assert found.judged.kind == "hopf"
    assert found.judged.mode == 1
    assert found.told_share < 0.34
    assert found.speeds
    for speed in found.speeds:
        assert natural * 60.0 / speed == pytest.approx(round(natural * 60.0 / speed), abs=1e-6)


def test_a_second_cut_decides_between_a_mode_and_the_chip() -> None:
    chance = np.random.default_rng(1)
    time = np.arange(20000) / 10000.0

    def recorded(frequency: float, speed: float) -> RecordedCut:
        force = 100.0 + 10.0 * np.cos(2.0 * np.pi * frequency * time) + chance.standard_normal(len(time))
        return RecordedCut("force", force, np.zeros(0), 10000.0, speed / 60.0)

    first = recorded(207.3, 1000.0)
    assert diagnose_cut(first).judged.runner_up == "segmentation"
    assert diagnose_cut(first, other=recorded(228.03, 1100.0)).judged.kind == "segmentation"
    assert diagnose_cut(first, other=recorded(207.9, 1100.0)).judged.kind == "hopf"


def test_prediction_errors_tell_what_strikes_a_mode_from_noise_that_shakes_it() -> None:
    chance = np.random.default_rng(5)
    pole = 0.99 * np.exp(2j * np.pi * 0.05)
    noise = chance.standard_normal(20000)
    struck = noise + 8.0 * (chance.random(20000) < 0.02)

    def rung(force: np.ndarray) -> np.ndarray:
        return np.asarray(lfilter([1.0], [1.0, -2.0 * pole.real, abs(pole) ** 2], force))

    assert departure_from_gaussian(rung(noise)) < 5.0
    assert departure_from_gaussian(rung(struck)) > 20.0


def test_the_speed_is_found_from_low_orders_and_not_from_chatter_near_a_high_one() -> None:
    chance = np.random.default_rng(6)
    time = np.arange(20000) / 10000.0
    noise = 0.5 * chance.standard_normal(len(time))
    turning = 30.0
    orders = np.cos(2.0 * np.pi * turning * time) + 0.6 * np.cos(4.0 * np.pi * turning * time + 1.0)
    assert refined_speed(orders + noise, 10000.0, 1.003 * turning) == pytest.approx(turning, rel=4e-4)  # half a step between trials
    chatter = 3.0 * np.cos(2.0 * np.pi * 26.05 * turning * time)
    assert refined_speed(chatter + noise, 10000.0, turning) == turning


def test_silence_before_the_cut_is_no_growth() -> None:
    chance = np.random.default_rng(7)
    time = np.arange(20000) / 10000.0
    ringing = np.where(time > 0.4, np.exp(-15.0 * (time - 0.4)) * np.cos(2.0 * np.pi * 137.0 * time), 0.0)
    first, last = cutting_stretch(ringing + 0.004 * chance.standard_normal(len(time)), 10000.0, 20.0)
    assert 0.39 < first / 10000.0 <= 0.4
    assert last == 20000
    grown = 1e-3 * np.exp(np.minimum(8.0 * time, 7.0)) * np.cos(2.0 * np.pi * 137.0 * time)
    assert cutting_stretch(grown + 4e-4 * chance.standard_normal(len(time)), 10000.0, 20.0)[0] == 0


def test_a_tacho_that_rings_gives_the_speed() -> None:
    pulse = np.zeros(30000)
    for turn in range(50):
        pulse[100 + turn * 548 : 104 + turn * 548] = 5.0
        pulse[106 + turn * 548 : 108 + turn * 548] = 3.0
    assert turning_of(pulse + 0.05 * np.random.default_rng(0).standard_normal(30000), 10000.0) == pytest.approx(10000.0 / 548.0, rel=2e-3)


def test_the_command_tells_and_refuses_in_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    cut = recording("hopf", 1, "tuning")
    time = np.arange(len(cut.signal)) / cut.rate
    np.savetxt("cut.csv", np.stack([time, cut.signal], axis=1), delimiter=",", header="time [s],force [N]", comments="", fmt="%.6g")
    found = json_of(capsys, "chatter", "cut.csv", "--speed", str(cut.speed), "--json", "--save", "cut.png")
    assert found["kind"] == "hopf"
    assert found["frequency_hz"] == pytest.approx(cut.rig.modes[1][0], rel=0.2)
    assert Path("cut.png").stat().st_size > 10_000
    assert "the speed of the spindle is not known" in call(capsys, "chatter", "cut.csv").err
    assert "the file has no column 'forc'" in call(capsys, "chatter", "cut.csv", "--speed", "900", "--channel", "forc").err
    assert call(capsys, "chatter", "cut.csv", "--speed", "0").code == 2
    assert "holds 0.9 turns" in call(capsys, "chatter", "cut.csv", "--speed", "20").err


@needs_shared
def test_a_real_cut_says_what_its_band_cannot_be(capsys: pytest.CaptureFixture[str]) -> None:
    path = SHARED / "data" / "turning_forces" / "f416_a100.lvm"
    assert path.is_file()
    found = json_of(capsys, "chatter", path, "--channel", "Fx", "--band", "190..212", "--json")
    assert found["kind"] == "segmentation"
    assert math.isclose(found["speed_rpm"], 1065.0, rel_tol=0.01)
    told = " ".join(found["cannot_be"])
    assert "forced vibration" in told
    assert "mains hum" in told
    assert "chatter that has set in" in told
    assert "Half the width" in found["second_cut"]
