"""A diagnosis from end to end: every verdict, and what stands behind it. One table, one small catalogue."""

import functools
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import lathesim.diagnosis.answer as answering
from lathesim.diagnosis.diagnose import _completed, ask, diagnose
from lathesim.diagnosis.method import STANDARD
from lathesim.diagnosis.preparation import Question, prepare
from lathesim.diagnosis.recording_checks.checks import of_a_slow_log, too_slow_for_commands
from lathesim.diagnosis.records.diagnosis import ChannelFit, Diagnosis, as_json
from lathesim.identification.execution import Deadline
from lathesim.identification.replay.loading import Recorded
from lathesim.record import Record
from lathesim.recordings.raw_table import Finding
from tests.diagnosis.pushed_table import EFFECTS, MASS, POSITION, Hidden, machine, recording
from tests.diagnosis.sample_diagnoses import NAMED
from tests.diagnosis.small_case import controlled_axis


def offset(v: float, q: float, t: float) -> float:
    return 6.0


def outside(v: float, q: float, t: float) -> float:
    """A drag that grows with the square of the speed is not in the small catalogue."""
    return 600.0 * v * abs(v)


def question(first: Record, second: Record | None, **values: Any) -> Question:
    recordings = [Recorded("fit.csv", first, ()), *([Recorded("check.csv", second, ())] if second is not None else [])]
    return ask("A table", machine(**values), tuple(recordings), EFFECTS)


@functools.cache
def diagnosis(hidden: Hidden, mass: float = MASS) -> Diagnosis:
    return diagnose(question(recording(hidden, seed=1), recording(hidden, seed=2), mass=mass))


def test_a_simulation_that_is_right_is_called_so() -> None:
    found = diagnosis(Hidden())
    assert (found.verdict, found.effects, found.lines.insert) == ("no_mismatch", (), ())
    assert found.rest.adequate
    assert found.complete
    assert found.fit[POSITION].after < 3.0 * found.fit[POSITION].floor
    assert found.rest.discovered == ""


def test_other_values_are_no_missing_physics() -> None:
    found = diagnosis(Hidden(), mass=1.04 * MASS)
    assert (found.verdict, found.effects) == ("parameters_only", ())
    mass = found.baseline["x_axis.mass"]
    assert mass.given == pytest.approx(1.04 * MASS)
    assert mass.refit_with == pytest.approx(MASS, rel=1e-3)


def test_a_friction_is_named_with_its_size_and_where_it_sits() -> None:
    found = diagnosis(Hidden(dry=8.0))
    assert found.verdict == "named"
    (effect,) = found.effects
    assert (effect.effect, effect.at, effect.family) == ("CoulombFriction", "x_axis", "reversal")
    assert effect.probability > 0.9
    level = effect.parameters["level"]
    assert level.unit == "N"
    assert level.value == pytest.approx(8.0, rel=0.05)
    assert level.low < level.value < level.high
    assert found.sentence.startswith("The simulation left out CoulombFriction at x_axis. Nothing brings back x_encoder.position, so ")
    assert found.location.components[0] == "x_axis"
    assert found.location.channels == (POSITION,)
    assert found.fit[POSITION].after < 0.1 * found.fit[POSITION].before
    assert found.rest.removed_share > 0.9
    (entry,) = found.lines.insert
    assert entry["effect"] == "CoulombFriction"
    assert entry["level"].endswith(" N")


def test_what_the_baseline_had_absorbed_is_shown() -> None:
    viscous = diagnosis(Hidden(dry=8.0)).baseline["x_axis.viscous"]
    assert viscous.given == 200.0
    assert viscous.refit_without > 230.0
    assert viscous.refit_with == pytest.approx(200.0, rel=0.02)
    assert viscous.low < viscous.refit_with < viscous.high


