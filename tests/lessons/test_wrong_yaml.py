"""Every kind of wrong YAML gets one sentence that says where, what, and what was meant. Lines 1 to 3 of each lesson are right."""

from pathlib import Path

import pytest

from lathesim.errors import LatheSimError
from lathesim.lessons.assemble import assemble
from lathesim.lessons.lesson import find_lesson, load_lesson
from tests.lessons.small_machine import small_registry, write_lesson

WRONG = {
    "unknown key": ("sett: {}", "4:1: there is no key 'sett' here. Did you mean 'set'?"),
    "unknown key far from all": (
        "goals: [{metric: a, at_most: 1 mm, because: x}]",
        "4:36: there is no key 'because' here. Known here: metric, at_most, at_least, hint.",
    ),
    "a comma in a text without quotes": (
        "questions: [{ask: Where, and when?, answer: x}]",
        "4:26: there is no key 'and when?' here. Put a text that holds a comma or a colon in quotes.",
    ),
    "unknown key of a variant": ("variants:\n  I: {sett: {}}", "5:7: there is no key 'sett' here. Did you mean 'set'?"),
    "key given twice": (
        "seed: 1\nset: {}\nseed: 2",
        "6:1: the key 'seed' is given a second time (first in line 4). Take one of them away.",
    ),
    "naked number": ("set: {table.mass: 30}", "4:19: '30' has no unit. Write it with one, for example '30 kg'."),
    "naked number for a time": ("sample_period: 0.005", "4:16: '0.005' has no unit. Write it with one, for example '0.005 s'."),
    "unit of another kind": ("set: {table.mass: 3 mm}", "4:19: '3 mm' is given in mm, but kg is wanted. Use a unit like kg."),
    "unknown unit": (
        "set: {table.mass: 3 kilo}",
        "4:19: 'kilo' is no unit. Write units as in 'mm', 'm/s', 'N*s/m', 'V/mm', 'rpm'.",
    ),
    "no quantity": (
        "set: {table.mass: heavy}",
        "4:19: 'heavy' is not a number with a unit. Write a number and a unit, for example '5 ms'.",
    ),
    "not finite": ("set: {table.mass: inf kg}", "4:19: 'inf kg' is not a finite number. Write a number and a unit."),
    "true for a quantity": ("set: {table.mass: true}", "4:19: true stands here, and a quantity is expected, for example '5 ms'."),
    "list for a quantity": ("step: [1 ms]", "4:7: a list stands here, and a quantity is expected, for example '5 ms'."),
    "out of bounds": (
        "set: {table.mass: 2000 kg}",
        "4:19: table.mass is 2000 kg, outside 0.1 to 1000 kg. Choose a value inside.",
    ),
    "unknown parameter": ("set: {table.viscos: 1 kg}", "4:7: table has no parameter 'viscos'. Did you mean 'viscous'?"),
    "unknown parameter far from all": (
        "set: {table.colour: 1 kg}",
        "4:7: table has no parameter 'colour'. It has speed, travel, mass, viscous.",
    ),
    "output as parameter": ("set: {table.position: 1 m}", "4:7: table.position is an output, not a parameter."),
    "input as parameter": (
        "set: {table.disturbance: 1 N}",
        "4:7: table.disturbance is an input, not a parameter. Feed it with a wire, under 'wires:'.",
    ),
    "unknown part": ("set: {tabel.mass: 1 kg}", "4:7: there is no part 'tabel'. Did you mean 'table'?"),
    "no part and item": (
        "set: {table: 1 kg}",
        "4:7: 'table' names no part and item. Write it as part.name, for example x_axis.position.",
    ),
    "units of a wire to a parameter": (
        "wires: {table.mass: push.target}",
        "4:21: wire table.mass <- push.target: units differ, kg against m. "
        "Table declares mass in kg, at small_machine.py:36; Push declares target in m, at small_machine.py:14. Change one of them.",
    ),
    "setting without effect": (
        "wires: {table.viscous: 3 N*s/m}\nset: {table.viscous: 1 N*s/m}",
        "5:7: table.viscous is fed by a constant, so setting it changes nothing. Change the wire under 'wires:' instead.",
    ),
    "unknown component": ("replace: {table: HevyTable}", "4:18: there is no component 'HevyTable'. Did you mean 'HeavyTable'?"),
    "effect as component": (
        "replace: {table: Drag}",
        "4:18: 'Drag' is an effect, not a component. Effects go under 'insert:'.",
    ),
    "unknown part replaced": ("replace: {tables: HeavyTable}", "4:11: there is no part 'tables'. Did you mean 'table'?"),
    "units of a wire": (
        "wires: {table.force: ruler.reading}",
        "4:22: wire table.force <- ruler.reading: units differ, N against m. "
        "Table declares force in N, at small_machine.py:32; Ruler declares reading in m, at small_machine.py:61. Change one of them.",
    ),
    "unknown output": ("wires: {table.force: push.forse}", "4:22: push has no output 'forse'. Did you mean 'force'?"),
    "unknown input": ("wires: {table.forse: push.force}", "4:9: table has no input 'forse'. Did you mean 'force'?"),
    "unknown source": ("wires: {table.force: pusher.force}", "4:22: there is no part 'pusher'. Did you mean 'push'?"),
    "unknown effect": ("insert: [{effect: Drgag, at: table}]", "4:19: there is no effect 'Drgag'. Did you mean 'Drag'?"),
    "component as effect": (
        "insert: [{effect: Ruler, at: table}]",
        "4:19: 'Ruler' is a component, not an effect. Components go under 'parts:' of a machine, or 'replace:'.",
    ),
    "effect at no part": ("insert: [{effect: Drag, at: tabel}]", "4:29: there is no part 'tabel'. Did you mean 'table'?"),
    "effect where it has no port": (
        "insert: [{effect: Drag, at: ruler}]",
        "4:29: ruler (Ruler) has no port 'effort', where Drag sits. "
        "Here table has one. Or name the place, as in 'at: ruler.<input, parameter or output>'.",
    ),
    "effect that senses nothing": (
        "insert: [{effect: Drag, at: push.target}]",
        "4:29: push has no port 'flow', which Drag needs (velocity of the host). Say what it senses, as in 'flow: part.output'.",
    ),
    "effect at no item": (
        "insert: [{effect: Shift, at: table.positon}]",
        "4:30: table has no input, output or parameter 'positon'. Did you mean 'position'?",
    ),
    "parameter of an effect": (
        "insert: [{effect: Drag, at: table, levle: 3 N}]",
        "4:36: Drag has no parameter 'levle'. Did you mean 'level'?",
    ),
    "unit of an effect's parameter": (
        "insert: [{effect: Drag, at: table, level: 3 m}]",
        "4:43: '3 m' is given in m, but N is wanted. Use a unit like N.",
    ),
    "effect twice under one name": (
        "insert: [{effect: Drag, at: table}, {effect: Drag, at: table}]",
        "4:56: two parts are called 'table_drag'. Give the effect another name, with 'name: ...'.",
    ),
    "missing key": ("insert: [{effect: Drag}]", "4:10: the key 'at' is missing. Write 'at: ...'."),
    "number for a text": ("text: 3", "4:7: the number 3 stands here, and a text is expected."),
    "text for a count": ("seed: many", "4:7: 'seed' is the text 'many', and a whole number of 0 or more is expected."),
    "fraction for a count": ("every: {push: 1.5}", "4:15: 'push' is the number 1.5, and a whole number of 1 or more is expected."),
    "goal without limit": ("goals: [{metric: a}]", "4:9: the goal has no limit. Write at_most or at_least with a quantity."),
    "text for keys": (
        "set: table",
        "4:6: 'set' is the text 'table', and keys with values are expected. Write 'key: value' lines, indented.",
    ),
    "nothing for keys": ("set:", "4:5: 'set' is nothing, and keys with values are expected. Write 'key: value' lines, indented."),
    "text for a list": ("insert: Drag", "4:9: 'insert' is the text 'Drag', and a list is expected. Write it as [first, second]."),
    "unknown engine": ("engine: fast", "4:9: 'engine' is the text 'fast', and 'auto', 'plain' or 'compiled' is expected."),
    "alias": ("set: &here {}\nreplace: *here", "4:6: an alias (*name) stands here, and lessons have none. Write the value out."),
    "tag": (
        "seed: !!python/object/apply:os.getpid []",
        "4:7: the tag 'tag:yaml.org,2002:python/object/apply:os.getpid' stands here, and lessons have none. Take it away.",
    ),
    "tab": ("set:\n\ttable.mass: 1 kg", "5:1: the line is indented with a tab. Indent with spaces."),
    "zero time": ("step: 0 s", "4:7: the time is 0 s, and it must be above zero."),
    "channel that is none": ("record: [table.mass]", "4:10: table.mass is a parameter, not an output."),
    "missing program": (
        "program: turn.nc",
        "4:10: there is no part program 'turn.nc'. The path is taken from the lesson's folder.",
    ),
    "machine that is none": ("", "2:10: there is no machine template 'smal'. Did you mean 'small'?"),
}


