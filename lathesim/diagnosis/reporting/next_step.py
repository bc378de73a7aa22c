"""What to do after a diagnosis, in one line."""

from __future__ import annotations

from collections.abc import Sequence

from lathesim.diagnosis.records.diagnosis import Diagnosis, listed


def next_step(diagnosis: Diagnosis, worse: Sequence[str]) -> str:
    """Return the next step; ``worse`` are the channels that the answer predicts worse than the lesson alone."""
    if not diagnosis.complete:
        return "Give the search more time (--at-most), and ask again."
    if diagnosis.verdict == "recording_fault":
        return "Mend the recording, or what the lesson says of its columns, and diagnose again."
    if worse and diagnosis.verdict != "unknown":
        return f"Do not rely on it yet: it predicts {listed(list(worse))} worse. {_record_more(diagnosis)}"
    if diagnosis.names:
        return _after_names(diagnosis)
    if diagnosis.verdict == "unknown":
        return _after_unknown(diagnosis)
    if diagnosis.verdict == "parameters_only":
        return "Measure these values, and correct them in the lesson."
    return "Nothing: the lesson may be used as it is, for motions like these."


def _after_names(diagnosis: Diagnosis) -> str:
    if diagnosis.is_one_stroke:
        return "Record the stroke a second time, and give that recording with --validate."
    ordered = sorted(diagnosis.effects, key=lambda effect: effect.may_be_zero)
    open_ = next((effect for effect in ordered if effect.separating_experiment), None)
    if open_ is not None and open_.tied_with:
        return f"To tell {open_.effect} from {listed(list(open_.tied_with))}: {open_.separating_experiment}"
    if open_ is not None:
        return f"To determine {open_.effect}: {open_.separating_experiment}"
    paste = "Paste the lines below into the lesson, or run the _explained.yaml beside the report, which holds them."
    return paste if diagnosis.adequate else f"{paste} The report shows when most is left."


def _record_more(diagnosis: Diagnosis) -> str:
    if diagnosis.judges_itself:
        return "One recording cannot well judge itself: record a second one, and give it with --validate."
    return "Record more motion, at other speeds and places."


def _after_unknown(diagnosis: Diagnosis) -> str:
    if diagnosis.discovered:
        return "Try the formula below: the plug-in discovered_term.py beside the report holds it as an effect."
    at = f" at {diagnosis.location.components[0]}" if diagnosis.location.components else ""
    return f"Look in the report when and with which motion it is largest, and measure the force or position{at} there."
