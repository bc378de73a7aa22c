"""The answer at a terminal: every verdict in lines that a person reads, and no name where nothing is named."""

from dataclasses import replace

import pytest

from lathesim.diagnosis.records.diagnosis import BaselineValue, Interval, PossibleEffect, as_json, no_surer_than, with_unit
from lathesim.diagnosis.reporting.html_report import report_html
from lathesim.diagnosis.reporting.terminal_text import answer_lines
from tests.diagnosis.sample_diagnoses import ALL, COULOMB, NAMED, UNKNOWN


@pytest.mark.parametrize("name", ALL)
def test_every_verdict_says_its_sentence_and_what_is_left(name: str) -> None:
    lines = answer_lines(ALL[name])
    assert ALL[name].sentence in lines
    assert set(ALL[name].left) <= set(lines)
    assert ("The search was stopped; this is what was known until then." in lines) != ALL[name].complete


def test_a_search_that_was_stopped_says_what_it_had_not_tried() -> None:
    names = tuple(f"Effect{number} at x_axis" for number in range(9))
    lines = answer_lines(replace(ALL["stopped"], untried=names))
    assert lines[-1] == f"Not tried: {', '.join(names[:6])} and 3 more. Give it more time, and ask again."
    assert as_json(replace(ALL["stopped"], untried=names))["untried"] == list(names)


def test_a_name_comes_with_its_probability_and_its_values() -> None:
    text = "\n".join(answer_lines(NAMED))
    assert "  CoulombFriction at x_axis  (reversal, probability 0.97, 97% of the error)\n" in text
    assert "    level = 20.41 N  (95 %: 20.22 to 20.6)\n" in text
    assert "\nPaste into the lesson:\ninsert:\n  - {effect: CoulombFriction, at: x_axis, level: 20.41 N}" in text


def test_values_that_are_others_beside_what_is_pasted_are_told() -> None:
    """A line pasted without them leaves more: what a friction is, is worked out beside another viscosity."""
    assert not any(line.startswith("That is with") for line in answer_lines(NAMED))
    moved = replace(NAMED, baseline={**NAMED.baseline, "ways.level": BaselineValue("N", 40.0, 61.0, 49.22, 48.1, 50.3)})
    assert "That is with ways.level = 49.22 N (given 40), as in lesson_explained.yaml." in answer_lines(moved)


def test_what_is_not_determined_is_marked_and_a_pure_number_has_no_unit() -> None:
    shape = replace(COULOMB, parameters={"hump": Interval(0.48, "1", -0.9, 5.0)}, undetermined=("hump",))
    assert "    hump = 0.48  (95 %: -0.9 to 5; not determined)" in answer_lines(replace(NAMED, effects=(shape,)))


def test_an_interval_is_wider_than_nothing() -> None:
    parameters = {"shift": Interval(6.99996e-3, "s", 6.99991e-3, 7.00001e-3), "level": Interval(0.0, "N", 0.0, 0.25)}
    lines = answer_lines(replace(NAMED, effects=(replace(COULOMB, parameters=parameters),)))
    assert "    shift = 0.00699996 s  (95 %: 0.00699991 to 0.00700001)" in lines
    assert "    level = 0 N  (95 %: 0 to 0.25)" in lines


@pytest.mark.parametrize(
    ("removed", "sentence", "share"),
    [
        (0.28, "This takes away part of it, and is no name for it", ", 28% of the error"),
        (-0.5, "This takes away part of it in recording.csv, all in all nothing in validate.csv, and is no name for it", ""),
    ],
)
def test_what_explains_a_part_is_no_name(removed: float, sentence: str, share: str) -> None:
    part = replace(UNKNOWN, effects=(replace(COULOMB, probability=max(0.0, removed), share=0.9),), removed_share=removed)
    lines = answer_lines(part)
    assert f"{sentence}:" in lines
    assert f"  CoulombFriction at x_axis  (reversal{share})" in lines
    assert "probability" not in "\n".join(lines)
    page = report_html(part)
    assert f"<p>{sentence}.</p>" in page
    assert "<dt>probability</dt>" not in page
    assert "Left out" not in page


def test_what_is_possible_besides_is_offered_and_not_named() -> None:
    """The friction of a published axis is uneven, by two hundredths of the error."""
    slope = {"viscous_difference": Interval(-36.8, "N/(m/s)", -41.1, -32.5)}
    uneven = replace(COULOMB, effect="AsymmetricFriction", parameters=slope, share=0.024, removes=0.79, probability=0.98)
    answer = replace(NAMED, possible=(PossibleEffect(uneven, ("CoulombFriction",)),))
    lines = answer_lines(answer)
    place = lines.index("Possible besides, and no part of the verdict:")
    assert lines[place + 1 : place + 3] == [
        "  AsymmetricFriction at x_axis in the place of CoulombFriction  "
        "(reversal, probability 0.98, 79% of what is left, 2.4% of the error)",
        "    viscous_difference = -36.8 N/(m/s)  (95 %: -41.1 to -32.5)",
    ]
    page = report_html(answer)
    assert "in the place of CoulombFriction" in page
    assert "79.0 % of what is left, 2.4 % of the error" in page
    (told,) = as_json(answer)["possible"]
    assert told["share_of_rest"] == 0.79
    assert told["in_place_of"] == ["CoulombFriction"]
    assert "Possible besides" not in "\n".join(answer_lines(NAMED)) + report_html(NAMED)


def test_what_is_no_name_is_no_surer_than_what_it_took_away() -> None:
    assert no_surer_than(0.28, COULOMB).probability == 0.28
    assert no_surer_than(0.0, COULOMB).probability == 0.0
    assert no_surer_than(1.0, replace(COULOMB, share=0.1)).probability == 0.1
    assert no_surer_than(1.0, replace(COULOMB, share=-0.1)).probability == 0.0
    assert no_surer_than(0.6, replace(COULOMB, probability=0.2)).probability == 0.2
    assert no_surer_than(0.6, replace(COULOMB, share=float("nan"))).probability == 0.6


def test_a_pure_number_has_no_unit() -> None:
    assert (with_unit("0.4", "1"), with_unit("0.4", "mm")) == ("0.4", "0.4 mm")
