"""The six lines of an answer: what, where, how large, how sure, compared with what, what next; nothing that a channel contradicts."""

import math
import re
from dataclasses import replace

import pytest

from lathesim.diagnosis.records.comparison import Explanation
from lathesim.diagnosis.records.diagnosis import VERDICTS, BaselineValue, ChannelFit, Diagnosis, Interval, Location, VariableBar
from lathesim.diagnosis.reporting.number_text import plain
from lathesim.diagnosis.reporting.summary import headline, summary_lines
from tests.diagnosis.sample_diagnoses import ALL, CLEAN, COULOMB, FAULT, NAMED, PARAMETERS, TIED, UNKNOWN

FOREIGN = re.compile(r"\b(floors?|nats?|shaken|replicates?|null|of the rest|residual)\b")
"""Words that a reader from outside does not know."""
SCALE = "x_scale.position"
OFF = {"x_encoder.position": ChannelFit("m", 3e-7, 9e-7, 5e-7, "v"), SCALE: ChannelFit("m", 3e-7, 2e-6, 1.77e-6, "v")}
"""A pitch error that a diagnosis called no missing physics."""
GENERIC = replace(UNKNOWN, sentence=VERDICTS["unknown"])


def lines(diagnosis: Diagnosis) -> dict[str, str]:
    """Return the lines that have a label, by it."""
    return dict(plain(line).split(": ", 1) for line in summary_lines(diagnosis)[1:])  # type: ignore[misc]


@pytest.mark.parametrize("name", ALL)
def test_an_answer_is_six_lines_in_words_that_a_control_engineer_knows(name: str) -> None:
    told = summary_lines(ALL[name])
    assert 2 <= len(told) <= 6
    assert "Next" in lines(ALL[name])
    assert not [line for line in told if FOREIGN.search(line)]


def test_a_named_effect_is_told_with_place_size_doubt_comparison_and_next_step() -> None:
    assert headline(NAMED) == "The simulation left out CoulombFriction at x_axis."
    told = lines(NAMED)
    assert told["Where"].startswith("x_axis, x_drive; the error goes with sign of velocity of x_axis")
    assert (
        told["Size"]
        == "CoulombFriction 20.41 N (95 % interval 20.22 to 20.60 N). With recorded inputs this explains 98.3 % of the held-out error."
    )
    assert told["Sure"].startswith("97.4 % probable, among the 6 effects that were tried; the next best, AsymmetricFriction at x_axis")
    assert told["Compared"].startswith(
        "error of the whole simulation on validate.csv (not fitted), lesson alone -> with this: x_encoder.position 27 um -> 0.44 um; "
    )
    assert told["Next"].startswith("Paste the lines below into the lesson")


@pytest.mark.parametrize(
    ("diagnosis", "beginning"),
    [
        (CLEAN, "The lesson's physics"),
        (replace(PARAMETERS, sentence=VERDICTS["parameters_only"]), "With other values the lesson's physics"),
    ],
    ids=["as it is", "other values"],
)
def test_no_physics_is_missing_is_never_said_beside_a_channel_that_is_off(diagnosis: Diagnosis, beginning: str) -> None:
    told = headline(replace(diagnosis, fit=OFF))
    assert told == f"{beginning} is enough for x_encoder.position; at {SCALE} 1.77 µm are left that it does not explain."
    alone = headline(replace(diagnosis, fit={SCALE: OFF[SCALE]}))
    assert alone == f"{beginning} explains no channel down to the noise: at {SCALE} 1.77 µm are left that it does not explain."
    assert lines(replace(diagnosis, fit=OFF))["Where"].startswith(SCALE)
    assert headline(diagnosis) == diagnosis.sentence or diagnosis.fit != CLEAN.fit


def test_what_nothing_recorded_predicts_is_called_so() -> None:
    """In open loop noise of a force adds up to many times the noise of a position."""
    flexible = Explanation("a smooth function", SCALE, "flexible", -30.0, 9.0, 4.0, False, "predicts the held-out data worse")
    noise = replace(CLEAN, fit=OFF, explanations=(*CLEAN.explanations, flexible))
    end = f"explains all that can be predicted; at {SCALE} 1.77 µm are left that nothing recorded predicts."
    assert headline(noise) == f"The lesson's physics {end}"
    assert lines(noise)["Next"].startswith("Nothing")
    clear = replace(flexible, gain=900.0, kept=True)
    assert headline(replace(noise, explanations=(clear,))).endswith("are left that it does not explain.")


