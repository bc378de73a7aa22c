"""``lathesim diagnose``: an answer for a person, JSON for a program, a report, and a lesson that explains the recording."""

import contextlib
import io
import json
import re
import signal
import threading
from pathlib import Path
from typing import Any

import pytest

from lathesim.cli.main import run_command_line
from lathesim.cli.progress import progress_lines
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare
from lathesim.plugins import load_registry
from lathesim.shipped import shipped_folder
from tests.cli.command import Said, call, done
from tests.diagnosis.pushed_table import LESSON, POSITION, Hidden, write_case
from tests.diagnosis.small_case import write_lesson

ONLY = ("--effect", "CoulombFriction", "--effect", "ForceOffset", "--effect", "TorqueRipple")
KEYS = {"schema", "verdict", "effects", "location", "fit", "removed_share", "adequate", "baseline", "insert", "report", "wall_time_s"}


@pytest.fixture(scope="module")
def rubbing(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, Path]:
    """A lesson without friction and two recordings of a table that rubs with 8 N."""
    return write_case(tmp_path_factory.mktemp("rubbing"), Hidden(dry=8.0))


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, Path]:
    """A lesson and two recordings of the very machine that it describes."""
    return write_case(tmp_path_factory.mktemp("sound"))


def diagnosed(capsys: pytest.CaptureFixture[str], files: tuple[Path, Path, Path], *more: str | Path) -> Said:
    return call(capsys, "diagnose", files[0], files[1], "--validate", files[2], *ONLY, *more)


def told(said: Said) -> dict[str, Any]:
    assert said.code == 0, said.err
    found: dict[str, Any] = json.loads(said.out)
    return found


@pytest.fixture(scope="module")
def answered(tmp_path_factory: pytest.TempPathFactory) -> tuple[Said, Path]:
    """What a person is told about the table that rubs, and the folder of the case.

    The machine template stands beside the user's lesson, and the answer goes into a folder below.
    """
    folder = tmp_path_factory.mktemp("answered")
    files = write_case(folder, Hidden(dry=8.0), lesson=LESSON.replace("machine: force_axis", "machine: machine_own"))
    template = shipped_folder("lesson_configs") / "machines" / "force_axis.yaml"
    (folder / "machine_own.yaml").write_text(template.read_text(encoding="utf-8"), encoding="utf-8")
    names = [file.name for file in files]
    more = (*ONLY, "--explain-decision", "--out", "out", "--json", "answer.json")
    with pytest.MonkeyPatch.context() as there:
        there.chdir(folder)
        with contextlib.redirect_stdout(io.StringIO()) as printed, contextlib.redirect_stderr(io.StringIO()) as errors:
            code = run_command_line(["diagnose", *names[:2], "--validate", names[2], *more])
    return Said(code, printed.getvalue(), errors.getvalue()), folder


def test_json_tells_what_a_program_needs(answered: tuple[Said, Path]) -> None:
    answer = json.loads((answered[1] / "answer.json").read_text(encoding="utf-8"))
    assert set(answer) >= KEYS
    assert (answer["schema"], answer["verdict"], answer["report"]) == ("lathesim-diagnosis/1", "named", "out/report.html")
    (effect,) = answer["effects"]
    assert set(effect) >= {"effect", "at", "family", "probability", "parameters", "tied_with", "separating_experiment"}
    assert (effect["effect"], effect["at"], effect["family"]) == ("CoulombFriction", "x_axis", "reversal")
    assert set(effect["parameters"]["level"]) == {"value", "unit", "low", "high"}
    assert effect["parameters"]["level"]["value"] == pytest.approx(8.0, rel=0.05)
    assert set(answer["location"]) >= {"components", "channels", "windows_s", "variables"}
    assert set(answer["fit"][POSITION]) >= {"unit", "floor", "before", "after", "recording"}
    assert answer["fit"][POSITION]["recording"] == "check.csv"
    assert set(answer["baseline"]["x_axis.viscous"]) >= {"unit", "given", "refit_without", "refit_with"}
    assert answer["summary"][0] == answer["sentence"]
    assert re.fullmatch(
        r"The simulation left out CoulombFriction at x_axis\. Nothing brings back x_encoder\.position, so small errors add up: "
        r"it is off by [\d.]+ um, 0\.\d+ % of its travel\.",
        answer["sentence"],
    )
    kept = [one for one in answer["explanations"] if one["kept"] and one["kind"] == "effect"]
    assert [(one["name"], one["place"], one["kind"]) for one in kept] == [("CoulombFriction", "x_axis", "effect")]
    assert kept[0]["gain"] > kept[0]["chance"] + 5.0 * kept[0]["standard_error"] > 0.0
    assert all(one["reason"] for one in answer["explanations"])
    assert answer["insert"][0]["effect"] == "CoulombFriction"
    assert 0.9 < answer["removed_share"] <= 1.0
    assert answer["adequate"] is True


