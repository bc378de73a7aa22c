"""The tests of what a model leaves: each a small function, all asked in the order of :data:`RESIDUAL_TESTS`."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from lathesim.analysis.share_of_acting import still_missing_at
from lathesim.diagnosis.method import Limit, Method
from lathesim.diagnosis.records.diagnosis import MissingSignal, VariableBar, with_unit
from lathesim.diagnosis.records.residual_test import Condition, Criterion, ResidualTest, all_of, held
from lathesim.diagnosis.selection.laboratory import IMPLAUSIBLE
from lathesim.diagnosis.verdict.judged import Judged, Unsized, ValueOff, counted, of_forces, ratio, relative_error, structured_share
from lathesim.diagnosis.verdict.replicate_check import BAND, COHERENCE, DEPENDENCE, SENSORS
from lathesim.identification.estimation.estimates import CONFIDENCE

OTHER_FORM = "form of what is left"
CALIBRATED = (
    "narrow band",
    "coherent with the command",
    "force follows the motion",
    "redundant sensors agree",
)
"""Tests that are held against replicates where they fail."""
Test = Callable[[Judged, Method], Iterator[ResidualTest]]


def force_follows_motion(judged: Judged, method: Method) -> Iterator[ResidualTest]:
    """The force that is missing depends on what the machine was doing.

    More than half of all that acts is missing where the noise of a sensor is made into a force: that is no reason while the closed-loop
    simulation is at the noise floor there.
    """
    for channel, missing, bar in judged.off():
        explained, fit = bar.after if bar else 0.0, judged.fit[channel]
        share = structured_share(explained, missing.share_after)
        left = still_missing_at(missing.at, missing.share_after, digits=1)
        follows = (held(share, ">=", method.verdict.within_laws, share * relative_error(missing.after)),)
        no_noise = (
            held(missing.share_after, "<=", method.shared.larger_part, missing.share_after * relative_error(missing.after)),
            held(ratio(fit.after, fit.floor), ">=", method.shared.alike),
        )
        yield ResidualTest(
            "force follows the motion",
            channel,
            Criterion((follows, no_noise, *_no_chance(judged, DEPENDENCE, channel, method))),
            f"{left}, and goes with {bar.variable}" if bar else left,
        )


def implausible_values(judged: Judged, method: Method) -> Iterator[ResidualTest]:
    """A value of the lesson is further off than the lesson holds possible."""
    for item in judged.values:
        value = with_unit(f"{item.value.refit_with:.4g}", item.value.unit)
        yield ResidualTest(
            "plausible value", item.name, all_of(_implausible(item)),
            f"it needs {item.name} at {value}, further off than the lesson holds possible",
        )  # fmt: skip


def narrow_bands(judged: Judged, method: Method) -> Iterator[ResidualTest]:
    """A channel swings in a narrow band of frequencies, more than the fitted model does with its converters and noise."""
    for band in judged.bands:
        if band.channel not in judged.by_chance:
            yield ResidualTest(
                "narrow band", band.channel, _beyond_replicates(judged, BAND, band.octave, band.share, method.location.band_share, method),
                f"{band.channel} still swings {band.place}",
            )  # fmt: skip


def another_form(judged: Judged, method: Method) -> Iterator[ResidualTest]:
    """Effects leave so much that follows the motion, where they took something away, that they are of another form than what is there.

    Only the channel of which most is left is asked, and what stepping leaves of a force is none.
    """
    if not judged.effects:
        return
    found = [(share, item) for item in judged.missing() if (share := _left_of_form(*item[1:], method)) is not None]
    if found:
        share, (channel, missing, bar) = max(found, key=lambda pair: pair[0])
        yield ResidualTest(
            OTHER_FORM, channel, all_of(held(share, ">=", method.verdict.within_form, share * relative_error(missing.after))),
            f"{share:.0%} of what was missing at {missing.at} is left and goes with {bar.variable if bar else ''}",
        )  # fmt: skip


def controller_laws(judged: Judged, method: Method) -> Iterator[ResidualTest]:
    """A controller has another law than the lesson's."""
    for law in judged.laws:
        yield ResidualTest("controller law", law.channel, all_of(held(law.share, ">", method.recording_checks.worth_of_command)), str(law))


