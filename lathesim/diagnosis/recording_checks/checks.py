"""The checks of recordings, of the baseline and of the model: three lists of small functions, and one :class:`Finding` for what they find.

A check returns a sentence, empty where nothing is wrong. Its name in the list is the ``kind`` of the finding.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import partial
from typing import Any

from lathesim.diagnosis.method import Method
from lathesim.diagnosis.recording_checks.another_place import of_another_place
from lathesim.diagnosis.recording_checks.change_points import changed_midway, jumped_midway
from lathesim.diagnosis.recording_checks.command_consistency import contradicted, exchanged_with, swapped
from lathesim.diagnosis.recording_checks.different_machine import another_machine
from lathesim.diagnosis.recording_checks.mapped_elsewhere import mapped_elsewhere
from lathesim.diagnosis.recording_checks.sample_clock import of_another_period
from lathesim.diagnosis.recording_checks.wrong_readings import clipped_reading, in_another_unit, wrong_unit
from lathesim.diagnosis.records.diagnosis import Diagnosis
from lathesim.diagnosis.records.found import Found
from lathesim.identification.replay.controller_rate import MOST
from lathesim.identification.replay.experiment import Experiment, RecordedMachine
from lathesim.identification.roles import closes_a_loop
from lathesim.recordings.raw_table import Finding

Check = Callable[..., str]
Checks = Mapping[str, Check]
CHECKS_OF_MAPPING: Checks = {"exchanged": exchanged_with, "mapped elsewhere": mapped_elsewhere, "of another place": of_another_place}
"""Asked of an experiment with the values as given, before anything is fitted."""
CHECKS_OF_CLOCK: Checks = {"sample period": of_another_period}
"""Asked with the values of controllers that follow the commands best."""
CHECKS_OF_COLUMNS: Checks = {"swapped": swapped, "unit": in_another_unit}
"""Asked with these as well, beside what contradicts a command."""
CHECKS_OF_RECORDINGS: Checks = {"exchanged": exchanged_with, **CHECKS_OF_CLOCK, **CHECKS_OF_COLUMNS}
"""Asked of an experiment where nothing is fitted at all."""
CHECKS_OF_BASELINE: Checks = {"changed midway": changed_midway, "clipped": clipped_reading}
"""Asked of an experiment and the fit of its baseline, once a model was searched for."""
CHECKS_WITHOUT_EFFECTS: Checks = {"lost counts": jumped_midway}
"""The same where no effect was accepted."""
SLOW_LOG = "slow log"
"""The kind of a recording that is sound, and too slow to tell."""


def fault(kind: str, sentence: str) -> tuple[Finding, ...]:
    """Return a sentence as the finding that a recording is at fault; nothing where it is empty."""
    return (Finding(kind, "", sentence.removesuffix("."), "", serious=True),) if sentence else ()


def found_by(checks: Checks, cases: Sequence[tuple[Experiment, Any]], method: Method) -> tuple[Finding, ...]:
    """Return what some checks find, each asked of every experiment with its values or its fit."""
    return tuple(one for kind, check in checks.items() for case in cases for one in fault(kind, check(*case, method=method)))


def first_found(checks: Checks, cases: Sequence[tuple[Experiment, Any]], method: Method) -> tuple[Finding, ...]:
    """Return what the first check finds that finds anything."""
    return next((found for kind, check in checks.items() if (found := found_by({kind: check}, cases, method))), ())


def against_commands(
    experiments: Iterable[Experiment], given: Mapping[str, float], laws: Mapping[str, bool], method: Method, added: Collection[str] = ()
) -> tuple[Finding, ...]:
    """Return where recorded commands do not follow, but for other ``laws`` of controllers and for what may be ``added`` to commands."""
    checks: Checks = {"command": partial(contradicted, of_another_law=laws, added=added), **CHECKS_OF_COLUMNS}
    return tuple(one for experiment in experiments for one in found_by(checks, [(experiment, given)], method))


def against_model(experiments: Sequence[Experiment], found: Found, method: Method, *, two_files: bool) -> tuple[Finding, ...]:
    """Return the first finding that the recordings do not fit the model that was found: another machine, or a change midway."""
    experiment, validation = experiments
    if two_files and (stranger := fault("another machine", another_machine(found.model, experiment, validation, method=method))):
        return stranger
    judged = ((experiment, found.baseline.fitted), (validation, found.baseline.validation_fit))
    return first_found({**CHECKS_OF_BASELINE, **({} if found.model.candidates else CHECKS_WITHOUT_EFFECTS)}, judged, method)[:1]


def with_a_wrong_unit(found: Found, values: Mapping[str, float], method: Method, *, implausible: bool) -> tuple[Finding, ...]:
    """Return the finding that an effect which explains most is the factor of a mistaken unit.

    Beside implausible values of the lesson, or other effects, a factor on a reading makes up for those, and is not asked about.
    """
    credible = [] if found.far_off or implausible or len(found.model.candidates) > 1 else found.model.candidates
    most = [one for one in credible if (worth := found.worth.get(one.part)) and worth.predicted.share > method.larger_part]
    return fault("unit", wrong_unit(most, values, method=method))


def too_slow_for_commands(findings: Iterable[Finding], compared: Iterable[str]) -> tuple[Finding, ...]:
    """Return a finding where a command cannot be followed because its controller decided more often than was recorded, and by more than is
    interpolated; empty for other recordings. Neither a fault of a channel nor one of the machine can be told from such a log."""
    slow = next((finding for finding in findings if finding.kind == "coarse"), None)
    if slow is None:
        return ()
    return fault(
        SLOW_LOG,
        f"{slow.fact[:1].upper()}{slow.fact[1:]}: samples so far apart cannot show what happens within the loop between two of them, "
        f"and {', '.join(compared)} cannot be computed without that. Record each decision, or every k-th up to k = {MOST}.",
    )


def of_a_slow_log(findings: Iterable[Finding], machine: RecordedMachine, answer: Diagnosis) -> tuple[Finding, ...]:
    """Return a finding where what nothing explains sits in a controller that decided more often than was recorded."""
    slow = next((finding for finding in findings if finding.kind == "coarse"), None)
    suspect = next(iter(answer.location.components), "")
    part = machine.assembly.by_name.get(suspect)
    if answer.verdict != "unknown" or slow is None or part is None or not closes_a_loop(part):
        return ()
    fact = f"{slow.fact[:1].upper()}{slow.fact[1:]}"
    sentence = f"{fact}: what nothing explains of {suspect} may be what happened between two samples. Record each decision, or every k-th."
    return fault(SLOW_LOG, sentence)
