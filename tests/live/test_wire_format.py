"""The wire format: whatever way a stream of bytes is cut, every sample comes once and in order, and nothing else passes."""

from __future__ import annotations

import itertools
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lathesim.live.feedback_source import WAIT, FeedbackOrder
from lathesim.live.wire_format import (
    Decoder,
    Frame,
    FrameKind,
    Numbers,
    WireError,
    end_frame,
    numbers_frame,
    read_datagram,
    read_numbers,
    read_text,
    read_total,
    text_frame,
)


@given(st.lists(st.integers(1, 40), min_size=1, max_size=8), st.lists(st.integers(0, 4000), max_size=30))
def test_no_sample_is_lost_or_doubled_in_any_cut_of_the_bytes(counts: list[int], cuts: list[int]) -> None:
    rng = np.random.default_rng(len(counts))
    blocks = [rng.normal(size=(count, 3)) for count in counts]
    firsts = np.concatenate([[0], np.cumsum(counts)])
    data = b"".join(numbers_frame(FrameKind.SET_POINTS, int(first), block) for first, block in zip(firsts, blocks, strict=False))
    data += end_frame(int(firsts[-1]))
    places = sorted({0, len(data), *(cut % len(data) for cut in cuts)})
    decoder, frames = Decoder(), []
    for begin, end in itertools.pairwise(places):
        frames += decoder.feed(data[begin:end])
    assert decoder.waiting == 0
    assert np.array_equal(np.concatenate([read_numbers(item).values for item in frames[:-1]]), np.concatenate(blocks))
    assert read_total(frames[-1]) == sum(counts)


@given(st.binary(max_size=400))
def test_bytes_of_chance_are_refused_or_wait(data: bytes) -> None:
    decoder = Decoder()
    try:
        frames = decoder.feed(data)
    except WireError:
        return
    assert frames == []
    assert decoder.waiting == len(data)


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (b"GET / HTTP/1.1\r\n", "the peer sent b'GET ' where a frame begins with b'LSET'"),
        (struct.pack("<4sBBHI", b"LSET", 2, 1, 0, 0), "the peer speaks version 2, and this program version 1"),
        (struct.pack("<4sBBHI", b"LSET", 1, 99, 0, 0), "there is no frame of kind 99"),
        (struct.pack("<4sBBHI", b"LSET", 1, 2, 0, 1 << 30), "a SET_POINTS frame of 1073741824 bytes is too long"),
        (struct.pack("<4sBBHI", b"LSET", 1, 1, 0, 1 << 17), "a HELLO frame of 131072 bytes is too long"),
    ],
)
def test_a_header_that_cannot_be_is_named(data: bytes, sentence: str) -> None:
    with pytest.raises(WireError) as refused:
        Decoder().feed(data)
    assert sentence in str(refused.value)


def test_numbers_that_are_not_finite_or_do_not_fit_are_named() -> None:
    with pytest.raises(WireError, match=r"sample 8 holds a number that is not finite"):
        read_numbers(read_datagram(numbers_frame(FrameKind.FEEDBACK, 7, np.array([[1.0, 2.0], [3.0, np.nan]]))))
    with pytest.raises(WireError, match="says 3 samples of 1 columns and holds 8 bytes"):
        read_numbers(Frame(FrameKind.FEEDBACK, struct.pack("<QIHHd", 0, 3, 1, 0, 1.0)))
    with pytest.raises(WireError, match="holds no JSON object"):
        read_text(Frame(FrameKind.HELLO, b'{"a": NaN}'))
    with pytest.raises(WireError, match="holds no JSON object"):
        read_text(Frame(FrameKind.HELLO, b"[" * 60_000))
    with pytest.raises(WireError, match="a datagram says 2 bytes and holds 1"):
        read_datagram(text_frame(FrameKind.STATUS, {})[:-1])


@given(st.permutations(list(range(12))), st.sets(st.integers(0, 11), max_size=4), st.sets(st.integers(0, 11), max_size=4))
def test_feedback_is_put_in_order_and_what_happened_is_counted(order: list[int], lost: set[int], doubled: set[int]) -> None:
    kept = [number for number in order if number not in lost]
    taken = FeedbackOrder()
    rows: list[tuple[int, float]] = []
    for number in kept:
        for _ in range(1 + (number in doubled)):
            for run in taken.take(Numbers(5 * number, 5.0 * number + np.arange(5.0)[:, None])):
                rows += [(run.first + at, float(value)) for at, value in enumerate(run.values[:, 0])]
    for run in taken.rest():
        rows += [(run.first + at, float(value)) for at, value in enumerate(run.values[:, 0])]
    assert rows == [(number, float(number)) for number in range(60) if number // 5 not in lost]
    assert taken.received == 5 * len(kept)
    assert taken.doubled == 5 * len(doubled - lost)
    assert taken.lost == (5 * sum(number < max(kept) for number in lost) if kept else 0)


def test_a_sample_that_comes_too_late_is_late_and_not_doubled() -> None:
    taken = FeedbackOrder()
    taken.take(Numbers(0, np.zeros((1, 1))))
    taken.take(Numbers(2, np.zeros((WAIT + 1, 1))))
    assert taken.lost == 1
    taken.take(Numbers(1, np.zeros((1, 1))))
    assert (taken.late, taken.doubled) == (1, 0)
