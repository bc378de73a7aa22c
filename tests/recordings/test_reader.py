"""The right reader is found by the ending and by what is in the file; what cannot be read is told in one sentence."""

from pathlib import Path

import pytest

from lathesim.errors import LatheSimError
from lathesim.plugins import load_registry
from lathesim.recordings.raw_table import read_recording
from lathesim.recordings.stock_readers import stock_readers

SUFFIXES = (
    ".h5, .mat, .hdf5, .hdf, .lvm, .mcap, .mf4, .mdf, .dat, .tdms, .xml, .json, .svdx, .log, .csv, .txt, .hal, .halsampler, .sampler, "
    ".tsv, .asc"
)


def test_the_content_counts_where_the_ending_misleads(tmp_path: Path) -> None:
    path = tmp_path / "run.lvm"
    path.write_text("t [s],x [m]\n0,1\n1,2\n", encoding="utf-8")
    assert list(read_recording(path, stock_readers()).columns) == ["t", "x"]


def test_readers_come_through_the_registry(tmp_path: Path) -> None:
    readers = load_registry(installed=False).readers
    assert [reader.name for reader in stock_readers()] == list(readers)
    path = tmp_path / "run.unheard"
    path.write_text("t;x\n0;1\n1;2\n", encoding="utf-8")
    assert list(read_recording(path, readers).columns) == ["t", "x"]


REFUSED = {
    "run.bmp": (b"BM\x00\x01\x02\x03\x04\x05\x06\x07\x08", f"the file is no recording of a known kind. Read are {SUFFIXES}."),
    "run.mat": (b"nothing of MATLAB", f"the file ends in .mat and holds no MAT file. Read are {SUFFIXES}."),
    "empty.csv": (b"", "the file is empty. Record again, or give another file."),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_read(name: str, tmp_path: Path) -> None:
    content, sentence = REFUSED[name]
    (tmp_path / name).write_bytes(content)
    with pytest.raises(LatheSimError) as refused:
        read_recording(tmp_path / name, stock_readers())
    assert str(refused.value) == f"{tmp_path / name}: {sentence}"


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    (tmp_path / "axis.csv").write_text("1,2\n", encoding="utf-8")
    with pytest.raises(LatheSimError) as refused:
        read_recording(tmp_path / "axs.csv", stock_readers())
    assert str(refused.value) == f"{tmp_path / 'axs.csv'}: there is no such file. Did you mean 'axis.csv'?"
    with pytest.raises(LatheSimError, match=r"this is a folder\. Give the name of a file\.$"):
        read_recording(tmp_path, stock_readers())
