"""What is beyond belief on a small lathe is usual on a large machine: bounds are taken from what acts there."""

import functools
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lathesim.diagnosis.explaining.plausible import Implausible, is_usual, runs_away, unusual_sizes
from lathesim.diagnosis.explaining.search import explain
from lathesim.diagnosis.explaining.starts import candidate_free
from lathesim.diagnosis.explaining.trial import modelled
from lathesim.diagnosis.method import Method
from lathesim.diagnosis.reporting.explanations import _why_implausible
from lathesim.effects.drive_errors import AmplifierDeadZone, DriveSaturation, SlewLimit
from lathesim.effects.effect import Effect
from lathesim.effects.force_law import WearForceGrowth
from lathesim.effects.friction import AsymmetricFriction, CoulombFriction, PreslidingFriction, StribeckFriction, ViscousWarmUp
from lathesim.effects.offset_and_gain import ConverterOffset, DriveGainError, ForceOffset, ScaleFactorError
from lathesim.effects.time_shift import TransportDelay
from lathesim.identification.catalogue import insert_candidates
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records import Model
from lathesim.identification.replay.experiment import Experiment
from tests.diagnosis.one_cut import cut_machine
from tests.diagnosis.pushed_table import FORCE, POSITION, VISCOUS, Hidden, as_record, baseline, experiments, machine, recording, study

RUBBING = Hidden(dry=15.0)


def test_a_friction_may_be_as_large_as_what_pushes() -> None:
    experiment, other = experiments(recording(RUBBING), recording(RUBBING, seed=2))
    sizes = study(experiment, other).possible
    level = next(name for name in sizes if name.endswith("coulomb_friction.level"))
    assert sizes[level] == pytest.approx(float(np.max(np.abs(experiment.record[FORCE]))))
    assert not any("period" in name or "phase" in name for name in sizes)
    assert POSITION in experiment.machine.compare


def test_a_friction_may_rise_over_the_whole_way() -> None:
    tables = experiments(recording(RUBBING), recording(RUBBING, seed=2), effects=(PreslidingFriction, StribeckFriction))
    experiment, sizes = tables[0], {name.partition("friction.")[2]: size for name, size in study(*tables).possible.items()}
    assert sizes["distance"] == pytest.approx(float(np.ptp(experiment.record[POSITION])), rel=0.01)
    assert 0.0 < sizes["stribeck_velocity"] < 1.0


def judging(possible: dict[str, float] | None = None) -> Any:
    """Return a study of a machine on which parameters could be so large."""
    return SimpleNamespace(method=Method(), possible=possible or {}, pushing={}, earlier=None)


@pytest.mark.parametrize(("possible", "believed"), [(0.0, False), (1e5, True)], ids=["a small machine", "a large one"])
def test_a_size_is_believed_where_that_much_acts(possible: float, believed: bool) -> None:
    (experiment, _) = experiments(recording(RUBBING), recording(RUBBING, seed=2))
    candidate = next(candidate for candidate in experiment.candidates if candidate.name == "CoulombFriction")
    (level,) = candidate.parameters
    assert (not any(unusual_sizes(judging({level: possible}), candidate, {level: 50_000.0}))) == believed


@pytest.mark.parametrize(("size", "believed"), [(1.2, True), (3.0, False)], ids=["nearly all", "far more"])
def test_a_force_is_not_clearly_larger_than_all_that_pushes(size: float, believed: bool) -> None:
    """On a motion in one direction an offset and a friction of six times what the drive gives had cancelled each other."""
    tables = experiments(recording(RUBBING), recording(RUBBING, seed=2), effects=(ForceOffset,))
    (candidate,) = tables[0].candidates
    offset = size * float(np.max(np.abs(tables[0].record[FORCE])))
    assert is_usual(study(*tables), candidate, dict.fromkeys(candidate.parameters, offset)) == believed


