"""Every file of the program is short, has a telling name, and says what its public things are; no figure of its shape grows."""

import ast
import json
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from lathesim.component import ON
from tests.cli.command import ROOT
from tests.house.counts import bare_numbers, counts, decisions_on_names, nodes, parsed
from tests.house.descents import own_descents

PACKAGE = ROOT / "lathesim"
MODULES = sorted(PACKAGE.rglob("*.py"))
LONGEST = 441
MOST_FILES = {
    "analysis": 13, "cli": 44, "compensation": 13, "components": 23, "effects": 19, "engine": 16, "exercises": 8,
    "experiments": 22, "fmi": 3, "lessons": 22, "live": 34, "manual": 4, "motion": 9, "program": 25, "recordings": 16,
    "stability": 21, "tui": 33,
}  # fmt: skip
"""Modules of each folder with its own folders: numbers that only fall."""
BARE = {"tui": 8}
"""Comparisons with a number that has no name, and with that neither a unit nor a reason, of folders that have any: they only fall."""
HALVES: dict[str, int] = {}
"""Comparisons with a bare half of folders that have any; a flag is compared with ``ON``, anything else with a name: they only fall."""
ON_TEXT = {"experiments": 9, "live": 17, "program": 12, "recordings": 14, "stability": 11}
"""Decisions of each folder on how a text begins or ends, or on a name; of these folders most read files: numbers that only fall."""
FIELDS, ARGUMENTS, LENGTH = 12, 8, 60
"""Fields of a dataclass, arguments of a function that is no law of a part, and lines of a function: what a reader keeps in mind."""
WIDE = {"Identification"}
"""Dataclasses with more fields, a set that only shrinks; authors of plug-ins write an ``Identification``, of few entries."""
MANY_ARGUMENTS: set[str] = set()
"""Functions with more arguments that are no laws of a part: a set that only shrinks."""
REPEATED: set[str] = set()
"""File names that several folders have: a set that only shrinks."""
VAGUE = re.compile(r"(\w+_)?(utils?|helpers?|managers?)|common|base|misc|tools|stuff")
LAW = re.compile(r"(derivative|output|update)(_\w+)?")
"""The laws of a part: their equation stands in the docstring of the class."""
HOME = re.compile(r"(?<![\w.:/$}-])/(home|root|work|Users)/\w|[A-Z]:\\Users")
"""A path of the machine on which a file was written."""
TEXTS = {".py", ".md", ".yaml", ".nc", ".toml", ".j2", ".csv", ".m", ".c", ".txt"}

KEPT = Path(__file__).parent / "diagnosis_counts.json"
"""The figures of commit a0113a3, before the folder was put on shelves, and those that may not be exceeded: lower them where one falls."""
SIZES = {"files", "floors", "arrows", "limits", "lines"}
"""Figures that grow with what the diagnosis can do."""
UNCLEAR = ("Give ", "Say ", "Tell ")
"""A function returns a value or does something; these words leave open which."""

Definition = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef


def texts() -> Iterator[Path]:
    """Return every text file of the project."""
    for top in ("lathesim", "lesson_configs", "part_programs", "plugins", "tests"):
        yield from (path for path in sorted((ROOT / top).rglob("*")) if path.suffix in TEXTS)
    yield from (ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "pyproject.toml"))


def public(node: ast.Module | ast.ClassDef, prefix: str = "") -> Iterator[tuple[str, Definition]]:
    """Return the public classes and functions of a module, and those of its public classes, with their names."""
    for item in node.body:
        if isinstance(item, Definition) and not item.name.startswith("_"):
            yield prefix + item.name, item
            if isinstance(item, ast.ClassDef):
                yield from public(item, f"{prefix}{item.name}.")


def begins_oddly(path: Path) -> list[str]:
    """Return the functions of a module whose docstring begins with a verb that may mean either to return or to show."""
    functions = [node for node in nodes(parsed(path)) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]
    return [node.name for node in functions if (ast.get_docstring(node) or "").startswith(UNCLEAR)]


def named(node: ast.AST, prefix: str = "") -> Iterator[tuple[str, Definition]]:
    """Return all classes and functions inside a node, with the names of the classes that they stand in."""
    for item in ast.iter_child_nodes(node):
        if isinstance(item, ast.expr):
            continue  # in which nothing is defined
        own = f"{prefix}{item.name}" if isinstance(item, Definition) else ""
        if isinstance(item, Definition):
            yield own, item
        yield from named(item, f"{own}." if isinstance(item, ast.ClassDef) else "" if own else prefix)


def fields(node: ast.ClassDef) -> int:
    """Return how many fields a dataclass has, 0 for any other class."""
    if not any("dataclass" in ast.unparse(mark) for mark in node.decorator_list):
        return 0
    return sum(isinstance(item, ast.AnnAssign) and "ClassVar" not in ast.unparse(item.annotation) for item in node.body)


