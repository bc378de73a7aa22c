"""The checks of recordings, as lists of small functions: each returns a sentence, empty where nothing is wrong."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Any

from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.recording_checks.change_points import changed_midway, jumped_midway
from lathesim.diagnosis.recording_checks.clipping import clipped_reading
from lathesim.diagnosis.recording_checks.command_consistency import contradicted
from lathesim.diagnosis.recording_checks.different_machine import another_machine
from lathesim.diagnosis.recording_checks.exchanged_channels import exchanged_with, swapped
from lathesim.diagnosis.recording_checks.mistaken_unit import in_another_unit, wrong_unit
from lathesim.diagnosis.recording_checks.sample_clock import of_another_period
from lathesim.diagnosis.records.diagnosis import Diagnosis
from lathesim.diagnosis.records.search import SearchResult
from lathesim.identification.machine.roles import closes_a_loop
from lathesim.identification.replay.controller_rate import MOST
from lathesim.identification.replay.experiment import Experiment, Machine
from lathesim.recordings.finding import Finding

CHECKS_OF_RECORDINGS: tuple[Callable[..., str], ...] = (exchanged_with, of_another_period, swapped, in_another_unit)
"""Asked of an experiment at given values, before any fit."""
CHECKS_AGAINST_MODEL: tuple[Callable[..., str], ...] = (changed_midway, clipped_reading)
"""Asked of an experiment and the fit of its baseline, once a model was searched for."""
CHECKS_WITHOUT_EFFECTS: tuple[Callable[..., str], ...] = (jumped_midway,)
"""The same where no effect was accepted."""


def found_by(checks: Iterable[Callable[..., str]], cases: Sequence[tuple[Experiment, Any]], method: Method) -> tuple[str, ...]:
    """Return the sentences of some checks, each asked of every experiment with its values or its fit."""
    return tuple(sentence for check in checks for one, item in cases if (sentence := check(one, item, method=method)))


def at_odds(experiment: Experiment, values: Mapping[str, float], method: Method = STANDARD) -> tuple[str, ...]:
    """Return the sentences in which a recording contradicts itself with the machine at ``values``, as far as no other law of a controller
    would be behind that."""
    return found_by(CHECKS_OF_RECORDINGS, [(experiment, values)], method)


def against_commands(
    experiments: Iterable[Experiment], given: Mapping[str, float], laws: Mapping[str, bool], method: Method, added: Collection[str] = ()
) -> tuple[str, ...]:
    """Return the sentences in which the recorded commands do not follow from what the controllers were given, but for other ``laws`` and
    for what may be ``added`` to commands."""
    checked = [
        (
            contradicted(one, given, laws, added, method=method),
            swapped(one, given, method=method),
            in_another_unit(one, given, method=method),
        )
        for one in experiments
    ]
    return tuple(sentence for sentences in checked for sentence in sentences if sentence)


def against_model(experiments: Sequence[Experiment], found: SearchResult, method: Method, *, two_files: bool) -> tuple[str, ...]:
    """Return the first sentence in which the recordings do not fit the model that was found: another machine, or a change midway."""
    experiment, validation = experiments
    if two_files and (stranger := another_machine(found.model, experiment, validation, method=method)):
        return (stranger,)
    judged = ((experiment, found.baseline.fitted), (validation, found.baseline.validation_fit))
    checks = (*CHECKS_AGAINST_MODEL, *(() if found.model.candidates else CHECKS_WITHOUT_EFFECTS))
    return next((told for check in checks if (told := found_by((check,), judged, method)[:1])), ())


def with_a_wrong_unit(found: SearchResult, values: Mapping[str, float], method: Method, *, implausible: bool) -> tuple[str, ...]:
    """Return the sentence in which an effect that explains most is the factor of a mistaken unit.

    Beside implausible values of the lesson a factor on a reading makes up for those, and is not asked about.
    """
    credible = [] if found.far_off or implausible else found.model.candidates
    most = [candidate for candidate in credible if found.removed_by(candidate) > method.shared.larger_part]
    mistaken = wrong_unit(most, values, method=method)
    return (mistaken,) if mistaken else ()


def too_slow_for_commands(findings: Iterable[Finding], compared: Iterable[str]) -> tuple[str, ...]:
    """Return a sentence where a command cannot be followed because its controller decided more often than was recorded, and by more than is
    interpolated; empty for other recordings. Neither a fault of a channel nor one of the machine can be told from such a log."""
    slow = next((finding for finding in findings if finding.kind == "coarse"), None)
    if slow is None:
        return ()
    return (
        f"{slow.fact[:1].upper()}{slow.fact[1:]}: samples so far apart cannot show what happens within the loop between two of them, "
        f"and {', '.join(compared)} cannot be computed without that. Record each decision, or every k-th up to k = {MOST}.",
    )


def of_a_slow_log(findings: Iterable[Finding], machine: Machine, answer: Diagnosis) -> tuple[str, ...]:
    """Return a sentence where what nothing explains sits in a controller that decided more often than was recorded; empty where it does
    not."""
    slow = next((finding for finding in findings if finding.kind == "coarse"), None)
    suspect = next(iter(answer.location.components), "")
    part = next((part for part in machine.assembly.parts if part.name == suspect), None)
    if answer.verdict != "unknown" or slow is None or part is None or not closes_a_loop(part):
        return ()
    fact = f"{slow.fact[:1].upper()}{slow.fact[1:]}"
    return (f"{fact}: what nothing explains of {suspect} may be what happened between two samples. Record each decision, or every k-th.",)
