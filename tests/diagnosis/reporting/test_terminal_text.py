"""The answer at a terminal: every verdict in lines that a person reads, and no name where nothing is named."""

from dataclasses import replace

import pytest

from lathesim.diagnosis.records.diagnosis import BaselineValue, Interval, as_json, no_surer_than, with_unit
from lathesim.diagnosis.reporting.html_report import report_html
from lathesim.diagnosis.reporting.number_text import plain
from lathesim.diagnosis.reporting.summary import headline
from lathesim.diagnosis.reporting.terminal_text import answer_lines
from tests.diagnosis.sample_diagnoses import ALL, CLEAN, COULOMB, NAMED, UNKNOWN


@pytest.mark.parametrize("name", ALL)
def test_every_verdict_says_its_sentence_and_what_is_left(name: str) -> None:
    lines = answer_lines(ALL[name])
    assert lines[0] == plain(headline(ALL[name]))
    assert {f"- {line}" for line in ALL[name].left} <= set(lines)
    assert ("The search was stopped; this is what was known until then." in lines) != ALL[name].complete


def test_a_search_that_was_stopped_says_what_it_had_not_tried() -> None:
    names = tuple(f"Effect{number} at x_axis" for number in range(9))
    lines = answer_lines(replace(ALL["stopped"], untried=names))
    assert lines[-1] == f"Not tried: {', '.join(names[:6])} and 3 more. Give it more time, and ask again."
    assert as_json(replace(ALL["stopped"], untried=names))["untried"] == list(names)


def test_a_name_comes_with_its_probability_and_its_values() -> None:
    text = "\n".join(answer_lines(NAMED))
    assert "CoulombFriction  x_axis  level 20.41 N (20.22 to 20.60 N)  7871\n" in text
    assert "x_encoder.position       27 um   0.44 um  0.21 um\n" in text
    assert "\nPaste into the lesson:\ninsert:\n  - {effect: CoulombFriction, at: x_axis, level: 20.41 N}" in text


def test_values_that_are_others_beside_what_is_pasted_are_told() -> None:
    """A line pasted without them leaves more: what a friction is, is worked out beside another viscosity."""
    assert not any(line.startswith("That is with") for line in answer_lines(NAMED))
    moved = replace(NAMED, baseline={**NAMED.baseline, "ways.level": BaselineValue("N", 40.0, 61.0, 49.22, 48.1, 50.3)})
    assert "That is with ways.level = 49.22 N (given 40), as in lesson_explained.yaml." in answer_lines(moved)


def test_what_is_not_determined_is_marked_and_a_pure_number_has_no_unit() -> None:
    shape = replace(COULOMB, parameters={"hump": Interval(0.48, "1", -0.9, 5.0)}, undetermined=("hump",))
    assert "hump 0.5 (-0.9 to 5.0, not determined here)" in "\n".join(answer_lines(replace(NAMED, effects=(shape,))))


def test_an_interval_is_wider_than_nothing() -> None:
    parameters = {"shift": Interval(6.99996e-3, "s", 6.99991e-3, 7.00001e-3), "level": Interval(0.0, "N", 0.0, 0.25)}
    text = "\n".join(answer_lines(replace(NAMED, effects=(replace(COULOMB, parameters=parameters),))))
    assert "shift 6.999960 ms (6.999910 to 7.000010 ms)" in text
    assert "level 0 mN (0 to 250 mN)" in text


@pytest.mark.parametrize(
    ("removed", "sentence"),
    [
        (0.28, "These explain a part of it and are no name for the whole"),
        (-0.5, "These explain a part of it in recording.csv, but nothing in validate.csv, and are no name for the whole"),
    ],
)
def test_what_explains_a_part_is_no_name(removed: float, sentence: str) -> None:
    part = replace(UNKNOWN, effects=(replace(COULOMB, probability=max(0.0, removed), share=0.9),), removed_share=removed)
    lines = answer_lines(part)
    assert f"{sentence}:" in lines
    assert "probab" not in "\n".join(lines[:6])
    page = report_html(part)
    assert f"<p>{sentence}.</p>" in page


def test_terminal_and_report_say_why_a_named_model_is_not_adequate() -> None:
    sentence = "The model is not adequate: 4.6% of what acts at x_axis.disturbance is still missing, and goes with velocity of x_axis."
    short = replace(NAMED, adequate=False, shortfall=sentence)
    assert f"- {sentence}" in answer_lines(short)
    assert sentence in report_html(short)
    for right in (NAMED, CLEAN):
        assert "not adequate" not in "\n".join(answer_lines(right)) + report_html(right)


def test_what_is_no_name_is_no_surer_than_what_it_took_away() -> None:
    assert no_surer_than(0.28, COULOMB).probability == 0.28
    assert no_surer_than(0.0, COULOMB).probability == 0.0
    assert no_surer_than(1.0, replace(COULOMB, share=0.1)).probability == 0.1
    assert no_surer_than(1.0, replace(COULOMB, share=-0.1)).probability == 0.0
    assert no_surer_than(0.6, replace(COULOMB, probability=0.2)).probability == 0.2
    assert no_surer_than(0.6, replace(COULOMB, share=float("nan"))).probability == 0.6


def test_a_pure_number_has_no_unit() -> None:
    assert (with_unit("0.4", "1"), with_unit("0.4", "mm")) == ("0.4", "0.4 mm")
