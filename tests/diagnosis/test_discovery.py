"""Discovery: what is in no catalogue comes out as a formula with units, and as a plug-in file that runs."""

import functools
from pathlib import Path

import numpy as np
import pytest

from lathesim.conformance import check_component
from lathesim.diagnosis.discovery.generated_plugin import plugin_text
from lathesim.diagnosis.discovery.sparse_regression import Addend, Discovered, Span, discover
from lathesim.effects.effect import Effect
from lathesim.engine.assembly import Part, Wire
from lathesim.engine.run import run
from lathesim.engine.wiring import wire
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.replay.experiment import RecordedMachine, baseline_free
from lathesim.identification.replay.joined import joined
from lathesim.lessons.insertion import insert_effect
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import simulate
from lathesim.plugins import load_registry
from lathesim.units import si_factor
from tests.diagnosis.pushed_table import FORCE, LESSON, POSITION, Hidden, Law, baseline, baselines, experiments, machine, pair, recording


def drag(v: float, q: float, t: float) -> float:
    return 600.0 * v * abs(v)


def spring_and_push(v: float, q: float, t: float) -> float:
    return 400.0 * q + 5.0


def wave(v: float, q: float, t: float) -> float:
    return float(5.0 * np.sin(300.0 * q))


@functools.cache
def discovered(law: Law | None) -> Discovered | None:
    (experiment, validation), (fitted, judged) = pair(Hidden(law=law)), baselines(Hidden(law=law))
    return discover(experiment, fitted, validation, judged)


def formula(law: Law) -> Discovered:
    found = discovered(law)
    assert found is not None
    return found


def test_a_drag_that_grows_with_the_square_of_speed() -> None:
    found = formula(drag)
    (addend,) = found.addends
    assert (found.at, found.unit, addend.text, addend.unit) == ("x_axis.disturbance", "N", "v * abs(v)", "N/(m/s)^2")
    assert addend.coefficient == pytest.approx(600.0, rel=0.05)
    assert abs(addend.coefficient - 600.0) < 4.0 * addend.error
    assert found.share > 0.95
    assert found.formula.endswith("N/(m/s)^2) v * abs(v)  [N]")


def test_a_sum_of_two_functions() -> None:
    found = formula(spring_and_push)
    addends = {addend.text: addend for addend in found.addends}
    assert set(addends) == {"q", "1.0"}
    assert addends["q"].coefficient == pytest.approx(400.0, rel=0.01)
    assert addends["q"].unit == "N/m"
    assert addends["1.0"].coefficient == pytest.approx(5.0, rel=0.01)
    assert addends["1.0"].unit == "N"


def test_a_wave_over_the_place() -> None:
    found = formula(wave)
    for addend in found.addends:
        number = float(addend.text.split("(")[1].split(" ")[0])
        assert number == pytest.approx(300.0, rel=0.01)
    assert np.linalg.norm([addend.coefficient for addend in found.addends]) == pytest.approx(5.0, rel=0.05)


def test_every_coefficient_has_a_unit_that_can_be_read() -> None:
    for law in (drag, spring_and_push, wave):
        for addend in formula(law).addends:
            assert si_factor(addend.unit)[0] == 1.0


def test_nothing_is_discovered_in_noise() -> None:
    assert discovered(None) is None


def test_nothing_is_discovered_that_the_other_recording_does_not_show() -> None:
    first, second = experiments(recording(Hidden(law=drag), seed=1), recording(seed=2))
    fitted, judged = (fit(experiment.sensed, baseline(experiment)) for experiment in (first, second))
    assert discover(first, fitted, second, judged) is None


def test_recordings_that_were_fitted_together_leave_none_to_judge_a_formula() -> None:
    """The search for one ended without an answer there: its addends were in the machine of none of the recordings."""
    both = joined(pair(Hidden(law=drag)))
    fitted = fit(both.sensed, [*baseline_free(both.machine), *both.start_states(both.sensed.plan)])
    assert discover(both, fitted, both, fitted) is None


def test_what_a_value_of_the_machine_can_take_up_is_no_discovery() -> None:
    """More mass and more viscous friction are other values, not missing physics."""
    (experiment, validation) = experiments(*(recording(Hidden(mass=44.0, viscous=240.0), seed=seed) for seed in (1, 2)))
    fitted, judged = (fit(one.sensed, baseline(one)) for one in (experiment, validation))
    assert discover(experiment, fitted, validation, judged) is None


