"""What predicts as well as an effect at first is tried again in its place before a further effect comes in beside it."""

from dataclasses import replace
from pathlib import Path

from lathesim.diagnosis.explaining.rounds import Rounds
from lathesim.diagnosis.explaining.search import explain
from lathesim.effects.friction import CoulombFriction
from lathesim.effects.lag import MotorInductance
from lathesim.effects.offset_and_gain import ForceOffset
from lathesim.effects.sensor_errors import SensorFilter
from lathesim.effects.time_shift import ChannelTimeShift
from lathesim.identification.replay.experiment import build_experiments
from lathesim.identification.replay.loading import Recorded, load_case
from lathesim.lessons.lesson import load_lesson
from lathesim.plugins import load_registry
from lathesim.record import Record
from tests.diagnosis.pushed_table import Hidden, experiments, recording, study
from tests.diagnosis.rigs.cases import case_of, write_case

ROWS = 1000


def cut(recorded: Recorded) -> tuple[str, Record]:
    """Return the first rows of a recording with its name."""
    record = recorded.record
    channels = {name: replace(channel, values=channel.values[:ROWS]) for name, channel in record.channels.items()}
    return recorded.name, Record(record.time[:ROWS], channels, dict(record.meta))


def test_a_filter_of_the_current_takes_the_place_of_a_lag_and_no_sensor_is_late(tmp_path: Path) -> None:
    """Without the friction both do the same; beside the lag of the motor the encoder was 0.8 ms early."""
    folder = write_case(case_of("servo_current_2k", "pair", 4611, ("coulomb", "current_filter")), tmp_path)[1]
    case = load_case(load_lesson(folder / "lesson.yaml"), [folder / "fit.csv", folder / "validate.csv"], load_registry())
    effects = (CoulombFriction, MotorInductance, SensorFilter, ChannelTimeShift)
    found = explain(study(*build_experiments(case.machine, map(cut, case.recordings), effects)))
    assert {(one.name, one.place) for one in found.model.candidates} == {("CoulombFriction", "x_axis"), ("SensorFilter", "x_axis.current")}


def test_what_is_known_beside_a_model_is_not_fitted_again() -> None:
    asked = study(*experiments(*(recording(Hidden(dry=10.0), seed=seed) for seed in (1, 2)), effects=(CoulombFriction, ForceOffset)))
    (own,) = explain(asked).worth.values()
    known, anew = Rounds(asked).on(own.before, own), Rounds(asked).on(own.before)
    assert [one.name for one in known] == [one.name for one in anew]
    assert [one is own for one in known] == [one.name == own.name for one in known]
    assert not any(one is own for one in anew)
