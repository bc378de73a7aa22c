"""The words of an answer: six lines, its table and remarks at a terminal; nothing that another line contradicts."""

import ast
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lathesim.diagnosis.records.comparison import HARDLY_REACHED, NEVER_REACHED, Explanation
from lathesim.diagnosis.records.diagnosis import (
    VERDICTS,
    BaselineValue,
    ChannelFit,
    Determined,
    Diagnosis,
    FoundEffect,
    Interval,
    Location,
    Unanswerable,
    Unnamed,
    as_json,
    with_unit,
)
from lathesim.diagnosis.reporting import explanations
from lathesim.diagnosis.reporting.effect_report import for_a_turning_part
from lathesim.diagnosis.reporting.explanations import NOT_REACHED, explanation_lines
from lathesim.diagnosis.reporting.html_report import report_html
from lathesim.diagnosis.reporting.number_text import plain
from lathesim.diagnosis.reporting.remarks import at_their_bounds, not_answered, not_determined, not_shown, value_instead
from lathesim.diagnosis.reporting.summary import headline, summary_lines
from lathesim.diagnosis.reporting.terminal_text import answer_lines
from lathesim.effects.friction import StribeckFriction
from tests.diagnosis.sample_diagnoses import ALL, CLEAN, COULOMB, FAULT, NAMED, PARAMETERS, TIED, UNKNOWN, varied
from tests.diagnosis.stored.answers import stored

FOREIGN = re.compile(r"\b(floors?|nats?|shaken|replicates?|null|of the rest|residual|held.out|catalogue)\b")
"""Words that a reader from outside does not know."""
MOST_WORDS = 25
SCALE = "x_scale.position"
OFF = {"x_encoder.position": ChannelFit("m", 3e-7, 9e-7, 5e-7, "v"), SCALE: ChannelFit("m", 3e-7, 2e-6, 1.77e-6, "v")}
"""Noise of a force that adds up to many times the noise of a position."""


def lines(diagnosis: Diagnosis) -> dict[str, str]:
    """Return the lines that have a label, by it."""
    return dict(plain(line).split(": ", 1) for line in summary_lines(diagnosis)[1:])  # type: ignore[misc]


@pytest.mark.parametrize("name", ALL)
def test_an_answer_is_six_lines_in_words_that_a_control_engineer_knows(name: str) -> None:
    told = summary_lines(ALL[name])
    assert 2 <= len(told) <= 6
    assert "Next" in lines(ALL[name])
    assert not [line for line in told if FOREIGN.search(line)]
    sentences = [sentence for line in told for sentence in re.split(r"(?<=[.;:]) ", line)]
    assert not [sentence for sentence in sentences if len(sentence.split()) > MOST_WORDS]


def test_a_named_effect_is_told_with_place_size_doubt_comparison_and_next_step() -> None:
    assert headline(NAMED) == "The simulation left out CoulombFriction at x_axis."
    told = lines(NAMED)
    assert told["Where"] == "x_axis and x_drive."
    assert told["Size"].startswith("CoulombFriction 20.41 N (95 % interval 20.22 to 20.60 N). With each part driven by its recorded inputs")
    assert told["Size"].endswith(" and slow drift left out, this explains 98.3 % of the squared error.")
    assert told["Sure"] == (
        "97.4 % probable among all explanations compared. The closest rival, AsymmetricFriction at x_axis, "
        "refines CoulombFriction and explains little more."
    )
    assert told["Compared"].startswith(
        "with other values of 3 uncertain parameters of the lesson and 7 effects at 7 places. "
        "Each was fitted to recording.csv and validated on validate.csv. "
        "RMS error of the whole simulation on validate.csv (lesson alone -> with this): x_encoder.position 27 um -> 0.44 um; "
    )
    assert told["Next"].startswith("Paste the lines below into the lesson")


def test_a_small_share_under_recorded_inputs_is_not_given_beside_a_simulation_that_becomes_right() -> None:
    """A motor's answer explained 8 % in one line, and in the next one its angle went from 3 to 0.04 rad."""
    assert "this explains" not in lines(varied(NAMED, removed_share=0.08))["Size"]
    little = {name: replace(one, after=0.9 * one.before) for name, one in NAMED.fit.items()}
    assert "this explains 8 % of the squared error" in lines(varied(NAMED, removed_share=0.08, fit=little))["Size"]