def test_two_effects_are_named_together() -> None:
    found = diagnosis(Hidden(dry=8.0, law=offset))
    assert found.verdict in ("named", "tied")
    assert {effect.effect for effect in found.effects} == {"CoulombFriction", "ForceOffset"}
    sizes = {effect.effect: next(iter(effect.parameters.values())).value for effect in found.effects}
    assert sizes == pytest.approx({"CoulombFriction": 8.0, "ForceOffset": 6.0}, rel=0.1)


@pytest.mark.slow
def test_what_is_in_no_catalogue_is_not_given_a_name() -> None:
    found = diagnosis(Hidden(law=outside))
    assert (found.verdict, found.rest.adequate, found.lines.insert) == ("unknown", False, ())
    assert "velocity of x_axis" in found.sentence


@pytest.mark.slow
def test_what_is_in_no_catalogue_is_told_as_a_formula() -> None:
    found = diagnosis(Hidden(law=outside))
    assert "v * abs(v)" in found.rest.discovered
    assert "class DiscoveredTerm(Effect)" in found.lines.plugin


def test_an_adequate_model_falls_short_of_nothing() -> None:
    assert diagnosis(Hidden(dry=8.0)).rest.unnamed == ()


def test_a_recording_at_fault_names_no_physics() -> None:
    fault = Finding("frozen", POSITION, "it stands still for 0.5 s", "", serious=True)
    first = Recorded("fit.csv", recording(Hidden(dry=8.0)), (fault,))
    found = diagnose(ask("A table", machine(), (first,), EFFECTS))
    assert (found.verdict, found.effects) == ("recording_fault", ())
    assert "it stands still for 0.5 s" in found.sentence
    assert found.question.findings == (str(fault),)


def test_what_one_of_two_recordings_has_is_said_of_that_one() -> None:
    uneven, assumed = Finding("jitter", "time", "the rows come unevenly", ""), Finding("mapping", POSITION, "it is held", "")
    both = tuple(
        Recorded(name, recording(Hidden(), seed=1), found) for name, found in (("fit.csv", (assumed,)), ("check.csv", (assumed, uneven)))
    )
    told = prepare(ask("A table", machine(), both, EFFECTS)).findings
    assert told == (f"{POSITION}: it is held.", "check.csv, time: the rows come unevenly.")


@pytest.mark.parametrize(
    ("verdict", "suspect", "kind", "told"),
    [
        ("unknown", "x_controller", "coarse", True),
        ("unknown", "x_axis", "coarse", False),
        ("unknown", "x_controller", "interpolated", False),
        ("named", "x_controller", "coarse", False),
    ],
)
def test_what_a_controller_did_between_two_samples_is_no_missing_physics(
    verdict: str, suspect: str, kind: str, told: bool, tmp_path: Path
) -> None:
    """A log of 400 Hz beside a loop of 1 kHz, for which no whole number of decisions can be simulated."""
    controlled, record = controlled_axis(tmp_path)
    slow = Finding(kind, "", "one sample every 2.5 ms, and x_controller decides every 1 ms", "")
    asked = ask("An axis", controlled, (Recorded("fit.csv", record, (slow,)),), EFFECTS)
    answer: Any = SimpleNamespace(verdict=verdict, location=SimpleNamespace(components=(suspect, "x_encoder")))
    sentences = [str(one) for one in of_a_slow_log(asked.fitted.findings, asked.machine, answer)]
    assert "".join(sentences).startswith("One sample every 2.5 ms, and x_controller decides every 1 ms: what nothing explains") == told
    assert bool(sentences) == told


def test_one_recording_is_judged_on_its_second_half() -> None:
    found = diagnose(question(recording(Hidden(dry=8.0), count=4000), None))
    assert (found.question.validation, found.question.judges_itself) == ("fit.csv, second half", True)
    assert [effect.effect for effect in found.effects] == ["CoulombFriction"]
    assert found.effects[0].parameters["level"].value == pytest.approx(8.0, rel=0.05)


