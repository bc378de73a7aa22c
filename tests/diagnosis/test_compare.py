"""What compare says of recordings, sound and damaged."""

import itertools
import json
import math
import random
from collections import Counter
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

import lathesim
from lathesim.diagnosis.comparison.compare import SCHEMA, Comparison, Dependence, Replayed, as_json, compare, load_recording
from lathesim.diagnosis.comparison.compare_text import compare_figure, comparison_lines
from lathesim.diagnosis.explanations.conditions import Term
from lathesim.errors import LatheSimError, LessonError, RecordingError
from lathesim.exercises.class_folder import answer_place, publish
from lathesim.exercises.conceal import Situation, conceal
from lathesim.exercises.hidden_effect import read_wish
from lathesim.exercises.logger import logged_columns
from lathesim.identification.replay.loading import Recorded
from lathesim.lessons.lesson import Lesson, load_lesson
from lathesim.lessons.simulate import prepare
from lathesim.plugins import Registry, load_registry
from lathesim.recordings import binary_files
from tests.diagnosis.pushed_table import FORCE, Hidden, machine, recording, write_case
from tests.diagnosis.small_case import write_lesson
from tests.shared_data import SHARED, needs_shared


def comparison(folder: Path, registry: Registry, *wishes: str) -> Comparison:
    """Conceal the wishes in the small axis, its values as given, and compare."""
    lesson = load_lesson(write_lesson(folder))
    prepared = prepare(lesson, registry)
    columns = logged_columns(lesson, prepared.machinery, {})
    asked = [read_wish(text, registry.effects) for text in wishes]
    made = conceal([Situation(prepared.machinery, prepared.duration, {})], columns, asked, {}, seed=2)
    publish(lesson, made, folder / "case", answer_place(folder / "case", None), seed=2, noise=1.0)
    published = load_lesson(folder / "case" / "lesson.yaml")
    return compare("small", *load_recording(published, folder / "case" / "recording.csv", registry))


@pytest.fixture(scope="module")
def friction(tmp_path_factory: pytest.TempPathFactory, registry: Registry) -> Comparison:
    return comparison(tmp_path_factory.mktemp("friction"), registry, "CoulombFriction:level=20 N@x_axis")


@pytest.fixture(scope="module")
def nothing(tmp_path_factory: pytest.TempPathFactory, registry: Registry) -> Comparison:
    return comparison(tmp_path_factory.mktemp("nothing"), registry)


def test_two_readings_of_one_sensor_that_are_off_point_to_what_they_measure(friction: Comparison) -> None:
    """A force that softens is in every channel of the dynamometer; a zero that drifts is in one."""
    made_by = ("dynamometer", "cutting")
    main, feed = (
        Replayed(name, made_by, over_floor, name, "N", 10.0, 0.1)
        for name, over_floor in (("dynamometer.main", 14.0), ("dynamometer.feed", 5.0))
    )
    assert replace(friction, replayed=(main, feed)).suspect == "cutting"
    assert replace(friction, replayed=(main, replace(feed, over_floor=0.5))).suspect == "dynamometer"


def test_each_part_that_is_off_is_named_and_that_in_which_most_of_what_acts_is_missing_first(friction: Comparison) -> None:
    """A play of the scale is micrometres of a way of decimetres, and no smaller mismatch than a tenth of the friction."""
    table = Replayed("x_encoder.position", ("x_encoder", "x_axis"), 9.0e4, "x_axis.disturbance", "N", 1.0, 0.02)
    scale = Replayed("x_scale.position", ("x_scale", "x_axis"), 156.0, "x_scale.position", "m", 12e-6, 3e-4)
    both = replace(friction, replayed=(table, scale))
    assert both.suspects == ("x_axis", "x_scale")
    assert as_json(both)["suspects"] == ["x_axis", "x_scale"]
    assert any(line.startswith("The mismatch sits in x_axis and in x_scale. Values are") for line in comparison_lines(both))
    assert replace(friction, replayed=(replace(table, over_floor=0.4), scale)).suspects == ("x_scale",)
    assert replace(friction, replayed=(replace(table, over_floor=0.4),)).suspect == ""


def test_what_a_faulty_recording_shows_is_said_to_mean_little(friction: Comparison) -> None:
    lines = comparison_lines(replace(friction, faults=("x_scale.position: it counts in inches.",)))
    assert "The recording itself is at fault; until that is mended the rest says little of the machine." in lines
    assert not any(line.startswith("The mismatch sits") for line in lines)


