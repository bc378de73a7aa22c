"""Traces damaged at one place are refused in one sentence, or no number is wrong that the damage did not touch.

The rows of the damaged table are held against those of the whole one from both ends, as far as each cell is equal or missing. The rows in
between are those that the damage touched: a dozen at most, as it touches at most 64 bytes. Damage of the head may also rewrite what the
head alone says: one column in all its rows, by its scale, or the clock. A table with a note that the whole file has not is not silent.
What no form can notice: digits of a value, a name, or a sampling period changed into others, where the file holds no check sum.
"""

import gc
import random
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from lathesim.errors import LatheSimError
from lathesim.recordings.raw_table import RawTable, read_recording
from lathesim.recordings.stock_readers import stock_readers
from tests.recordings.forked_trial import trial_in_a_fork
from tests.recordings.trace_files import FILES

MOST_ROWS = 12
"""Rows that damage of 64 bytes touches, the shortest of which has 8 bytes, with the rows in which a value is held."""
CLOCKLESS = ("Heidenhain scope", "halscope", "halscope, until 2.8")
"""Forms without times in their rows: where a row is lost the later ones follow too soon."""
WORDS = (b"9", b"-", b".", b",", b"\n", b"e5", b"nan", b" ", b'"', b"<", b"\x00", b"\t", b";")


def damaged(content: bytes, chance: random.Random) -> tuple[bytes, int]:
    """Return the bytes damaged at one place, and where that begins."""
    begin = chance.randrange(len(content))
    end = min(len(content), begin + chance.choice((1, 1, 2, 8, 64)))
    lines = content.split(b"\n")
    line = content.count(b"\n", 0, begin)
    start = sum(len(item) + 1 for item in lines[:line])
    match chance.randrange(9):
        case 0:
            return content[:begin] + bytes([content[begin] ^ 1 << chance.randrange(8)]) + content[begin + 1 :], begin
        case 1:
            return content[:begin] + chance.randbytes(1) + content[begin + 1 :], begin
        case 2:
            return content[:begin] + content[end:], begin
        case 3:
            return content[:begin] + bytes(end - begin) + content[end:], begin
        case 4:
            return content[:begin] + content[begin:end] + content[begin:], begin
        case 5:
            return content[:begin] + chance.choice(WORDS) + content[begin:], begin
        case 6:
            return content[:begin], begin
        case 7:
            return b"\n".join([*lines[:line], *lines[line + 1 :]]), start
        case _:
            return b"\n".join([*lines[: line + 1], *lines[line:]]), start


def clocks(expected: RawTable) -> Iterator[list[str]]:
    """Yield the columns of each clock: those of one length that follow a column of times."""
    group: list[str] = []
    for name, values in expected.columns.items():
        if group and (name.startswith("time of ") or len(values) != len(expected.columns[group[0]])):
            yield group
            group = []
        group.append(name)
    yield group


def touched_rows(table: RawTable, whole: RawTable, names: list[str]) -> int:
    """Return the rows between the equal ones at the beginning and at the end."""
    rows, right = (np.column_stack([item.columns[name] for name in names]) for item in (table, whole))
    shared = min(len(rows), len(right))

    def equal(first: np.ndarray, second: np.ndarray) -> int:
        same = (np.isnan(first) | (np.abs(first - second) <= 1e-9 * (1.0 + np.abs(second)))).all(axis=1)
        return int(np.argmin(same)) if not same.all() else len(same)

    ahead = equal(rows[:shared], right[:shared])
    behind = equal(rows[len(rows) - shared :][::-1], right[len(right) - shared :][::-1])
    return max(0, len(rows) - ahead - behind)


def wrong(table: RawTable, whole: RawTable, in_head: bool, with_clock: bool) -> bool:
    """Return whether more is wrong than what the damage touched."""
    for group in clocks(whole):
        names = [name for name in group if name in table.columns and (with_clock or name != "time")]
        names = [name for name in names if len(table.columns[name]) == len(table.columns[names[0]])]
        spared: list[str | None] = [None, *(names if in_head else ())]
        compared = [[name for name in names if name != one] for one in spared]
        if all(kept and touched_rows(table, whole, kept) > MOST_ROWS for kept in compared):
            return True
    return False