def removes_nothing(judged: Judged, method: Method) -> Iterator[ResidualTest]:
    """Effects take away nothing on the validation recording."""
    if judged.effects:
        nothing = Condition(judged.removed, "<=", 0.0, "", "share of error", judged.removed_error)
        sentence = "it takes away nothing of what is missing on the recording that judges"
        yield ResidualTest("something removed", "", all_of(nothing), sentence, "discredits")


def removes_too_little(judged: Judged, method: Method) -> Iterator[ResidualTest]:
    """Effects explain less than half of the error on the validation recording, and leave more than half of what is missing everywhere.

    Something of their shape may be there, and most of it is something else. Not so a line of each turn beside a load that wanders far: it
    is all that followed the motion, and what is left follows nothing. Nor waves that were much of it.
    """
    if judged.effects and judged.removed > 0.0:
        verdict, signals = method.verdict, judged.evidence.missing
        before, after = (max((getattr(bar, side) for bar in judged.evidence.bars), default=0.0) for side in ("before", "after"))
        more = (
            held(after, ">", 0.0),
            *(held(item.share_after, ">=", verdict.within_laws, item.share_after * relative_error(item.after)) for item in signals),
            *(() if judged.waves else (held(before, "<=", method.shared.dependence),)),
        )
        clauses = (
            (held(judged.removed, "<", method.shared.larger_part, judged.removed_error),),
            *((_left(item, item.share_after, method.shared.larger_part),) for item in signals),
            more,
        )
        sentence = f"it takes away only {judged.removed:.0%} of the error on the recording that judges"
        yield ResidualTest("half removed", "", Criterion(clauses), sentence)


def value_leaves_much(judged: Judged, method: Method) -> Iterator[ResidualTest]:
    """A value that the lesson holds impossible does not explain what it is believed for."""
    if judged.value_is_answer and not judged.effects:
        yield ResidualTest("most removed", "", _leaves_much(judged, method), _no_more_than(judged))


def value_leaves_form(judged: Judged, method: Method) -> Iterator[ResidualTest]:
    """A value explains most of what an impossible machine is off by, and leaves as much as an effect of another form, far over the floor.

    A drag that grows with the square of the speed is no larger viscosity.
    """
    for channel, missing, bar in judged.missing():
        if not judged.value_is_answer or judged.effects or bar is None:
            continue
        fit, share = judged.fit[channel], ratio(counted(missing), missing.share_before)
        yield ResidualTest(
            "form of what a value leaves",
            channel,
            all_of(
                held(share, ">", method.verdict.leaves_much, share * relative_error(missing.after)),
                held(ratio(fit.after, fit.floor), ">", method.verdict.load_shows),
                held(bar.after, ">", method.shared.larger_part),
                held(missing.share_after, ">=", method.location.integration_error),
            ),
            f"{share:.0%} of what was missing at {missing.at} is left, and goes with {bar.variable}",
        )


def answers_to_command(judged: Judged, method: Method) -> Iterator[ResidualTest]:
    """What no effect explains answers to a driven input."""
    for one in judged.coherent if _nothing_found(judged) else ():
        criterion = _beyond_replicates(judged, COHERENCE, one.channel, one.share, method.shared.dependence, method)
        yield ResidualTest("coherent with the command", one.channel, criterion, str(one))


def force_is_missing(judged: Judged, method: Method) -> Iterator[ResidualTest]:
    """So much is missing that something is, though it follows nothing that the machine was doing.

    What is as large whether little acts or much is a load that nobody measured: physics of the machine grows with what acts.
    """
    for channel, missing, _ in judged.off() if _nothing_found(judged) else ():
        fit = judged.fit[channel]
        conditions = [
            held(missing.share_after, ">", method.verdict.small_load, missing.share_after * relative_error(missing.after)),
            held(ratio(fit.after, fit.floor), ">", method.verdict.load_shows),
        ]
        if of_forces(missing):
            conditions.append(held(_at_small_over_large_load(missing), "<=", method.selection.rival))
        sentence = still_missing_at(missing.at, missing.share_after, digits=0)
        yield ResidualTest("force is missing", channel, all_of(*conditions), sentence)


