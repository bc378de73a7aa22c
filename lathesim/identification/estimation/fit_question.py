"""From a lesson, a recording and the names of what is free to a fit that can be made."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from lathesim.errors import LessonError
from lathesim.identification.estimation.multistart import free_parameters
from lathesim.identification.estimation.replay_misfit import Misfit, replay_misfit
from lathesim.identification.records import Free
from lathesim.identification.replay.controller_rate import decisions_for_each
from lathesim.identification.replay.loading import at_period, coarser_than_decided, read_mapped, refuse_endless, refuse_still
from lathesim.lessons.lesson import Lesson
from lathesim.lessons.recording_mapping import mapping_of
from lathesim.lessons.simulate import prepare
from lathesim.plugins import Registry
from lathesim.recordings.raw_table import MOST_COMPARED, Finding
from lathesim.recordings.recording_faults import recording_faults


@dataclass(frozen=True, eq=False)
class FitQuestion:
    """What is to be fitted to what, and what was found in the recording on the way."""

    misfit: Misfit
    free: tuple[Free, ...]
    findings: tuple[Finding, ...]


def ask_fit(
    lesson: Lesson,
    recording: Path,
    registry: Registry,
    names: Sequence[str],
    variant: str | None = None,
    overrides: Mapping[str, str | float] | None = None,
    *,
    closed: bool = False,
) -> FitQuestion:
    """Read the recording as the lesson maps it and put the machine beside it, sampled as the recording is.

    Raises :class:`LessonError` for what the lesson does not say or the machine does not have, :class:`RecordingError` for the file.
    """
    prepared = prepare(lesson, registry, variant, overrides)
    mapping = mapping_of(lesson, prepared.machinery)
    mapped = read_mapped(recording, registry, mapping, MOST_COMPARED)
    refuse_still(recording, mapped.record, mapping.targets("compare"))
    refuse_endless(recording, mapped, prepared, mapping)
    period = mapped.record.sample_period
    assembly, decisions = at_period(prepared.machinery, period), decisions_for_each(period, prepared.machinery)
    driven, compared = mapping.targets("drive"), mapping.targets("compare")
    misfit = replay_misfit(
        assembly, mapped.record, driven, compared, mapped.resolution, closed=closed, decisions=decisions, moving=mapping.moving
    )
    for name in names:
        known = name in prepared.plan.parameters or name in prepared.plan.states
        if known and name not in misfit.plan.parameters and name not in misfit.plan.states:
            raise LessonError(f"no compared channel depends on {name}.", place="--free", remedy="Compare more channels, or leave it out.")
    coarse = coarser_than_decided(period, prepared.machinery, compared)
    findings = (*mapped.findings, *recording_faults(mapped.record, mapping), *coarse)
    return FitQuestion(misfit, tuple(free_parameters(misfit.plan, names)), findings)