def damage(folder: Path, form: str, number: int, seed: int) -> Counter[str]:
    """Read so many damaged versions; return how many were refused, told more, or were right. The first wrong one is raised."""
    file = FILES[form]
    path = folder / file.name
    file.write(path)
    whole = read_recording(path, stock_readers())
    beside = path.with_suffix(".r64")
    targets = [path, *([beside] if beside.exists() else [])]
    contents = {target: target.read_bytes() for target in targets}
    ended: Counter[str] = Counter()
    for case in range(number):
        chance = random.Random(f"{form} {seed} {case}")
        target = chance.choice(targets)
        content, begin = damaged(contents[target], chance)
        target.write_bytes(content)
        try:
            table = read_recording(path, stock_readers())
        except LatheSimError as error:
            assert len(str(error).splitlines()) == 1, (form, case)
            ended["refused"] += 1
        else:
            first = contents[target].find(b"\n0") if form != "SINUMERIK trace" else contents[target].find(b"<rec")
            in_head = target == path and (file.library != "" or beside.exists() or begin < max(first, 200))
            if set(table.notes) - set(whole.notes):
                ended["said"] += 1
            elif wrong(table, whole, in_head, form not in CLOCKLESS):
                raise AssertionError(f"case {case} of seed {seed}, {form}: wrong without a word")
            else:
                ended["right"] += 1
        target.write_bytes(contents[target])
    return ended


@pytest.fixture
def forked(monkeypatch: pytest.MonkeyPatch) -> None:
    gc.collect()
    gc.freeze()  # a reader collects garbage after each refusal: what earlier tests left takes ten times as long as the reading
    monkeypatch.setattr("lathesim.recordings.binary_traces.refuse_deadly_file", trial_in_a_fork)


@pytest.mark.parametrize(("traces", "seed"), [(30, 1), pytest.param(1000, 2, marks=pytest.mark.slow)])
@pytest.mark.parametrize("form", FILES)
@pytest.mark.usefixtures("forked")
def test_a_damaged_trace_is_refused_or_right_where_it_is_whole(form: str, traces: int, seed: int, tmp_path: Path) -> None:
    if FILES[form].library:
        pytest.importorskip(FILES[form].library)
    assert damage(tmp_path, form, traces, seed).total() == traces


def test_a_document_type_is_refused_before_an_entity_grows(tmp_path: Path) -> None:
    """Entities within entities, which would become a gigabyte of text."""
    entities = "".join(f'<!ENTITY e{level} "{f"&e{level - 1};" * 10}">' for level in range(1, 10))
    text = f'<?xml version="1.0"?><!DOCTYPE traceSession [<!ENTITY e0 "ten chars.">{entities}]><traceSession>&e9;</traceSession>'
    (tmp_path / "bomb.xml").write_text(text, encoding="utf-8")
    with pytest.raises(LatheSimError, match=r"bomb\.xml: the XML declares a document type, which is not read\."):
        read_recording(tmp_path / "bomb.xml", stock_readers())


def test_a_missing_library_is_one_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "car.mf4").write_bytes(b"MDF     4.10    ")
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    sentence = (
        r"MF4 files need the package 'asammdf', which is not installed\. Install it with: python -m pip install 'lathesim\[traces\]'$"
    )
    with pytest.raises(LatheSimError, match=sentence):
        read_recording(tmp_path / "car.mf4", stock_readers())


def test_files_that_no_library_reads_are_named(tmp_path: Path) -> None:
    (tmp_path / "scope.svdx").write_bytes(b"PK\x03\x04")
    with pytest.raises(LatheSimError, match=r"this is a project of TwinCAT Scope, which no library reads\. Export it as CSV"):
        read_recording(tmp_path / "scope.svdx", stock_readers())
