"""The comparators of the suite answer what they should be able to, so that what they get wrong is their method's fault and not a slip's."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.diagnosis.suite.axis_physics import AxisPhysics
from tests.diagnosis.suite.axis_rig import simulate_axis
from tests.diagnosis.suite.beside import folder_beside, groups, lines_of, others
from tests.diagnosis.suite.cases import write_case
from tests.diagnosis.suite.comparators.answer import COMPARATORS, ask
from tests.diagnosis.suite.comparators.axis_model import AxisNumbers, simulate_axis_numbers
from tests.diagnosis.suite.comparators.equation_error import since_reversal, strongest_periods
from tests.diagnosis.suite.comparators.raw_bic import Candidate, select
from tests.diagnosis.suite.comparators.read_case import Case, read_case
from tests.diagnosis.suite.comparators.sindy import Residual, sparse_terms
from tests.diagnosis.suite.references import rich_course
from tests.diagnosis.suite.schedule import Entry, schedule

TIME = np.arange(4000) * 1e-2


class Line:
    """A grey box that is a line of uncertain slope, with waves that may be added to it."""

    def __init__(self, observed: np.ndarray) -> None:
        self.observed = observed[None]
        self.uncertain = {"slope": (1.0, 0.1)}

    def run(self, values: Mapping[str, float]) -> np.ndarray:
        waves = sum(values.get(f"wave{n}", 0.0) * np.sin(n * TIME) for n in range(1, 6))
        return np.asarray(values["slope"] * TIME + waves)[None]


WAVES = [Candidate(f"wave{n}", (f"wave{n}",), (((0.0,), ((1.0,),)),), (-100.0,), (100.0,)) for n in range(1, 6)]


def selected(observed: np.ndarray) -> list[str]:
    return [one.key for one in select(Line(observed), WAVES).model.candidates]


def white(size: float = 1.0) -> np.ndarray:
    return size * np.random.default_rng(5).standard_normal(len(TIME))


def test_raw_criterion_names_what_is_there_and_refits_the_uncertain_value() -> None:
    chosen = select(Line(1.1 * TIME + 0.7 * np.sin(3 * TIME) + white()), WAVES)
    assert [one.key for one in chosen.model.candidates] == ["wave3"]
    assert chosen.model.values["wave3"] == pytest.approx(0.7, abs=0.1)
    assert chosen.model.values["slope"] == pytest.approx(1.1, abs=3e-3)


def test_raw_criterion_is_quiet_in_white_noise_and_not_in_slow_noise() -> None:
    assert selected(TIME + white()) == []
    assert selected(TIME + lfilter([1.0], [1.0, -0.99], white(0.1)))


def test_sparse_regression_names_the_term_that_is_there() -> None:
    library = {f"wave{n}": np.sin(n * TIME) for n in range(1, 6)}
    line = [(TIME, 0.1)]
    assert sparse_terms([Residual(0.2 * TIME + 0.7 * np.sin(3 * TIME) + white(), line, library)]) == [("wave3", ())]
    assert sparse_terms([Residual(0.2 * TIME + white(), line, library)]) == []


def test_sparse_regression_makes_nothing_of_what_is_too_small() -> None:
    small = Residual(1e-3 * np.sin(TIME), [], {"wave1:a": np.sin(TIME)}, ties={"wave1": ("wave9",)})
    assert sparse_terms([small]) == [("wave1", ("wave9",))]
    assert sparse_terms([dataclasses.replace(small, smallest=1e-2)]) == []


def test_strongest_wavelength_is_found_over_the_place() -> None:
    place = 0.1 * np.sin(TIME)
    residual = np.sin(2.0 * np.pi * place / 0.004) + place + white(0.3)
    assert strongest_periods(place, residual, 1e-3, 0.02, 1)[0] == pytest.approx(0.004, rel=0.01)


def test_distance_since_reversal_has_the_sign_of_the_motion() -> None:
    place = np.r_[np.linspace(0.0, 1.0, 11), np.linspace(1.0, 0.5, 6)]
    travelled = since_reversal(place, band=0.01)
    assert travelled[[10, -1]] == pytest.approx([1.0, -0.5])


@pytest.mark.slow
def test_grey_box_of_an_axis_runs_as_the_axis_of_the_truth_does() -> None:
    """With other steps, and friction and lag in both."""
    physics = AxisPhysics(coulomb=20.0, inductance_time=3e-3, velocity_gain=250.0, position_gain=20.0, converter_bits=32.0)
    exact = physics._replace(encoder_resolution=0.0, encoder_noise=0.0)
    course = rich_course(np.random.default_rng(2), 0.1, 0.1, 2.0).position[:6000]
    true = simulate_axis(exact, course, np.zeros((3, len(course))), np.zeros(len(course)))
    same = ("mass", "viscous", "conductance", "effort_constant", "velocity_gain", "position_gain", "mean_share", "coulomb")
    numbers = AxisNumbers(**{name: getattr(exact, name) for name in same}, lag=3e-3)
    command, encoder = simulate_axis_numbers(numbers, course, 0.0)[:2]
    assert np.std(command - true.command) < 0.02 * np.std(true.command)
    assert np.std(encoder - true.encoder) < 2e-3 * np.std(true.encoder)


@pytest.fixture(scope="module")
def edge(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cut with the force of a blunt edge hidden in it."""
    folder = tmp_path_factory.mktemp("cases") / "case_000"
    write_case(4, schedule(4).index(Entry("cutting", "single", ("edge_force",))), folder)
    return folder


def test_case_is_read_without_its_truth(edge: Path) -> None:
    case = read_case(edge)
    truth = json.loads((edge / "truth.json").read_text())
    assert case.template == "cutting_process"
    assert case.given["specific_force"] == pytest.approx(truth["baseline"]["cutting.specific_force"]["given"])
    assert case.sigma["thrust_ratio"] == pytest.approx(0.05 * case.given["thrust_ratio"])
    assert set(case.fitted) == {"time", "feed", "depth", "speed", *case.channels}
    assert np.max(case.fitted["feed"]) < 1e-3
    assert "truth" not in {field.name for field in dataclasses.fields(Case)}


@pytest.fixture(scope="module")
def answers(edge: Path) -> dict[str, Any]:
    """What the comparators say of it."""
    return {name: ask(name, edge) for name in COMPARATORS}


def test_both_comparators_name_the_edge(answers: dict[str, Any]) -> None:
    first = [told["answer"]["effects"][0] for told in answers.values()]
    assert [one["effect"] for one in first] == ["EdgeForce", "EdgeForce"]
    assert set(first[0]["parameters"]) == {"coefficient"}
    assert set(answers["raw BIC"]["answer"]["fit"]) <= {"dynamometer.main", "dynamometer.thrust", "dynamometer.feed"}


def test_answers_stand_beside_the_programs_on_the_same_cases(edge: Path, answers: dict[str, Any], tmp_path: Path) -> None:
    for name, told in answers.items():
        folder_beside(tmp_path, name).mkdir(parents=True)
        for folder in (folder_beside(tmp_path, name), tmp_path):
            (folder / "case_000.json").write_text(json.dumps(told), encoding="utf-8")
    (folder_beside(tmp_path, "without null")).mkdir()
    assert set(others(tmp_path)) == {*COMPARATORS, "without null"}
    (group,) = groups([edge], tmp_path)
    head, *lines = lines_of(group)
    assert head == ("question", "lathesim", "SINDy on three residuals", "raw BIC")
    assert ("... singles", *["100.0% (1/1)"] * 3) in lines