def test_a_simulation_that_is_hardly_off_is_said_to_be(friction: Comparison) -> None:
    close = replace(friction, channels=tuple(replace(item, rms=2.0 * item.floor) for item in friction.channels))
    told = "Nothing is wrong that this shows: the lesson's own simulation is within 3 times the noise. What little is left sits in x_axis."
    assert told in comparison_lines(close)
    assert not any(line.startswith("The mismatch sits") for line in comparison_lines(close))


def test_a_force_that_is_next_to_nothing_of_what_acts_is_nowhere(friction: Comparison) -> None:
    """Steps of half a millisecond leave a millinewton, which adds up to floors of a place that nothing holds."""
    table = Replayed("x_encoder.position", ("x_encoder", "x_axis"), 157.0, "x_axis.disturbance", "N", 0.04, 1e-4)
    stepped = replace(friction, replayed=(table,))
    assert (stepped.suspects, stepped.adds_up) == ((), True)
    lines = comparison_lines(stepped)
    assert "Each part leaves next to nothing. Run by itself, with no recording to hold it, the simulation adds that up." in lines
    assert not any(line.startswith("What is missing depends on") for line in lines)
    assert replace(stepped, replayed=(replace(table, share=0.01),)).suspects == ("x_axis",)


def test_friction_is_off_by_many_floors_in_the_axis_and_goes_with_the_velocity(friction: Comparison) -> None:
    assert {item.channel for item in friction.channels} == {"x_encoder.position", "x_controller.voltage"}
    assert all(item.over_floor > 20.0 for item in friction.channels)
    assert friction.suspect == "x_axis"
    worst = friction.replayed[0]
    assert (worst.channel, worst.at, worst.unit) == ("x_encoder.position", "x_axis.disturbance", "N")
    assert 10.0 < worst.missing < 20.0
    first = friction.depends_on[0]
    assert (first.channel, first.variable) == ("x_encoder.position", "velocity of x_axis")
    assert first.share > 0.25


def test_the_replay_acquits_the_controller(friction: Comparison) -> None:
    controller = next(item for item in friction.replayed if item.channel == "x_controller.voltage")
    assert controller.parts == ("x_controller",)
    assert controller.share < 0.01


def test_where_nothing_is_hidden_all_channels_stay_near_their_floor(nothing: Comparison) -> None:
    assert all(item.over_floor < 3.0 for item in nothing.channels)
    assert nothing.explained_by == ()


@pytest.mark.parametrize(("share", "text", "number"), [(6.96, "696.00%", 6.96), (6138.365, "-", None), (math.inf, "-", None)])
def test_where_next_to_nothing_acts_there_is_no_share(share: float, text: str, number: float | None, friction: Comparison) -> None:
    told = replace(friction, replayed=(Replayed("x_encoder.position", ("x_axis",), 9.0, "x_axis.disturbance", "N", 1.0, share),))
    (row,) = [line for line in comparison_lines(told) if "x_axis.disturbance" in line]
    assert row.split()[-1] == text
    assert as_json(told)["replay"][0]["share"] == number


def test_a_simulation_without_bound_tells_nothing_of_the_place() -> None:
    """A force of 1e20 N where one of newtons was recorded."""
    off = recording(Hidden())
    driven = off.with_channel(FORCE, "N", 1e20 * off[FORCE])
    lines = comparison_lines(compare("table", machine(), Recorded("run.csv", driven, ())))
    assert lines[0].startswith("Recording: x_encoder.position: the lesson's own simulation diverges with these inputs; check")
    assert lines[-1] == "So the place of the mismatch is unknown."
    assert not any("nan" in line or "%" in line for line in lines)


def test_the_json_holds_it_all(friction: Comparison) -> None:
    told = json.loads(json.dumps(as_json(friction), allow_nan=False))
    assert told["schema"] == SCHEMA == "lathesim-compare/1"
    assert (told["samples"], told["sample_period_s"], told["suspect"]) == (2201, 1e-3, "x_axis")
    channel = told["channels"]["x_encoder.position"]
    assert channel["unit"] == "m"
    assert channel["over_floor"] == pytest.approx(channel["rms"] / channel["floor"], rel=1e-6)
    begin, end = channel["worst_window_s"]
    assert 0.0 <= begin < end <= 2.2
    assert {"channel", "parts", "missing_at", "share"} <= set(told["replay"][0])


def test_the_figure_shows_channels_and_bars(friction: Comparison, tmp_path: Path) -> None:
    from lathesim.analysis.plots import save_figure

    figure = compare_figure(friction)
    texts = [text.get_text() for panel in figure.get_axes() for text in (panel.title, panel._left_title, *panel.texts)]
    assert {"x_encoder.position", "x_controller.voltage", "Depends on"} <= set(texts)
    save_figure(figure, tmp_path / "compared.png")
    assert (tmp_path / "compared.png").stat().st_size > 20_000


