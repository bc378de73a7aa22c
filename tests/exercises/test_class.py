"""A class: a machine of their own for each student, and what the class hands in graded in one table."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from lathesim.classroom import class_grades
from lathesim.classroom.class_grades import GRADES, NBGRADER, StudentGrade, copies, grade_class, write_forms
from lathesim.classroom.making import HIDDEN, MadeMachine, make_class
from lathesim.classroom.roster import ClassFolder, Student, read_students
from lathesim.classroom.teacher_notes import teacher_notes
from lathesim.cluster import Cluster
from lathesim.errors import LessonError, RecordingError
from lathesim.exercises.sealed_answer import opened
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.questions import keep_answer
from lathesim.lessons.simulate import simulate
from lathesim.plugins import Registry
from lathesim.record import Record
from lathesim.record_writer import save
from lathesim.shipped import shipped_files
from lathesim.units import quantity
from tests.cli.command import call, done
from tests.diagnosis.small_case import write_lesson

LESSON = "01_contour_error"
LIST = 'ID number;Surname;First name;Email address\ns1;Ames;"Ann; A.";a@x\ns2;Bell;Bo;b@x\ns3;Cole;Cid;c@x\ns4;Dean;Dee;d@x\n'
LIST += '../../evil;Eck;=HYPERLINK("http://x");e@x\n=1+1;Fox;Fay;f@x\n'
S1, S2, S3, S4, EVIL, FORMULA = "s1", "s2", "s3", "s4", "../../evil", "=1+1"
GAINS = {"x_controller.proportional": "0.9 V/mm", "z_controller.proportional": "0.9 V/mm"}
LAG, LOOP = (question.ask for question in load_lesson(LESSON).settings.questions)


@pytest.fixture(scope="module")
def students(tmp_path_factory: pytest.TempPathFactory) -> list[Student]:
    path = tmp_path_factory.mktemp("list") / "students.csv"
    path.write_text(LIST, encoding="utf-8")
    return read_students(path)


@pytest.fixture(scope="module")
def made(students: list[Student], registry: Registry, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[MadeMachine]]:
    folder = tmp_path_factory.mktemp("made") / "class"
    return folder, list(make_class(load_lesson(LESSON), registry, students, folder, seed=13))


def answer_of(folder: Path, student: Student) -> dict[str, object]:
    found: dict[str, object] = json.loads(ClassFolder(folder).kept(student, ".json").read_text())
    return found


# ---- the list --------------------------------------------------------------------------------------------------------------------


def test_a_name_never_leads_out_of_the_folder(students: list[Student]) -> None:
    assert [student.id for student in students] == [S1, S2, S3, S4, EVIL, FORMULA]
    assert students[0] == Student("s1", "Ames", "Ann; A.", "a@x")
    assert [student.folder for student in students[:4]] == [S1, S2, S3, S4]
    for name in (EVIL, FORMULA, "..", "", "/etc/passwd", "a\\b", "C:x", "con", "x" * 300, "ä ö", ".hidden", "a\nb"):
        folder = Student(name).folder
        assert Path(folder).name == folder != ".."
        assert len(folder) < 60
        assert folder.isascii()
        assert not folder.startswith((".", "-"))
    assert Student("a b").folder != Student("a_b").folder


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "no column is headed 'id', 'email' or 'name'"),
        ("id\n", "the list has no students"),
        ("id,name\na,b\nA,c\n", "'A' is in the list twice"),
        ("id,name\n,b\n", "the student has no id"),
        ('id,name\n"a', "the list is no CSV"),
    ],
)
def test_a_list_that_is_none_is_refused(text: str, sentence: str, tmp_path: Path) -> None:
    path = tmp_path / "list.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(RecordingError, match=sentence):
        read_students(path)


# ---- the machines ----------------------------------------------------------------------------------------------------------------


def test_each_gets_a_machine_of_their_own_equally_hard(made: tuple[Path, list[MadeMachine]], students: list[Student]) -> None:
    folder, machines = made
    assert {machine.student for machine in machines} == set(students)
    hard = [machine.difficulty for machine in machines]
    own = (0.68494 - 0.2) / 0.2  # the published error against the limit
    assert all(abs(value / own - 1.0) <= 1.05 * HIDDEN.within for value in hard)
    assert {path.name for path in (folder / "students").iterdir()} == {student.folder for student in students}
    values = {json.dumps(answer_of(folder, student)["values"]) for student in students}
    assert len(values) == len(students)
    assert sorted(path.name for path in folder.iterdir()) == ["class.json", "students", "teacher"]


def test_the_folder_of_a_student_holds_the_tasks_and_no_answer(made: tuple[Path, list[MadeMachine]], students: list[Student]) -> None:
    folder, _ = made
    for student in students:
        own = folder / "students" / student.folder
        assert {path.name for path in own.iterdir()} == {"lesson.yaml", "seal.json"}
        answer = opened(own, ClassFolder(folder).kept(student, ".json"))
        text = "".join(path.read_text() for path in own.iterdir())
        assert not any(str(item) in text for item in (answer["answers"][1], answer["salt"], answer["seed"]))
        lesson = load_lesson(own / "lesson.yaml")
        assert lesson.settings.goals == load_lesson(LESSON).settings.goals
        assert dict(lesson.settings.set) == answer["values"]
        assert not any(variant.published for variant in lesson.settings.variants.values())
        assert all(question.answer is None for question in lesson.settings.questions)


def test_the_same_student_gets_the_same_machine_and_a_stopped_call_goes_on(
    made: tuple[Path, list[MadeMachine]], students: list[Student], registry: Registry, tmp_path: Path
) -> None:
    folder, lesson = tmp_path / "class", load_lesson(LESSON)
    (again,) = make_class(lesson, registry, students[1:2], folder, seed=13)
    assert not again.before
    texts = [top / "students" / students[1].folder / "lesson.yaml" for top in (folder, made[0])]
    assert texts[0].read_bytes() == texts[1].read_bytes()
    shutil.rmtree(folder / "students")
    assert [item.before for item in make_class(lesson, registry, students[1:3], folder)] == [False, False]
    assert texts[0].read_bytes() == texts[1].read_bytes()
    assert [item.before for item in make_class(lesson, registry, students[1:3], folder)] == [True, True]
    with pytest.raises(RecordingError, match="the folder has another class"):
        list(make_class(lesson, registry, students, folder, seed=8))


def test_a_lesson_in_which_nothing_varies_is_refused(registry: Registry, students: list[Student], tmp_path: Path) -> None:
    path = write_lesson(tmp_path)
    path.write_text(path.read_text().partition("uncertain:")[0], encoding="utf-8")
    with pytest.raises(LessonError, match=r"nothing says which values differ in a class\. Write them in .*teacher/small\.yaml"):
        list(make_class(load_lesson(path), registry, students, tmp_path / "class"))


@pytest.mark.parametrize(
    ("name", "fact"), [("01_contour_error", "the lesson has no recordings"), ("30_how_full_must_a_buffer_be", "nothing that moves feeds")]
)
def test_an_effect_is_refused_where_nothing_can_be_hidden(
    name: str, fact: str, registry: Registry, students: list[Student], tmp_path: Path
) -> None:
    with pytest.raises(LessonError, match=rf"{fact}.* Leave --effect out\."):
        list(make_class(load_lesson(name), registry, students, tmp_path / "class", asked=["CoulombFriction"]))
    assert not (tmp_path / "class").exists()


def test_a_tool_point_and_an_answer_follow_the_machine_of_the_student(registry: Registry, students: list[Student], tmp_path: Path) -> None:
    (made,) = make_class(load_lesson("18_stability_lobes"), registry, students[:1], tmp_path / "class", seed=1)
    place = ClassFolder(tmp_path / "class")
    own = load_lesson(place.students / made.student.folder / "lesson.yaml").source.data
    assert {mode["stiffness"] for mode in own["tool_point"]["modes"]} == {own["set"]["mode.stiffness"]} != {"1e6 N/m"}
    assert own["tool_point"]["cutting_stiffness"] == own["set"]["cut.cutting_stiffness"]
    softer = quantity(own["set"]["mode.stiffness"], "N/m") / 1e6 / (quantity(own["set"]["cut.cutting_stiffness"], "N/m^2") / 7e8)
    (answer,) = answer_of(tmp_path / "class", made.student)["answers"]  # type: ignore[misc]
    assert quantity(str(answer), "mm") == pytest.approx(0.915e-3 * softer, rel=1e-4)


VARIED = [path for path in shipped_files("lesson_configs", "*.yaml") if teacher_notes(load_lesson(path)).vary]


@pytest.mark.slow
@pytest.mark.parametrize("path", VARIED, ids=lambda path: path.stem)
def test_a_lesson_in_which_values_vary_makes_a_class(path: Path, students: list[Student], registry: Registry, tmp_path: Path) -> None:
    hard = [machine.difficulty for machine in make_class(load_lesson(path), registry, students, tmp_path / "class", seed=1)]
    assert len(hard) == len(students)
    assert max(hard) <= (1.0 + HIDDEN.within) / (1.0 - HIDDEN.within) * min(hard)


# ---- the grades ------------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def handed_in(
    made: tuple[Path, list[MadeMachine]], students: list[Student], registry: Registry, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """Return the class with its work: s1 is right, s2 has the record of s1, s3 the answer of s1, s4 nothing; two more are at fault."""
    folder = tmp_path_factory.mktemp("handed_in") / "class"
    shutil.copytree(made[0], folder)
    place = {student.id: folder / "students" / student.folder for student in students}

    def run(name: str, **more: str) -> Path:
        (place[name] / "work").mkdir()
        record = place[name] / "work" / "run.h5"
        lesson = load_lesson(place[name] / "lesson.yaml")
        save(simulate(lesson, registry, "I", {**GAINS, **{key.replace("__", "."): value for key, value in more.items()}}), record)
        return record

    loop = str(answer_of(folder, students[0])["answers"][1])  # type: ignore[index]
    first = run(S1)
    keep_answer(first, "lesson", keep_answer(first, "lesson", {}, LAG, "nearly zero"), LOOP, loop)
    shutil.copy(first, place[S2] / "mine.hdf5")
    keep_answer(run(S3), "lesson", {}, LOOP, loop)
    run(EVIL, x_axis__gain="30 mm/(s*V)")
    (place[FORMULA] / "run.h5").write_bytes(b"no record")
    (place[FORMULA] / "guess.json").write_text(
        '{"schema": "lathesim-diagnosis/1", "verdict": [], "effects": [{"effect": "A", "tied_with": [[]]}]}'
    )
    (place[S4] / "theirs.h5").symlink_to(first)
    return folder


@pytest.fixture(scope="module")
def grades(handed_in: Path, registry: Registry) -> dict[str, StudentGrade]:
    return {item.student.id: item for item in grade_class(handed_in, registry)}


def test_work_is_graded_on_the_students_own_machine(grades: dict[str, StudentGrade]) -> None:
    found = {name: (item.result, item.goals_met, item.answers_right, item.marks) for name, item in grades.items()}
    assert found == {
        S1: ("met", 1, 2, 100.0),
        S2: ("another machine", 0, 0, 0.0),
        S3: ("met", 1, 0, 75.0),
        S4: ("nothing handed in", 0, 0, 0.0),
        EVIL: ("another machine", 0, 0, 0.0),
        FORMULA: ("unreadable", 0, 0, 0.0),
    }


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_workers_of_a_cluster_grade_alike(handed_in: Path, grades: dict[str, StudentGrade], registry: Registry) -> None:
    distributed = pytest.importorskip("distributed")
    for kept in handed_in.rglob("*_grade.json"):
        kept.unlink()
    workers = {"n_workers": 2, "threads_per_worker": 1, "processes": True, "dashboard_address": None}
    with distributed.LocalCluster(**workers) as local, Cluster(local.scheduler_address, registry.plugins) as cluster:
        found = {item.student.id: item for item in grade_class(handed_in, registry, cluster=cluster)}
    assert found == grades
    assert len(list(handed_in.rglob("*_grade.json"))) == len(grades)


def test_copies_are_named_and_nobody_else(handed_in: Path, grades: dict[str, StudentGrade]) -> None:
    loop = grades[S1].prints["right"][LOOP]
    found = {name: sentences for name, sentences in copies(handed_in, list(grades.values())).items() if sentences}
    assert found == {
        S1: ["The same record as that of s2."],
        S2: ["The same record as that of s1.", "mine.hdf5 was made on the machine of s1."],
        S3: [f"The answer {loop} is that of s1, whose machine it fits better. Chance does that in 0.1% of all cases."],
    }


def test_a_copied_answer_is_named_also_where_it_is_right_and_an_honest_one_is_not(registry: Registry, tmp_path: Path) -> None:
    people = [Student(f"s{number:02d}") for number in range(12)]
    made = make_class(load_lesson("17_waves_on_the_part"), registry, people, tmp_path / "class", seed=5)
    for machine in made:
        own = ClassFolder(tmp_path / "class").students / machine.student.folder
        lesson = load_lesson(own / "lesson.yaml")
        save(
            Record(
                np.arange(3.0) + int(lesson.path.parent.name[1:]),
                {},
                {"lesson": lesson.text, "lesson_name": lesson.name, "status": "complete"},
            ),
            own / "run.h5",
        )
    true = [quantity(str(answer_of(tmp_path / "class", one)["answers"][0]), "mm") * 1e3 for one in people]  # type: ignore[index]
    # every second one predicts the limit; the others try widths, and are off by up to 0.03 mm
    given = [
        f"{value + (number % 4 - 1) * 3e-5:.4f} mm" if number % 2 else f"{value + 0.03 * np.cos(number):.2f} mm"
        for number, value in enumerate(true)
    ]
    given[8], given[9] = given[3], given[5]
    for student, text in zip(people, given, strict=True):
        keep_answer(tmp_path / "class/students" / student.folder / "run.h5", "lesson", {}, lesson.settings.questions[0].ask, text)
    grades = list(grade_class(tmp_path / "class", registry))
    assert {grades[8].answers_right, grades[9].answers_right} == {0, 1}
    named = {name: sentences for name, sentences in copies(tmp_path / "class", grades).items() if sentences}
    assert [sentence.partition(",")[0] for (sentence,) in named.values()] == [
        f"The answer {text} is that of {name}" for text, name in ((given[3], "s03"), (given[5], "s05"))
    ]
    assert list(named) == ["s08", "s09"]


def test_what_was_graded_is_not_read_again(
    handed_in: Path, grades: dict[str, StudentGrade], registry: Registry, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(class_grades, "grade_file", lambda *given: pytest.fail("it was graded before"))
    assert list(grade_class(handed_in, registry)) == list(grades.values())


def test_the_tables_are_those_that_others_read(handed_in: Path, grades: dict[str, StudentGrade], tmp_path: Path) -> None:
    write_forms(tmp_path, LESSON, list(grades.values()), copies(handed_in, list(grades.values())))

    def rows(name: str) -> list[list[str]]:
        with (tmp_path / name).open(encoding="utf-8", newline="") as file:
            return list(csv.reader(file))

    own = rows("grades.csv")
    assert own[0] == list(GRADES)
    assert own[1][:5] == ["s1", "Ames", "Ann; A.", "a@x", "yes"]
    assert own[4][4:6] == ["no", "nothing handed in"]
    assert [own[5][2], own[6][0]] == ['\'=HYPERLINK("http://x")', "'=1+1"]
    assert not any(cell[:1] in tuple("=+-@") for row in own for cell in row)
    assert rows("moodle.csv")[0] == ["ID number", "Email address", f"{LESSON} (Real)", f"{LESSON} (Feedback)"]
    assert [row[2] for row in rows("moodle.csv")[1:5]] == ["100.0", "0.0", "75.0", "-"]
    assert rows("nbgrader.csv")[0] == list(NBGRADER)
    assert rows("nbgrader.csv")[3] == [LESSON, "", "", "s3", "Cole", "Cid", "c@x", "75.0", "0.0", "75.0", "100.0"]
    result = json.loads((tmp_path / "gradescope" / "s3" / "results.json").read_text())
    assert result["score"] == 75.0
    assert {path.parent.parent for path in tmp_path.rglob("results.json")} == {tmp_path / "gradescope"}


# ---- a class of detectives, by the command line ----------------------------------------------------------------------------------


def test_a_class_of_detectives(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    lesson = write_lesson(tmp_path, "0.5 s")
    Path("list.csv").write_text("id\na\nb\nc\n", encoding="utf-8")
    new = ("class", "new", str(lesson), "--students", "list.csv", "--out", "class", "--effect", "CoulombFriction@x_axis", "--seed", "3")
    said = done(capsys, *new)
    assert said.out.startswith(f"3 machines, 3 of them made now, in {Path('class/students')}\nDifficulty: the hidden effect moves")
    truths = {name: json.loads(Path(f"class/teacher/{name}.json").read_text()) for name in "abc"}
    assert all(abs(truth["difficulty"] / 100.0 - 1.0) <= HIDDEN.within for truth in truths.values())
    assert len({truth["effects"][0]["parameters"]["level"]["value"] for truth in truths.values()}) == 3
    own = {path.name for path in Path("class/students/a").iterdir()}
    assert own == {"lesson.yaml", "recording.csv", "seal.json", "small.nc"}
    assert not any("CoulombFriction" in path.read_text() for path in Path("class/students").rglob("*.*"))
    sizes = truths["a"]["effects"][0]["parameters"]
    guess = {"schema": "lathesim-diagnosis/1", "verdict": "named", "effects": [{**truths["a"]["effects"][0], "parameters": sizes}]}
    for name in "ab":
        Path(f"class/students/{name}/mine.json").write_text(json.dumps(guess), encoding="utf-8")
    said = done(capsys, "class", "grade", "class")
    assert "2 of 3 students handed something in.\nNothing from: c\na: The same diagnosis as that of b.\n" in said.out
    assert Path("class/grades/grades.csv").read_text().splitlines()[1].startswith("a,,,,yes,no record,0,0,0,0,right,100.0,")


def test_ctrl_c_says_how_to_go_on(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    def stopped(*given: object, **more: object) -> list[MadeMachine]:
        raise KeyboardInterrupt

    monkeypatch.setattr("lathesim.classroom.making.make_class", stopped)
    monkeypatch.chdir(tmp_path)
    Path("list.csv").write_text("id\na\n", encoding="utf-8")
    said = call(capsys, "class", "new", LESSON, "--students", "list.csv", "--out", "class")
    assert (said.code, said.err) == (130, "Stopped after 0 of 1 machines; the same command goes on from there.\n")
