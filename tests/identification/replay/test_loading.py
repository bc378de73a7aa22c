"""From a lesson and its recordings to what a diagnosis works on."""

from pathlib import Path

import numpy as np
import pytest

from lathesim.errors import LatheSimError, LessonError, RecordingError
from lathesim.identification.estimation.fit_question import ask_fit
from lathesim.identification.replay.loading import LEAST_SAMPLES, Recorded, at_period, coarser_than_decided, load_case
from lathesim.lessons.lesson import load_lesson, load_machine
from lathesim.lessons.simulate import check_machine
from lathesim.plugins import Registry, load_registry
from lathesim.recordings.raw_table import Finding
from tests.diagnosis.pushed_table import FORCE, LESSON, MASS, POSITION, VISCOUS, machine, recording, write_case


@pytest.fixture(scope="module")
def registry() -> Registry:
    return load_registry(installed=False)


def test_a_case_is_what_the_lesson_says_of_its_recordings(registry: Registry, tmp_path: Path) -> None:
    lesson, first, second = write_case(tmp_path)
    case = load_case(load_lesson(lesson), [first, second], registry)
    assert (case.machine.drive, case.machine.compare) == ((FORCE,), (POSITION,))
    assert case.machine.uncertain == pytest.approx({"x_axis.mass": 0.05 * MASS, "x_axis.viscous": 0.1 * VISCOUS})
    assert case.machine.resolution == {POSITION: 1e-6}
    assert [one.name for one in case.recordings] == ["fit.csv", "check.csv"]
    assert case.recordings[0].record[POSITION] == pytest.approx(recording()[POSITION], abs=1e-9)
    assert case.recordings[0].faults == ()


def test_the_machine_is_sampled_as_the_recording_is() -> None:
    assembly = at_period(machine().assembly, 5e-3)
    assert assembly.sample_period == 5e-3
    assert assembly.step == pytest.approx(1e-3)
    assert at_period(machine().assembly, 2.5e-3).step == pytest.approx(2.5e-3 / 3.0)


def test_a_recording_at_another_rate_sets_the_rate(registry: Registry, tmp_path: Path) -> None:
    lesson, first, _ = write_case(tmp_path)
    rows = np.loadtxt(first, delimiter=",", skiprows=1)[::2]
    np.savetxt(first, rows, delimiter=",", header="t [s],push [N],seen [mm]", comments="", fmt="%.10g")
    assert load_case(load_lesson(lesson), [first], registry).machine.assembly.sample_period == pytest.approx(4e-3)


def test_a_recording_that_lasts_more_steps_than_can_be_simulated_is_refused(registry: Registry, tmp_path: Path) -> None:
    lesson, first, _ = write_case(tmp_path)
    lesson.write_text(lesson.read_text(encoding="utf-8").replace("time: {column: t, unit: s}", "time: {rate: 1 mHz}"), encoding="utf-8")
    with pytest.raises(RecordingError, match=r"lasts 2e\+06 s, which are .* steps of .* s; the limit is 1e\+09"):
        load_case(load_lesson(lesson), [first], registry)
    with pytest.raises(RecordingError, match="the limit is"):
        ask_fit(load_lesson(lesson), first, registry, ["x_axis.mass"])


def test_a_recording_in_which_nothing_moves_is_refused(registry: Registry, tmp_path: Path) -> None:
    lesson, first, _ = write_case(tmp_path)
    rows = np.loadtxt(first, delimiter=",", skiprows=1) * [1.0, 0.0, 0.0]
    np.savetxt(first, rows, delimiter=",", header="t [s],push [N],seen [mm]", comments="", fmt="%.10g")
    with pytest.raises(RecordingError, match=r"nothing that is compared moves in it: x_encoder\.position"):
        load_case(load_lesson(lesson), [first], registry)
    with pytest.raises(RecordingError, match="nothing that is compared moves"):
        ask_fit(load_lesson(lesson), first, registry, ["x_axis.mass"])