def test_the_bars_of_one_channel_have_room_for_their_names(friction: Comparison) -> None:
    """On the low page of a single channel the names lay on each other."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    named = [Dependence("x_encoder.position", "N", Term(f"variable {place}"), 0.7, 1.0) for place in range(6)]
    figure = compare_figure(replace(friction, channels=friction.channels[:1], depends_on=tuple(named)))
    figure.draw_without_rendering()
    renderer = FigureCanvasAgg(figure).get_renderer()
    texts = [text for panel in figure.get_axes() for text in panel.texts if text.get_text().startswith("variable")]
    boxes = sorted((text.get_window_extent(renderer) for text in texts), key=lambda box: box.y0)
    assert len(boxes) == 6
    assert all(lower.y1 < upper.y0 for lower, upper in itertools.pairwise(boxes))


def write_slow_log(folder: Path, held: str = "") -> tuple[Path, Path]:
    """Write 50 Hz of a force that goes on between the rows and the place of the mass that it pushes, in closed form, and the lesson.

    m dv/dt = F cos(w t): v = F/(m w) sin w t, x = F/(m w^2) (1 - cos w t).
    """
    time, turning, push = 0.02 * np.arange(300), 2.0 * np.pi * 1.3, 300.0
    place = push / (40.0 * turning**2) * (1.0 - np.cos(turning * time))
    rows = np.column_stack([time, push * np.cos(turning * time), place])
    np.savetxt(folder / "slow.csv", rows, delimiter=",", header="t [s],push [N],seen [m]", comments="", fmt="%.12g")
    lesson = folder / "slow.yaml"
    lesson.write_text(
        "lesson: Slow log\nmachine: force_axis\nduration: 1 s\nset: {x_axis.mass: 40 kg, x_axis.viscous: 0 N*s/m}\n"
        "recordings:\n  time: {column: t, unit: s}\n"
        f"  drive: {{x_axis.force: {{column: push, unit: N{held}}}}}\n"
        "  compare: {x_axis.position: {column: seen, unit: m, resolution: 1 um}}\n",
        encoding="utf-8",
    )
    return lesson, folder / "slow.csv"


def test_a_measured_force_adds_no_half_row_of_lateness(registry: Registry, tmp_path: Path) -> None:
    """Held from row to row the force comes half a row late, 10 ms here, and the place with it."""
    machine, recorded = load_recording(load_lesson(write_slow_log(tmp_path)[0]), tmp_path / "slow.csv", registry)
    told = "x_axis.force: the force or torque is assumed to be measured, and interpolated linearly between rows; write 'held"
    assert any(str(finding).startswith(told) for finding in recorded.findings)
    moving = compare("slow", machine, recorded).channels[0]
    held = compare("slow", *load_recording(load_lesson(write_slow_log(tmp_path, ", held: true")[0]), tmp_path / "slow.csv", registry))
    assert held.channels[0].rms > 1e-3
    assert moving.rms < 0.1 * held.channels[0].rms
    assert not any("taken as measured" in text for text in held.findings)


def stepped_motor(folder: Path, dry: float) -> Comparison:
    """Return the comparison of the lesson of the manual on a motor under a voltage with its step to 11.73 V, read in steps of 11 rpm.

    w = (Kt U/R - F)/b (1 - exp(-b t/J)) from the step on, b the friction with Kt Ke/R, F a ``dry`` friction that the lesson leaves out.
    """
    torque, resistance, friction, inertia, push = 0.067, 10.0, 1.9e-4, 1.9e-5, 11.73
    time, viscous = 1e-3 * np.arange(600), friction + torque * torque / resistance
    speed = (torque * push / resistance - dry) / viscous * (1.0 - np.exp(-np.maximum(0.0, time - 0.1) * viscous / inertia))
    rows = np.column_stack([1e3 * time, np.where(time > 0.0995, push, 0.0), 11.1 * np.round(speed * 30.0 / np.pi / 11.1)])
    np.savetxt(folder / "step.csv", rows, delimiter=",", header="t_ms,voltage_V,speed_rpm", comments="", fmt="%.9g")
    page = (Path(lathesim.__file__).parent / "manual" / "your_recording.md").read_text(encoding="utf-8")
    text = page.partition("```yaml\nlesson: A 12 V gear motor\n")[2].partition("```")[0]
    (folder / "motor.yaml").write_text(f"lesson: A 12 V gear motor\n{text}", encoding="utf-8")
    found = load_recording(load_lesson(folder / "motor.yaml"), folder / "step.csv", load_registry(installed=False))
    return compare("motor", *found)


def test_a_force_behind_a_coarse_reading_is_averaged_and_never_absurd(tmp_path: Path) -> None:
    """A reading of few counts, differentiated, is hundreds of times the force that is missing."""
    found = stepped_motor(tmp_path, 7.5e-3)
    (spindle,) = found.replayed
    assert (spindle.at, spindle.unit) == ("spindle.disturbance", "N*m")
    assert spindle.missing == pytest.approx(7.5e-3, rel=0.3)
    unknown = comparison_lines(replace(found, replayed=(replace(spindle, missing=math.nan, share=math.nan),)))
    assert [line.split()[-3:] for line in unknown if "spindle.disturbance" in line] == [["not", "known", "-"]]
    assert "Not known: the noise of the reading, turned into a force, would be as large." in unknown


def test_a_voltage_on_a_motor_is_mapped_as_the_manual_says(tmp_path: Path) -> None:
    assert stepped_motor(tmp_path, 0.0).within_floors


# ---- what cannot be compared -----------------------------------------------------------------------------------------------------


def test_a_lesson_that_maps_nothing_is_refused(registry: Registry, tmp_path: Path) -> None:
    (tmp_path / "r.csv").write_text("t [s],a [m]\n0,0\n", encoding="utf-8")
    with pytest.raises(LessonError, match="the lesson does not say what the columns of a recording mean"):
        load_recording(load_lesson("01_contour_error"), tmp_path / "r.csv", registry)


def test_a_recording_of_few_samples_is_refused(registry: Registry, tmp_path: Path) -> None:
    lesson = load_lesson(write_lesson(tmp_path))
    rows = "\n".join(f"{k},{k * 0.1:.3f},{k * 0.1:.3f},0.1" for k in range(60))
    (tmp_path / "r.csv").write_text(f"t [ms],asked [mm],motor [mm],voltage [V]\n{rows}\n", encoding="utf-8")
    with pytest.raises(
        RecordingError, match=r"the recording has 60 usable samples, and 100 are needed\. Record longer, or more often; a file"
    ):
        load_recording(lesson, tmp_path / "r.csv", registry)


@pytest.mark.parametrize("column", ["push", "seen"])
def test_a_recording_without_the_driven_or_the_only_compared_channel_is_refused(column: str, registry: Registry, tmp_path: Path) -> None:
    lesson, file, _ = write_case(tmp_path, count=200)
    head, *rows = file.read_text(encoding="utf-8").splitlines()
    place = [name.split()[0] for name in head.split(",")].index(column)
    emptied = [",".join("1" if row == 0 and cell == place else "-" if cell == place else text for cell, text in enumerate(line.split(",")))
               for row, line in enumerate(rows)]  # fmt: skip
    file.write_text("\n".join([head, *emptied]) + "\n", encoding="utf-8")
    with pytest.raises(RecordingError, match=f"column '{column}' holds hardly any numbers, so x_.* is not known"):
        load_recording(load_lesson(lesson), file, registry)


@needs_shared
def test_a_date_in_the_head_of_a_load_cell_file_is_no_time_stamp(registry: Registry) -> None:
    """A stroke of a rack and pinion: two channels of 2 kHz, each behind its own time."""
    folder = SHARED / "data" / "real" / "rack_pinion"
    _, recorded = load_recording(load_lesson(folder / "ni2.yaml"), folder / "a3NI.csv", registry)
    assert len(recorded.record) == 1078
    assert recorded.record.sample_period == 5e-4
    assert recorded.record["x_axis.force"][0] == pytest.approx(-200.0 * -0.12917863583060313)
    assert recorded.record["x_axis.position"][-1] == pytest.approx(5.3305758855363266e-3)


@needs_shared
@pytest.mark.slow
def test_the_published_axis_without_its_friction_is_off_in_the_axis_at_reversal(registry: Registry) -> None:
    """EMPS, mass and viscous friction only: the published Coulomb friction of 20.4 N is what is missing."""
    lesson = load_lesson(Path(__file__).parent / "lessons" / "emps.yaml")
    found = compare("emps", *load_recording(lesson, SHARED / "data" / "emps" / "DATA_EMPS.mat", registry))
    assert found.suspect == "x_axis"
    assert found.replayed[0].missing == pytest.approx(20.4, rel=0.05)
    assert any("velocity" in item.variable and item.share > 0.8 for item in found.depends_on)


def test_a_table_that_nothing_feeds_back_starts_as_the_recording_shows() -> None:
    """A fit that allows for forces hardly knows how fast a table started, and was off by nine counts of its encoder."""
    sound = compare("table", machine(), Recorded("run.csv", recording(Hidden()), ()))
    assert all(item.over_floor < 1.5 for item in (*sound.channels, *sound.replayed))
    assert sound.suspects == ()


SAMPLES = 300
TIME = np.arange(SAMPLES) * 1e-3
DRIVEN = {"x_controller.reference": ("m", 1e-3 * (1.0 - np.cos(8.0 * TIME)))}
COMPARED = {
    "x_encoder.position": ("m", 1e-3 * (1.0 - np.cos(8.0 * TIME - 0.1))),
    "x_scale.position": ("m", 1e-3 * (1.0 - np.cos(8.0 * TIME - 0.1))),
    "x_controller.voltage": ("V", 0.3 * np.sin(8.0 * TIME)),
    "x_drive.current": ("A", 0.3 * np.sin(8.0 * TIME)),
}
VALUES = (np.nan, np.inf, -np.inf, 1e300, -1e300, 1e29, -1e29, 1e15, 1e-300, 5e-324, 0.0)
FACTORS = (1e-300, 1e300, 1e28, 1e20, 1e-20, 1e-160, -1.0, 0.0)


def damaged(case: int) -> dict[str, np.ndarray]:
    """Return the columns with one to six of them changed at a place, over a stretch, or throughout."""
    chance = random.Random(case)
    columns = {name: values.copy() for name, (_, values) in (DRIVEN | COMPARED).items()} | {"t": TIME.copy()}
    for _ in range(chance.choice((1, 1, 2, 3, 6))):
        name, value = chance.choice(list(columns)), chance.choice(VALUES)
        begin = chance.randrange(SAMPLES)
        piece = slice(begin, begin + chance.randrange(1, SAMPLES))
        column = columns[name]
        match chance.randrange(9):
            case 0:
                column[begin] = value
            case 1:
                column[piece] = value
            case 2:
                column[:] = value
            case 3:
                column *= chance.choice(FACTORS)
            case 4:
                column[piece] = column[begin]
            case 5:
                column[:] = np.random.default_rng(case).standard_normal(SAMPLES) * chance.choice((1.0, 1e25, 1e-25))
            case 6:
                column[::2] = value
            case 7:
                columns[name] = columns[chance.choice(list(columns))].copy()
            case _:
                column[:] = np.frombuffer(chance.randbytes(8 * SAMPLES))
    return columns


@pytest.fixture(scope="module")
def lesson(tmp_path_factory: pytest.TempPathFactory) -> Lesson:
    path = tmp_path_factory.mktemp("lesson") / "axis.yaml"
    drive, seen = (
        ", ".join(f"{name}: {{column: {name}, unit: {unit}}}" for name, (unit, _) in given.items()) for given in (DRIVEN, COMPARED)
    )
    path.write_text(
        "lesson: An axis\nmachine: cascade_axis\nduration: 1 s\nrecordings:\n  time: {column: t, unit: s}\n"
        f"  drive: {{{drive}}}\n  compare: {{{seen}}}\n",
        encoding="utf-8",
    )
    return load_lesson(path)


def compared(lesson: Lesson, registry: Registry, file: Path, cases: range) -> Counter[str]:
    """Compare damaged recordings; return how many were compared and how many refused."""
    ended: Counter[str] = Counter()
    for case in cases:
        with np.errstate(over="ignore", invalid="ignore"):
            columns = damaged(case)
        with h5py.File(file, "w") as recording:
            for name, values in columns.items():
                recording[name] = values
        try:
            found = compare("axis", *load_recording(lesson, file, registry))
            told = "\n".join(comparison_lines(found))
            json.dumps(as_json(found), allow_nan=False)
            assert not any(word in ("nan", "inf", "-inf") for word in told.split()), told
            ended["compared"] += 1
        except LatheSimError as error:
            assert len(str(error).splitlines()) == 1
            ended["refused"] += 1
        except Exception as error:
            raise AssertionError(f"case {case}: {error!r}") from error
    return ended


def test_damaged_numbers_make_no_fault(lesson: Lesson, registry: Registry, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(binary_files, "refuse_deadly_file", lambda path, script: None)  # the file itself is sound
    ended = compared(lesson, registry, tmp_path / "run.h5", range(10, 13))
    assert ended["compared"] > 1


@pytest.mark.slow
def test_a_thousand_recordings_of_damaged_numbers_make_no_fault(
    lesson: Lesson, registry: Registry, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(binary_files, "refuse_deadly_file", lambda path, script: None)
    ended = compared(lesson, registry, tmp_path / "run.h5", range(20, 1020))
    assert ended["compared"] > 300 and ended["refused"] > 100