@pytest.mark.parametrize("kind", WRONG)
def test_wrong_yaml_gets_its_sentence(kind: str, tmp_path: Path) -> None:
    body, sentence = WRONG[kind]
    path = write_lesson(tmp_path, body)
    if kind == "machine that is none":
        path.write_text("lesson: Small\nmachine: smal\n", encoding="utf-8")
    with pytest.raises(LatheSimError) as refused:
        assemble(load_lesson(path), small_registry())
    assert str(refused.value) == f"{path}:{sentence}"


def test_not_yaml_names_the_place(tmp_path: Path) -> None:
    path = write_lesson(tmp_path, "set: {a: b")
    with pytest.raises(LatheSimError, match=r"lesson\.yaml:5:1: this is not YAML: .*\. Check the indentation, colons and quotes there\."):
        load_lesson(path)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"", ": the file is empty. Begin with 'lesson: a title'."),
        (b"- a\n- b\n", ":1:1: the file holds a list where keys and values are expected. Write 'key: value' lines."),
        (b"lesson: caf\xe9\n", ": byte 11 is not UTF-8 text. Save the file as UTF-8."),
        (b"lesson: a\n", ":1:1: the key 'machine' is missing. Write 'machine: ...'."),
        (b"machine: a\nparts: {}\n", ": this is a machine template, not a lesson. Write a lesson with the key 'machine' naming it."),
    ],
)
def test_a_file_that_is_no_lesson(content: bytes, sentence: str, tmp_path: Path) -> None:
    path = tmp_path / "lesson.yaml"
    path.write_bytes(content)
    with pytest.raises(LatheSimError) as refused:
        load_lesson(path)
    assert str(refused.value) == f"{path}{sentence}"


