"""An example plug-in broken in five ways: each costs one sentence with file, line and what to do, and the rest still works."""

import _thread
import threading
import time
from pathlib import Path

import pytest

from lathesim.engine.run import Attendance
from lathesim.errors import LatheSimError, SimulationError
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare, run_prepared
from lathesim.plugins import Registry, load_registry
from lathesim.record import Record
from lathesim.shipped import shipped_folder
from lathesim.units import registry as unit_registry

EXAMPLE = (shipped_folder("plugins") / "sandoval_force.py").read_text(encoding="utf-8")
PROGRAM = "N10 G90 G94 G71\nN20 M03 G00 X16.0 Z14.5 S1000\nN30 G01 Z18.0 F240\n"
LESSON = "lesson: A short cut\nmachine: two_axis_lathe\nprogram: cut.nc\nreplace: {cutting_force: %s}\n"


def line(text: str, containing: str) -> int:
    return next(number for number, content in enumerate(text.splitlines(), 1) if containing in content)


@pytest.fixture(autouse=True, scope="module")
def loaded_units() -> None:
    """The unit registry takes longer to load than the shortened patience of these tests."""
    unit_registry()


@pytest.fixture
def bench(tmp_path: Path) -> "Bench":
    return Bench(tmp_path)


class Bench:
    """A folder with one broken plug-in beside whole ones, and lessons that use them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.plugins = folder / "plugins"
        self.plugins.mkdir()
        self.broken = self.plugins / "a_broken_force.py"
        for path in shipped_folder("plugins").glob("*.py"):
            if path.name != "sandoval_force.py":
                (self.plugins / path.name).write_text(path.read_text(encoding="utf-8"), encoding="utf-8")
        (folder / "cut.nc").write_text(PROGRAM, encoding="utf-8")
        for name in ("SandovalForce", "NonlinearForce"):
            (folder / f"{name}.yaml").write_text(LESSON % name, encoding="utf-8")

    def load(self, text: str) -> Registry:
        """Load the plug-ins with this one among them."""
        self.broken.write_text(text, encoding="utf-8")
        registry = load_registry([self.plugins], installed=False)
        registry.ask("components")
        return registry

    def run(self, registry: Registry, name: str = "SandovalForce", stop: threading.Event | None = None) -> Record:
        """Run the lesson with this force."""
        prepared = prepare(load_lesson(self.folder / f"{name}.yaml"), registry)
        return run_prepared(prepared, engine="plain", attended=Attendance(stop=stop))

    def the_rest_works(self, registry: Registry) -> None:
        """The other eight plug-ins are there, and a lesson without the broken one runs."""
        assert len([name for name in registry.plugins if Path(name).parent == self.plugins and Path(name) != self.broken]) == 8
        assert {"BeltSpindle", "LeadController", "ExtendedTaylorWear"} <= set(registry.components)
        assert self.run(registry, "NonlinearForce").status == "complete"


@pytest.mark.parametrize(
    ("old", "new", "marked", "sentence"),
    [
        (
            "def output(depth_of_cut: float, feed: float,",
            "def output(depth_of_cut: float, fed: float,",
            "class SandovalForce",
            "SandovalForce: output takes 'fed', which is not declared. Did you mean 'feed'?",
        ),
        (
            'cutting_force = Output("N"',
            'cutting_force = Output("kN"',
            'Output("kN"',
            "SandovalForce.cutting_force is declared in 'kN'. Laws work in SI units.",
        ),
        (
            "            return 0.0, 0.0, 0.0\n",
            "            return math.nan, 0.0, 0.0\n",
            "@staticmethod",
            "SandovalForce.output gives nan for cutting_force with the defaults;",
        ),
        (
            "        depth = math.log(",
            "        depth = 1.0 / (feed - feed)\n        depth = math.log(",
            "feed - feed",
            "SandovalForce raises ZeroDivisionError (float division by zero)",
        ),
        (
            "        depth = math.log(",
            "        raise RuntimeError('not done yet')\n        depth = math.log(",
            "@staticmethod",
            "SandovalForce.output: the law uses 'RuntimeError' (line 46), which is neither math, a number nor a plain function.",
        ),
        (
            "        depth = math.log(",
            "        while feed > 0.0:\n            pass\n        depth = math.log(",
            "while feed",
            "SandovalForce: a law runs on without end. Let every loop end.",
        ),
    ],
    ids=["wrong argument", "wrong unit", "no number at a corner", "exception", "exception of its own", "endless loop"],
)
def test_a_broken_plugin_is_named_when_it_is_loaded(
    old: str, new: str, marked: str, sentence: str, bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lathesim.guest_check.PATIENCE", 0.3)
    assert old in EXAMPLE
    text = EXAMPLE.replace(old, new, 1)
    registry = bench.load(text)
    assert len(registry.problems) == 1
    told = registry.problems[0]
    assert "\n" not in told
    place, _, rest = told.partition(": ")
    assert place.startswith(f"{bench.broken}:")
    assert abs(int(place.rpartition(":")[2]) - line(text, marked)) <= 1
    assert rest.startswith(sentence)
    with pytest.raises(LatheSimError, match="the component 'SandovalForce' is missing, because of a plug-in at fault"):
        bench.run(registry)
    bench.the_rest_works(registry)


def test_a_unit_of_another_kind_is_named_where_it_meets_a_wire(bench: Bench) -> None:
    text = EXAMPLE.replace('cutting_force = Output("N"', 'cutting_force = Output("m"', 1)
    registry = bench.load(text)
    with pytest.raises(LatheSimError) as refused:
        bench.run(registry)
    told = str(refused.value)
    assert "wire load.cutting_force <- cutting_force.cutting_force: units differ, N against m." in told
    where = f"a_broken_force.py:{line(text, 'along the cutting speed')}"
    assert told.endswith(f"SandovalForce declares cutting_force in m, at {where}. Change the unit there.")
    bench.the_rest_works(registry)


@pytest.mark.parametrize(
    ("new", "sentence"),
    [("math.nan", "cutting_force.cutting_force stopped being a number at t = "), ("1.0 / (feed - feed)", "cutting_force failed at t = ")],
    ids=["no number", "exception"],
)
def test_what_breaks_only_during_a_run_is_named_with_time_law_and_inputs(new: str, sentence: str, bench: Bench) -> None:
    rare = f"        if 2.0e-4 < feed < 5.0e-4 and depth_of_cut > 1.9e-3:\n            return {new}, 0.0, 0.0\n"
    text = EXAMPLE.replace("        depth = math.log(", f"{rare}        depth = math.log(", 1)
    registry = bench.load(text)
    assert registry.problems == []
    with pytest.raises(SimulationError) as failed:
        bench.run(registry)
    told = str(failed.value)
    assert told.startswith(sentence)
    assert f"in SandovalForce.output ({bench.broken}:{line(text, 'def output') - 1})" in told
    assert "depth_of_cut = 0.00" in told and told.endswith("The data up to then are kept.")
    kept = failed.value.record
    assert isinstance(kept, Record)
    assert len(kept) > 50
    bench.the_rest_works(registry)


@pytest.mark.slow  # it stops a run from outside, after a time in which a busy machine may not have come to the loop
@pytest.mark.parametrize("way", ["STOP", "Ctrl-C"])
def test_an_endless_loop_during_a_run_is_ended_and_named(way: str, bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lathesim.engine.failure.PATIENCE", 0.3)
    rare = "        while 2.0e-4 < feed < 5.0e-4 and depth_of_cut > 1.9e-3:\n            pass\n"
    text = EXAMPLE.replace("        depth = math.log(", f"{rare}        depth = math.log(", 1)
    registry = bench.load(text)
    assert registry.problems == []
    stop = threading.Event()
    threading.Timer(5.0, stop.set if way == "STOP" else _thread.interrupt_main).start()
    begun = time.monotonic()
    with pytest.raises(SimulationError) as failed:
        bench.run(registry, stop=stop)
    assert time.monotonic() - begun < 20.0
    told = str(failed.value)
    assert told.startswith(
        f"cutting_force: SandovalForce.output ({bench.broken}:{line(text, 'def output') - 1}) runs on without end after t = "
    )
    assert told.endswith("Let every loop end. The data up to then are kept.")
    bench.the_rest_works(registry)
