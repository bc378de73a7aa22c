"""Rows put together from single values, and records that tell gaps, restarts and doubled samples."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lathesim.live.channel_names import map_from
from lathesim.live.even_clock import RowAssembly
from lathesim.live.publishing import Faults, PublishedRun, Publisher
from lathesim.live.recording_run import Recorder, record
from lathesim.live.samples import LiveError, SampleBlock, Signal
from lathesim.record import load

RAMP = PublishedRun("lesson", (Signal("a.b", "m"), Signal("c.d", "N")), 1e-2, np.array([np.arange(50.0), 2.0 * np.arange(50.0)]))


class Listed:
    """A source of blocks that are known beforehand."""

    name = "listed"
    signals = RAMP.signals

    def __init__(self, blocks: list[SampleBlock], for_ever: bool = False) -> None:
        self._blocks, self._for_ever = blocks, for_ever

    async def blocks(self) -> AsyncIterator[SampleBlock]:
        """Return the blocks, then wait for ever where that is wanted."""
        for block in self._blocks:
            yield block
        if self._for_ever:
            await asyncio.Event().wait()


def block_of(numbers: list[int], notes: tuple[str, ...] = ()) -> SampleBlock:
    """Return a block with the samples of these numbers, 10 ms apart."""
    time = 1e-2 * np.array(numbers, dtype=np.float64)
    return SampleBlock(time, np.array([time, 2.0 * time]), notes)


@given(st.permutations(list(range(20))))
def test_values_that_belong_together_come_together_whatever_their_order(order: list[int]) -> None:
    rows, found = RowAssembly(2), []
    for entry in order:
        rows.add(entry % 2, 1e-3 * (entry // 2), float(entry))
    found.append(rows.quiet())
    times = np.concatenate([block.time for block in found])
    values = np.concatenate([block.values for block in found], axis=1)
    assert np.array_equal(times, 1e-3 * np.arange(10))
    assert np.array_equal(values, np.array([2.0 * np.arange(10), 2.0 * np.arange(10) + 1.0]))


def test_what_was_not_sent_did_not_change_and_rows_wait_for_the_slowest() -> None:
    rows = RowAssembly(2)
    for time, value in ((0.0, 1.0), (1.0, 2.0), (2.0, 3.0)):
        rows.add(0, time, value)
    rows.add(1, 0.0, 10.0)
    assert rows.whole().values.tolist() == [[1.0], [10.0]]
    rows.add(1, 2.0, 12.0)
    assert rows.whole().values.tolist() == [[2.0, 3.0], [10.0, 12.0]]
    assert not rows.add(0, 1.5, 9.0)


@given(st.sets(st.integers(1, 98), max_size=12), st.lists(st.integers(1, 20), min_size=1, max_size=30))
def test_every_gap_is_in_the_record_to_the_sample(missing: set[int], cuts: list[int]) -> None:
    numbers = [number for number in range(100) if number not in missing]
    recorder = Recorder(Listed([]), Path("unused.h5"))
    kept: list[int] = []

    class Nowhere:
        def write(self, time: np.ndarray, values: np.ndarray) -> None:
            kept.extend(round(1e2 * float(value)) for value in time)

    recorder._writer = Nowhere()  # type: ignore[assignment]
    while numbers:
        count = cuts[len(numbers) % len(cuts)]
        recorder.take(block_of(numbers[:count]))
        numbers = numbers[count:]
    recorder._writer = None
    recorder.finish()
    lost = {number for begin, end, _ in recorder.noted.gaps for number in range(round(1e2 * begin) + 1, round(1e2 * end))}
    assert lost == missing
    assert recorder.noted.lost == len(missing)
    assert len(kept) == 100 - len(missing)


async def test_a_record_tells_gaps_restarts_and_doubled_samples(tmp_path: Path) -> None:
    blocks = [block_of([0, 1, 2, 3]), block_of([3, 4, 2, 5]), block_of([9, 10], ("the server was away",))]
    noted = await record(Listed(blocks), tmp_path / "r.h5", 10.0, asyncio.Event(), lambda _: None)
    assert (noted.samples, noted.doubled, noted.status) == (8, 2, "complete")
    assert noted.gaps == [(pytest.approx(0.05), pytest.approx(0.09), 3)]
    assert noted.notes == [(pytest.approx(0.09), "the server was away")]
    kept = load(tmp_path / "r.h5")
    assert kept.time == pytest.approx([0.0, 0.01, 0.02, 0.03, 0.04, 0.05, 0.09, 0.1])
    assert json.loads(str(kept.meta["recording"]))["lost"] == 3


async def test_what_came_is_kept_when_it_is_stopped(tmp_path: Path) -> None:
    stop = asyncio.Event()
    asyncio.get_running_loop().call_later(0.2, stop.set)
    noted = await record(Listed([block_of([0, 1, 2])], for_ever=True), tmp_path / "r.h5", 60.0, stop, lambda _: None)
    assert noted.status == "stopped"
    assert len(load(tmp_path / "r.h5")) == 3


def test_a_publisher_gives_each_row_once_and_its_faults_when_asked() -> None:
    sound = Publisher(RAMP, Faults(), laps=2)
    rows = [row for elapsed in (0.1, 0.333, 0.333, 5.0) for row in sound.due(elapsed)]
    assert [row.number for row in rows] == list(range(100))
    assert sound.finished
    assert rows[73].values.tolist() == [23.0, 46.0]
    holes = [row.number for row in Publisher(RAMP, Faults(gap_every=0.2, gap=0.05), laps=1).due(1.0)]
    assert set(range(50)) - set(holes) == {15, 16, 17, 18, 19, 35, 36, 37, 38, 39}
    jumped = [row.time for row in Publisher(RAMP, Faults(jump_at=0.3, jump=-0.2), laps=1).due(1.0)]
    assert jumped[29:32] == pytest.approx([0.29, 0.1, 0.11])
    held = Publisher(RAMP, Faults(burst=0.2), laps=1)
    assert [len(list(held.due(elapsed))) for elapsed in (0.1, 0.19, 0.21, 0.39, 0.41)] == [1, 0, 20, 0, 20]


def test_a_lower_rate_takes_the_sample_of_each_instant_and_a_higher_one_is_refused() -> None:
    slow = RAMP.sampled(10.0)
    assert slow.values[0].tolist() == [0.0, 10.0, 20.0, 30.0, 40.0]
    with pytest.raises(LiveError, match="1000 Hz is above the 100 Hz of the machine"):
        RAMP.sampled(1000.0)


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        ({}, "the map names no channels"),
        ({"channels": {"a.b": {"path": "X"}}, "chanels": 1}, "there is no key 'chanels'. Did you mean 'channels'?"),
        ({"channels": {"a.b": {"unit": "mm"}}}, "the channel has 0 of node, path, item"),
        ({"channels": {"a.b": {"node": "i=1", "item": "x"}}}, "the channel has 2 of node, path, item"),
        ({"channels": {"a.b": {"item": "x", "untis": "mm"}}}, "there is no key 'untis'. Did you mean 'unit'?"),
        ({"channels": {"a.b": {"item": "x", "unit": "furlong per fortnigh"}}}, "is no unit"),
        ({"channels": {"a.b": {"item": "x", "unit": "mm", "si": "N"}}}, "N is not the SI unit of mm"),
    ],
)
def test_a_map_that_cannot_be_used_is_told(data: dict[str, object], sentence: str) -> None:
    with pytest.raises(LiveError) as refused:
        map_from(data, "map.yaml")
    assert sentence in str(refused.value)


def test_a_map_knows_units() -> None:
    found = map_from({"channels": {"s.speed": {"item": "S1", "unit": "rpm"}, "a.b": {"node": "i=4", "unit": "mm"}}}, "m")
    assert [(item.name, item.way, item.at, item.si_unit) for item in found] == [
        ("s.speed", "item", "S1", "rad/s"),
        ("a.b", "node", "i=4", "m"),
    ]
    assert found[0].factor == pytest.approx(2 * np.pi / 60)