@pytest.mark.parametrize(("delay", "believed"), [(1e-7, False), (1.5e-3, True)], ids=["a command that was held", "a delay"])
def test_a_delay_of_next_to_nothing_is_none(delay: float, believed: bool) -> None:
    tables = experiments(recording(RUBBING), recording(RUBBING, seed=2), effects=(TransportDelay,))
    (candidate,) = tables[0].candidates
    assert is_usual(study(*tables), candidate, dict.fromkeys(candidate.parameters, delay)) == believed


@pytest.mark.parametrize(("time_constant", "believed"), [(0.05, False), (0.5, True)], ids=["over at once", "during 4 s"])
def test_a_warm_up_that_is_over_before_the_recording_begins_is_another_friction(time_constant: float, believed: bool) -> None:
    tables = experiments(recording(RUBBING), recording(RUBBING, seed=2), effects=(ViscousWarmUp,))
    (candidate,) = tables[0].candidates
    values = dict(zip(candidate.parameters, candidate.points[0], strict=True)) | {f"{candidate.part}.time_constant": time_constant}
    assert is_usual(study(*tables), candidate, values) == believed


@functools.cache
def with_errors_of_drives() -> tuple[Experiment, Experiment]:
    """Return two recordings of one table with all effects of the next test: one machine is compiled for all of them."""
    effects = (AmplifierDeadZone, DriveSaturation, SlewLimit, DriveGainError, ScaleFactorError)
    first, second = experiments(recording(RUBBING), recording(RUBBING, seed=2), effects=effects)
    return first, second


PEAK = float(np.max(np.abs(recording(RUBBING).channels[FORCE].values)))


@pytest.mark.parametrize(
    ("effect", "value", "believed"),
    [
        (AmplifierDeadZone, 0.95 * PEAK, False),
        (AmplifierDeadZone, 0.2 * PEAK, True),
        (DriveSaturation, 0.0, False),
        (DriveSaturation, 0.3 * PEAK, True),
        (SlewLimit, 300.0, True),
        (DriveGainError, -0.9, False),
        (DriveGainError, 0.5, True),
        (ScaleFactorError, 0.0005, False),
        (ScaleFactorError, 0.001, True),
        (ScaleFactorError, 0.5, True),
    ],
)
def test_an_effect_that_takes_a_drive_or_a_sensor_away_is_none(effect: type[Effect], value: float, believed: bool) -> None:
    """A drive that is as good as switched off, or a scale that stands still, is like a table that friction holds; but 1000 is a unit."""
    tables = with_errors_of_drives()
    (candidate,) = (one for one in tables[0].candidates if one.effect is effect)
    (size, *_) = effect.neutral
    values = {**dict(zip(candidate.parameters, candidate.points[0], strict=True)), f"{candidate.part}.{size}": value}
    values |= {f"{candidate.part}.sag": 0.0} if effect is DriveGainError else {}
    assert is_usual(study(*tables), candidate, values) == believed


@pytest.mark.parametrize(
    ("effects", "names", "move"),
    [((AmplifierDeadZone, CoulombFriction), ["CoulombFriction"], "swap"), ((AmplifierDeadZone,), [], "drop")],
    ids=["another one explains it", "nothing else does"],
)
def test_what_is_no_longer_believed_goes(effects: tuple[type[Effect], ...], names: list[str], move: str) -> None:
    """A table that friction holds stands as one whose drive does nothing: a search that came to that goes on."""
    held = Hidden(dry=200.0)
    first, second = experiments(recording(held, count=600), recording(held, count=600, seed=2), effects=effects)
    asked = study(first, second)
    zone = next(one for one in first.candidates if one.effect is AmplifierDeadZone)
    fitted = fit(first.sensed, [*baseline(first), *candidate_free(asked, zone, np.array([2.0 * PEAK]))])
    found = explain(asked, modelled(asked, (zone,), fitted))
    assert [one.name for one in found.model.candidates] == names
    assert (found.history[0].move, found.history[0].went) == (move, ("AmplifierDeadZone at x_axis",))