@pytest.mark.parametrize("program", ["G21 G90\nG00 X42. Z2.\n", "(Groove: 2 mm)\nG21\n"])
def test_a_part_program_given_as_a_lesson_says_where_it_belongs(program: str, tmp_path: Path) -> None:
    (tmp_path / "groove.nc").write_text(program, encoding="utf-8")
    with pytest.raises(LatheSimError, match=r"groove\.nc: the file is no lesson, which is YAML\. A lesson names .*'program: groove\.nc'"):
        load_lesson(tmp_path / "groove.nc")


def test_a_lesson_that_is_not_there_names_the_nearest() -> None:
    with pytest.raises(LatheSimError) as refused:
        load_lesson("01_contour_eror")
    assert str(refused.value) == "there is no lesson '01_contour_eror'. Did you mean '01_contour_error'?"


@pytest.mark.parametrize(
    ("asked", "remedy"),
    [
        ("mine/case_1/lessen.yaml", "Did you mean 'lesson.yaml'?"),
        ("mine/case_2/lesson.yaml", "There is no folder 'mine/case_2' either."),
    ],
)
def test_a_path_that_leads_nowhere_is_called_a_file(asked: str, remedy: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "mine" / "case_1").mkdir(parents=True)
    (tmp_path / "mine" / "case_1" / "lesson.yaml").write_text("lesson: mine\n")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(LatheSimError) as refused:
        find_lesson(asked)
    assert str(refused.value) == f"there is no file '{asked}'. {remedy}"
