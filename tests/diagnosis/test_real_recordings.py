"""``lathesim diagnose`` on recordings of real machines: a motor axis, a motor bench, a mill and a lathe with a dynamometer."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from tests.cli.command import call
from tests.shared_data import SHARED, needs_shared

pytestmark = [pytest.mark.slow, needs_shared]
LESSONS = Path(__file__).parent / "lessons"
DATA = SHARED / "data"


def diagnosed(capsys, tmp_path, lesson, recording):
    """Return the JSON of a diagnosis made with the command."""
    said = call(capsys, "diagnose", LESSONS / lesson, DATA / recording, "--no-report", "--json", "-", "--out", tmp_path)
    assert said.code == 0, said.err
    return json.loads(said.out)


def by_name(answer):
    return {effect["effect"]: effect for effect in answer["effects"]}


def size(answer, effect, parameter):
    return by_name(answer)[effect]["parameters"][parameter]["value"]


def test_the_friction_left_out_of_the_emps_axis_is_found_with_its_asymmetry(capsys, tmp_path):
    answer = diagnosed(capsys, tmp_path, "emps.yaml", "emps/DATA_EMPS.mat")
    assert answer["verdict"] in ("named", "tied")
    friction, ripple = answer["effects"]
    assert (friction["effect"], friction["at"]) == ("AsymmetricFriction", "x_axis")
    # what was left every 2.5 mm has a name
    assert (ripple["effect"], ripple["parameters"]["period"]["value"]) == ("TorqueRipple", pytest.approx(2.5e-3, rel=0.01))
    # Janot et al. (2019): mass 95.1089 kg, viscous 203.5034 N s/m, dry friction 20.3935 N
    level = friction["parameters"]["level"]
    assert level["low"] < 20.3935 < level["high"]
    # the published model has no ripple, which moves the mass by more than its interval
    assert answer["history"][-1]["validation_gain"] > 1000.0
    assert answer["baseline"]["x_axis.mass"]["refit_with"] == pytest.approx(95.1089, rel=0.02)
    assert answer["baseline"]["x_axis.viscous"]["refit_with"] == pytest.approx(203.5034, rel=0.02)
    slope = friction["parameters"]["viscous_difference"]
    assert slope["low"] < -37.0 * 0.95
    assert slope["high"] < 0.0
    force = next(item for item in answer["missing"] if item["at"] == "x_axis.disturbance")
    assert force["share_before"] > 0.16
    assert force["share_after"] < 0.02


LATE = """\
lesson: EMPS axis with its friction, the position logged late
machine: force_axis
sample_period: 1 ms
step: 0.5 ms
set: {x_axis.mass: 95.1 kg, x_axis.viscous: 203.5 N*s/m}
insert:
  - {effect: AsymmetricFriction, at: x_axis, level: 20.27 N, asymmetry: 0, viscous_difference: -36 N*s/m}
recordings:
  time: {column: t, unit: s}
  drive: {x_axis.force: {column: f, unit: N}}
  compare: {x_encoder.position: {column: q, unit: m, resolution: 5e-8 m}}
uncertain: {x_axis.mass: 2 %, x_axis.viscous: 10 %}
"""


def test_a_position_that_is_logged_late_is_tied_with_a_late_force(capsys, tmp_path):
    """Half real: 3 ms put into the recording. The tie stands also after a further effect has come in."""
    data = loadmat(DATA / "emps" / "DATA_EMPS.mat")
    place = data["qm"].ravel()
    time = 1e-3 * np.arange(len(place))
    rows = np.column_stack([time, data["vir"].ravel() * data["gtau"].item(), np.interp(time - 3e-3, time, place)])
    np.savetxt(tmp_path / "late.csv", rows, delimiter=",", header="t,f,q", comments="", fmt="%.9g")
    (tmp_path / "late.yaml").write_text(LATE, encoding="utf-8")
    answer = diagnosed(capsys, tmp_path, tmp_path / "late.yaml", tmp_path / "late.csv")
    delay = by_name(answer)["TransportDelay"]
    assert "ChannelTimeShift" in delay["tied_with"]
    assert delay["parameters"]["delay"]["low"] < 3e-3 < delay["parameters"]["delay"]["high"]


def test_dry_friction_of_a_spin_up_is_named_and_what_one_direction_cannot_tell_is_said(capsys, tmp_path):
    answer = diagnosed(capsys, tmp_path, "hsm150.yaml", "hsm150/idf_pos_0.06_1.mat")
    assert answer["verdict"] == "tied"
    friction = answer["effects"][0]
    assert friction["effect"] == "CoulombFriction"
    assert "AsymmetricFriction" in friction["tied_with"]
    assert "both directions" in friction["separating_experiment"]
    speed = answer["fit"]["spindle.speed"]
    assert speed["after"] < 0.01 * 192.0  # rad/s, root mean square speed of the second half


def test_dry_friction_shows_in_ten_samples_a_second_of_three_digits(capsys, tmp_path):
    answer = diagnosed(capsys, tmp_path, "umich.yaml", "umich_cnc/experiment_11.csv")
    assert answer["verdict"] == "named"
    # the position lags by 8 ms: at 0.1 mm a reading and with half the samples at rest that gains 66 +- 26, too little to be sure
    assert [effect["effect"] for effect in answer["effects"]] == ["CoulombFriction"]
    assert size(answer, "CoulombFriction", "level") == pytest.approx(4.87, rel=0.05)  # A: least squares by hand
    assert answer["baseline"]["x_axis.viscous"]["low"] > 0.0
    assert any("stands still in 5" in sentence for sentence in answer["left"])  # where dry friction holds, the current tells nothing


def test_entry_build_up_and_the_line_of_the_spindle_show_in_one_turning_cut(capsys, tmp_path):
    answer = diagnosed(capsys, tmp_path, "turning.yaml", "turning_forces/f416_a100.lvm")
    assert answer["verdict"] == "named"
    assert [effect["effect"] for effect in answer["effects"]] == ["EntryBuildUp"]
    assert 0.03 < size(answer, "EntryBuildUp", "time_constant") < 0.1  # s: about a turn of the spindle
    # the zeros of thrust and feed drift: each gains about 2.5 standard errors, too little to be sure, and is left without a name
    assert any("dynamometer.thrust" in sentence and "no name" in sentence for sentence in answer["left"])
    # the three forces of one dynamometer go together, and drift with the time
    assert {"time", "what is left at dynamometer.main"} <= set(answer["location"]["variables"])
    force = answer["fit"]["dynamometer.main"]
    assert force["recording"] == "f416_a100.lvm, every other stretch of one run"
    assert force["after"] < 0.7 * force["before"]
    assert not answer["adequate"]


def test_a_flexible_link_is_found_by_the_error_of_its_simulation_with_the_side_of_its_sensor(capsys, tmp_path):
    folder = DATA / "real" / "flexible_link"
    words = [folder / "slfr_cad.yaml", folder / "swept1-0-10hz.txt", "--validate", folder / "swept2-0-10hz.txt"]
    said = call(capsys, "diagnose", *words, "--no-report", "--json", "-", "--out", tmp_path)
    answer = json.loads(said.out)
    assert answer["verdict"] == "named"
    assert list(by_name(answer)) == ["AxialResonance"]
    assert size(answer, "AxialResonance", "frequency") == pytest.approx(2.53, abs=0.03)
    assert answer["fit"]["spindle_encoder.angle"]["after"] < 0.076
    assert answer["side"] == {"spindle_encoder": "motor"}
