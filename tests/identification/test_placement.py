"""What may be added to a model: every effect where it can sit, and none of them felt until it is given a size."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from lathesim.diagnosis.explaining.plausible import resonates
from lathesim.effects.backlash_and_screw import Backlash
from lathesim.effects.drive_errors import TorqueRipple
from lathesim.effects.effect import Effect
from lathesim.effects.force_law import ChipThicknessExponent, EdgeForce, EntryBuildUp
from lathesim.effects.friction import CoulombFriction, PreslidingFriction, StribeckFriction
from lathesim.effects.lag import CurrentLoopLag, MotorInductance
from lathesim.effects.offset_and_gain import ConverterOffset, ConverterResolution, ForceOffset, ScaleFactorError
from lathesim.effects.sensor_errors import DynamometerCrosstalk, DynamometerDrift, EncoderEccentricity, LostCounts, SensorFilter
from lathesim.effects.spindle_error import Runout, Unbalance
from lathesim.effects.structure import AxialResonance
from lathesim.effects.time_shift import TransportDelay
from lathesim.engine.assembly import Assembly, Place, Wire
from lathesim.engine.run import run
from lathesim.engine.wiring import wire
from lathesim.identification.catalogue import insert_candidates
from lathesim.lessons.insertion import insert_effect
from lathesim.lessons.lesson import load_machine
from lathesim.lessons.simulate import check_machine
from lathesim.plugins import Registry
from tests.diagnosis.one_cut import cut_machine
from tests.diagnosis.pushed_table import EFFECTS, POSITION, Hidden, machine, pair

TEMPLATES = sorted((Path(__file__).parents[2] / "lesson_configs" / "machines").glob("*.yaml"))
FEWEST = {"voltage_axis": 20, "force_axis": 15, "cascade_axis": 20, "torque_spindle": 8, "cutting_process": 10}
ALIKE = (
    "two_axis_lathe_analytical",
    "two_axis_table",
    "coordinated_plant",
    "closed_controller_xy",
    "rotary_axis",
    "watched_axis",
    "force_axis",
)
"""Machines much like ``two_axis_lathe`` or ``cascade_axis``."""


def assembly_of(template: Path, registry: Registry) -> Assembly:
    return check_machine(load_machine(template), registry).assembly


@pytest.mark.parametrize(
    "template", [pytest.param(path, id=path.stem, marks=pytest.mark.slow if path.stem in ALIKE else ()) for path in TEMPLATES]
)
def test_every_candidate_of_every_template_is_neutral(template: Path, registry: Registry) -> None:
    """The plain run is the run with all candidates in it, bit for bit."""
    assembly = assembly_of(template, registry)
    channels = tuple(wire(assembly).channels)[:40]
    filled, candidates = insert_candidates(assembly, registry.effects.values())  # type: ignore[arg-type]
    assert len(candidates) >= FEWEST.get(template.stem, 1)
    for_runs = {"duration": 40.0 * assembly.sample_period, "engine": "plain", "check_stability": False}
    plain = run(wire(changed(assembly, channels)), **for_runs)  # type: ignore[arg-type]
    full = run(wire(changed(filled, channels)), **for_runs)  # type: ignore[arg-type]
    for channel in channels:
        assert np.array_equal(plain[channel], full[channel], equal_nan=True), channel


def changed(assembly: Assembly, channels: tuple[str, ...]) -> Assembly:
    import dataclasses

    return dataclasses.replace(assembly, record=channels, finish="")


def test_a_candidate_is_named_for_its_host_and_effect() -> None:
    _, candidates = insert_candidates(machine().assembly, EFFECTS)
    assert [(candidate.part, candidate.name, candidate.at) for candidate in candidates] == [
        ("try_x_axis_force_offset", "ForceOffset", "x_axis"),
        ("try_x_axis_torque_ripple", "TorqueRipple", "x_axis"),
        ("try_x_axis_coulomb_friction", "CoulombFriction", "x_axis"),
    ]


def test_frictions_come_last_on_a_port() -> None:
    """They answer to the sum of what else pushes."""
    assembly, _ = insert_candidates(machine().assembly, (CoulombFriction, ForceOffset))
    feeding = {item.target: item.source for item in assembly.wires}
    assert feeding["x_axis.disturbance"] == "try_x_axis_coulomb_friction.outgoing"
    assert feeding["try_x_axis_coulomb_friction.incoming"] == "try_x_axis_force_offset.outgoing"


def test_what_pushes_acts_before_the_friction_that_the_machine_has_already() -> None:
    """A friction that did not know of a constant force would let it push a resting table away."""
    assembly = insert_effect(machine().assembly, CoulombFriction, "x_axis", parameters={"level": 5.0})
    found, _ = insert_candidates(assembly, (ForceOffset, TorqueRipple, StribeckFriction))
    sources = {item.target: item.source for item in found.wires}
    chain = ["x_axis.disturbance"]
    while chain[-1] in sources and sources[chain[-1]]:
        chain.append(sources[chain[-1]].replace(".outgoing", ".incoming"))
    parts = [name.partition(".")[0] for name in chain]
    assert parts[:3] == ["x_axis", "try_x_axis_stribeck_friction", "x_axis_coulomb_friction"]
    assert set(parts[3:]) == {"try_x_axis_force_offset", "try_x_axis_torque_ripple"}


def test_lobes_come_in_whole_numbers_a_turn() -> None:
    _, candidates = insert_candidates(cut_machine().assembly, (Runout,))
    (runout,) = [candidate for candidate in candidates if candidate.name == "Runout"]
    order = [name.endswith(".order") for name in runout.parameters].index(True)
    assert sorted(set(runout.points[:, order])) == [1.0, 2.0, 3.0]


def test_the_phases_of_one_order_have_one_size() -> None:
    """From responses of one size the best phase of a wave is worked out."""
    _, candidates = insert_candidates(cut_machine().assembly, (Runout,))
    (runout,) = [candidate for candidate in candidates if candidate.name == "Runout"]
    sizes = runout.points[:, [name.endswith(".eccentricity") for name in runout.parameters].index(True)]
    assert len(set(sizes)) == 1


def test_what_opens_the_cut_acts_on_all_that_is_in_proportion_to_the_depth() -> None:
    _, candidates = insert_candidates(cut_machine().assembly, (Unbalance, Runout, EdgeForce, ChipThicknessExponent))
    assert [candidate.name for candidate in candidates] == ["ChipThicknessExponent", "EdgeForce", "Runout", "Unbalance"]


def test_what_an_amplifier_shows_may_be_filtered_or_off_by_a_factor(registry: Registry) -> None:
    assembly = assembly_of(next(path for path in TEMPLATES if path.stem == "voltage_axis"), registry)
    candidates = insert_candidates(assembly, (SensorFilter, ScaleFactorError), ["x_drive.current"])[1]
    assert {(candidate.name, candidate.at) for candidate in candidates} >= {
        ("SensorFilter", "x_drive.current"),
        ("ScaleFactorError", "x_drive.current"),
    }


def test_a_filter_is_told_whether_its_signal_is_held_between_samples(registry: Registry) -> None:
    assembly = assembly_of(next(path for path in TEMPLATES if path.stem == "voltage_axis"), registry)
    found, _ = insert_candidates(assembly, (ScaleFactorError, SensorFilter), ["x_drive.current", "x_encoder.position"])
    held = {part.name: part.parameters["held"] for part in found.parts if part.component.__name__ == "SensorFilter"}
    assert held == {"try_x_encoder_sensor_filter": 0.0, "try_x_drive_current_sensor_filter": 1.0}


def voltage_axis_with(registry: Registry, effect: type[Effect], at: str, values: dict[str, float]) -> Assembly:
    """Return the axis whose lesson inserts an effect, called ``own``."""
    assembly = assembly_of(next(path for path in TEMPLATES if path.stem == "voltage_axis"), registry)
    return insert_effect(assembly, effect, at, name="own", parameters=values)


def test_a_command_comes_late_before_the_lag_that_the_lesson_declares(registry: Registry) -> None:
    """Behind it a delay would take what goes on between samples for held."""
    assembly = voltage_axis_with(registry, CurrentLoopLag, "x_drive", {"time_constant": 1e-3})
    found, (delay,) = insert_candidates(assembly, (TransportDelay,), ["x_encoder.position"])
    feeds = {item.target: item.source for item in found.wires}
    assert (delay.at, delay.seat.before, delay.place) == ("x_drive", "own", "own")
    assert feeds["own.incoming"] == f"{delay.part}.outgoing"


def test_a_friction_is_tried_on_both_sides_of_a_spring_that_the_lesson_declares(registry: Registry) -> None:
    values = {"table_share": 0.5, "frequency": 40.0}
    found, both = insert_candidates(voltage_axis_with(registry, AxialResonance, "x_axis", values), (CoulombFriction,))
    feeds = {item.target: item.source for item in found.wires}
    parts = {candidate.seat.before: candidate.part for candidate in both}
    assert {candidate.at for candidate in both} == {"x_axis"}
    assert (feeds["own.motor_side"], feeds["own.incoming"]) == (f"{parts['']}.outgoing", f"{parts['own']}.outgoing")


def test_a_disc_on_an_axis_that_turns_repeats_once_a_turn(registry: Registry) -> None:
    assembly = assembly_of(next(path for path in TEMPLATES if path.stem == "rotary_axis"), registry)
    (candidate,) = [one for one in insert_candidates(assembly, (EncoderEccentricity,))[1] if one.at == "encoder"]
    (turn,) = [place for place, name in enumerate(candidate.parameters) if name.endswith(".turn")]
    assert candidate.low[turn] == candidate.high[turn] == pytest.approx(2.0 * np.pi)


def test_starting_values_spread_over_the_usual_range_inside_the_bounds() -> None:
    _, candidates = insert_candidates(machine().assembly, (StribeckFriction, TorqueRipple, CoulombFriction))
    for candidate in candidates:
        assert candidate.points.shape[1] == len(candidate.parameters)
        assert len(candidate.points) == (3 if len(candidate.parameters) == 1 else 8)
        assert np.all(candidate.points >= candidate.low)
        assert np.all(candidate.points <= candidate.high)
        for name, column in zip(candidate.parameters, candidate.points.T, strict=True):
            low, high = candidate.effect.identification.typical[name.partition(".")[2]]
            assert np.all(column >= low)
            assert np.all(column <= high)
            assert len(np.unique(column)) == len(column)


def test_the_simplest_form_of_an_effect_has_its_own_values_alone() -> None:
    _, candidates = insert_candidates(machine().assembly, (PreslidingFriction, CoulombFriction))
    presliding, coulomb = (next(one for one in candidates if one.name == name) for name in ("PreslidingFriction", "CoulombFriction"))
    assert [Place.of(name).port for name in presliding.parameters] == ["level", "distance"]
    assert presliding.points.shape[1] == len(presliding.low) == 2
    assert presliding.shaped is not None
    assert len(presliding.shaped.parameters) == 5
    assert coulomb.shaped is None


def test_a_converter_is_looked_for_from_whole_bits() -> None:
    _, (candidate,) = insert_candidates(machine().assembly, (ConverterResolution,))
    assert [20.0 / 255.0, 0.5] in candidate.points.tolist()
    assert [20.0 / 4096.0, 0.0] in candidate.points.tolist()


def test_neutral_values_are_those_of_the_effect() -> None:
    _, (candidate,) = insert_candidates(machine().assembly, (CoulombFriction,))
    assert candidate.neutral.tolist() == [0.0]
    assert candidate.low.tolist() == [0.0]


def test_a_phase_belongs_to_the_recording() -> None:
    _, (candidate,) = insert_candidates(machine().assembly, (TorqueRipple,))
    assert candidate.nuisance == ("try_x_axis_torque_ripple.phase",)


def test_sensors_that_nobody_looks_at_get_no_candidates(registry: Registry) -> None:
    assembly = assembly_of(next(path for path in TEMPLATES if path.stem == "force_axis"), registry)
    at = [candidate.at for candidate in insert_candidates(assembly, (Backlash,))[1]]
    assert {"x_encoder", "x_scale"} <= set(at)
    at = [candidate.at for candidate in insert_candidates(assembly, (Backlash,), [POSITION])[1]]
    assert "x_scale" not in at


def test_what_a_drive_leaves_out_belongs_to_the_drive(registry: Registry) -> None:
    assembly = assembly_of(next(path for path in TEMPLATES if path.stem == "voltage_axis"), registry)
    candidates = insert_candidates(assembly, (MotorInductance, ConverterOffset))[1]
    assert {(candidate.name, candidate.at) for candidate in candidates} == {("MotorInductance", "x_drive"), ("ConverterOffset", "x_drive")}


def test_an_effect_that_fits_nowhere_gives_no_term() -> None:
    assembly, candidates = insert_candidates(machine().assembly, ())
    assert candidates == []
    assert assembly == machine().assembly


def test_neutral_candidates_leave_a_compiled_replay_alone_too() -> None:
    experiment = pair(Hidden())[0]
    names = [name for candidate in experiment.candidates for name in candidate.parameters]
    neutral = [value for candidate in experiment.candidates for value in candidate.neutral]
    unset = experiment.replayed.one({"x_axis.mass": 40.0})
    assert np.array_equal(experiment.replayed.one({"x_axis.mass": 40.0, **dict(zip(names, neutral, strict=True))}), unset)


def test_each_compared_reading_of_a_sensor_has_a_zero_of_its_own() -> None:
    assembly = cut_machine().assembly
    wires = (*assembly.wires, Wire("dynamometer.thrust_force", "cutting.thrust_force"))
    machine = dataclasses.replace(assembly, wires=wires)
    _, candidates = insert_candidates(machine, [DynamometerDrift, EntryBuildUp], ("dynamometer.main", "dynamometer.thrust"))
    assert [(candidate.name, candidate.at) for candidate in candidates] == [
        ("EntryBuildUp", "cutting"), ("DynamometerDrift", "dynamometer"), ("DynamometerDrift", "dynamometer.thrust")
    ]  # fmt: skip


def test_a_channel_may_have_a_share_of_another_one_that_is_compared() -> None:
    """Of one that is not, it would be a factor on the own channel."""
    assembly = cut_machine().assembly
    wires = (*assembly.wires, *(Wire(f"dynamometer.{name}_force", f"cutting.{name}_force") for name in ("thrust", "feed")))
    machine = dataclasses.replace(assembly, wires=wires)
    _, candidates = insert_candidates(machine, [DynamometerCrosstalk], ("dynamometer.main", "dynamometer.thrust"))
    assert [(candidate.at, dict(candidate.seat.senses)) for candidate in candidates] == [
        ("dynamometer", {"other_force": "cutting.thrust_force"}), ("dynamometer.thrust", {"other_force": "cutting.main_force"})
    ]  # fmt: skip


def test_a_term_has_its_plain_shape_until_it_is_found() -> None:
    _, (lost,) = insert_candidates(machine().assembly, [LostCounts])
    assert [name.partition(".")[2] for name in lost.parameters] == ["jump", "instant"]
    assert lost.shaped is not None
    assert set(lost.parameters) < set(lost.shaped.parameters)
    assert (lost.shaped.part, lost.shaped.at, lost.shaped.shaped) == (lost.part, lost.at, None)
    neutral = dict(zip(lost.shaped.parameters, lost.shaped.neutral.tolist(), strict=True))
    assert neutral[f"{lost.part}.second_jump"] == 0.0


@pytest.mark.parametrize(("name", "second"), [("cascade_axis", "x_scale"), ("voltage_axis", "x_scale"), ("torque_spindle", "tachometer")])
def test_an_error_between_two_sensors_is_told_at_the_one_that_closes_no_loop(name: str, second: str, registry: Registry) -> None:
    """Either sensor would explain it: a screw sits between motor and scale, and it is no counter that has a wrong gain."""
    template = next(template for template in TEMPLATES if template.stem == name)
    _, candidates = insert_candidates(assembly_of(template, registry), [ScaleFactorError])
    assert [candidate.at for candidate in candidates if candidate.seat.second] == [second]
    assert len(candidates) > 1


def test_a_resonance_is_no_faster_than_samples_show(registry: Registry) -> None:
    """Beyond half of their rate a spring with any frequency does the same."""
    table = dataclasses.replace(machine().assembly, sample_period=4e-3)
    _, candidates = insert_candidates(table, [registry.effect("AxialResonance")])  # type: ignore[list-item]
    (candidate,) = candidates
    place = candidate.parameters.index(f"{candidate.part}.frequency")
    assert candidate.high[place] == 125.0
    assert candidate.points[:, place].max() == 125.0
    # a lag is another effect: with as much damping as there may be nothing resonates any more
    values = dict(zip(candidate.parameters, candidate.high.tolist(), strict=True))
    damping = f"{candidate.part}.damping"
    assert values[damping] == pytest.approx(0.7071, rel=1e-4)
    assert [resonates(candidate, {**values, damping: value}) for value in (values[damping], 0.3)] == [False, True]


def test_an_axis_out_of_square_is_looked_for_along_each_other_axis(registry: Registry) -> None:
    """A single axis has none beside it; the spindle of a lathe turns, and nothing is square to that."""
    squareness = registry.effect("SquarenessError")
    lathe = next(template for template in TEMPLATES if template.stem == "two_axis_lathe")
    filled, candidates = insert_candidates(assembly_of(lathe, registry), [squareness])
    sources = {wire.target: wire.source for wire in filled.wires}
    assert {(candidate.seat.of_motion, candidate.seat.senses["other_position"]) for candidate in candidates} == {
        ("x_axis", "z_axis.position"), ("z_axis", "x_axis.position")
    }  # fmt: skip
    assert all(sources[f"{candidate.part}.other_position"] == candidate.seat.senses["other_position"] for candidate in candidates)
    alone = next(template for template in TEMPLATES if template.stem == "cascade_axis")
    assert insert_candidates(assembly_of(alone, registry), [squareness])[1] == []


@pytest.mark.parametrize(("side", "unsaid"), [("", True), ("load", False), ("motor", False)])
def test_a_spring_may_be_on_either_side_of_the_only_sensor_unless_the_lesson_says_its_side(registry, side, unsaid):
    bare = assembly_of(next(path for path in TEMPLATES if path.stem == "torque_spindle"), registry)
    parts = tuple(dataclasses.replace(part, side=side if part.name == "spindle_encoder" else part.side) for part in bare.parts)
    assembly, (spring,) = insert_candidates(dataclasses.replace(bare, parts=parts), [AxialResonance], ["spindle_encoder.angle"])
    setting = f"{spring.part}_beyond_spindle_encoder.share"
    assert spring.seat.unsaid_side == ({"spindle_encoder": setting} if unsaid else {})
    assert spring.otherwise == ({setting: 0.0} if unsaid else {})
    assert set(spring.otherwise) <= set(wire(dataclasses.replace(assembly, finish="", record=())).parameters)