def test_a_value_that_is_far_off_is_named_beside_a_channel_that_stays_off() -> None:
    sentence = "No physics is missing, but x_axis.mass is further off than the lesson holds possible."
    told = headline(replace(PARAMETERS, sentence=sentence, fit=OFF))
    assert told == f"x_axis.mass is further off than the lesson holds possible. At {SCALE} 1.77 µm are left that this does not explain."
    assert headline(replace(PARAMETERS, sentence=sentence, fit=CLEAN.fit)) == sentence


@pytest.mark.parametrize("name", ["named", "tied", "unknown", "parameters_only"])
@pytest.mark.parametrize(("after", "word"), [(2.9e-5, "WORSE"), (2.72e-5, "slightly worse")])
def test_what_predicts_held_out_data_worse_is_said_so(name: str, after: float, word: str) -> None:
    fit = {**NAMED.fit, "x_encoder.position": replace(NAMED.fit["x_encoder.position"], after=after)}
    told = lines(replace(ALL[name], fit=fit))
    assert re.search(rf"x_encoder\.position 27 um -> 2[79][.\d]* um, {word}", told["Compared"])
    assert ("Do not " in told["Next"]) == (word == "WORSE" and name != "unknown")


def test_what_is_certain_is_named_also_where_something_is_left() -> None:
    bars = (VariableBar("x_controller.voltage", "position of x_axis", 0.2, 0.7),)
    left = replace(NAMED, adequate=False, removed_share=0.95, evidence=replace(NAMED.evidence, bars=bars))
    assert headline(left) == (
        "The simulation left out CoulombFriction of 20.41 N at x_axis, which explains 95.0 % of the held-out error; "
        "what is left depends on position of x_axis and has no name."
    )
    part = headline(replace(GENERIC, effects=(COULOMB,), evidence=left.evidence))
    assert part.startswith(
        "Physics is missing at x_axis that no effect of the catalogue explains. A part of it looks like CoulombFriction of"
    )
    assert headline(replace(GENERIC, effects=(COULOMB,), removed_share=-0.1)).endswith("explains.")


def test_an_effect_whose_interval_holds_zero_is_no_find() -> None:
    doubtful = replace(
        COULOMB, effect="ForceOffset", parameters={"offset": Interval(0.2, "N", -0.4, 0.8)}, may_be_zero=True, tied_with=("Weight",)
    )
    both = replace(
        NAMED, sentence="The simulation left out CoulombFriction at x_axis and ForceOffset at x_axis.", effects=(COULOMB, doubtful)
    )
    assert headline(both) == "The simulation left out CoulombFriction at x_axis."
    assert "ForceOffset 200 mN (95 % interval -400 to 800 mN), which holds zero: no find" in lines(both)["Size"]
    only = replace(both, sentence="The simulation left out ForceOffset at x_axis.", effects=(doubtful,))
    assert "its size may be zero" in headline(only)
    assert "left out" not in headline(only)


def test_a_tie_names_its_rivals_and_what_would_tell() -> None:
    told = lines(TIED)
    assert "cannot tell ForceOffset from ConverterOffset at x_drive" in told["Sure"]
    assert told["Next"].startswith("Tell them apart. Record the current as well")


def test_effects_of_which_none_was_fitted_are_counted() -> None:
    waiting = tuple(replace(one, gain=math.nan) for one in CLEAN.explanations)
    assert lines(replace(CLEAN, explanations=waiting))["Sure"] == "None of 4 effects promises more than chance, so none was fitted."
    assert "Sure" not in lines(replace(CLEAN, explanations=()))


def test_an_effect_that_predicts_better_is_never_passed_over_in_silence() -> None:
    assert lines(CLEAN)["Sure"] == "None of the 3 effects that were tried predicts clearly better than chance would."
    pitch = Explanation("PeriodicPitchError", SCALE, "effect", 24813.0, 223.0, 22.0, False, "left out by a rule on sizes")
    told = lines(replace(CLEAN, explanations=(*CLEAN.explanations, pitch)))["Sure"]
    assert (
        told
        == f"Of the 4 effects that were tried PeriodicPitchError at {SCALE} predicts best, and is not taken: left out by a rule on sizes."
    )


def test_values_that_moved_are_told_with_interval_and_the_given_value() -> None:
    moved = {f"x.v{place}": BaselineValue("kg", 10.0, 10.0, 12.0 + place, 11.0, 15.0) for place in range(5)}
    told = lines(replace(PARAMETERS, baseline=moved))["Size"]
    assert told.startswith("x.v4 is 16.0 kg (95 % interval 11.0 to 15.0 kg) and not 10 kg; ")
    assert told.endswith("; 2 more below.")


def test_a_fault_of_the_recording_keeps_its_sentence() -> None:
    assert headline(FAULT) == FAULT.sentence
    assert headline(replace(FAULT, sentence="")) == VERDICTS["recording_fault"]
    assert "Where" not in lines(replace(FAULT, location=Location()))
