"""The answer at a terminal: every verdict in lines that a person reads, and no name where nothing is named."""

from dataclasses import replace

import pytest

from lathesim.diagnosis.records.diagnosis import BaselineValue, Interval, as_json, with_unit
from lathesim.diagnosis.reporting.explanations import explanation_lines
from lathesim.diagnosis.reporting.number_text import plain
from lathesim.diagnosis.reporting.summary import headline
from lathesim.diagnosis.reporting.terminal_text import answer_lines
from tests.diagnosis.sample_diagnoses import ALL, COULOMB, FAULT, NAMED, UNKNOWN


@pytest.mark.parametrize("name", ALL)
def test_every_verdict_says_its_sentence_and_what_is_left(name: str) -> None:
    lines = answer_lines(ALL[name])
    assert lines[0] == plain(headline(ALL[name]))
    assert {f"- {line}" for line in ALL[name].left} <= set(lines)
    assert ("The search was stopped" in "\n".join(lines)) != ALL[name].complete


def test_a_search_that_was_stopped_says_what_it_had_not_tried() -> None:
    names = tuple(f"Effect{number} at x_axis" for number in range(9))
    lines = answer_lines(replace(ALL["stopped"], untried=names))
    assert lines[-1] == f"Not tried: {', '.join(names[:6])} and 3 more."
    assert as_json(replace(ALL["stopped"], untried=names))["untried"] == list(names)


def test_a_name_comes_with_its_probability_and_its_values() -> None:
    text = "\n".join(answer_lines(NAMED))
    assert "CoulombFriction  x_axis  level 20.41 N (20.22 to 20.60 N)  97.4 %\n" in text
    assert "x_encoder.position           27 um   0.44 um  0.21 um\n" in text
    assert "\nPaste into the lesson:\ninsert:\n  - {effect: CoulombFriction, at: x_axis, level: 20.41 N}" in text


def test_values_that_are_others_beside_what_is_pasted_are_told() -> None:
    """A line pasted without them leaves more: what a friction is, is worked out beside another viscosity."""
    assert not any(line.startswith("These lines belong") for line in answer_lines(NAMED))
    moved = replace(NAMED, baseline={**NAMED.baseline, "ways.level": BaselineValue("N", 40.0, 61.0, 49.22, 48.1, 50.3)})
    assert "These lines belong with ways.level = 49.22 N, as in the _explained.yaml." in answer_lines(moved)


def test_what_is_not_determined_is_marked_and_a_pure_number_has_no_unit() -> None:
    shape = replace(COULOMB, parameters={"hump": Interval(0.48, "1", -0.9, 5.0)}, undetermined=("hump",))
    assert "hump 0.5 (-0.9 to 5.0, not determined here)" in "\n".join(answer_lines(replace(NAMED, effects=(shape,))))


def test_an_interval_is_wider_than_nothing() -> None:
    parameters = {"shift": Interval(6.99996e-3, "s", 6.99991e-3, 7.00001e-3), "level": Interval(0.0, "N", 0.0, 0.25)}
    text = "\n".join(answer_lines(replace(NAMED, effects=(replace(COULOMB, parameters=parameters),))))
    assert "shift 6.999960 ms (6.999910 to 7.000010 ms)" in text
    assert "level 0 mN (0 to 250 mN)" in text


def test_the_table_of_the_decision_holds_all_that_competed_and_says_what_its_columns_mean() -> None:
    lines = explanation_lines(UNKNOWN)
    assert lines[2].split() == ["explanation", "gain", "error", "chance", "level", "kept", "why"]
    assert [line.split("  ")[0] for line in lines[4:8]] == [
        "the lesson, its uncertain values refitted", "TorqueRipple at x_axis", "Backlash at x_scale", "TransportDelay at x_drive"
    ]  # fmt: skip
    smooth = (
        "smooth functions, for what is left at x_controller.voltage  2220  210    630           yes   predicts what is left; it depends on"
    )
    assert lines[8].startswith(smooth)
    assert lines[9] == "Not judged, as the first recording is fitted hardly better: 1 effect."
    assert lines[-1] == "Chance level: smaller gains may be chance. It is 3 errors, or 10 and 3 for each fitted value if that is more."
    assert "unit at x_encoder.position" in explanation_lines(FAULT)[4]


def test_a_pure_number_has_no_unit() -> None:
    assert (with_unit("0.4", "1"), with_unit("0.4", "mm")) == ("0.4", "0.4 mm")
