"""``import lathesim as ls``: light to import, the examples of README and manual as plain scripts, and the answers of the commands."""

import inspect
import json
import sys
from pathlib import Path

import numpy as np
import pytest

import lathesim as ls
from lathesim.classroom.notebook import notebook_text
from lathesim.errors import LatheSimError, LessonError, RecordError
from lathesim.record import Channel, Record
from tests.cli.command import ROOT, done, python
from tests.cli.test_readme import block, blocks
from tests.exercises.test_notebook import checked, run_cells

SCRIPTS = ["".join(text for text in blocks("python") if " ls." in text or "ls.lesson" in text)]


def small() -> Record:
    """Return a record of three samples."""
    return Record(np.arange(3.0), {"x_axis.position": Channel("x_axis.position", "m", np.ones(3), "where it is")})


def test_the_import_alone_loads_nothing() -> None:
    done = python("import sys; before = set(sys.modules); import lathesim; print(sorted(set(sys.modules) - before))")
    assert not {"numpy", "pydantic", "yaml", "click", "h5py", "scipy", "lathesim.scripting"} & set(
        json.loads(done.stdout.replace("'", '"'))
    )


def test_every_public_name_has_types_and_begins_with_what_it_does() -> None:
    for name in ls.__all__:
        found = getattr(ls, name)
        assert inspect.getdoc(found), name
        if inspect.isfunction(found):
            assert "" not in found.__annotations__ and "return" in found.__annotations__, name
    assert set(ls.__all__) <= set(dir(ls))
    with pytest.raises(AttributeError, match="has no attribute 'diagnos'"):
        ls.diagnos  # noqa: B018


def test_the_examples_of_readme_and_manual_run_as_a_plain_script(tmp_path: Path) -> None:
    (script,) = SCRIPTS
    done = python(script, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    said = (ROOT / "README.md").read_text(encoding="utf-8").partition("This prints `")[2].split("`")
    assert done.stdout.splitlines()[:2] == [said[0], said[2]]
    assert (tmp_path / "run.png").stat().st_size > 1000


@pytest.mark.slow
def test_the_example_of_the_readme_runs_in_a_notebook(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    page = (ROOT / "README.md").read_text(encoding="utf-8")
    text = block("python", "import lathesim as ls", page)
    Path("readme.ipynb").write_text(notebook_text([("code", part) for part in (*text.split("\n\n"), "record.plot()")]), encoding="utf-8")
    printed = run_cells(checked(Path("readme.ipynb")))
    assert printed.splitlines()[:2] == page.partition("This prints `")[2].split("`")[:3:2]


def test_a_run_is_that_of_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    done(capsys, "run", "15", "--out", tmp_path / "run.h5", "--no-plots")
    (written,) = tmp_path.glob("run*.h5")
    kept = ls.load(written)
    record = ls.lesson("15").run(variant=str(kept.meta["variant"]) or None)
    assert list(record) == list(kept)
    assert all(np.array_equal(record[name], kept[name], equal_nan=True) for name in record)


def test_a_name_that_is_wrong_is_an_error_with_the_nearest_one() -> None:
    with pytest.raises(LessonError, match="no lesson '99'"):
        ls.lesson("99")
    with pytest.raises(LessonError):
        ls.lesson("15").run(set={"x_axis.nonsense": "1 m"})
    with pytest.raises(RecordError, match=r"max_contour_error: .*needs channel"):
        ls.measure(small(), "max_contour_error")


def test_tables_carry_units() -> None:
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    table, data = small().to_pandas(), small().to_xarray()
    assert (list(table.columns), table.index.name, table.attrs["units"]) == (["x_axis.position"], "time", {"x_axis.position": "m"})
    assert data["x_axis.position"].attrs == {"units": "m", "long_name": "where it is"} and data.time.attrs == {"units": "s"}


@pytest.mark.parametrize("package", ["pandas", "xarray"])
def test_a_missing_package_is_one_sentence(package: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(LatheSimError, match=f"the package '{package}' is not installed. Install it with: "):
        getattr(small(), f"to_{package}")()