def test_an_error_of_a_second_sensor_is_found_in_its_own_channel() -> None:
    given = machine()
    parts = (*given.assembly.parts, Part("x_scale", given.assembly.parts[1].component, {"resolution": 1e-6}))
    wires = (*given.assembly.wires, Wire("x_scale.measured", "x_axis.position"))
    assembly = type(given.assembly)(parts, wires, given.assembly.sample_period, given.assembly.step)
    two = RecordedMachine(assembly, (FORCE,), (POSITION, "x_scale.position"), given.uncertain, {POSITION: 1e-6, "x_scale.position": 1e-6})
    records = []
    for seed in (1, 2):
        record = recording(seed=seed)
        bent = record[POSITION] + 0.02 * record[POSITION] ** 2
        records.append(record.with_channel("x_scale.position", "m", np.round(bent / 1e-6) * 1e-6))
    first, second = experiments(*records, of=two)
    fitted, judged = (fit(experiment.sensed, baseline(experiment)) for experiment in (first, second))
    found = discover(first, fitted, second, judged)
    assert found is not None
    assert (found.at, found.unit, found.role) == ("x_scale.position", "m", "reading")
    (addend,) = found.addends
    assert (addend.text, addend.unit) == ("q * q", "m/m^2")
    assert addend.coefficient == pytest.approx(0.02, rel=0.05)


def loaded(folder: Path, found: Discovered) -> type[Effect]:
    (folder / "discovered.py").write_text(plugin_text(found), encoding="utf-8")
    registry = load_registry([folder], installed=False)
    effect = registry.effect("DiscoveredTerm")
    assert registry.problems == []
    assert issubclass(effect, Effect)
    return effect


@pytest.mark.parametrize("law", [drag, spring_and_push, wave])
def test_the_plugin_file_keeps_the_contract(law: Law, tmp_path: Path) -> None:
    effect = loaded(tmp_path, formula(law))
    assert check_component(effect) == []
    assert effect.family == "discovered"
    assert "empirical" in (tmp_path / "discovered.py").read_text(encoding="utf-8")


def test_a_formula_of_time_keeps_the_contract_too(tmp_path: Path) -> None:
    addends = (Addend(2.0, "N/s", "t", 0.1, "t"), Addend(-3.0, "N/(m^2/s)", "q * v", 0.1, "q*v"), Addend(1.0, "N", "tanh(v / 0.01)", 0.1))
    effect = loaded(tmp_path, Discovered("x_axis.disturbance", "N", addends, 0.7, "effort", (Span("t", "s", 0.0, 4.0),)))
    assert check_component(effect) == []
    placed = effect.with_units({"signal": "N", "flow": "m/s", "displacement": "m"})
    assert si_factor(placed.declarations["coefficient_2"].unit) == si_factor("N/(m^2/s)")
    assert effect.laws["output"](1.0, 0.5, 0.25, 4.0, 2.0, -3.0, 1.0) == pytest.approx(1.0 + 2.0 * 4.0 - 3.0 * 0.25 * 0.5 + 1.0)


def test_neutral_values_are_an_identity(tmp_path: Path) -> None:
    effect = loaded(tmp_path, formula(drag))
    given = machine().assembly
    start = {"x_axis.speed": 0.1}
    plain = run(wire(given), duration=0.2, engine="plain", overrides=start)
    neutral = run(wire(insert_effect(given, effect, "x_axis", parameters=effect.neutral)), duration=0.2, engine="plain", overrides=start)
    with_simulated_motion = run(wire(insert_effect(given, effect, "x_axis")), duration=0.2, engine="plain", overrides=start)
    assert np.array_equal(plain["x_axis.position"], neutral["x_axis.position"])
    assert with_simulated_motion["x_axis.position"][-1] < plain["x_axis.position"][-1]


def test_a_lesson_inserts_it_with_its_unit(tmp_path: Path) -> None:
    loaded(tmp_path, formula(drag))
    text = f"{LESSON}insert:\n  - {{effect: DiscoveredTerm, at: x_axis, coefficient_1: 600 N*s^2/m^2}}\n"
    (tmp_path / "table.yaml").write_text(text, encoding="utf-8")
    record = simulate(load_lesson(tmp_path / "table.yaml"), load_registry([tmp_path], installed=False), engine="plain")
    assert record.status == "complete"
