"""The peers simulate the same lathe: each agrees with the engine to one encoder count, the hand-written C in every bit."""

from __future__ import annotations

import numpy as np
import pytest

from lathesim.cli.speed.bench_rows import ENCODER_COUNT, SEED, Work
from lathesim.engine.run import run
from tests.benchmarks.peers import PEERS, hand_written_c, peer_module, times_and_positions


def test_hand_written_c_gives_the_same_bits_in_all_channels(work: Work) -> None:
    if hand_written_c.absent():
        pytest.skip(hand_written_c.absent())
    record = run(work.plan, seed=SEED, engine="compiled")
    ours = np.stack([record[name] for name in work.channels], axis=1)
    assert np.array_equal(hand_written_c.record(work), ours)


def test_the_work_has_all_it_is_said_to_have(work: Work) -> None:
    record = run(work.plan, seed=SEED, engine="compiled")
    assert 18.0 < work.duration < 19.0
    assert len(work.channels) == 30
    assert work.steps == 10
    assert record["cutting_force.cutting_force"].max() > 500.0
    assert np.ptp(record["tachometer_adc.reading"][-100:]) > 0.1
    assert abs(record["cross_coupling.voltage"]).max() > 0.01
    cutting = record["interpolator.cutting_block"] > 0.5
    assert len(np.unique(record["interpolator.feed_speed"][cutting])) > 1000


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("peer", PEERS)
def test_a_peer_agrees_to_one_encoder_count(peer: str, work: Work) -> None:
    reason = peer_module(peer).absent()
    if reason:
        pytest.skip(reason)
    record = run(work.plan, seed=SEED, engine="compiled")
    _, positions = times_and_positions(peer, work, 1)
    ours = np.stack([record["x_axis.position"], record["z_axis.position"]])
    assert positions.shape == ours.shape
    assert np.abs(positions - ours).max() < ENCODER_COUNT
