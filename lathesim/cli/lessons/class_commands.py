"""``lathesim class``, ``sheet``, ``notebook``: machines for a class, the grades of all in one table, a lesson on paper and in Jupyter."""

from __future__ import annotations

from pathlib import Path

import click

from lathesim.cli.options import STOPPED, OutputPath, cluster_at, cluster_option, open_registry, plugins_option, variant_option
from lathesim.cli.progress import count_bar

_GO_ON = "the same command goes on from there."


@click.group("class")
def class_() -> None:
    """Make a machine of their own for each student of a class, and grade what the class hands in."""


@class_.command()
@click.argument("lesson")
@click.option("--students", "file", type=click.Path(path_type=Path), required=True, metavar="FILE.csv", help="The list of the class.")
@click.option("--out", type=OutputPath(folder=True), required=True, metavar="DIR", help="The folder of the class.")
@click.option(
    "--effect",
    "asked",
    multiple=True,
    metavar="NAME[:PARAMETER=VALUE,...][@PART]",
    help="Hide this, or of several one each; sizes are drawn unless given.",
)
@click.option("--seed", type=click.IntRange(min=0), help="Draw the same machines again [default: drawn, and kept in DIR].")
@plugins_option
def new(lesson: str, file: Path, out: Path, asked: tuple[str, ...], seed: int | None, plugin_folders: tuple[Path, ...]) -> int:
    """Make a machine for each student of FILE.csv: LESSON with other values, and a hidden effect if its recordings show one.

    DIR/students has a folder for each student, to be handed out. All else in DIR stays with the teacher: the sealed answers and the seed.
    FILE.csv has headings: id, last_name, first_name, email, or those of Moodle, nbgrader and Gradescope. All machines are equally hard, to
    10 %. Stopped and started again, the command goes on where it was; students added to FILE.csv get theirs.
    """
    from lathesim.classroom.making import hides_effects, make_class
    from lathesim.classroom.roster import read_students
    from lathesim.lessons.lesson import load_lesson

    students, loaded = read_students(file), load_lesson(lesson)
    made = []
    try:
        with count_bar("machines", len(students)) as tell:
            for machine in make_class(loaded, open_registry(plugin_folders), students, out, asked=asked, seed=seed):
                made.append(machine)
                tell()
    except KeyboardInterrupt:
        click.echo(f"Stopped after {len(made)} of {len(students)} machines; {_GO_ON}", err=True)
        return STOPPED
    hard = sorted(machine.difficulty for machine in made)
    click.echo(f"{len(made)} machines, {sum(not machine.before for machine in made)} of them made now, in {out / 'students'}")
    hidden = hides_effects(loaded, asked)
    by, times = ("the hidden effect moves a channel", "its noise") if hidden else ("the lesson's case misses its goals", "their limits")
    click.echo(f"Difficulty: {by} by {hard[0]:.4g} to {hard[-1]:.4g} times {times}; the median is {hard[len(hard) // 2]:.4g}")
    click.echo(f"To be kept from the class: {out / 'teacher'} and {out / 'class.json'}")
    return 0