def arguments(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Return how many arguments a function takes beside its instance or class."""
    own = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
    return len(own) - bool(own and own[0].arg in ("self", "cls"))


def halves(tree: ast.Module) -> Iterator[int]:
    """Return the lines of comparisons of something with 0.5."""
    for node in nodes(tree):
        if isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            yield from (side.lineno for side in sides if isinstance(side, ast.Constant) and side.value == ON)


def undocumented(path: Path) -> list[str]:
    """Return what of a module has no docstring; what sets a property is described where the property is read."""
    module = parsed(path)
    missing = [] if ast.get_docstring(module) else ["the module"]
    for name, item in public(module):
        is_law = "." in name and LAW.fullmatch(item.name) is not None
        sets = any(isinstance(mark, ast.Attribute) and mark.attr == "setter" for mark in item.decorator_list)
        if not is_law and not sets and not ast.get_docstring(item):
            missing.append(name)
    return missing


def test_no_file_is_long() -> None:
    lengths = {str(path.relative_to(ROOT)): len(path.read_text(encoding="utf-8").splitlines()) for path in MODULES}
    assert {name: lines for name, lines in lengths.items() if lines > LONGEST} == {}


def test_no_folder_has_more_files_than_it_had() -> None:
    found = {folder: len(list((PACKAGE / folder).rglob("*.py"))) for folder in MOST_FILES}
    assert {folder: count for folder, count in found.items() if count > MOST_FILES[folder]} == {}


def test_no_comparison_with_a_nameless_number_and_no_decision_on_a_text_comes_up() -> None:
    for most, counted in ((BARE, bare_numbers), (HALVES, halves), (ON_TEXT, decisions_on_names)):
        found = Counter[str]()
        for path in MODULES:
            found[path.relative_to(PACKAGE).parts[0]] += len(list(counted(parsed(path))))
        folders = most if most is ON_TEXT else found
        assert {folder: found[folder] for folder in folders if found[folder] > most.get(folder, 0)} == {}


def test_no_more_dataclasses_are_wide_and_no_more_functions_long_or_of_many_arguments() -> None:
    everything = [item for path in MODULES for item in named(parsed(path))]
    functions = [(name, node) for name, node in everything if not isinstance(node, ast.ClassDef)]
    laws = {name for name, node in functions if "." in name and LAW.fullmatch(node.name)}
    assert {name for name, node in everything if isinstance(node, ast.ClassDef) and fields(node) > FIELDS} <= WIDE
    assert {name for name, node in functions if name not in laws and arguments(node) > ARGUMENTS} <= MANY_ARGUMENTS
    assert {name for name, node in functions if (node.end_lineno or 0) - node.lineno + 1 > LENGTH} == set()


def test_no_constant_of_a_module_is_given_twice() -> None:
    """The second value would count for what stands above it too."""
    twice = []
    for path in MODULES:
        names = Counter(
            target.id
            for node in parsed(path).body
            if isinstance(node, ast.Assign)
            for target in node.targets
            if isinstance(target, ast.Name)
        )
        twice += [f"{path.relative_to(PACKAGE)}: {name}" for name, count in names.items() if count > 1]
    assert twice == []


def test_no_class_shares_its_name() -> None:
    names = Counter(node.name for path in MODULES for node in nodes(parsed(path)) if isinstance(node, ast.ClassDef))
    assert {name for name, count in names.items() if count > 1} == set()


def test_no_file_shares_its_name() -> None:
    names = [path.stem for path in MODULES if path.stem not in ("__init__", "__main__")]
    assert {name for name in names if names.count(name) > 1} <= REPEATED


def test_no_name_is_vague() -> None:
    paths = [path for top in ("lathesim", "tests", "plugins") for path in (ROOT / top).rglob("*") if path.suffix in ("", ".py")]
    assert [str(path.relative_to(ROOT)) for path in paths if VAGUE.fullmatch(path.stem)] == []


def test_everything_public_has_a_docstring() -> None:
    missing = {str(path.relative_to(ROOT)): undocumented(path) for path in MODULES}
    assert {name: names for name, names in missing.items() if names} == {}


def test_no_docstring_leaves_open_whether_a_function_returns() -> None:
    found = {str(path.relative_to(ROOT)): begins_oddly(path) for path in MODULES}
    assert {name: names for name, names in found.items() if names} == {}


def test_no_file_names_a_place_on_somebodys_machine() -> None:
    found = {str(path.relative_to(ROOT)): HOME.search(path.read_text(encoding="utf-8", errors="replace")) for path in texts()}
    assert {name: match[0] for name, match in found.items() if match} == {}


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (f"see {'/home'}/anna/lathe", True),
        (f"see '{'/work'}/lathe'", True),
        ("C:" + "\\Users\\anna", True),
        ("cd work/plugins", False),
        (f"..{'/work'}/plugins", False),
        ("https://example.org/home/page", False),
    ],
)
def test_a_place_on_a_machine_is_told_from_other_paths(text: str, found: bool) -> None:
    assert bool(HOME.search(text)) == found


def test_a_missing_docstring_is_seen(tmp_path: Path) -> None:
    path = tmp_path / "part.py"
    path.write_text('"""A part."""\nclass Part:\n    """A part."""\n    def output(): ...\n    def name(self): ...\n', encoding="utf-8")
    assert undocumented(path) == ["Part.name"]


def test_no_figure_of_the_shape_of_the_diagnosis_grows() -> None:
    most = json.loads(KEPT.read_text(encoding="utf-8"))["at most"]
    now = {name: number for name, number in counts().items() if name not in SIZES}
    assert {name: (number, most[name]) for name, number in now.items() if number > most[name]} == {}


def test_no_import_runs_up() -> None:
    assert counts()["arrows that run up"] == 0


def test_a_loop_that_solves_for_a_step_is_counted(tmp_path: Path) -> None:
    (tmp_path / "lathesim").mkdir()
    text = """
def descended(values):
    for _ in range(9):
        step = solve_for(values)
        if left(values + step) > left(values):
            break
        values = values + step
    return values


def solve_for(values):
    return np.linalg.lstsq(slopes(values), left(values))[0]
"""
    (tmp_path / "lathesim" / "own.py").write_text(text, encoding="utf-8")
    assert own_descents(tmp_path) == ["own.descended"]