def test_a_servo_that_decides_more_often_than_it_was_logged_cannot_be_replayed(registry: Registry) -> None:
    """Unless what it commanded was logged too, or the log holds every so many-th decision."""
    template = Path(__file__).parents[3] / "lesson_configs" / "machines" / "cascade_axis.yaml"
    assembly = check_machine(load_machine(template), registry).assembly
    (finding,) = coarser_than_decided(2.5 * assembly.sample_period, assembly, [])
    assert finding.serious
    assert "x_controller decides every" in finding.fact
    assert coarser_than_decided(assembly.sample_period, assembly, []) == []
    (known,) = coarser_than_decided(2.5 * assembly.sample_period, assembly, ["x_controller.voltage"])
    assert not known.serious
    assert "a slower loop than the real one" in known.done
    (between,) = coarser_than_decided(4.0 * assembly.sample_period, assembly, [])
    assert not between.serious
    assert "simulated at the controller's rate" in between.done


def test_a_short_recording_is_refused(registry: Registry, tmp_path: Path) -> None:
    lesson, first, _ = write_case(tmp_path, count=LEAST_SAMPLES - 10)
    with pytest.raises(RecordingError, match=r"the recording has 90 usable samples.*Record at least 100"):
        load_case(load_lesson(lesson), [first], registry)


def test_a_lesson_that_is_sure_of_everything_is_asked(registry: Registry, tmp_path: Path) -> None:
    lesson, first, _ = write_case(tmp_path, lesson=LESSON.partition("uncertain:")[0])
    with pytest.raises(LessonError, match=r"does not say how sure its values are.*uncertain:"):
        load_case(load_lesson(lesson), [first], registry)


def test_a_share_of_nothing_is_no_uncertainty(registry: Registry, tmp_path: Path) -> None:
    lesson, first, _ = write_case(tmp_path, lesson=LESSON.replace("200 N*s/m}", "200 N*s/m}").replace("viscous: 200", "viscous: 0"))
    text = lesson.read_text(encoding="utf-8").replace("x_axis.viscous: 200 N*s/m", "x_axis.viscous: 0 N*s/m")
    lesson.write_text(text, encoding="utf-8")
    with pytest.raises(LessonError, match=r"x_axis.viscous is 0, and a share of it is no uncertainty"):
        load_case(load_lesson(lesson), [first], registry)


def test_an_uncertainty_may_be_a_quantity(registry: Registry, tmp_path: Path) -> None:
    lesson, first, _ = write_case(tmp_path, lesson=LESSON.replace("x_axis.mass: 5 %", "x_axis.mass: 500 g"))
    assert load_case(load_lesson(lesson), [first], registry).machine.uncertain["x_axis.mass"] == pytest.approx(0.5)


@pytest.mark.parametrize("missing", ["seen", "push"])
def test_a_column_that_is_not_there_is_named(missing: str, registry: Registry, tmp_path: Path) -> None:
    lesson, first, _ = write_case(tmp_path)
    first.write_text(first.read_text(encoding="utf-8").replace(f"{missing} [", "other ["), encoding="utf-8")
    with pytest.raises(LatheSimError, match=missing):
        load_case(load_lesson(lesson), [first], registry)


def test_serious_findings_are_faults() -> None:
    findings = (Finding("gap", "", "two rows are missing", "bridged"), Finding("frozen", POSITION, "it stands still", "", serious=True))
    assert Recorded("a.csv", recording(count=200), findings).faults == (findings[1],)


def test_a_frozen_sensor_is_a_fault_of_the_recording(registry: Registry, tmp_path: Path) -> None:
    lesson, first, _ = write_case(tmp_path)
    rows = np.loadtxt(first, delimiter=",", skiprows=1)
    rows[:, 2] = rows[0, 2]
    np.savetxt(first, rows, delimiter=",", header="t [s],push [N],seen [mm]", comments="", fmt="%.10g")
    (recorded,) = load_case(load_lesson(lesson), [first], registry).recordings
    assert [fault.channel for fault in recorded.faults] == [POSITION]