def test_one_recording_that_judges_itself_is_said_to_do_so() -> None:
    halves = varied(NAMED, validation="recording.csv, second half", judges_itself=True)
    said = "Each was fitted to one part of recording.csv and validated on the other (second half)."
    assert said in lines(halves)["Compared"]


def test_beside_a_recording_from_before_a_change_the_answer_is_what_is_new() -> None:
    assert headline(varied(NAMED, before="march.h5")) == "New since march.h5: CoulombFriction at x_axis."
    assert headline(varied(CLEAN, before="march.h5")) == "Nothing is new since march.h5: the lesson explains the recording."


@pytest.mark.parametrize(
    ("diagnosis", "beginning"),
    [(CLEAN, "the lesson explains the recording"), (PARAMETERS, "other values of the lesson explain the recording")],
    ids=["as it is", "other values"],
)
def test_a_channel_that_stays_off_and_that_nothing_predicts_is_said_beside_the_verdict(diagnosis: Diagnosis, beginning: str) -> None:
    off = varied(diagnosis, fit=OFF, easiest="x_drive.current")
    stays = f"The error of {SCALE} remains 1.77 µm, 5.9 times its noise."
    part = f"{beginning.removesuffix(' the recording')} a part of the recording."
    assert headline(off) == f"{part[0].upper()}{part[1:]} {stays} No known effect and no recorded signal predicts it."
    told = lines(off)
    assert "Where" not in told
    more = "Record more motion: longer, at other speeds and places."
    assert told["Next"].endswith(f"{more} Log x_drive.current too: of the signals that would show more, it is the easiest to log.")
    assert "with --validate." in lines(varied(off, judges_itself=True))["Next"]
    assert ", in part<" in report_html(off) or "Explained in part" in report_html(off)
    assert "may be used as it is" not in "".join(answer_lines(off)) + report_html(off)
    assert headline(replace(diagnosis, fit=CLEAN.fit)) == f"No physics is missing: {beginning}."


def test_a_channel_that_stays_off_is_named_also_where_effects_are() -> None:
    assert (
        headline(replace(NAMED, fit=OFF))
        == f"The simulation left out CoulombFriction at x_axis. The error of {SCALE} remains 1.77 µm, 5.9 times its noise."
    )
    assert lines(replace(NAMED, fit=OFF))["Next"].endswith("lesson, and see with lathesim compare when the remaining error is largest.")


def test_of_a_place_that_nothing_brings_back_the_share_of_its_travel_is_told_and_not_how_often_its_noise() -> None:
    """138 rad at an encoder of 0.2 mrad are 600 000 times its noise, and 7 % of what a motor turned without a loop."""
    traces = tuple(replace(trace, held="encoder" not in trace.channel) for trace in NAMED.evidence.traces)
    adrift = replace(NAMED, fit={**NAMED.fit, "x_encoder.position": ChannelFit("m", 3e-7, 4e-3, 1e-3, "v")})
    adrift = replace(adrift, evidence=replace(NAMED.evidence, traces=traces))
    travel = np.ptp(traces[0].recorded)
    drift = f"Nothing brings back x_encoder.position, so small errors add up: it is off by 1 mm, {1e-1 / travel:.2g} % of its travel."
    assert headline(adrift) == f"The simulation left out CoulombFriction at x_axis. {drift}"
    far = replace(adrift, fit={"x_encoder.position": ChannelFit("m", 3e-7, 9.0, float(3.0 * travel), "v")})
    assert headline(far).endswith(", 3 times its travel.")
    both = replace(adrift, fit={**adrift.fit, "x_controller.voltage": ChannelFit("V", 4e-3, 0.58, 0.02, "v")})
    assert headline(both).endswith(f" The error of x_controller.voltage remains 20 mV, 5 times its noise. {drift}")


def test_values_that_end_at_the_limit_of_their_doubt_are_named() -> None:
    assert at_their_bounds(()) == []
    assert at_their_bounds(("x_axis.viscous", "x_drive.conductance")) == [
        "x_axis.viscous and x_drive.conductance end at the limit of the declared uncertainty: "
        "something that acts like them may be missing too."
    ]


def test_a_value_that_is_far_off_is_named() -> None:
    far = varied(PARAMETERS, far_off=("x_axis.mass",))
    said = "x_axis.mass is further off than the lesson declares possible."
    assert headline(replace(far, fit=CLEAN.fit)) == f"No physics is missing, but {said}"
    assert f"explain a part of the recording. {said} The error of {SCALE} remains " in headline(replace(far, fit=OFF))


