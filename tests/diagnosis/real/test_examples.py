"""The examples of the manual: each case has its place, an answer replaces the one before, and pictures keep their labels."""

import pytest

from tests.diagnosis.real.examples import CHAPTER, standing_alone, with_answer
from tests.diagnosis.real.recordings import real

TEXT = "# One\n\n<!-- answer of a -->\n\n## Two\n"


def test_every_real_recording_is_an_example_of_the_manual_with_its_picture() -> None:
    text = CHAPTER.read_text(encoding="utf-8")
    for case in real():
        assert text.count(f"<!-- answer of {case.name} -->\n\n```\n") == 1
        assert (CHAPTER.parent / "pictures" / f"real_{case.name}.svg").stat().st_size < 100_000
        assert case.fitted in text


def test_an_answer_takes_the_place_of_the_one_before() -> None:
    first = with_answer(TEXT, "a", "```\nold\n```\n\n![p](a.svg)")
    assert first == "# One\n\n<!-- answer of a -->\n\n```\nold\n```\n\n![p](a.svg)\n\n## Two\n"
    assert with_answer(first, "a", "```\nnew\n```\n\n![p](a.svg)") == first.replace("old", "new")
    with pytest.raises(ValueError, match="no line <!-- answer of b -->"):
        with_answer(TEXT, "b", "")


def test_a_picture_stands_alone_with_rounded_lines_and_whole_labels() -> None:
    drawn = standing_alone('<svg viewBox="0 0 9 9"><path d="M 1.2345 6.789 L 2 3"/><text>0.05</text></svg>')
    assert 'xmlns="http://www.w3.org/2000/svg"' in drawn
    assert 'd="M 1.2 6.7 L 2 3"' in drawn
    assert "<text>0.05</text>" in drawn