@class_.command()
@click.argument("folder", type=click.Path(path_type=Path), metavar="DIR")
@click.option("--handed-in", type=click.Path(path_type=Path), metavar="FOLDER", help="Where the work is [default: DIR/students].")
@click.option("--out", type=OutputPath(folder=True), metavar="FOLDER", help="Where the tables go [default: DIR/grades].")
@cluster_option
@plugins_option
def grade(folder: Path, handed_in: Path | None, out: Path | None, cluster: str | None, plugin_folders: tuple[Path, ...]) -> int:
    """Grade the work of the class in DIR: records, answers and diagnoses, in one table.

    Each student hands in the records (RUN.h5), their RUN.answers.json, and the diagnosis as JSON, in a folder of the same name as the one
    that was handed out. The tables are grades.csv, moodle.csv, nbgrader.csv and gradescope/STUDENT/results.json. A copy is named and still
    gets its marks: look at it. Stopped and started again, the command goes on where it was.
    """
    from lathesim.classroom.class_grades import copies, grade_class, write_forms
    from lathesim.classroom.roster import ClassFolder

    about = ClassFolder(folder).read()
    grades = []
    try:
        registry = open_registry(plugin_folders)
        with cluster_at(cluster, registry.plugins) as workers, count_bar("students", len(about["students"])) as tell:
            for graded in grade_class(folder, registry, handed_in, workers):
                grades.append(graded)
                tell()
        grades.sort(key=lambda item: about["students"].index(item.student))
    except KeyboardInterrupt:
        click.echo(f"Stopped after {len(grades)} of {len(about['students'])} students; {_GO_ON}", err=True)
        return STOPPED
    copied = copies(folder, grades)
    missing = [item.student.id for item in grades if not item.files]
    click.echo(f"{len(grades) - len(missing)} of {len(grades)} students handed something in.")
    if missing:
        click.echo(f"Nothing from: {', '.join(missing)}")
    for name, sentences in copied.items():
        for sentence in sentences:
            click.echo(f"{name}: {sentence}")
    for path in write_forms(out or folder / "grades", about["lesson"], grades, copied):
        click.echo(f"See {path}")
    return 0


@click.command()
@click.argument("lesson")
@click.option(
    "--out", type=OutputPath(makes_folder=True), metavar="F.html|F.pdf", help="Write this file [default: LESSON_sheet.html and .pdf]."
)
@click.option("--solutions", is_flag=True, help="Add answers, solution and marks, for the teacher only.")
@variant_option
@plugins_option
def sheet(lesson: str, out: Path | None, solutions: bool, variant: str | None, plugin_folders: tuple[Path, ...]) -> int:
    """Write LESSON as a sheet to print: what it says, tasks and questions with room for answers, and the plot of a run.

    The plot is that of --variant, else of the lesson's first case. Answers and solution come from the teacher's notes beside the lesson.
    """
    from lathesim.classroom.sheet import FORMS, sheet_blocks, sheet_figure, write_sheet
    from lathesim.classroom.teacher_notes import COPY_NOTES, notes_file, teacher_notes
    from lathesim.errors import LatheSimError, LessonError
    from lathesim.lessons.lesson import load_lesson
    from lathesim.whole_file import make_folder

    loaded = load_lesson(lesson)
    if solutions and not notes_file(loaded).is_file():
        raise LessonError("the lesson has no notes for teachers.", place=str(notes_file(loaded)), remedy=COPY_NOTES)
    blocks = sheet_blocks(loaded, teacher_notes(loaded) if solutions else None)
    try:
        figure = sheet_figure(loaded, open_registry(plugin_folders), variant)
    except LatheSimError as error:
        if variant is not None:
            raise
        figure = None
        click.echo(f"The sheet has no plot: {error}", err=True)
    name = f"{loaded.name}_{'solutions' if solutions else 'sheet'}"
    for path in [out] if out is not None else [Path(f"{name}{form}") for form in FORMS]:
        make_folder(path.parent)
        write_sheet(path, blocks, figure)
        click.echo(f"See {path}")
    return 0


@click.command()
@click.argument("lesson")
@click.option("--out", type=OutputPath(makes_folder=True), metavar="F.ipynb", help="Write this file [default: LESSON.ipynb].")
def notebook(lesson: str, out: Path | None) -> int:
    """Write LESSON as a Jupyter notebook: its text, a run of each case, its tasks and its questions.

    The cells call 'import lathesim'. Jupyter is not needed to write the file. Open the notebook where lathesim is installed.
    """
    from lathesim.classroom.notebook import write_notebook
    from lathesim.lessons.lesson import load_lesson
    from lathesim.whole_file import make_folder

    loaded = load_lesson(lesson)
    path = out or Path(f"{loaded.name}.ipynb")
    make_folder(path.parent)
    write_notebook(path, loaded)
    click.echo(f"See {path}")
    return 0