def test_json_is_nothing_else_and_says_which_step_was_left_out(
    rubbing: tuple[Path, Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    answer = told(diagnosed(capsys, rubbing, "--json", "-", "--no-report", "--without", "held-out"))
    assert answer["recording"] == ["Answered without held-out: the recording that was fitted judged itself."]
    assert answer["fit"][POSITION]["recording"] == "fit.csv"
    assert "--without" in call(capsys, "diagnose", "--help").out


def test_a_person_reads_what_where_and_how_sure(answered: tuple[Said, Path]) -> None:
    said, folder = answered
    assert said.code == 0, said.err
    assert "The simulation left out CoulombFriction at x_axis." in said.out
    assert "Where: x_axis" in said.out
    assert "Paste into the lesson:\ninsert:\n  - {effect: CoulombFriction, at: x_axis, level: " in said.out
    assert "Traceback" not in said.err
    assert (folder / "out" / "report.html").is_file()
    assert said.out.startswith("The simulation left out CoulombFriction at x_axis. Nothing brings back x_encoder.position, so ")
    decided = said.out.partition("\nHow it was decided:\n")[2].splitlines()
    assert decided[0].split() == ["explanation", "gain", "error", "chance", "level", "kept", "why"]
    assert decided[2].startswith("the lesson, its uncertain values fitted")
    (named,) = (line.split() for line in decided if line.startswith("CoulombFriction at x_axis "))
    assert named[6] == "yes"


def test_the_lesson_it_writes_explains_the_recording(
    answered: tuple[Said, Path], rubbing: tuple[Path, Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    file = answered[1] / "out" / "table_explained.yaml"
    assert "x_axis_coulomb_friction" in {part.name for part in prepare(load_lesson(file), load_registry()).machinery.parts}
    answer = told(diagnosed(capsys, (file, *rubbing[1:]), "--json", "-", "--no-report"))
    assert (answer["verdict"], answer["effects"]) == ("no_mismatch", [])


def test_the_lesson_it_writes_runs_where_it_stands(
    answered: tuple[Said, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    file = answered[1] / "out" / "table_explained.yaml"
    assert "machine: ../machine_own.yaml" in file.read_text(encoding="utf-8")
    for folder in (answered[1], tmp_path):
        monkeypatch.chdir(folder)
        done(capsys, "check", file)
        done(capsys, "run", file, "--no-plots", "--out", tmp_path / "run.h5")


def test_a_sound_machine_needs_no_new_lesson(sound: tuple[Path, Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = diagnosed(capsys, sound, "--out", tmp_path, "--json", tmp_path / "answer.json")
    assert said.code == 0, said.err
    assert "No physics is missing: the lesson explains the recording." in said.out
    assert not (tmp_path / "table_explained.yaml").exists()
    answer = json.loads((tmp_path / "answer.json").read_text(encoding="utf-8"))
    assert (answer["verdict"], answer["insert"]) == ("no_mismatch", [])
    assert answer["report"] == str(tmp_path / "report.html")


def test_a_request_to_terminate_keeps_what_is_known(
    rubbing: tuple[Path, Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It interrupts as Ctrl-C does."""
    import lathesim.diagnosis.explaining.rounds as searching

    screen, rounds = searching.screen, []

    def terminated(*given: Any, **more: Any) -> Any:
        rounds.append(1)
        if len(rounds) == 2:
            signal.raise_signal(signal.SIGTERM)
        return screen(*given, **more)

    monkeypatch.setattr(searching, "screen", terminated)
    said = diagnosed(capsys, rubbing, "--out", tmp_path)
    assert said.code == 130
    assert "The simulation left out CoulombFriction at x_axis." in said.out
    assert "The search was stopped before it had tried everything." in said.out
    assert (tmp_path / "report.html").is_file()
    assert signal.getsignal(signal.SIGTERM) is not signal.default_int_handler


def test_without_a_terminal_a_line_every_ten_seconds_tells_the_last_step(capsys: pytest.CaptureFixture[str]) -> None:
    passed, begun = [False, False, True], threading.Event()
    waits: list[float] = []

    def waited(seconds: float) -> bool:
        begun.wait(10.0)
        waits.append(seconds)
        return passed.pop(0)

    with progress_lines(waited) as tell:
        tell("34 effects by a linear estimate, beside 0 found")
        tell("  CoulombFriction at x_axis: 12 nats")
        begun.set()
    assert waits == [10.0, 10.0, 10.0]
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert all(line.startswith("After ") and line.endswith(" s: CoulombFriction at x_axis: 12 nats.") for line in lines)


@pytest.mark.slow
def test_a_search_ends_after_the_time_it_is_given(rubbing: tuple[Path, Path, Path], capsys: pytest.CaptureFixture[str]) -> None:
    said = diagnosed(capsys, rubbing, "--no-report", "--at-most", "0 s")
    assert said.code == 0
    assert "The search was stopped before it had tried everything." in said.out


@pytest.mark.parametrize(
    ("arguments", "code", "sentence"),
    [
        (("{lesson}", "{recording}", "--at-most", "2"), 1, "unit"),
        (("{lesson}", "{folder}/missing.csv"), 1, "there is no such file"),
        (("{lesson}", "{recording}", "--effect", "CoulombFrictoin"), 1, "CoulombFriction"),
        (("{lesson}",), 2, "RECORDING"),
        (("no_such_lesson", "{recording}"), 1, "no_such_lesson"),
        (("{lesson}", "{recording}", "--variant", "worn"), 1, "worn"),
        (("01_contour_error", "{recording}"), 1, "the lesson does not say what the columns of a recording mean"),
    ],
    ids=["time without unit", "no recording", "misspelt effect", "usage", "no lesson", "no variant", "no mapping"],
)
def test_what_cannot_be_diagnosed_says_why_in_a_sentence(
    arguments: tuple[str, ...], code: int, sentence: str, rubbing: tuple[Path, Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    filled = [text.format(lesson=rubbing[0], recording=rubbing[1], folder=rubbing[0].parent) for text in arguments]
    said = call(capsys, "diagnose", *filled, "--no-report")
    assert (said.code, said.out) == (code, "")
    assert sentence in said.err
    assert "Traceback" not in said.err


def test_a_lesson_that_is_sure_of_everything_is_asked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = write_case(tmp_path, lesson=LESSON.partition("uncertain:")[0], count=300)
    said = diagnosed(capsys, files, "--no-report")
    assert said.code == 1
    assert "the lesson does not say how sure its values are" in said.err


@pytest.mark.slow
def test_a_friction_that_a_controller_hides_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """In closed loop the position hardly shows it; the command does."""
    lesson = write_lesson(tmp_path, duration="2.6 s")
    hide = ("--effect", "CoulombFriction:level=20 N@x_axis", "--seed", "4")
    done(capsys, "conceal", lesson, "--out", tmp_path / "case", *hide)
    files = tmp_path / "case" / "lesson.yaml", tmp_path / "case" / "recording.csv"
    answer = told(call(capsys, "diagnose", *files, *ONLY[:4], "--json", "-", "--no-report"))
    assert answer["verdict"] == "named"
    (effect,) = answer["effects"]
    assert (effect["effect"], effect["at"]) == ("CoulombFriction", "x_axis")
    assert effect["parameters"]["level"]["value"] == pytest.approx(20.0, rel=0.1)
    assert set(answer["fit"]) == {"x_encoder.position", "x_controller.voltage"}


@pytest.mark.slow
def test_the_whole_catalogue_names_the_same(rubbing: tuple[Path, Path, Path], capsys: pytest.CaptureFixture[str]) -> None:
    answer = told(call(capsys, "diagnose", rubbing[0], rubbing[1], "--validate", rubbing[2], "--json", "-", "--no-report"))
    names = {name for effect in answer["effects"] for name in (effect["effect"], *effect["tied_with"])}
    assert answer["verdict"] in ("named", "tied")
    assert names & {"CoulombFriction", "AsymmetricFriction", "PreslidingFriction"}


def test_beside_a_recording_from_before_only_what_changed_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("sound", "rubs"):
        (tmp_path / name).mkdir()
    _, before, _ = write_case(tmp_path / "sound", count=1500)
    lesson, now, again = write_case(tmp_path / "rubs", Hidden(dry=8.0), count=1500)
    changed, unchanged = (
        told(call(capsys, "diagnose", lesson, now, *ONLY, "--before", earlier, "--json", "-", "--no-report")) for earlier in (before, again)
    )
    assert [effect["effect"] for effect in changed["effects"]] == ["CoulombFriction"]
    assert changed["fit"][POSITION]["recording"] == "fit.csv, second half"
    assert changed["sentence"].startswith("New since fit.csv: CoulombFriction at x_axis. Nothing brings back x_encoder.position, so ")
    assert unchanged["effects"] == []
    assert any("from before the change" in line for line in unchanged["left"])


def test_a_recording_from_before_is_not_asked_beside_another_lesson(
    rubbing: tuple[Path, Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    said = call(capsys, "diagnose", rubbing[0], rubbing[1], "--before", rubbing[2], "--with", rubbing[0], rubbing[2])
    assert said.code != 0
    assert "--with and --before ask two questions: give one of them." in said.err
    said = call(capsys, "diagnose", *rubbing)
    assert (said.code, said.out) == (2, "")
    assert f"'{rubbing[2]}' is a second recording, and one is fitted. Give it with --validate {rubbing[2]}, and it judges, " in said.err