def test_stopped_it_tells_what_is_known() -> None:
    said: list[str] = []

    def stop(text: str) -> None:
        said.append(text)
        if sum("linear estimate" in line for line in said) == 2 and "linear estimate" in text:
            raise KeyboardInterrupt

    found = diagnose(question(recording(Hidden(dry=8.0), seed=1), recording(Hidden(dry=8.0), seed=2)), stop)
    assert not found.complete
    assert [effect.effect for effect in found.effects] == ["CoulombFriction"]
    assert as_json(found)["verdict"] == "named"


def test_when_the_time_is_over_nothing_is_begun_that_takes_long(monkeypatch: pytest.MonkeyPatch) -> None:
    """An answer within 30 s took 61 s with a formula and what else is made after the search."""
    begun: list[str] = []
    monkeypatch.setattr(answering, "discover", lambda *given, **more: begun.append("discover"))
    asked = question(recording(Hidden(law=outside), seed=1), recording(Hidden(law=outside), seed=2))
    late = diagnose(replace(asked, ends=Deadline(0.0)))
    assert not late.complete
    assert late.verdict == "unknown"
    assert begun == []


def test_a_noisier_recording_gives_wider_intervals() -> None:
    widths = []
    for noise in (0.3e-6, 30e-6):
        pair = [recording(Hidden(law=offset), seed=seed, noise=noise) for seed in (1, 2)]
        found = diagnose(question(pair[0], pair[1]))
        assert [effect.effect for effect in found.effects] == ["ForceOffset"]
        (interval,) = found.effects[0].parameters.values()
        assert interval.low < interval.value < interval.high
        assert interval.value == pytest.approx(6.0, rel=0.02)
        widths.append(interval.high - interval.low)
    assert widths[1] > 3.0 * widths[0]


def test_an_answer_is_the_same_twice() -> None:
    again = diagnose(question(recording(Hidden(dry=8.0), seed=1), recording(Hidden(dry=8.0), seed=2)))
    first, second = as_json(diagnosis(Hidden(dry=8.0))), as_json(again)
    for told in (first, second):
        told.pop("wall_time_s")
    assert first == second


@pytest.mark.parametrize("hidden", [Hidden(), Hidden(dry=8.0), pytest.param(Hidden(law=outside), marks=pytest.mark.slow)])
def test_every_number_of_the_answer_can_be_written(hidden: Hidden) -> None:
    assert all(math.isfinite(value) for value in numbers(as_json(diagnosis(hidden))))


def numbers(told: Any) -> list[float]:
    if isinstance(told, dict):
        return [number for value in told.values() for number in numbers(value)]
    if isinstance(told, list):
        return [number for value in told for number in numbers(value)]
    return [told] if isinstance(told, float) else []


def test_commands_between_samples_far_apart_are_out_of_reach_and_not_wrong() -> None:
    slow = Finding("coarse", "", "one sample every 100 ms, and x_controller decides every 1 ms", "")
    (found,) = too_slow_for_commands([slow], ["x_controller.voltage"])
    assert str(found).startswith("One sample every 100 ms, and x_controller decides every 1 ms: samples so far apart cannot show")
    assert too_slow_for_commands([replace(slow, kind="interpolated")], ["x_controller.voltage"]) == ()


@pytest.mark.parametrize(("after", "adequate"), [(5e-4, True), (6e-4, True), (1.5e-3, False)])
def test_effects_that_lead_the_simulation_away_are_not_adequate(after: float, adequate: bool) -> None:
    """A weight that was named for a spring of the third power: each part is explained, and the whole ends three times as far off."""
    question = SimpleNamespace(method=STANDARD, validation=None, ends=Deadline())
    prepared: Any = SimpleNamespace(question=question, experiment=None, added=(), validation_name="b.csv", findings=(), turned=())
    found: Any = SimpleNamespace(complete=True)
    led = replace(NAMED, fit={POSITION: ChannelFit("m", 1e-6, 5e-4, after, "b.csv")})
    assert _completed(led, prepared, found).rest.adequate == adequate