@pytest.mark.parametrize("name", ["named", "tied", "unknown", "parameters_only"])
@pytest.mark.parametrize(("after", "word"), [(2.9e-5, "WORSE"), (2.72e-5, "slightly worse")])
def test_what_predicts_the_judging_recording_worse_is_said_so(name: str, after: float, word: str) -> None:
    fit = {**NAMED.fit, "x_encoder.position": replace(NAMED.fit["x_encoder.position"], after=after)}
    told = lines(replace(ALL[name], fit=fit))
    assert re.search(rf"x_encoder\.position 27 um -> 2[79][.\d]* um, {word}", told["Compared"])
    assert ("Do not " in told["Next"]) == (word == "WORSE" and name != "unknown")
    doubt = "Less than the fit suggests: x_encoder.position has a larger error than with the lesson alone."
    assert told["Sure"].startswith(doubt) == (word == "WORSE" and name in ("named", "tied"))


def test_what_makes_every_channel_worse_is_no_find() -> None:
    spoilt = {name: replace(item, after=2.0 * item.before) for name, item in NAMED.fit.items()}
    said = headline(replace(NAMED, fit=spoilt))
    assert said.startswith("Something is missing. CoulombFriction at x_axis describes it best, but the error of ")
    assert " is larger than with the lesson alone: it may be something else." in said
    # a place that nothing brings back sums up small errors, whatever is right
    adrift = replace(NAMED.evidence, traces=tuple(replace(trace, held=False) for trace in NAMED.evidence.traces))
    assert headline(replace(NAMED, fit=spoilt, evidence=adrift)).startswith("The simulation left out CoulombFriction at x_axis.")


def test_a_lesson_whose_fitted_values_predict_worse_is_not_said_to_explain() -> None:
    channel, item = next(iter(CLEAN.fit.items()))
    worse = varied(CLEAN, fit={channel: replace(item, before=1.5 * item.floor, after=2.5 * item.floor)})
    assert headline(worse) == f"No effect that is missing shows, and the fitted values predict {channel} worse than the given ones."
    assert "Size" not in lines(worse)


def test_what_is_certain_is_named_also_where_something_is_left() -> None:
    rest = Unnamed("x_axis.disturbance", 0.62, "N", ("depends on position of x_axis",))
    left = varied(NAMED, adequate=False, unnamed=(rest,))
    assert headline(left) == (
        "The simulation left out CoulombFriction at x_axis. The unexplained error at x_axis.disturbance depends on position of x_axis."
    )
    assert re.search(r"Unexplained: 620 mN RMS at x_axis\.disturbance, [\d.]+ % of the total there\.$", lines(left)["Size"])


def test_what_has_no_name_is_said_with_its_place_size_and_how_sure_that_is() -> None:
    assert headline(UNKNOWN) == (
        "Physics is missing at x_axis that no known effect explains. "
        "The unexplained error at x_axis.disturbance depends on position and direction of x_axis."
    )
    told = lines(UNKNOWN)
    assert told["Sure"].startswith("A smooth function of the motion predicts x_controller.voltage clearly better: ")
    assert told["Sure"].endswith(" the log-likelihood gains 2220, and by chance at most 630.")
    assert told["Size"].startswith("Unexplained: 3.1 N RMS at x_axis.disturbance, ")
    law = varied(UNKNOWN, explanations=(), unnamed=(), rule="a controller follows another law than the lesson's")
    assert lines(law)["Sure"] == "A controller follows another law than the lesson's."


def test_an_effect_whose_interval_holds_zero_is_no_find() -> None:
    doubtful = replace(
        COULOMB,
        effect="ForceOffset",
        parameters={"offset": Interval(0.2, "N", -0.4, 0.8)},
        sizes=Determined(may_be_zero=True),
        tied_with=("Weight",),
    )
    both = replace(NAMED, effects=(COULOMB, doubtful))
    assert headline(both) == "The simulation left out CoulombFriction at x_axis."
    absent = "ForceOffset makes the prediction better too. Its size is not determined: it may be absent."
    assert absent in lines(both)["Size"]
    assert "ForceOffset 200 mN (95 % interval -400 to 800 mN), may be zero" in lines(replace(both, effects=(doubtful,)))["Size"]
    only = headline(replace(both, effects=(doubtful,)))
    assert only == (
        "Something is missing. ForceOffset at x_axis describes it best, but its size is not determined: it may be something else."
    )


