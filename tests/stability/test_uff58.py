"""Universal files as instruments write them: every form of dataset 58, made here byte by byte, and what spoils real ones."""

from __future__ import annotations

import itertools
import struct
from pathlib import Path

import numpy as np
import pytest

from lathesim.errors import LatheSimError
from lathesim.stability.uff58 import read_uff58

EVEN = 2.0 + 0.5 * np.arange(24)
UNEVEN = np.round(np.geomspace(1.0, 900.0, 24), 2)
VALUES = np.round(np.sin(np.arange(24.0)) * 1e3) / 1024.0 + 1j * np.round(np.cos(np.arange(24.0)) * 1e3) / 1024.0


def dataset(
    x: np.ndarray,
    y: np.ndarray,
    *,
    even: bool,
    double: bool,
    binary: str = "",
    end: str = "\n",
    stray: str = "",
    title: bytes = b"tap of the tool point",
    exponent: str = "E",
    joined: bool = False,
) -> bytes:
    """Return a file with one function; ``binary`` is < or > for little or big endian, ``stray`` stands before the closing -1."""
    complex_values = np.iscomplexobj(y)
    kind = {(False, False): 2, (False, True): 4, (True, False): 5, (True, True): 6}[complex_values, double]
    columns = ([] if even else [x]) + ([y.real, y.imag] if complex_values else [y])
    numbers = np.stack(columns, axis=1).ravel()
    size = 8 if double else 4
    lead = f"b{1 if binary == '<' else 2:6d}{2:6d}{11:12d}{len(numbers) * size:12d}{0:6d}{0:6d}{0:12d}{0:12d}" if binary else ""
    start, step = (x[0], x[1] - x[0]) if even else (0.0, 0.0)
    head = [
        f"{-1:6d}".encode(), f"{58:6d}{lead}".encode(), title, b"NONE", b"12-Nov-26 10:00:00", b"NONE", b"NONE",
        f"{4:5d}{0:10d}{0:5d}{0:10d} {'NONE':>10}{1:10d}{3:4d} {'NONE':>10}{1:10d}{3:4d}".encode(),
        f"{kind:10d}{len(x):10d}{int(even):10d}{start:13.5E}{step:13.5E}{0.0:13.5E}".encode(),
        f"{18:10d}{0:5d}{0:5d}{0:5d} {'Frequency':<20} {'Hz':<20}".encode(),
        f"{8:10d}{0:5d}{0:5d}{0:5d} {'Displacement':<20} {'m':<20}".encode(),
        f"{13:10d}{0:5d}{0:5d}{0:5d} {'Force':<20} {'N':<20}".encode(),
        f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':<20} {'NONE':<20}".encode(),
    ]  # fmt: skip
    if binary:
        data = struct.pack(f"{binary}{len(numbers)}{'d' if double else 'f'}", *numbers)
    else:
        width = "20.12" if double else "13.5"
        texts = [f"{value:{width}E}".replace("E", exponent) for value in numbers]
        data = end.join(("" if joined else " ").join(texts[at : at + 4]) for at in range(0, len(texts), 4)).encode() + end.encode()
    return end.encode().join(head) + end.encode() + data + stray.encode() + f"{-1:6d}{end}".encode()


FORMS = list(itertools.product((True, False), (True, False), (True, False), ("", "<", ">")))


@pytest.mark.parametrize(("even", "double", "complex_values", "binary"), FORMS)
def test_every_form_is_read(even: bool, double: bool, complex_values: bool, binary: str, tmp_path: Path) -> None:
    x, y = (EVEN if even else UNEVEN), (VALUES if complex_values else VALUES.real)
    (tmp_path / "a.uff").write_bytes(dataset(x, y, even=even, double=double, binary=binary))
    (found,) = read_uff58(tmp_path / "a.uff")
    single = 0.0 if double and binary else 1e-12 if double else 1e-5
    assert found.x == pytest.approx(x, rel=max(single, 1e-15) if not even else 1e-6, abs=0.0)
    assert found.y == pytest.approx(y, rel=max(single, 1e-15), abs=1e-5 if not double else 0.0)
    assert np.iscomplexobj(found.y) == complex_values
    assert found.numerator == (8, "Displacement", "m")


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("stray", ["", "\n", "\r\n"])
@pytest.mark.parametrize("binary", ["", "<", ">"])
@pytest.mark.parametrize("title", [b"plain", "Fräsmaschine µm Ø".encode(), b"Fr\xe4se \xb5m \xd8"])
def test_line_ends_and_headers_that_are_not_ascii(end: str, stray: str, binary: str, title: bytes, tmp_path: Path) -> None:
    once = dataset(EVEN, VALUES, even=True, double=True, binary=binary, end=end, stray=stray, title=title)
    (tmp_path / "a.uff").write_bytes(once + once)
    found = read_uff58(tmp_path / "a.uff")
    assert len(found) == 2
    for function in found:
        assert function.y == pytest.approx(VALUES, rel=1e-12)


@pytest.mark.parametrize("exponent", ["E", "e", "D", "d"])
@pytest.mark.parametrize("joined", [False, True])
def test_exponents_and_columns_without_a_space(exponent: str, joined: bool, tmp_path: Path) -> None:
    (tmp_path / "a.uff").write_bytes(dataset(UNEVEN, VALUES, even=False, double=True, exponent=exponent, joined=joined))
    (found,) = read_uff58(tmp_path / "a.uff")
    assert found.y == pytest.approx(VALUES, rel=1e-12)


def test_a_half_byte_count_and_bytes_that_look_like_an_end_are_no_trap(tmp_path: Path) -> None:
    values = VALUES.copy()
    values[3] = np.frombuffer(b"\n    -1\n", "<f8")[0]  # the data may hold what closes a dataset
    raw = dataset(EVEN, values, even=True, double=True, binary="<")
    (tmp_path / "a.uff").write_bytes(raw.replace(f"{48 * 8:12d}".encode(), f"{24 * 8:12d}".encode()) + raw)
    found = read_uff58(tmp_path / "a.uff")
    assert [np.array_equal(function.y, values) for function in found] == [True, True]


@pytest.mark.parametrize(
    ("spoilt", "told"),
    [
        (dataset(EVEN, VALUES, even=True, double=True, binary="<")[:-60], "the data end after"),
        (dataset(EVEN, VALUES, even=True, double=True)[:-100], "the data end after"),
        (dataset(EVEN, VALUES, even=True, double=True).replace(b"         6        24", b"         9        24"), "data type 9"),
        (b"    -1\n    55\n    -1\n", "holds no dataset 58"),
        (b"", "holds no dataset 58"),
    ],
)
def test_a_file_that_cannot_be_read_is_told_in_a_sentence(spoilt: bytes, told: str, tmp_path: Path) -> None:
    (tmp_path / "a.uff").write_bytes(spoilt)
    with pytest.raises(LatheSimError, match=told) as caught:
        read_uff58(tmp_path / "a.uff")
    assert "\n" not in str(caught.value)
