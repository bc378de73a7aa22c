"""The line to paste: every effect at every place, with units that a lesson takes, and without what the recording does not determine."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lathesim.component import Parameter
from lathesim.diagnosis.records.diagnosis import Determined, FoundEffect, Interval
from lathesim.diagnosis.records.found import Found
from lathesim.diagnosis.reporting.effect_report import bounded
from lathesim.diagnosis.reporting.lesson_entry import lesson_entry, without_undetermined, written
from lathesim.effects.friction import AsymmetricFriction
from lathesim.engine.wiring import wire
from lathesim.identification.catalogue import insert_candidates
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records import Candidate
from lathesim.identification.replay.experiment import Experiment
from lathesim.lessons.insertion import insert_effect
from lathesim.lessons.lesson import load_machine
from lathesim.lessons.simulate import check_machine
from lathesim.plugins import Registry
from lathesim.units import quantity
from tests.diagnosis.pushed_table import Hidden, experiments, recording, searched
from tests.effects.rigs import PLACES, machinery

TEMPLATES = sorted((Path(__file__).parents[2] / "lesson_configs" / "machines").glob("*.yaml"))
QUICK = ("cascade_axis", "cutting_process", "torque_spindle", "led_axis")
"""Templates of every run of the tests: an axis, a cut, a spindle, and an axis that is led."""


def check_units(name: str, effect: type) -> None:
    for item, declared in effect.declared(Parameter).items():  # type: ignore[attr-defined]
        text = written(1.5, declared.unit)
        assert "{" not in text and "((" not in text, f"{name}.{item}: {text}"
        assert np.isfinite(quantity(text, declared.unit))


@pytest.mark.parametrize(
    "template",
    [pytest.param(path, id=path.stem, marks=() if path.stem in QUICK else pytest.mark.slow) for path in TEMPLATES],
)
def test_every_value_of_every_candidate_is_written_with_the_unit_of_its_wire(template: Path, registry: Registry) -> None:
    assembly = check_machine(load_machine(template), registry).assembly
    filled, candidates = insert_candidates(assembly, registry.effects.values(), wire(assembly).channels)  # type: ignore[arg-type]
    parts = {part.name: part.component for part in filled.parts}
    for candidate in candidates:
        check_units(f"{candidate.name} at {candidate.at}", parts[candidate.part])


def test_every_effect_of_the_catalogue_is_written_with_units(registry: Registry, tmp_path: Path) -> None:
    for name, (experiment, at, sources, _) in PLACES.items():
        assembly = insert_effect(machinery(experiment, tmp_path), registry.effects[name], at, name="it", sources=sources)
        check_units(name, next(part.component for part in assembly.parts if part.name == "it"))


def found_with(*effects: type) -> tuple[Experiment, Experiment, Found]:
    """Return a table that rubs, searched with an effect that has more to it than the rubbing."""
    experiment, validation = experiments(recording(Hidden(dry=8.0), seed=1), recording(Hidden(dry=8.0), seed=2), effects=effects)
    return experiment, validation, searched(experiment, validation)


@pytest.fixture(scope="module")
def rubbing() -> tuple[Experiment, Experiment, Found, Candidate]:
    experiment, validation, found = found_with(AsymmetricFriction)
    (candidate,) = found.model.candidates
    return experiment, validation, found, candidate


def values_of(found: Found, **changed: float) -> dict[str, float]:
    (candidate,) = found.model.candidates
    return {**found.model.fitted.by_name, **{f"{candidate.part}.{name}": value for name, value in changed.items()}}


def told(level: Interval, difference: Interval, *undetermined: str) -> FoundEffect:
    parameters = {"level": level, "asymmetry": Interval(0.0, "1", -0.5, 0.5), "viscous_difference": difference}
    return FoundEffect("AsymmetricFriction", "x_axis", "reversal", 1.0, parameters, sizes=Determined(undetermined))


SURE, NOTHING = Interval(8.0, "N", 7.9, 8.1), Interval(0.004, "N/(m/s)", -4.0, 4.8)


def test_what_is_not_determined_and_not_missed_is_left_out(rubbing: tuple[Experiment, Experiment, Found, Candidate]) -> None:
    experiment, validation, found, candidate = rubbing
    effect = told(SURE, NOTHING, "viscous_difference")
    (left,) = without_undetermined([effect], [candidate], validation, found, values_of(found, viscous_difference=0.004))
    assert left.sizes.left_out == ("viscous_difference",)
    entry = lesson_entry(left, candidate, found.model.fitted, experiment)
    assert entry == {"effect": "AsymmetricFriction", "at": "x_axis", "level": "8 N", "asymmetry": "0"}


def test_what_is_missed_stays_however_wide_its_interval(rubbing: tuple[Experiment, Experiment, Found, Candidate]) -> None:
    _, validation, found, candidate = rubbing
    effect = told(Interval(8.0, "N", -1.0, 17.0), Interval(40.0, "N/(m/s)", 30.0, 50.0), "level")
    (left,) = without_undetermined([effect], [candidate], validation, found, values_of(found))
    assert left.sizes.left_out == ()


@pytest.mark.parametrize(
    "effect",
    [
        told(SURE, NOTHING),
        told(SURE, Interval(0.4, "N/(m/s)", 0.1, 0.7), "viscous_difference"),
        told(Interval(8.0, "N", -1.0, 17.0), NOTHING, "level", "viscous_difference"),
    ],
    ids=["all determined", "surely not nothing", "nothing would remain"],
)
def test_an_effect_keeps_what_makes_it_felt(effect: FoundEffect, rubbing: tuple[Experiment, Experiment, Found, Candidate]) -> None:
    _, validation, found, candidate = rubbing
    (left,) = without_undetermined([effect], [candidate], validation, found, values_of(found))
    assert left.sizes.left_out == ()


def test_a_value_that_is_not_neutral_by_itself_is_written_as_neutral(
    rubbing: tuple[Experiment, Experiment, Found, Candidate],
) -> None:
    """Left out of the line, a level would be what the effect has where nobody names one."""
    experiment, _, found, candidate = rubbing
    left = replace(told(SURE, NOTHING), sizes=Determined(left_out=("level",)))
    default = experiment.sensed.plan.parts[candidate.part].component.declared(Parameter)["level"].default
    assert ("level" in lesson_entry(left, candidate, found.model.fitted, experiment)) == (default != 0.0)
    kept = [place for place, name in enumerate(candidate.parameters) if not name.endswith(".level")]
    arrays = {name: getattr(candidate, name)[kept] for name in ("neutral", "low", "high", "least", "usual")}
    lean = replace(candidate, parameters=tuple(candidate.parameters[place] for place in kept), points=candidate.points[:, kept], **arrays)
    spared = replace(told(SURE, NOTHING), parameters={"viscous_difference": NOTHING})
    assert ("level" in lesson_entry(spared, lean, found.model.fitted, experiment)) == (default != 0.0)


def test_intervals_end_where_the_declaration_does() -> None:
    lag = Parameter("s", 0.0, low=0.0, high=1.0, doc="a lag")
    assert bounded(Interval(0.003, "s", -0.001, 0.007), lag) == Interval(0.003, "s", 0.0, 0.007, ends=(True, False))
    assert bounded(Interval(0.9, "s", 0.7, 1.1), lag) == Interval(0.9, "s", 0.7, 1.0, ends=(False, True))
    assert bounded(Interval(0.5, "s", 0.4, 0.6), lag) == Interval(0.5, "s", 0.4, 0.6)
    free = Parameter("N", 0.0, doc="a force")
    assert bounded(Interval(0.5, "N", -0.4, 1.4), free) == Interval(0.5, "N", -0.4, 1.4)


def test_a_fit_is_not_touched_by_what_is_written(rubbing: tuple[Experiment, Experiment, Found, Candidate]) -> None:
    experiment, validation, found, candidate = rubbing
    before = found.model.validation_fit.values.copy()
    without_undetermined([told(SURE, NOTHING, "viscous_difference")], [candidate], validation, found, values_of(found))
    assert np.array_equal(found.model.validation_fit.values, before)
    assert fit(experiment.sensed, experiment.start_states(experiment.sensed.plan)).values is not None