def test_a_step_of_a_reading_comes_after_the_physics_of_the_machine() -> None:
    """A pendulum's answer named the count of its encoder, and put the friction that it also found in the second line."""
    count = replace(COULOMB, effect="Quantisation", at="x_encoder", parameters={"count": Interval(3e-6, "m", 2.9e-6, 3.1e-6)}, is_step=True)
    unsure = replace(COULOMB, tied_with=("PositionDependentFriction",), probability=0.53, sizes=Determined(may_be_zero=True))
    answer = replace(NAMED, effects=(unsure, count))
    assert headline(answer) == (
        "Something is missing. CoulombFriction at x_axis describes it best, but its size is not determined: it may be something else. "
        "Beside it, the simulation left out Quantisation at x_encoder."
    )
    told = lines(answer)
    assert told["Size"].startswith("CoulombFriction 20.41 N (95 % interval 20.22 to 20.60 N), may be zero; Quantisation 3.000 um (")
    assert told["Sure"].startswith("Each is at least 53 % probable among ")
    alone = replace(answer, effects=(count,))
    assert headline(alone) == "The simulation left out Quantisation at x_encoder."
    off = {name: replace(item, before=5e-4, after=5e-4) for name, item in NAMED.fit.items() if name == "x_encoder.position"}
    assert headline(replace(alone, fit=off)) == (
        "The lesson explains a part of the recording. The error of x_encoder.position remains 0.5 mm, 2400 times its noise. "
        "Beside it, the simulation left out Quantisation at x_encoder."
    )
    assert headline(replace(answer, effects=(COULOMB, count))) == (
        "The simulation left out CoulombFriction at x_axis and Quantisation at x_encoder."
    )
    spoilt = {name: replace(item, after=2.0 * item.before) for name, item in NAMED.fit.items()}
    said = headline(replace(answer, effects=(COULOMB, count), fit=spoilt))
    assert said.startswith("Something is missing. CoulombFriction at x_axis describes it best, but the error of ")
    assert " Beside it, the simulation left out Quantisation at x_encoder." in said


def test_where_recordings_determine_a_product_alone_that_is_the_size() -> None:
    parameters = {"growth": Interval(222.0, "1/m", 0.0, 13096.0), "rate": Interval(0.0, "m/s", 0.0, 4e-8)}
    wear = replace(COULOMB, effect="WearForceGrowth", parameters=parameters, sizes=Determined(("growth",)))
    wear = replace(wear, sizes=replace(wear.sizes, products={"growth x break_in": Interval(0.018, "1", 0.0174, 0.0186)}))
    assert lines(replace(NAMED, effects=(wear,)))["Size"].startswith(
        "WearForceGrowth growth x break in 0.01800 (95 % interval 0.01740 to 0.01860). "
    )


def test_the_size_that_is_surely_not_zero_stands_for_the_effect() -> None:
    parameters = {"level": Interval(0.0, "N", -np.inf, 11.6), "viscous_difference": Interval(-1106.0, "N/(m/s)", -1245.0, -967.0)}
    unequal = replace(COULOMB, effect="AsymmetricFriction", parameters=parameters)
    assert lines(replace(NAMED, effects=(unequal,)))["Size"].startswith(
        "AsymmetricFriction viscous difference -1106 N/(m/s) (95 % interval -1245 to -967 N/(m/s))."
    )


def test_effects_at_one_place_name_it_once_and_a_fault_of_the_recording_is_no_physics() -> None:
    late = replace(COULOMB, effect="ChannelTimeShift", at="x_scale", family="recording")
    cogging = replace(COULOMB, effect="Cogging", tied_with=("TorqueRipple",))
    told = headline(replace(NAMED, effects=(COULOMB, late, cogging)))
    assert told.startswith("The simulation left out CoulombFriction and Cogging (or TorqueRipple) at x_axis. ")
    assert told.endswith("The recording has a fault: ChannelTimeShift at x_scale.")


