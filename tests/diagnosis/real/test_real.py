"""Real recordings: what answers to them are worth, the comparators, the examples of the manual, and the EMPS benchmark."""

import h5py
import numpy as np
import pytest

from tests.diagnosis.asking import Answer
from tests.diagnosis.emps import PERIOD, Axis, _simulate
from tests.diagnosis.emps import told as axis_of
from tests.diagnosis.real.comparators.candidates import candidates
from tests.diagnosis.real.comparators.equations import Equation
from tests.diagnosis.real.comparators.grey_box import selected
from tests.diagnosis.real.comparators.regressions import best_shape
from tests.diagnosis.real.examples import CHAPTER, standing_alone, with_answer
from tests.diagnosis.real.recordings import cases, real
from tests.diagnosis.real.scoring import changed, row, worth
from tests.shared_data import SHARED, needs_shared

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


TEXT = "# One\n\n<!-- answer of a -->\n\n## Two\n"


def test_every_real_recording_is_an_example_of_the_manual_with_its_picture() -> None:
    text = CHAPTER.read_text(encoding="utf-8")
    for case in real():
        assert text.count(f"<!-- answer of {case.name} -->\n\n```\n") == 1
        assert (CHAPTER.parent / "pictures" / f"real_{case.name}.svg").stat().st_size < 100_000
        assert case.fitted in text


def test_an_answer_takes_the_place_of_the_one_before() -> None:
    first = with_answer(TEXT, "a", "```\nold\n```\n\n![p](a.svg)")
    assert first == "# One\n\n<!-- answer of a -->\n\n```\nold\n```\n\n![p](a.svg)\n\n## Two\n"
    assert with_answer(first, "a", "```\nnew\n```\n\n![p](a.svg)") == first.replace("old", "new")
    with pytest.raises(ValueError, match="no line <!-- answer of b -->"):
        with_answer(TEXT, "b", "")


def test_a_picture_stands_alone_with_rounded_lines_and_whole_labels() -> None:
    drawn = standing_alone('<svg viewBox="0 0 9 9"><path d="M 1.2345 6.789 L 2 3"/><text>0.05</text></svg>')
    assert 'xmlns="http://www.w3.org/2000/svg"' in drawn
    assert 'd="M 1.2 6.7 L 2 3"' in drawn
    assert "<text>0.05</text>" in drawn


TIME = np.arange(4000) * 2e-3


def force(seed, friction=0.0, wave=0.0, noise=0.1):
    """Return the force of a mass of 2 kg with 3 N s/m, unfiltered."""
    rng = np.random.default_rng(seed)
    phases = rng.uniform(-np.pi, np.pi, 3)
    rates = 2.0 * np.pi * np.array([0.3, 0.7, 1.1])
    place = sum(0.05 * np.sin(rate * TIME + phase) for rate, phase in zip(rates, phases, strict=True))
    speed = np.gradient(place, TIME)
    given = {"inertia": (np.gradient(speed, TIME), 2.0, 0.1), "viscous": (speed, 3.0, 0.1)}
    values = sum(value * column for column, value, _ in given.values())
    values = values + friction * np.sign(speed) + wave * np.sin(2.0 * np.pi * place / 0.01) + noise * rng.standard_normal(len(TIME))
    return Equation("force", "axis", "N", values, given, TIME, place, speed, values, lambda column: column)


def named(**hidden):
    model = selected(force(1, **hidden), force(2, **hidden), careful=True)[-1]
    return {term.candidate.effect: term.shape for term in model.terms}


def test_the_grey_box_names_nothing_where_nothing_is_hidden():
    assert not named()


def test_the_grey_box_names_friction_and_a_wave_with_its_period():
    found = named(friction=1.0, wave=0.5)
    assert set(found) == {"CoulombFriction", "Cogging"}
    assert found["Cogging"] == pytest.approx(0.01, rel=0.01)


def test_the_strongest_period_of_a_library_is_that_of_the_wave():
    equation = force(1, wave=0.5)
    cogging = next(one for one in candidates(equation) if one.effect == "Cogging")
    assert best_shape(cogging, equation, equation.values) == pytest.approx(0.01, rel=0.01)


simulate = _simulate.py_func


def test_an_axis_that_coasts_stops_where_dry_and_viscous_friction_leave_it():
    position = simulate(np.zeros(2000), 0.0, 0.1, 95.0, 200.0, 0.0, 20.0, 0.0)
    way = 95.0 / 200.0 * (0.1 - 20.0 / 200.0 * np.log1p(200.0 * 0.1 / 20.0))  # m, integral of (v + F/b) exp(-b t/M) - F/b
    assert position[-1] == pytest.approx(way, rel=1e-12)
    assert np.ptp(position[-1000:]) == 0.0


def test_a_held_force_brings_each_direction_to_its_own_speed():
    forth, back = (simulate(np.full(6000, force), 0.0, 0.0, 95.0, 200.0, -40.0, 20.0, -3.0) for force in (37.0, -43.0))
    assert (forth[-1] - forth[-2]) / PERIOD == pytest.approx((37.0 + 3.0 - 20.0) / 160.0, rel=1e-4)
    assert (back[-1] - back[-2]) / PERIOD == pytest.approx(-(43.0 - 3.0 - 20.0) / 240.0, rel=1e-4)


def test_the_effects_of_an_answer_become_the_values_of_the_axis():
    baseline = {"x_axis.mass": {"refit_with": 95.0}, "x_axis.viscous": {"refit_with": 205.0}}

    def effect(name, **sizes):
        return {"effect": name, "parameters": {key: {"value": value} for key, value in sizes.items()}}

    uneven = [effect("AsymmetricFriction", level=20.0, asymmetry=0.1, viscous_difference=-37.0), effect("ForceOffset", offset=-3.0)]
    assert axis_of({"baseline": baseline, "effects": uneven}) == Axis(95.0, 205.0, -37.0, 20.0, -1.0)
    with pytest.raises(ValueError, match="Backlash is no effect of this model"):
        axis_of({"baseline": baseline, "effects": [effect("Backlash", width=1e-6)]})


@needs_shared
@pytest.mark.parametrize(("name", "mass", "level", "excess"), [("a046", 6642.0, 203.0, 308.0), ("a060", 6318.0, 200.0, 250.0)])
def test_the_friction_of_suite_a_is_both_numbers_together_at_low_speed(name: str, mass: float, level: float, excess: float) -> None:
    """Force of the motor less mass times acceleration at 1 to 4 mm/s, against the direction: the peak has fallen by a third at most."""
    with h5py.File(SHARED / "data" / "suite_a" / f"{name}_fit.h5") as file:
        time, place, current = (file[channel][()] for channel in ("time", "encoder", "current"))
    smooth = np.ones(21) / 21.0
    velocity = np.convolve(np.gradient(place, time[1]), smooth, "same")
    force = 439.823 * current - mass * np.convolve(np.gradient(velocity, time[1]), smooth, "same")
    slow = (np.abs(velocity) > 1e-3) & (np.abs(velocity) < 4e-3)
    friction = float(np.median(force[slow] * np.sign(velocity[slow])))
    assert level + 0.67 * excess < friction < level + excess
    assert friction > 1.3 * max(excess, level)