def sensors_apart(judged: Judged, method: Method) -> Iterator[ResidualTest]:
    """Two sensors of one motion differ by far more than both can resolve: no load does that."""
    for pair in judged.sensors if _nothing_found(judged) else ():
        sentence = f"{pair.channels[0]} and {pair.channels[1]} differ by {pair.size} (root mean square)"
        far = (held(pair.resolutions, ">", method.verdict.sensors_apart),)
        criterion = Criterion((far, *_no_chance(judged, SENSORS, pair.channels[0], method)))
        yield ResidualTest("redundant sensors agree", pair.channels[0], criterion, sentence)


def every_channel_worse(judged: Judged, method: Method) -> Iterator[ResidualTest]:
    """The closed-loop simulation is further off with the effects in every channel.

    Without anything that feeds back a simulation drifts with whatever nobody modelled, and is not asked.
    """
    if judged.effects and judged.feeds_back and judged.fit:
        worse = [held(ratio(item.after, item.before), ">", method.shared.hardly_more) for item in judged.fit.values()]
        sentence = "with it the lesson's own simulation is further off in every channel"
        yield ResidualTest("closed loop not worse", "", all_of(*worse), sentence, "discredits")


def waves_draw_anything(judged: Judged, method: Method) -> Iterator[ResidualTest]:
    """Waves are there so few times that they may draw anything that goes with the place."""
    if judged.drawn:
        yield ResidualTest("period covered", "", Criterion(), judged.drawn, "discredits")


def impossible_machine(judged: Judged, method: Method) -> Iterator[ResidualTest]:
    """A machine that cannot be is no explanation: much is left as well, or nothing beside it is sure to be there."""
    off = [_implausible(item) for item in judged.values]
    if off:
        surest = max(judged.sizes, key=lambda item: item.half_intervals, default=None)
        nothing_sure = [_undetermined(surest, method)] if surest else []
        little = held(judged.removed, "<", method.shared.nearly_all, judged.removed_error)
        sentence = "it needs a machine that the lesson holds impossible, and leaves much"
        yield ResidualTest("possible machine", "", Criterion((tuple(off), (little, *nothing_sure))), sentence, "discredits")


def effects_leave_much(judged: Judged, method: Method) -> Iterator[ResidualTest]:
    """Effects do not explain most of the error and leave more of what is missing everywhere than an effect in its own form does.

    They are right as far as they go, perhaps, and not all there is.
    """
    if judged.effects:
        yield ResidualTest("most removed", "", _leaves_much(judged, method), _no_more_than(judged), "weakens")


def sizes_determined(judged: Judged, method: Method) -> Iterator[ResidualTest]:
    """The recordings do not determine how large an effect is."""
    for item in judged.sizes:
        yield ResidualTest(
            "size determined", item.at, all_of(_undetermined(item, method)),
            f"the recordings do not determine how large {item.name} at {item.at} is", "weakens",
        )  # fmt: skip


RESIDUAL_TESTS: tuple[Test, ...] = (
    force_follows_motion, implausible_values, narrow_bands, another_form, controller_laws, removes_nothing, removes_too_little,
    value_leaves_much, value_leaves_form, answers_to_command, force_is_missing, sensors_apart,
    every_channel_worse, waves_draw_anything, impossible_machine, sizes_determined,
)  # fmt: skip
"""In the order in which their reasons are told."""
TESTS_OF_THE_REST: tuple[Test, ...] = (effects_leave_much,)
"""Asked where all of these speak for the model."""


def residual_tests(judged: Judged, method: Method) -> tuple[ResidualTest, ...]:
    """Return the tests of what a model leaves."""
    tests = tuple(item for test in RESIDUAL_TESTS for item in test(judged, method))
    if any(not item.passed and item.severity != "weakens" for item in tests):
        return tests
    return (*(item for test in TESTS_OF_THE_REST for item in test(judged, method)), *tests)