def test_a_tie_names_the_rivals_of_each_effect_and_what_would_tell() -> None:
    told = lines(TIED)
    assert (
        told["Sure"]
        == "52 % probable among all explanations compared. This recording cannot tell ForceOffset from ConverterOffset at x_drive."
    )
    assert told["Next"].startswith("To tell ForceOffset from ConverterOffset at x_drive: Record the current as well")
    open_ = replace(COULOMB, separating_experiment="Creep both ways.")
    assert lines(replace(NAMED, effects=(open_,)))["Next"] == "To determine CoulombFriction: Creep both ways."
    second = replace(COULOMB, effect="Cogging", tied_with=("TorqueRipple",))
    several = lines(replace(TIED, effects=(*TIED.effects, second)))["Sure"]
    assert several.startswith("Each is at least 52 % probable among")
    sure = tuple(replace(effect, probability=1.0) for effect in (COULOMB, second))
    assert lines(replace(NAMED, effects=sure))["Sure"].startswith("Each is > 99.9 % probable among")
    assert several.endswith("cannot tell ForceOffset from ConverterOffset at x_drive, nor Cogging from TorqueRipple.")


def test_an_effect_that_predicts_better_is_never_passed_over_in_silence() -> None:
    assert lines(CLEAN)["Sure"] == "No effect predicts the recording better than chance could."
    pitch = Explanation("PeriodicPitchError", SCALE, "effect", 24813.0, 223.0, 669.0, False, "needs an amplitude of 9 mm")
    passed_over = varied(CLEAN, explanations=(*CLEAN.search.explanations, pitch))
    assert lines(passed_over)["Sure"] == f"No effect is named: the best one, PeriodicPitchError at {SCALE}, needs an amplitude of 9 mm."
    assert headline(varied(passed_over, fit=OFF)).endswith(f"The error of {SCALE} remains 1.77 µm, 5.9 times its noise.")
    assert "Sure" not in lines(varied(CLEAN, explanations=()))


def test_an_effect_that_the_second_recording_does_not_show_is_told_with_what_would_validate_it() -> None:
    limit = Explanation("CurrentLimit", "x_drive", "effect", -5.0, 6.0, 17.0, False, NEVER_REACHED)
    unseen = varied(CLEAN, explanations=(*CLEAN.search.explanations, limit), unanswerable=(Unanswerable("CurrentLimit", "x_drive", "it"),))
    both = "fits recording.csv clearly better, but validate.csv never reaches it and cannot validate it."
    shows = "validate.csv shows no missing physics: the lesson explains the recording."
    assert headline(unseen) == f"{shows} CurrentLimit at x_drive {both}"
    assert lines(unseen)["Next"].endswith("Validate with a recording that reaches CurrentLimit at x_drive, as recording.csv does.")
    assert not_answered(unseen) == []
    off = headline(varied(unseen, fit=OFF))
    assert off.endswith(f"5.9 times its noise. CurrentLimit at x_drive {both}")
    slew = replace(limit, name="SlewLimit", reason=HARDLY_REACHED)
    several = headline(varied(unseen, explanations=(limit, slew)))
    assert " CurrentLimit and SlewLimit at x_drive fit recording.csv clearly better, but validate.csv hardly reaches them and " in several


def test_every_reason_for_which_an_effect_is_left_out_reads_as_a_sentence_after_its_name() -> None:
    """A reason that begins with a verb reads after a name, in the line and in the table."""
    tree = ast.parse(Path(explanations.__file__).read_text(encoding="utf-8"))
    made = [one for one in ast.walk(tree) if isinstance(one, ast.FunctionDef) and one.name in ("_why_not", "_too_small", "_why_another")]
    texts = [one for function in made for one in ast.walk(function) if isinstance(one, ast.Return)]
    begun = [word for one in texts for word in re.findall(r"(?:return |if kept else )f?['\"](\w+)", ast.unparse(one))]
    verbs = {"predicts", "explains", "gains", "fits", "needs", "changes", "is", "refines", "was"}
    assert len(begun) >= 14
    assert set(begun) <= verbs
    for reason in {one["reason"] for answer in stored().values() for one in answer["explanations"] if one["kind"] == "effect"}:
        assert reason.split()[0] in verbs
        one = Explanation("Backlash", SCALE, "effect", 90.0, 1.0, 3.0, False, reason)
        assert lines(varied(CLEAN, explanations=(one,)))["Sure"] == f"No effect is named: the best one, Backlash at {SCALE}, {reason}."


