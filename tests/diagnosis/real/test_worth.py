"""What answers to real recordings are worth, on answers made up."""

import pytest

from tests.diagnosis.real.recordings import cases
from tests.diagnosis.real.scoring import Answer, changed, row, worth
from tests.shared_data import needs_shared

CASES = {case.name: case for case in cases(every_lesson=True)}


def effect(name, at, *, tied_with=(), **parameters):
    sizes = {key: {"value": value, "unit": "1", "low": low, "high": high} for key, (value, low, high) in parameters.items()}
    return {"effect": name, "at": at, "parameters": sizes, "tied_with": list(tied_with)}


def told(verdict, *effects, after=4.0):
    return {"verdict": verdict, "effects": list(effects), "fit": {"spindle.speed": {"before": 5.5, "after": after}}}


FRICTION = effect("CoulombFriction", "spindle")


@pytest.mark.parametrize(
    ("answer", "mark"),
    [
        (told("named", FRICTION), "right"),
        (told("named", FRICTION, effect("ChannelTimeShift", "spindle_encoder")), "right"),  # the machine shows it too
        (told("named", FRICTION, effect("ForceOffset", "spindle")), "partly"),
        (told("named", FRICTION, after=4.6), "partly"),  # the grey box leaves 4.17
        (told("tied", effect("CoulombFriction", "spindle", tied_with=["PreslidingFriction at spindle"])), "partly"),
        (told("tied", FRICTION, effect("SensorFilter", "spindle.speed", tied_with=["ChannelTimeShift"])), "right"),  # both are right for it
        (told("tied", effect("ForceOffset", "spindle", tied_with=["CoulombFriction at spindle"])), "partly"),
        (told("named", effect("PreslidingFriction", "spindle")), "partly"),
        (told("named", effect("CoulombFriction", "spindle_encoder")), "wrong"),
        (told("unknown", FRICTION), "wrong"),
        ({}, "wrong"),
    ],
)
def test_an_answer_is_right_with_the_names_of_the_truth_and_a_held_out_error_near_that_of_the_grey_box(answer, mark):
    assert worth(CASES["laas_fast"], answer) == mark


def test_a_sound_machine_may_have_other_values_and_one_of_wrong_values_must():
    assert [worth(CASES["a005"], told(verdict)) for verdict in ("no_mismatch", "parameters_only", "unknown")] == ["right", "right", "wrong"]
    assert [worth(CASES["a045"], told(verdict)) for verdict in ("no_mismatch", "parameters_only")] == ["wrong", "right"]


def test_the_table_says_whether_an_interval_holds_the_true_size():
    play = {"verdict": "named", "effects": [effect("Backlash", "second_encoder", width=(4.2e-3, 3.3e-3, 5e-3))]}
    assert "width 0.0042 1, 0.003 is OUT of 0.0033 to 0.005" in row(CASES["half_backlash"], Answer(play, 1.0))[3]


def test_two_runs_side_by_side_show_the_cells_that_changed():
    before, now = ({"laas_fast": Answer(told("named", one), 2.0)} for one in (effect("ForceOffset", "spindle"), FRICTION))
    lines = changed([CASES["laas_fast"]], now, before)
    assert "worth: wrong -> right" in lines[0]
    assert lines[-1] == "0 of 1 answers are the same; processor time 2 s, 2 s before, ratio 1.00"


@needs_shared
def test_every_case_has_its_recordings():
    for case in cases(every_lesson=True):
        assert all(case.file(name).is_file() for name in (case.lesson, case.fitted, case.validation or case.fitted))
