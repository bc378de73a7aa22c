"""``lathesim diagnose`` on the force of a single turning cut, in which nothing but the force tells when the tool cuts."""

import json

import pytest

from tests.cli.command import call
from tests.diagnosis.one_cut import write_cut

pytestmark = pytest.mark.slow


def diagnosed(capsys, folder, *wrong):
    lesson, recording = write_cut(folder, wrong)
    said = call(capsys, "diagnose", lesson, recording, "--no-report", "--json", "-", "--out", folder)
    assert said.code == 0, said.err
    return json.loads(said.out)


def test_a_sound_cut_is_called_sound(capsys, tmp_path):
    answer = diagnosed(capsys, tmp_path)
    assert answer["verdict"] in ("no_mismatch", "parameters_only")
    assert answer["fit"]["dynamometer.main"]["recording"] == "cut.csv, every other stretch of one run"


def test_the_build_up_after_the_only_entry_is_named(capsys, tmp_path):
    answer = diagnosed(capsys, tmp_path, "entry")
    assert answer["verdict"] in ("named", "tied")
    found = answer["effects"][0]
    assert (found["effect"], found["at"]) == ("EntryBuildUp", "cutting")
    assert found["parameters"]["time_constant"]["value"] == pytest.approx(0.1, rel=0.2)
    assert answer["location"]["variables"] == []  # nothing is left that depends on anything


def test_a_line_once_per_turn_is_named(capsys, tmp_path):
    answer = diagnosed(capsys, tmp_path, "line")
    assert answer["effects"][0]["effect"] in ("Runout", "HardSpot")
    assert answer["location"]["variables"] == []


def test_build_up_line_and_drift_are_found_in_one_cut(capsys, tmp_path):
    answer = diagnosed(capsys, tmp_path, "entry", "line", "drift")
    assert [effect["effect"] for effect in answer["effects"]] == ["EntryBuildUp", "Runout", "DynamometerDrift"]
    assert answer["adequate"]
    size = answer["effects"][1]["parameters"]["eccentricity"]["value"]
    assert size == pytest.approx(20.0 / 600.0 * 1e-3, rel=0.05)  # m: 20 N of 600 N at a depth of 1 mm