def test_where_the_verdict_is_of_the_lesson_and_values_moved_both_are_told() -> None:
    """The verdict asks what is likelier, the table which values the recordings hold."""
    moved = replace(CLEAN, baseline={"x_axis.mass": BaselineValue("kg", 10.0, 10.0, 12.0, 11.0, 13.0)})
    told = lines(moved)
    assert told["Size"] == "x_axis.mass is 12.0 kg (95 % interval 11.0 to 13.0 kg) and not 10 kg."
    assert told["Next"] == "Measure x_axis.mass: the lesson may be used as it is, for motions like these."
    needed = replace(moved, fit={SCALE: ChannelFit("m", 3e-7, 9e-6, 5e-7, "v")})
    assert headline(needed) == "No physics is missing: the lesson explains the recording, with other values than the given ones."
    assert lines(needed)["Next"] == "Measure x_axis.mass, and correct it in the lesson."
    assert "Other values<" in report_html(needed)


def test_values_that_moved_only_together_are_told_too() -> None:
    alone = {
        "late.delay": BaselineValue("s", 0.065, 0.065, 0.069, 0.039, 0.099),
        "x.inertia": BaselineValue("kg", 4.0, 4.0, 2.0, 0.0, 9.0, ends=(True, False)),
    }
    told = replace(PARAMETERS, baseline=alone, fit=CLEAN.fit)
    assert lines(told)["Size"] == (
        "x.inertia is 2.0 kg (95 % interval at most 9.0 kg) and not 4 kg; late.delay is 69 ms (95 % interval 39 to 99 ms) and not 65 ms; "
        "only together do these values explain more."
    )
    assert any(line.startswith("late.delay") and "39 to 99 ms" in line for line in answer_lines(told))


def test_each_recording_that_judged_is_named() -> None:
    told = lines(varied(NAMED, judges=("a.csv", "b.csv"), validation="a.csv"))["Compared"]
    assert "validated on a.csv and b.csv. RMS error of the whole simulation on a.csv (" in told


def test_values_that_moved_are_told_with_interval_and_the_given_value() -> None:
    moved = {f"x.v{place}": BaselineValue("kg", 10.0, 10.0, 12.0 + place, 11.0, 15.0) for place in range(5)}
    told = lines(replace(PARAMETERS, baseline=moved))["Size"]
    assert told.startswith("x.v4 is 16.0 kg (95 % interval 11.0 to 15.0 kg) and not 10 kg; ")
    assert told.endswith("; 2 more below.")


def test_a_fault_of_the_recording_keeps_its_sentence() -> None:
    assert headline(FAULT) == FAULT.sentence
    assert headline(replace(FAULT, sentence=VERDICTS["recording_fault"])).startswith(VERDICTS["recording_fault"])
    assert "Where" not in lines(replace(FAULT, location=Location()))


@pytest.mark.parametrize("name", ALL)
def test_every_verdict_says_its_sentence_and_what_is_left(name: str) -> None:
    lines = answer_lines(ALL[name])
    assert lines[0] == plain(headline(ALL[name]))
    assert {f"- {line}" for line in ALL[name].rest.left} <= set(lines)
    assert ("The search was stopped" in "\n".join(lines)) != ALL[name].complete


def test_a_search_that_was_stopped_says_what_it_had_not_tried() -> None:
    names = tuple(f"Effect{number} at x_axis" for number in range(9))
    lines = answer_lines(varied(ALL["stopped"], untried=names))
    assert lines[-1] == f"Not tried: {', '.join(names[:6])} and 3 more."
    assert as_json(varied(ALL["stopped"], untried=names))["untried"] == list(names)


def test_a_name_comes_with_its_probability_and_its_values() -> None:
    text = "\n".join(answer_lines(NAMED))
    assert "CoulombFriction  x_axis  level 20.41 N (20.22 to 20.60 N)  97.4 %\n" in text
    assert "x_encoder.position    27 um   0.44 um  0.21 um\n" in text
    assert "\nPaste into the lesson:\ninsert:\n  - {effect: CoulombFriction, at: x_axis, level: 20.41 N}" in text


def test_values_that_are_others_beside_what_is_pasted_are_told() -> None:
    """A line pasted without them leaves more: what a friction is, is worked out beside another viscosity."""
    assert not any(line.startswith("Use these lines") for line in answer_lines(NAMED))
    moved = replace(NAMED, baseline={**NAMED.baseline, "ways.level": BaselineValue("N", 40.0, 61.0, 49.22, 48.1, 50.3)})
    (beside,) = (line for line in answer_lines(moved) if line.startswith("Use these lines"))
    assert beside.startswith("Use these lines with ways.level = 49.22 N, x_axis.mass = 95.32 kg, ")
    assert beside.endswith(" N/A.")
    assert all(f"{name} = " in beside for name in moved.baseline)


