"""Stock parts, plug-in folders and installed packages come in through one door; what is at fault costs one line and nothing else."""

import importlib.util
import sys
from pathlib import Path

import pytest

from lathesim.errors import LatheSimError
from lathesim.plugins import Registry, load_registry
from lathesim.workspace import MARKER, mark_workspace, workspace_plugins

GOOD = '''\
"""A plug-in."""

from lathesim.component import Component, Output, Parameter
from lathesim.hookspecs import hookimpl


class SteadyForce(Component):
    """Gives a force that never changes."""

    level = Parameter("N", 10.0, doc="size of the force")
    force = Output("N", doc="force")

    @staticmethod
    def output(level: float) -> float:
        return level


@hookimpl
def register_components():
    return [SteadyForce]
'''
WRONG = {
    "no Python": (("class SteadyForce(Component):", "class SteadyForce(Component:"), "7: this is not Python: invalid syntax."),
    "module that is missing": (
        ('"""A plug-in."""', "import nothing_of_this_name"),
        "1: the plug-in cannot be imported: ModuleNotFoundError: No module named 'nothing_of_this_name'",
    ),
    "exception on import": (
        ("    level =", "    level = 1 / 0 #"),
        "10: the plug-in cannot be imported: ZeroDivisionError: division by zero",
    ),
    "exit on import": (('"""A plug-in."""', "raise SystemExit(3)"), "1: the plug-in cannot be imported: SystemExit: 3"),
    "undeclared argument": (
        ("def output(level: float)", "def output(levle: float)"),
        "7: SteadyForce: output takes 'levle', which is not declared. Did you mean 'level'?",
    ),
    "misspelt hook": (
        ("def register_components", "def register_component"),
        "18: there is no hook 'register_component'. Did you mean 'register_components'?",
    ),
    "hook without its mark": (("@hookimpl\n", ""), "18: register_components is not marked as a hook. Write @hookimpl above it."),
    "hook with an argument": (
        ("def register_components()", "def register_components(things)"),
        None,
    ),
    "nothing registered": (
        ("@hookimpl\ndef register_components():\n    return [SteadyForce]\n", ""),
        None,
    ),
    "hook that fails": (
        ("return [SteadyForce]", "return [SteadyForc]"),
        "18: register_components fails: NameError: name 'SteadyForc' is not defined",
    ),
    "no component": (("return [SteadyForce]", "return [3]"), None),
    "two parts of one name": (
        ("SteadyForce", "LinearForce"),
        "7: there is already a 'LinearForce', from lathesim.components.cutting_forces. Give this one another name.",
    ),
    "not a number": (("return level", "return level / 0.0"), None),
    "too many values": (("return level", "return level, level"), None),
    "endless loop": (
        ("        return level", "        while True: pass"),
        "15: SteadyForce: a law runs on without end. Let every loop end.",
    ),
}


def write_plugin(folder: Path, text: str = GOOD, name: str = "steady.py") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def load(folder: Path) -> Registry:
    registry = load_registry([folder], installed=False)
    assert registry.components  # asks every plug-in
    return registry


def test_a_good_plugin_comes_in_beside_the_stock_parts(tmp_path: Path) -> None:
    path = write_plugin(tmp_path)
    torn = Path(importlib.util.cache_from_source(str(path)))
    torn.parent.mkdir()
    times = int(path.stat().st_mtime).to_bytes(4, "little"), path.stat().st_size.to_bytes(4, "little")
    torn.write_bytes(b"".join([importlib.util.MAGIC_NUMBER, bytes(4), *times]) + b"\xe3")  # byte code that a full disk cut off
    registry = load(tmp_path)
    assert registry.problems == []
    assert registry.plugins == [str(path)]
    assert registry.component("SteadyForce").__name__ == "SteadyForce"
    assert registry.origins["SteadyForce"] == f"{path}:7"
    assert registry.origins["LinearForce"] == "lathesim.components.cutting_forces"
    assert list(registry.components) == sorted(registry.components)


@pytest.mark.parametrize("kind", WRONG)
def test_a_wrong_plugin_costs_one_line(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lathesim.guest_check.PATIENCE", 0.2)
    (old, new), sentence = WRONG[kind]
    assert old in GOOD
    path = write_plugin(tmp_path, GOOD.replace(old, new))
    write_plugin(tmp_path, GOOD.replace("SteadyForce", "OtherForce"), "zz_other.py")
    registry = load(tmp_path)
    assert len(registry.problems) == 1
    assert "\n" not in registry.problems[0]
    assert registry.problems[0].startswith(str(path))
    if sentence is not None:
        assert registry.problems[0] == f"{path}:{sentence}"
    assert "OtherForce" in registry.components
    assert "EmpiricalAxis" in registry.components


def test_a_lesson_that_needs_the_missing_part_is_told_why(tmp_path: Path) -> None:
    path = write_plugin(tmp_path, GOOD.replace("def output(level: float)", "def output(levle: float)"))
    with pytest.raises(LatheSimError) as refused:
        load(tmp_path).component("SteadyForce")
    assert str(refused.value) == (
        f"the component 'SteadyForce' is missing, because of a plug-in at fault: {path}:7: SteadyForce: "
        "output takes 'levle', which is not declared. Did you mean 'level'?"
    )


def test_names_are_kept_apart() -> None:
    registry = load_registry(installed=False)
    with pytest.raises(LatheSimError, match=r"^there is no component 'EmpiricalAxs'\. Did you mean 'EmpiricalAxis'\?$"):
        registry.component("EmpiricalAxs")
    with pytest.raises(LatheSimError, match=r"^there is no effect 'Qqq'\. See 'lathesim effects'\.$"):
        registry.effect("Qqq")


def test_a_folder_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(LatheSimError) as refused:
        load_registry([tmp_path / "plugs"], installed=False)
    assert str(refused.value) == f"there is no plug-in folder '{tmp_path}/plugs'."


def test_files_with_an_underscore_are_no_plugins(tmp_path: Path) -> None:
    write_plugin(tmp_path, "raise RuntimeError\n", "_shared.py")
    assert load(tmp_path).problems == []


def test_an_installed_package_comes_in_by_its_entry_point(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_plugin(tmp_path, name="guest_package.py")
    write_plugin(tmp_path, "raise OSError('broken')\n", name="broken_package.py")
    info = tmp_path / "guest-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: guest\nVersion: 1.0\n", encoding="utf-8")
    (info / "entry_points.txt").write_text("[lathesim.plugins]\nguest = guest_package\nbroken = broken_package\n", encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    registry = load_registry()
    assert "SteadyForce" in registry.components
    assert registry.problems == ["broken (broken_package): the plug-in cannot be imported: OSError: broken"]
    sys.modules.pop("guest_package", None)


def test_a_workspace_counts_only_where_it_was_made(tmp_path: Path) -> None:
    made, copied = tmp_path / "made", tmp_path / "copied"
    for folder in (made, copied):
        (folder / "plugins").mkdir(parents=True)
    assert workspace_plugins(made) is None
    mark_workspace(made)
    assert workspace_plugins(made) == made / "plugins"
    (copied / MARKER).write_bytes((made / MARKER).read_bytes())
    assert workspace_plugins(copied) is None
