"""A machine in which something is hidden: run by another integrator, with other values and noise, and written down as a class gets it."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lathesim.errors import LatheSimError, LessonError, RecordingError
from lathesim.exercises.class_folder import answer_place, publish
from lathesim.exercises.conceal import Concealed, NotSeenError, Situation, conceal, fine_plan, fine_run
from lathesim.exercises.graded_diagnosis import grade, read_guess
from lathesim.exercises.hidden_effect import place_wishes, random_wishes, read_wish
from lathesim.exercises.logger import LoggedColumn, logged_columns
from lathesim.exercises.sealed_answer import answer_of, changed_files, opened, seal_of
from lathesim.identification.replay.loading import uncertainties
from lathesim.json_text import digest_of
from lathesim.lessons.lesson import Lesson, load_lesson
from lathesim.lessons.recording_mapping import mapping_of
from lathesim.lessons.simulate import Prepared, prepare, run_prepared
from lathesim.plugins import Registry
from lathesim.recordings.mapping import map_recording
from lathesim.recordings.raw_table import read_recording
from tests.diagnosis.small_case import write_lesson

FRICTION = "CoulombFriction:level=20 N@x_axis"


@pytest.fixture(scope="module")
def lesson(tmp_path_factory: pytest.TempPathFactory) -> Lesson:
    return load_lesson(write_lesson(tmp_path_factory.mktemp("lesson"), "0.6 s"))


@pytest.fixture(scope="module")
def prepared(lesson: Lesson, registry: Registry) -> Prepared:
    return prepare(lesson, registry)


def concealed_in(prepared: Prepared, registry: Registry, *wishes: str, seed: int = 1, noise: float = 1.0, runs: int = 1) -> Concealed:
    lesson = prepared.case.lesson
    columns = logged_columns(lesson, prepared.machinery, {})
    asked = [read_wish(text, registry.effects) for text in wishes]
    situations = [Situation(prepared.machinery, prepared.duration, {})] * runs
    return conceal(situations, columns, asked, uncertainties(lesson, prepared.plan), seed=seed, noise=noise)


@pytest.fixture(scope="module")
def friction(prepared: Prepared, registry: Registry) -> Concealed:
    return concealed_in(prepared, registry, FRICTION, seed=3, runs=2)


# ---- the other integrator -------------------------------------------------------------------------------------------------------


def test_the_other_integrator_is_of_second_order(prepared: Prepared) -> None:
    """Against runs with a much finer step the error falls by four with half the step; the sensors resolve everything."""
    exact = tuple(
        replace(part, parameters={**part.parameters, "resolution": 0.0}) if "encoder" in part.name or "scale" in part.name else part
        for part in prepared.machinery.parts
    )
    assembly = replace(prepared.machinery, parts=exact, step=1e-3, record=("x_axis.position",))
    truth = fine_run(fine_plan(assembly, finer=64), 0.3)["x_axis.position"]
    errors = [float(np.abs(fine_run(fine_plan(assembly, finer=finer), 0.3)["x_axis.position"] - truth).max()) for finer in (2, 4, 8)]
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert orders == pytest.approx([2.0, 2.0], abs=0.1)


def test_it_differs_from_the_engine_and_by_next_to_nothing(prepared: Prepared) -> None:
    ours = fine_run(fine_plan(prepared.machinery), prepared.duration)
    engine = run_prepared(prepared, engine="plain")
    difference = np.abs(ours["x_axis.velocity"] - engine["x_axis.velocity"]).max()
    assert 0.0 < difference < 1e-4


# ---- what is asked for -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("CoulomFriction", "there is no effect 'CoulomFriction'. Did you mean 'CoulombFriction'?"),
        (
            "CoulombFriction:levle=20 N@x_axis",
            "CoulombFriction:levle=20 N@x_axis: CoulombFriction has no parameter 'levle'. Did you mean 'level'?",
        ),
        ("CoulombFriction:level", "CoulombFriction:level: 'level' gives no value. Write it as CoulombFriction:level=20 N@x_axis."),
        ("CoulombFriction:level=20 mm@x_axis", "'20 mm' is given in mm, but N is wanted. Use a unit like N."),
        (
            "CoulombFriction:level=-1 N@x_axis",
            "CoulombFriction:level=-1 N@x_axis: level is -1 N, outside 0 to inf N. Choose a value inside.",
        ),
        ("CoulombFriction:level=20 N@y_axis", "there is no part 'y_axis'. Did you mean 'x_axis'?"),
        ("Runout", "Runout: the machine has no place for Runout. Name one, as in Runout@part.input."),
    ],
)
def test_a_wish_that_cannot_be_met_is_refused_in_one_sentence(text: str, sentence: str, prepared: Prepared, registry: Registry) -> None:
    with pytest.raises(LatheSimError) as refused:
        place_wishes(prepared.machinery, [read_wish(text, registry.effects)], ["x_encoder.position"])
    assert str(refused.value) == sentence


def test_a_host_must_be_named_where_there_are_several(prepared: Prepared, registry: Registry) -> None:
    wish = read_wish("EncoderInterpolationError", registry.effects)
    with pytest.raises(LessonError, match=r"could sit at x_encoder, x_scale\. Say where: EncoderInterpolationError@x_encoder\."):
        place_wishes(prepared.machinery, [wish], ["x_encoder.position", "x_scale.position"])
    _, hidden = place_wishes(prepared.machinery, [wish], ["x_encoder.position"])
    assert hidden[0].at == "x_encoder"


def test_frictions_come_last_whatever_the_order_of_the_wishes(prepared: Prepared, registry: Registry) -> None:
    wishes = [read_wish(text, registry.effects) for text in (FRICTION, "ForceOffset:offset=5 N@x_axis")]
    assembly, hidden = place_wishes(prepared.machinery, wishes, ["x_encoder.position"])
    assert [item.effect.__name__ for item in hidden] == ["ForceOffset", "CoulombFriction"]
    assert [part.name for part in assembly.parts][-2:] == ["x_axis_force_offset", "x_axis_coulomb_friction"]


def test_drawing_gives_nothing_one_or_two_effects_of_different_families(prepared: Prepared, registry: Registry) -> None:
    drawn = []
    for seed in range(4):
        wishes = random_wishes(prepared.machinery, registry.effects.values(), ["x_encoder.position"], np.random.default_rng(seed))
        assert len({wish.effect.family for wish in wishes}) == len(wishes) <= 2
        assert not any(wish.effect.identification.generalises or wish.effect.identification.prerequisites for wish in wishes)
        drawn.append(len(wishes))
    assert len(set(drawn)) > 1


# ---- the recording ---------------------------------------------------------------------------------------------------------------


def test_what_is_hidden_is_what_was_asked_for_and_is_seen(friction: Concealed) -> None:
    (hidden,) = friction.hidden
    assert (hidden.effect.__name__, hidden.at, dict(hidden.values)) == ("CoulombFriction", "x_axis", {"level": 20.0})
    assert friction.moves["x_encoder.position"] > 50.0
    assert friction.moves["x_controller.voltage"] > 20.0


def test_true_values_lie_within_two_deviations_and_are_not_the_given_ones(friction: Concealed) -> None:
    assert set(friction.true_values) == {"x_axis.mass", "x_axis.viscous"}
    for name, share in (("x_axis.mass", 0.03), ("x_axis.viscous", 0.10)):
        item = friction.true_values[name]
        assert 0.0 < abs(item.true / item.given - 1.0) <= 2.0 * share + 1e-12


def test_sensors_count_in_steps_and_have_noise_and_the_drive_is_exact(friction: Concealed, prepared: Prepared) -> None:
    drive, motor, _ = friction.tables[0]
    assert np.abs(motor / 50e-9 - np.round(motor / 50e-9)).max() < 1e-3
    still = motor[:90]
    assert 0.5 * 50e-9 < still.std() < 3.0 * 50e-9
    given = run_prepared(prepared, engine="plain")["exercise.x_reference"]
    assert np.array_equal(drive, given)


def test_the_same_seed_gives_the_same_and_another_run_other_noise(friction: Concealed, prepared: Prepared, registry: Registry) -> None:
    again = concealed_in(prepared, registry, FRICTION, seed=3)
    assert np.array_equal(again.tables[0], friction.tables[0])
    assert again.true_values == friction.true_values
    assert not np.array_equal(friction.tables[0][1], friction.tables[1][1])


def test_without_effect_uncertainty_and_noise_the_recording_is_the_lesson(prepared: Prepared) -> None:
    columns = logged_columns(prepared.case.lesson, prepared.machinery, {})
    plain = conceal([Situation(prepared.machinery, prepared.duration, {})], columns, [], {}, seed=1, noise=0.0)
    engine = run_prepared(prepared, engine="plain")
    assert plain.hidden == ()
    assert np.abs(plain.tables[0][1] - engine["x_encoder.position"]).max() <= 1.01 * 50e-9


def test_sizes_that_are_not_given_are_drawn_until_they_are_seen(prepared: Prepared, registry: Registry) -> None:
    drawn = concealed_in(prepared, registry, "CoulombFriction@x_axis")
    assert 5.0 <= drawn.hidden[0].values["level"] <= 100.0
    assert max(drawn.moves.values()) >= 5.0
    with pytest.raises(
        NotSeenError, match="no usual size of ThermalScrewGrowth at x_encoder moves a recorded channel by 5 times its noise"
    ):
        concealed_in(prepared, registry, "ThermalScrewGrowth@x_encoder")


def test_a_size_that_is_given_need_not_be_seen(prepared: Prepared, registry: Registry) -> None:
    """Where the play stands at the start is drawn; how wide it is was asked for."""
    small = concealed_in(prepared, registry, "Backlash:width=50 nm@x_encoder")
    assert small.hidden[0].values["width"] == pytest.approx(50e-9)
    assert max(small.moves.values()) < 5.0


def test_an_input_that_nothing_moves_is_refused(registry: Registry, tmp_path: Path) -> None:
    path = write_lesson(tmp_path)
    path.write_text(path.read_text().replace("wires: {x_controller.reference: exercise.x_reference}\n", ""), encoding="utf-8")
    still = prepare(load_lesson(path), registry)
    with pytest.raises(LessonError, match=r"nothing that moves feeds x_controller\.reference, .* --drive FILE\."):
        logged_columns(still.case.lesson, still.machinery, {})


def test_a_lesson_without_mapping_logs_commands_voltages_and_sensors(registry: Registry) -> None:
    lathe = prepare(load_lesson("01_contour_error"), registry)
    columns = logged_columns(lathe.case.lesson, lathe.machinery, {})
    roles = {column.target: column.role for column in columns}
    assert roles["x_controller.reference"] == roles["z_controller.reference"] == "drive"
    assert roles["x_encoder.position"] == roles["x_controller.voltage"] == "compare"


def test_a_logger_without_known_resolution_gets_sixteen_bits() -> None:
    column = LoggedColumn("u", "V", 1.0, "a.u", "a.u", "compare", 0.0, "").over(np.array([-5.0, 10.0]))
    assert column.resolution == pytest.approx(2e-4)
    assert column.decimals == 5


# ---- the folder and the seal -----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def published(friction: Concealed, lesson: Lesson, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("class") / "case"
    publish(lesson, friction, folder, answer_place(folder, None), seed=3, noise=1.0)
    return folder


def test_the_folder_holds_what_a_class_needs_and_not_the_answer(published: Path) -> None:
    assert {path.name for path in published.iterdir()} == {"recording.csv", "validate.csv", "lesson.yaml", "small.nc", "seal.json"}
    for path in published.iterdir():
        assert "CoulombFriction" not in path.read_text()
    assert "CoulombFriction" in (published.parent / "case_answer.json").read_text()


def test_the_recording_reads_back_through_the_lesson_of_the_class(published: Path, friction: Concealed, registry: Registry) -> None:
    lesson = load_lesson(published / "lesson.yaml")
    mapping = mapping_of(lesson, prepare(lesson, registry).machinery)
    for name, table in zip(("recording.csv", "validate.csv"), friction.tables, strict=True):
        mapped = map_recording(read_recording(published / name, registry.readers), mapping)
        assert [finding for finding in mapped.findings if finding.serious] == []
        for row, channel in enumerate(("x_controller.reference", "x_encoder.position", "x_controller.voltage")):
            assert mapped.record[channel] == pytest.approx(table[row], abs=2e-10 + 1e-9 * np.abs(table[row]).max())
    assert (published / "recording.csv").read_text().startswith("t [ms],asked [mm],motor [mm],voltage [V]\n0,0,0.0000")


def test_the_seal_opens_for_its_answer_and_for_no_other(published: Path, friction: Concealed, tmp_path: Path) -> None:
    answer_file = published.parent / "case_answer.json"
    answer = opened(published, answer_file)
    assert answer == opened(published / "seal.json", answer_file)
    assert answer["effects"][0]["parameters"] == {"level": {"value": 20.0, "unit": "N"}}
    assert changed_files(published, answer) == []
    tampered = tmp_path / "tampered.json"
    answer["effects"][0]["parameters"]["level"]["value"] = 21.0
    tampered.write_text(json.dumps(answer), encoding="utf-8")
    with pytest.raises(RecordingError, match="the answer does not fit the seal"):
        opened(published, tampered)


def test_two_seals_of_one_answer_differ_by_their_salt(friction: Concealed) -> None:
    first, second = (answer_of(friction, "a", {}, seed=1, noise=1.0) for _ in range(2))
    assert len(first["salt"]) == 32
    assert seal_of(first)["digest"] != seal_of(second)["digest"]
    assert digest_of(first) == digest_of(json.loads(json.dumps(first)))
    assert not {"effects", "salt", "seed", "true_values"} & set(seal_of(first))


def test_a_changed_recording_is_named(friction: Concealed, lesson: Lesson, tmp_path: Path) -> None:
    folder = tmp_path / "case"
    answer = publish(lesson, friction, folder, answer_place(folder, None), seed=3, noise=1.0).answer
    (folder / "recording.csv").write_text("t\n0\n", encoding="utf-8")
    (folder / "validate.csv").unlink()
    assert changed_files(folder, answer) == ["recording.csv", "validate.csv"]


def test_a_file_of_another_is_not_replaced_by_a_case(friction: Concealed, lesson: Lesson, tmp_path: Path) -> None:
    (tmp_path / "case").mkdir()
    (tmp_path / "case" / "recording.csv").write_text("t [s]\n0\n", encoding="utf-8")
    with pytest.raises(RecordingError, match="this file is there already, and it is not replaced"):
        publish(lesson, friction, tmp_path / "case", tmp_path / "answer.json", seed=3, noise=1.0)
    assert [path.name for path in tmp_path.rglob("*.*")] == ["recording.csv"]
    (tmp_path / "case" / "recording.csv").unlink()
    publish(lesson, friction, tmp_path / "case", tmp_path / "answer.json", seed=3, noise=1.0)
    with pytest.raises(RecordingError, match="there is a sealed case here already"):  # as where two processes make it at once
        publish(lesson, friction, tmp_path / "case", tmp_path / "other.json", seed=3, noise=1.0)


def test_a_case_is_not_written_over_and_its_answer_not_published(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="the answer would lie in the folder for the class"):
        answer_place(tmp_path, tmp_path / "answer.json")
    (tmp_path / "seal.json").write_text("{}", encoding="utf-8")
    with pytest.raises(RecordingError, match="there is a sealed case here already"):
        answer_place(tmp_path, None)


# ---- grading ---------------------------------------------------------------------------------------------------------------------

TRUTH = {
    "effects": [
        {"effect": "CoulombFriction", "at": "x_axis", "family": "reversal", "parameters": {"level": {"value": 20.0, "unit": "N"}},
         "nuisance": []},
        {"effect": "PeriodicPitchError", "at": "x_scale", "family": "once per turn", "nuisance": ["phase"],
         "parameters": {"amplitude": {"value": 4e-6, "unit": "m"}, "phase": {"value": 1.0, "unit": "rad"}}},
    ]
}  # fmt: skip


def guess(*effects: dict[str, object], verdict: str = "named") -> dict[str, object]:
    return {"schema": "lathesim-diagnosis/1", "verdict": verdict, "effects": list(effects)}


def friction_guess(value: float, low: float, high: float) -> dict[str, object]:
    sizes = {"level": {"value": value, "unit": "N", "low": low, "high": high}}
    return {"effect": "CoulombFriction", "at": "x_axis", "family": "reversal", "parameters": sizes, "tied_with": []}


def test_names_sizes_and_intervals_are_graded() -> None:
    pitch = {"effect": "PeriodicPitchError", "at": "x_encoder", "family": "once per turn",
             "parameters": {"amplitude": {"value": 4.5, "unit": "um"}, "phase": {"value": 2.0, "unit": "rad"}}}  # fmt: skip
    graded = grade(TRUTH, guess(friction_guess(20.4, 20.2, 20.6), pitch))
    assert graded.right
    assert graded.sentence == "Right: CoulombFriction at x_axis and PeriodicPitchError at x_scale."
    first, second = graded.effects
    assert (first.named, first.first, first.place, first.family) == (True, True, True, True)
    assert (first.sizes["level"].off, first.sizes["level"].right) == (pytest.approx(0.02), True)
    assert first.sizes["level"].covered is False
    assert (second.first, second.place, set(second.sizes)) == (False, False, {"amplitude"})
    assert second.sizes["amplitude"].off == pytest.approx(0.125)
    assert second.sizes["amplitude"].covered is None


@pytest.mark.parametrize(
    ("told", "right", "sentence"),
    [
        (guess(friction_guess(20, 19, 21)), False, "1 of 2 named; not found: PeriodicPitchError."),
        (
            guess({"effect": "Backlash", "at": "x_axis", "family": "reversal"}),
            False,
            "Named was Backlash, and hidden is CoulombFriction and PeriodicPitchError.",
        ),
        (
            guess({"effect": "StribeckFriction", "at": "x_axis", "tied_with": ["CoulombFriction"]}, verdict="tied"),
            False,
            "Nearly: what is hidden is among those called tied.",
        ),
        (
            guess(friction_guess(20, 19, 21), verdict="unknown"),
            False,
            "The verdict is 'unknown', and hidden is CoulombFriction and PeriodicPitchError.",
        ),
    ],
)
def test_what_was_missed_is_said(told: dict[str, object], right: bool, sentence: str) -> None:
    graded = grade(TRUTH, told)
    assert (graded.right, graded.sentence) == (right, sentence)


def test_where_nothing_is_hidden_naming_nothing_is_right() -> None:
    nothing = {"effects": []}
    assert grade(nothing, guess(verdict="no_mismatch")).right
    assert grade(nothing, guess(verdict="parameters_only")).right
    wrong = grade(nothing, guess(friction_guess(20, 19, 21)))
    assert not wrong.right
    assert wrong.wrong_names == ("CoulombFriction",)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("{", "the diagnosis is no JSON file"),
        ("[1]", "the file has no schema"),
        ('{"schema": "lathesim-run/1"}', "the file has the schema 'lathesim-run/1'"),
        ('{"schema": "lathesim-diagnosis/1", "verdict": "named", "effects": [3]}', "no list of effects with a name"),
    ],
)
def test_a_guess_that_is_no_diagnosis_is_refused(text: str, sentence: str, tmp_path: Path) -> None:
    path = tmp_path / "guess.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(RecordingError, match=sentence):
        read_guess(path)
    with pytest.raises(RecordingError, match="cannot be read"):
        read_guess(tmp_path / "none.json")