@pytest.mark.parametrize("off", [{}, OFF], ids=["all is explained", "something remains"])
@pytest.mark.parametrize("name", ALL)
def test_an_answer_names_no_file_that_only_a_report_comes_with(name: str, off: dict[str, ChannelFit]) -> None:
    """With --no-report nothing is written; where a report is, the last line of the command names its files."""
    diagnosis = ALL[name]
    told = "\n".join(answer_lines(replace(diagnosis, fit=off or diagnosis.fit)))
    assert "_explained.yaml" not in told
    assert not re.search(r"[Tt]he report\b", told)


def test_what_is_not_determined_is_marked_and_a_pure_number_has_no_unit() -> None:
    shape = replace(COULOMB, parameters={"hump": Interval(0.48, "1", -0.9, 5.0)}, sizes=Determined(("hump",)))
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
    smooth = "smooth functions, for the remaining error at x_controller.voltage  2220  210    630           yes   predicts what is left"
    assert lines[8].startswith(smooth)
    assert lines[9] == "Not fitted, as a linear estimate promises too little: 1 effect."
    last = UNKNOWN.search.explanations[-1]
    waiting = [replace(last, kind="effect", gain=np.nan, reason=why) for why in (NOT_REACHED, "fits it hardly better")]
    assert explanation_lines(varied(UNKNOWN, explanations=tuple(waiting)))[4:6] == [
        "Not fitted, as the search was stopped: 1 effect.", "Not judged, as the first recording is fitted hardly better: 1 effect."
    ]  # fmt: skip
    assert lines[-1] == "Chance level: smaller gains may be chance. It is 3 errors, or 10 and 3 for each fitted value if that is more."
    assert "unit at x_encoder.position" in explanation_lines(FAULT)[4]


def test_a_pure_number_has_no_unit() -> None:
    assert (with_unit("0.4", "1"), with_unit("0.4", "mm")) == ("0.4", "0.4 mm")


PRESSURE = "cutting.specific_force"
BASELINE = {PRESSURE: BaselineValue("N/m^2", 8.5e8, 1.05e9, 1.05e9)}


def test_a_value_that_is_impossible_is_told_with_what_it_does() -> None:
    (whole,) = value_instead((PRESSURE,), BASELINE, whole=True)
    assert whole.startswith(f"{PRESSURE} of 1.05e+09 N/m^2 (+24%) explains the error by itself, though the lesson declares it impossible.")
    (part,) = value_instead((PRESSURE,), BASELINE, whole=False)
    assert "explains a part of the error, though" in part
    assert value_instead((), BASELINE, whole=True) == []


def test_advice_for_a_part_that_turns_has_speeds_of_a_turn() -> None:
    shown = for_a_turning_part(StribeckFriction.experiment or "")
    assert shown.startswith("Creep at constant speeds from 1.2 to 120 rpm, both ways: ")
    assert for_a_turning_part("A pass at 0.1 mm/s.") == "A pass at 0.6 rpm."


def test_ties_and_open_values_say_what_the_lines_to_paste_hold_and_each_experiment_stands_once() -> None:
    effects = (
        FoundEffect("LostCounts", "x_scale", "encoder", 0.5, {}, ("LostCounts at x_encoder",), "Return to the index mark."),
        FoundEffect("StribeckFriction", "x_axis", "reversal", 1.0, {}, (), "Creep.", sizes=Determined(("stribeck_velocity", "excess"))),
    )
    name, values, experiment = not_determined(effects)
    assert name == "The lines to paste use LostCounts at x_scale; LostCounts at x_encoder would fit as well."
    assert values.startswith(
        "This recording does not determine stribeck velocity and excess of StribeckFriction; the lines to paste hold a set"
    )
    assert experiment == "To determine StribeckFriction: Creep."


def test_a_value_that_no_channel_shows_is_said_to_be_one() -> None:
    slopes = np.array([[[0.0, 1e-5]], [[0.0, 1e-2]], [[0.0, 0.0]]])
    fitted: Any = SimpleNamespace(names=["tachometer.gain", "spindle.inertia", "spindle.speed"], sensitivity=slopes)
    (sentence,) = not_shown(fitted, {"tachometer.gain": 1.0, "spindle.inertia": 1.0}, np.array([0.1]))
    assert sentence.startswith("tachometer.gain moves no compared channel")
