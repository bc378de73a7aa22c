"""What to do after a diagnosis, in one line."""

from __future__ import annotations

from collections.abc import Sequence

from lathesim.diagnosis.records.diagnosis import Diagnosis, listed


def next_step(diagnosis: Diagnosis, off: Sequence[str], worse: Sequence[str]) -> str:
    """Return the next step; ``off`` are the channels that stay clearly further off than the recording resolves, ``worse`` those that the
    answer predicts worse than the lesson alone."""
    if not diagnosis.complete:
        return "Give the search more time (--at-most), and ask again."
    if diagnosis.verdict == "recording_fault":
        return "Mend the recording, or what the lesson says of its columns, and diagnose again."
    if diagnosis.names:
        return _after_names(diagnosis, worse)
    if diagnosis.verdict == "unknown":
        return _after_unknown(diagnosis)
    if worse and diagnosis.verdict == "parameters_only":
        return f"Do not use the fitted values: they predict {listed(list(worse))} worse. {_record_more(diagnosis)}"
    if off:
        return f"Look in the report when {off[0]} is off most. Other speeds, places or a further sensor may show the cause."
    if diagnosis.verdict == "parameters_only":
        return "Measure these values, and correct them in the lesson."
    return "Nothing: the lesson may be used as it is, for motions like these."


def _after_names(diagnosis: Diagnosis, worse: Sequence[str]) -> str:
    if worse:
        return f"Do not rely on it yet: it predicts {listed(list(worse))} worse. {_record_more(diagnosis)}"
    steps = []
    experiment = next((effect.separating_experiment for effect in diagnosis.effects if effect.separating_experiment), "")
    if experiment:
        tied = any(effect.tied_with for effect in diagnosis.effects)
        steps.append(f"{'Tell them apart' if tied else 'Determine its size'}. {experiment}")
    elif diagnosis.insert:
        steps.append("Paste the lines below into the lesson, or run the _explained.yaml beside the report, which holds them.")
    if not diagnosis.adequate and not experiment:
        steps.append("Look in the report at what is left.")
    return " ".join(steps)


def _record_more(diagnosis: Diagnosis) -> str:
    if diagnosis.recording in diagnosis.validation:
        return "One recording cannot well judge itself: record a second one, and give it with --validate."
    return "Record more motion, at other speeds and places."


def _after_unknown(diagnosis: Diagnosis) -> str:
    if diagnosis.discovered:
        return "Try the formula below: the plug-in discovered_term.py beside the report holds it as an effect."
    at = f" at {diagnosis.location.components[0]}" if diagnosis.location.components else ""
    return f"Look in the report when and with which motion it is largest, and measure the force or position{at} there."