def test_an_offset_of_a_reading_takes_no_drive_away() -> None:
    """The same effect sits at a drive and at a speed that a motor's own electronics show."""
    log, shown = recording(RUBBING), "x_axis.velocity"
    log = as_record(
        {FORCE: ("N", log[FORCE]), POSITION: ("m", log[POSITION]), shown: ("m/s", np.gradient(log[POSITION], log.sample_period))}
    )
    tables = experiments(log, log, effects=(ConverterOffset,), of=replace(machine(), compare=(POSITION, shown)))
    (candidate,) = (one for one in tables[0].candidates if one.at == shown)
    assert is_usual(study(*tables), candidate, dict.fromkeys(candidate.parameters, 0.01))


def test_a_size_that_is_not_believed_is_named_with_its_bound() -> None:
    (experiment, _) = experiments(recording(RUBBING), recording(RUBBING, seed=2))
    friction, other = (next(one for one in experiment.candidates if one.name == name) for name in ("CoulombFriction", "ForceOffset"))
    (level,) = friction.parameters
    (objection,) = unusual_sizes(judging({level: 1e4}), friction, {level: 50_000.0})
    assert (objection.names, objection.size, objection.bound) == ((level,), 50_000.0, 1e4)
    asked = SimpleNamespace(estimation=experiment)
    said = [_why_implausible(objection, SimpleNamespace(candidate=one), asked) for one in (friction, other)]  # type: ignore[arg-type]
    assert said == [
        "needs a level of 50 kN, beyond the plausible 10 kN",
        "needs CoulombFriction beside it, which needs a level of 50 kN, beyond the plausible 10 kN",
    ]
    runs_off = _why_implausible(Implausible("runs away"), SimpleNamespace(candidate=other), asked)  # type: ignore[arg-type]
    assert runs_off == "makes the simulation run away from the recording"


@pytest.mark.parametrize(
    ("growth", "rate", "usual"), [(800.0, 8e-5, True), (3000.0, 1e-3, False)], ids=["a usual product", "no wear at all"]
)
def test_of_a_growth_and_a_rate_of_wear_only_the_product_is_judged(growth: float, rate: float, usual: bool) -> None:
    """A rate of wear eighty times beyond any with a small growth is a usual wear that nobody can take apart."""
    _, candidates = insert_candidates(cut_machine().assembly, [WearForceGrowth])
    (candidate,) = candidates
    values = {
        f"{candidate.part}.{name}": value
        for name, value in (("growth", growth), ("rate", rate), ("break_in", 1e-5), ("break_in_time", 30.0))
    }
    assert (not any(unusual_sizes(judging(), candidate, values))) == usual


@pytest.mark.parametrize(("share", "away"), [(0.1, False), (4.0, True)], ids=["it brakes less one way", "it pushes one way"])
def test_a_friction_that_pushes_is_none(share: float, away: bool) -> None:
    """What the viscous friction has less in one direction than the host has in all drives the table on by itself."""
    first, second = experiments(recording(), recording(seed=2), effects=(AsymmetricFriction,))
    asked, (candidate,) = study(first, second), first.candidates
    values = np.array([1.0, 0.0, -share * VISCOUS])
    fitted = fit(first.sensed, [*baseline(first), *candidate_free(asked, candidate, values)])
    model = modelled(asked, (candidate,), replace(fitted, values=np.r_[fitted.values[: -len(values)], values]))
    assert runs_away(asked, model) == away


def test_a_friction_with_which_the_machine_stands_is_none() -> None:
    """Along the recorded motion it may be anything; the lesson alone makes that motion nearly."""
    first, second = experiments(recording(), recording(seed=2), effects=(CoulombFriction,))
    asked, (candidate,) = study(first, second), first.candidates
    fitted = fit(first.sensed, [*baseline(first), *candidate_free(asked, candidate, np.array([1.0]))])
    found = []
    for level in (1.0, 500.0):
        made = replace(fitted, values=np.r_[fitted.values[:-1], level])
        found.append(runs_away(asked, Model((candidate,), made, replace(fitted, values=made.values))))
    assert found == [False, True]