def not_adequate(tests: Sequence[ResidualTest]) -> str:
    """Return why a model is not adequate in one sentence, what weakens it last; empty where it is."""
    failed = sorted((item for item in tests if not item.passed), key=lambda item: item.severity == "weakens")
    reasons = dict.fromkeys(item.sentence for item in failed)
    return f"The model is not adequate: {'; '.join(reasons)}." if reasons else ""


def _nothing_found(judged: Judged) -> bool:
    return not (judged.effects or judged.value_is_answer)


def _implausible(item: ValueOff) -> Condition:
    return Condition(item.deviations, ">", IMPLAUSIBLE, "", "declared standard deviations", item.error)


def _undetermined(item: Unsized, method: Method) -> Condition:
    """Return the condition under which an interval comes near the neutral value."""
    near = method.verdict.undetermined_size
    return Condition(item.half_intervals, "<", 1.0 / (1.0 - near), "undetermined_size", "half intervals", 1.0 / CONFIDENCE)


def _left(missing: MissingSignal, share: float, limit: Limit) -> Condition:
    """Return the condition under which more than a share of what was missing is left."""
    left = ratio(share, missing.share_before)
    return held(left, ">=", limit, left * relative_error(missing.after) if math.isfinite(left) else 0.0)


def _leaves_much(judged: Judged, method: Method) -> Criterion:
    """Return the conditions under which most of the error is not explained, and more is missing than an own form leaves, everywhere."""
    little = held(judged.removed, "<", method.shared.nearly_all, judged.removed_error)
    return all_of(little, *(_left(item, counted(item), method.verdict.leaves_much) for item in judged.evidence.missing))


def _no_more_than(judged: Judged) -> str:
    return f"it takes away no more than {judged.removed:.0%} of the error on the recording that judges"


def _beyond_replicates(judged: Judged, kind: str, channel: str, share: float, least: Limit, method: Method) -> Criterion:
    """Return the conditions under which a doubt stands: no replicate of the fitted model shows as much. Where none was simulated the
    share decides, or, below its limit, how far a band stands out."""
    probability = judged.probabilities.get((kind, channel))
    if probability is None:
        return all_of(held(share, ">", least)) if share > least else Criterion()
    error = math.sqrt(probability * (1.0 - probability) / (1 + judged.replicates))
    return all_of(held(probability, "<=", method.verdict.false_alarms, error))


def _no_chance(judged: Judged, kind: str, channel: str, method: Method) -> Iterator[tuple[Condition, ...]]:
    """Return the clause by which no replicate of the fitted model shows as much; none where none was simulated."""
    if (probability := judged.probabilities.get((kind, channel))) is not None:
        error = math.sqrt(probability * (1.0 - probability) / (1 + judged.replicates))
        yield (held(probability, "<=", method.verdict.false_alarms, error),)


def _left_of_form(missing: MissingSignal, bar: VariableBar | None, method: Method) -> float | None:
    """Return the share of what was missing that is left and follows the motion; nothing where effects took nothing away, nothing follows,
    or no more is left than stepping leaves of a force."""
    if bar is None or not bar.after > 0.0:
        return None
    before, after = (float(np.sqrt(np.mean(np.square(values)))) for values in (missing.before, missing.after))
    follows = math.sqrt(bar.after)
    stepping = of_forces(missing) and missing.share_after * follows < method.location.integration_error
    return after / before * follows if 0.0 < after < method.selection.almost_all * before and not stepping else None


def _at_small_over_large_load(missing: MissingSignal) -> float:
    """Return how much is missing in the third of the samples in which least acts, beside that in which most does, the smaller over the
    larger; nothing where all act alike."""
    least, most = np.quantile(np.abs(missing.total), (1.0 / 3.0, 2.0 / 3.0))
    thirds = (np.abs(missing.total) <= least, np.abs(missing.total) > most)
    little, much = (float(np.sqrt(np.mean(np.square(missing.after[third])))) if third.any() else 0.0 for third in thirds)
    return min(little, much) / max(little, much) if most > least and max(little, much) > 0.0 else 0.0
