"""Machine code: made once, found again, never stale, and nothing lost where there is none."""

from __future__ import annotations

import itertools
import math
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from lathesim import cache_folder
from lathesim.component import Component, Output, State
from lathesim.engine import module_cache, run_arrays
from lathesim.engine.assembly import Assembly, Part
from lathesim.engine.fuse import fuse
from lathesim.engine.law_text import law_text
from lathesim.engine.machine_code import is_kept, load_code
from lathesim.engine.module_cache import compile_time, compiled_machine, is_compiled, tell_compiling_to, wiring_time
from lathesim.engine.run import Hints, run
from lathesim.engine.wiring import wire
from lathesim.errors import SimulationError
from tests.benchmarks.many_axes import axes_plan
from tests.engine import small_machine
from tests.engine.small_machine import PARTS, Axis, loop

SLOPES = (1.0, 2.0)


@pytest.fixture
def empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A cache in which nothing is known yet, not even to this process."""
    monkeypatch.setenv("LATHESIM_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(module_cache, "_MACHINES", {})
    monkeypatch.setattr(module_cache, "_LAWS", {})
    monkeypatch.setattr(cache_folder, "_INSTEAD", {})
    caches = (law_text, module_cache.plain_module)
    for cache in caches:
        cache.cache_clear()
    yield tmp_path / "cache"
    for cache in caches:
        cache.cache_clear()


@pytest.fixture
def said() -> Iterator[list[str]]:
    """What was told about compiling."""
    told: list[str] = []
    tell_compiling_to(told.append)
    yield told
    tell_compiling_to(None)


class Shrinking(Component):
    """A law of a stage with a variable that is a float first, then a whole number that only a whole number may be."""

    size = State("m", 1.0, doc="size")
    shown = Output("m", doc="size")

    @staticmethod
    def derivative(size: float) -> float:
        place = 1.5 * size
        place = math.floor(place)
        return -SLOPES[place] * size

    @staticmethod
    def output(size: float) -> float:
        return size


class Roundabout(Component):
    """A law of a stage that is written with tuples and a list."""

    size = State("m", 1.0, doc="size")
    shown = Output("m", doc="size")

    @staticmethod
    def derivative(size: float) -> float:
        halved = (size, 0.5 * size)[1]
        parts = [share * halved for share in SLOPES]
        return -min((2.0 * parts[0], max(parts)))

    @staticmethod
    def output(size: float) -> float:
        return size


def compile_loop(assembly: Assembly) -> None:
    compiled_machine(fuse(wire(assembly)))


def laws_compiled(folder: Path) -> set[str]:
    return {path.name for path in folder.glob("law_*.code")}


def test_values_never_compile_and_a_changed_helper_compiles_its_law_only(
    empty_cache: Path, said: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    compile_loop(loop())
    first = laws_compiled(empty_cache)
    assert len(said) == 1
    assert said[0].startswith("Compiling once, about ")

    compile_loop(replace(loop(), parts=(*PARTS[:2], Part("axis", Axis, {"lag": 0.2}, {"travel": 1.0}))))
    assert len(said) == 1

    monkeypatch.setattr(small_machine, "AMPLITUDE", 3.0)
    compile_loop(loop())
    assert len(said) == 2
    assert len(laws_compiled(empty_cache) - first) == 2  # the sine that uses the constant, and the law that calls it


def test_a_variable_may_change_its_type(empty_cache: Path) -> None:
    plan = wire(Assembly((Part("part", Shrinking),), (), 0.01, 0.01))
    plain, compiled = (run(plan, duration=1.0, engine=engine)["part.shown"] for engine in ("plain", "compiled"))
    assert plain.tobytes() == compiled.tobytes()
    assert 0.0 < compiled[-1] < compiled[0]


def test_a_law_may_be_written_with_what_a_wiring_has_none_of(empty_cache: Path) -> None:
    plan = wire(Assembly((Part("part", Roundabout),), (), 0.01, 0.01))
    plain, compiled = (run(plan, duration=1.0, engine=engine) for engine in ("plain", "compiled"))
    assert compiled.meta["engine"] == "compiled"
    assert plain["part.shown"].tobytes() == compiled["part.shown"].tobytes()
    assert compiled["part.shown"][-1] == pytest.approx(np.exp(-1.0), abs=1e-9)


@pytest.mark.parametrize("length", [0, 40, -100])
def test_a_cache_of_torn_files_is_made_anew(length: int, empty_cache: Path) -> None:
    fused = fuse(wire(loop()))
    before = run(wire(loop()), duration=1.0, engine="compiled")
    files = sorted(empty_cache.iterdir())
    assert {path.suffix for path in files} == {".code", ".bytecode", ".py", ".json"}
    sizes = [path.stat().st_size for path in files]
    for path in files:
        path.write_bytes(path.read_bytes()[:length])
    assert load_code(fused) is None
    module_cache._MACHINES.clear()
    module_cache._LAWS.clear()
    law_text.cache_clear()
    after = run(wire(loop()), duration=1.0, engine="compiled")
    assert np.array_equal(before["axis.position"], after["axis.position"])
    assert load_code(fused) is not None
    assert [path.stat().st_size for path in files] == pytest.approx(sizes, abs=50)  # symbols in machine code have numbers


def test_a_second_start_runs_compiled_without_the_compiler() -> None:
    compile_loop(loop())
    lines = (
        "import sys",
        "from lathesim.engine.run import run",
        "from lathesim.engine.wiring import wire",
        "from tests.engine.small_machine import loop",
        "print(run(wire(loop()), duration=1.0).meta['engine'], 'numba' in sys.modules)",
    )
    done = subprocess.run(
        [sys.executable, "-c", "\n".join(lines)], capture_output=True, text=True, check=True, cwd=Path(__file__).parents[2]
    )
    assert done.stdout == "compiled False\n"


def test_auto_compiles_only_what_pays(said: list[str], empty_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plan = wire(loop())
    assert compile_time(fuse(plan)) > 0.5
    assert run(plan, duration=5.0).meta["engine"] == "plain"
    assert said == []
    monkeypatch.setattr("lathesim.engine.run.wiring_time", lambda _: 0.0)
    monkeypatch.setattr("lathesim.engine.run.compile_time", lambda _: 0.01)
    assert run(plan, duration=50.0).meta["engine"] == "compiled"
    assert len(said) == 1
    assert run(plan, duration=5.0).meta["engine"] == "compiled"


def test_laws_that_are_kept_are_not_compiled_again(empty_cache: Path) -> None:
    fused = fuse(wire(loop()))
    with_laws = compile_time(fused)
    compile_loop(loop())
    assert wiring_time(fused) <= compile_time(fused) < with_laws


def test_code_is_known_by_the_module_it_was_made_from(empty_cache: Path) -> None:
    fused = fuse(wire(loop()))
    assert not is_compiled(fused)
    compile_loop(loop())
    assert is_compiled(fused)
    assert is_kept(fused)


class Named(Component):
    """Uses text, which is plain Python but cannot be compiled."""

    size = State("m", 1.0, doc="size")
    shown = Output("m", doc="size")

    @staticmethod
    def derivative(size: float) -> float:
        text = f"{-size:.17g}"
        return float(text)

    @staticmethod
    def output(size: float) -> float:
        return size


def test_a_part_that_cannot_be_compiled_runs_plain_and_that_is_said(said: list[str]) -> None:
    plan = wire(Assembly((Part("part", Named),), (), 0.01, 0.01))
    record = run(plan, duration=1.0, engine="compiled")
    assert record.meta["engine"] == "plain"
    assert record["part.shown"][-1] == pytest.approx(np.exp(-1.0), abs=1e-9)
    assert said[-1].startswith("Named_derivative cannot be compiled: ")
    assert said[-1].endswith("The run is plain, some fifty times slower.")


class Refusing(Component):
    """dx/dt = 1, and refuses more than half."""

    size = State("m", doc="size")
    shown = Output("m", doc="size")

    @staticmethod
    def derivative(size: float) -> float:
        assert size < 0.5, "more than half"
        return 1.0

    @staticmethod
    def output(size: float) -> float:
        return size


def test_a_law_that_raises_in_machine_code_is_named() -> None:
    plan = wire(Assembly((Part("part", Refusing),), (), 0.01, 0.01))
    with pytest.raises(SimulationError, match=r"part failed at t = 0.5 s in Refusing.derivative .*: more than half"):
        run(plan, duration=1.0, engine="compiled")


def test_an_array_that_is_not_laid_out_for_machine_code_is_refused() -> None:
    plan = wire(loop())
    machine = compiled_machine(fuse(plan))
    live = run_arrays.start_arrays(plan)
    with pytest.raises(TypeError, match="not contiguous"):
        machine.run_block(0, 1, 0.005, 0.0005, 10, live.parameters, live.states[::-1], live.discrete, (), (), np.zeros((1, 1)), np.zeros(9))


def shaped(width: float, limit: float = 2.0) -> float:
    """Square a width, up to a limit."""
    squared: float = width * width
    return min(squared, limit)


def test_the_text_of_a_law_is_found_again_and_told_from_any_other(empty_cache: Path) -> None:
    text = law_text(shaped)
    assert text.named("f", {}) == "def f(width, limit=2.0):\n    squared = width * width\n    return min(squared, limit)"
    law_text.cache_clear()
    assert law_text(shaped) == text
    (kept,) = empty_cache.glob("text_*.json")

    law_text.cache_clear()
    kept.write_text(kept.read_text().replace("width * width", "3.0 * width"))
    assert law_text(shaped) == text

    shaped.__defaults__ = (3.0,)
    law_text.cache_clear()
    try:
        law_text(shaped)
    finally:
        shaped.__defaults__ = (2.0,)
    assert len(list(empty_cache.glob("text_*.json"))) == 2


def test_a_source_edited_while_the_program_runs_is_not_taken_for_the_law(
    empty_cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    edited = tmp_path / "edited.py"
    edited.write_text("def shaped(width: float, limit: float = 2.0) -> float:\n    return 0.0\n")
    monkeypatch.setattr("inspect.getsource", lambda _: edited.read_text())
    monkeypatch.setattr("inspect.getsourcefile", lambda _: str(edited))
    law_text(shaped)
    assert not list(empty_cache.glob("text_*.json"))


def test_a_machine_that_is_run_often_is_compiled_sooner(said: list[str], empty_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ticks = itertools.count()
    monkeypatch.setattr("lathesim.engine.run.clock", SimpleNamespace(perf_counter=lambda: 1e-3 * next(ticks)))
    monkeypatch.setattr("lathesim.engine.run.compile_time", lambda _: 1.0)
    plan = wire(loop())
    assert run(plan, duration=100.0, engine="auto").meta["engine"] == "plain"
    assert run(plan, duration=100.0, engine="auto", hints=Hints(often=True)).meta["engine"] == "compiled"
    assert len(said) == 1


def test_like_parts_computed_side_by_side_keep_every_bit(empty_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module_cache, "_MANY_LINES", 0)
    plan = axes_plan(4)
    plain, compiled = (run(plan, duration=2.0, engine=engine) for engine in ("plain", "compiled"))
    assert compiled.meta["engine"] == "compiled"
    assert all(np.array_equal(plain[name], compiled[name]) for name in plan.channels)


TRIED = ("0.63.1", "0.68.1")
"""The oldest and the newest version of numba with which this folder's tests have run; a newer minor one is tried first."""


def test_the_requirement_ends_behind_the_newest_version_that_was_tried() -> None:
    with (Path(__file__).parents[2] / "pyproject.toml").open("rb") as file:
        requirements = tomllib.load(file)["project"]["dependencies"]
    major, minor, _ = TRIED[-1].split(".")
    assert f"numba>={TRIED[0]},<{major}.{int(minor) + 1}" in requirements


def test_the_version_here_is_one_of_those() -> None:
    found, oldest, newest = (tuple(map(int, text.split(".")[:2])) for text in (version("numba"), *TRIED))
    assert oldest <= found <= newest
