"""The report of a diagnosis: one self-contained HTML page that reads and prints without anything else.

Top to bottom it answers what, where, how sure, what changed, what the baseline had absorbed, and what could not be told. Everything comes
from the :class:`Diagnosis`; text is escaped, figures are SVG inside the page, and no script runs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import lathesim
from lathesim.analysis.display_unit import known_share
from lathesim.diagnosis.location import FORCES
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.diagnosis import BaselineValue, Diagnosis, MissingSignal, Verdict
from lathesim.diagnosis.records.shown import Shown
from lathesim.diagnosis.reporting.answer_tables import before_text, effect_rows
from lathesim.diagnosis.reporting.explanations import HEAD, explanation_rows, legend
from lathesim.diagnosis.reporting.number_text import NOTHING, interval_texts, percent, pretty, quantity_text, words
from lathesim.diagnosis.reporting.remarks import not_answered
from lathesim.diagnosis.reporting.summary import is_worse, needs_other_values, still_off, summary_lines
from lathesim.diagnosis.reporting.wiring_diagram import wiring_diagram
from lathesim.engine.assembly import Place
from lathesim.identification.estimation.estimates import CONFIDENCE
from lathesim.identification.roles import is_recorded_signal

_WORDS = {
    "no_mismatch": "Nothing is missing",
    "parameters_only": "Other values",
    "named": "Named",
    "tied": "Tied",
    "unknown": "Unknown",
    "recording_fault": "Fault of the recording",
}
_IN_PART: dict[str, str] = {"no_mismatch": "Explained in part", "parameters_only": "Other values, in part"}
"""The words of the verdicts that find no physics missing, where a channel stays off."""


def report_html(diagnosis: Diagnosis, method: Method = STANDARD) -> str:
    """Return the report of a diagnosis as the text of an HTML page."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    loader = FileSystemLoader(Path(__file__).parent)
    page = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    return page.get_template("report.html.j2").render(page=_page(diagnosis, method=method))


def _page(diagnosis: Diagnosis, method: Method = STANDARD) -> dict[str, Any]:
    modelled = bool(diagnosis.effects or diagnosis.rest.discovered)
    changed = modelled or needs_other_values(diagnosis, method)
    order = sorted(diagnosis.fit, key=lambda name: -_over(diagnosis.fit[name].before, diagnosis.fit[name].floor))
    # candidates and recorded signals are no parts of the machine
    wires = [pair for pair in diagnosis.evidence.wires if not any(is_recorded_signal(name) for name in pair)]
    changes = [_change(name, diagnosis) for name in order[: Shown.most_rows]]
    summary = summary_lines(diagnosis, method)
    decided, more = explanation_rows(diagnosis, 2 * Shown.most_rows)
    return {
        "verdict": diagnosis.verdict,
        **_shown_verdict(diagnosis, method),
        "headline": summary[0].partition(". ")[::2],
        "summary": [pretty(line).partition(": ")[::2] for line in summary[1:]],
        "before": before_text(diagnosis),
        "lesson": diagnosis.question.lesson,
        **_recordings(diagnosis),
        "findings": list(diagnosis.question.findings),
        "effects": [(name, words(at), size, probability) for name, at, size, probability in effect_rows(diagnosis)],
        "docs": [(effect.effect, effect.doc) for effect in diagnosis.effects if effect.doc],
        "discovered": diagnosis.rest.discovered,
        "located": f"seen in {', '.join(diagnosis.location.channels[:3])}" if diagnosis.location.channels else "",
        "diagram": wiring_diagram(wires, _suspects(diagnosis)),
        "suspects": _suspects(diagnosis),
        "strip": _strip(diagnosis),
        "changed": changed,
        "modelled": modelled,
        "changes": changes,
        "shares": [
            {"at": item.at, "of": "of what acts there" if item.unit in FORCES else "of the signal there",
             "before": percent(known_share(item.share_before)), "after": percent(known_share(item.share_after)),
             "removed": _removed(item.share_before, item.share_after)}
            for item in _missing(diagnosis) if changed
        ],
        "drawings": _drawings(diagnosis, order),
        "baseline": [_baseline(name, item, method) for name, item in diagnosis.baseline.items()],
        "left": list(map(pretty, diagnosis.rest.left)),
        "not_told": [*diagnosis.rest.not_told, *not_answered(diagnosis)],
        "insert": insert_lines(diagnosis.lines.insert, diagnosis.lines.side),
        "version": lathesim.__version__,
        "wall_time": f"{diagnosis.search.wall_time:.0f} s" if diagnosis.search.wall_time >= 1.0 else "",
        "decided": decided, "decided_head": HEAD, "decided_legend": " ".join([*more, *legend(method)]), "rule": diagnosis.search.rule,
    }  # fmt: skip


def _recordings(diagnosis: Diagnosis) -> dict[str, str]:
    """Return which recording was fitted, which one judged, and which one the errors are of."""
    if diagnosis.question.together:
        both = f"{diagnosis.question.recording} and {diagnosis.question.validation}"
        return {"recording": both, "held_out": "", "judged": f"on {both}"}
    judge = diagnosis.question.validation
    return {
        "recording": diagnosis.question.recording,
        "held_out": judge if judge != diagnosis.question.recording else "",
        "judged": f"on {judge}" if judge else "",
    }


def _shown_verdict(diagnosis: Diagnosis, method: Method) -> dict[str, str]:
    """Return the verdict in words, and the one in whose colours the page is."""
    if diagnosis.verdict in _IN_PART and still_off(diagnosis, method):
        return {"look": "unknown", "verdict_word": _IN_PART[diagnosis.verdict]}
    look: Verdict = "parameters_only" if needs_other_values(diagnosis, method) else diagnosis.verdict
    return {"look": look, "verdict_word": _WORDS[look]}


def insert_lines(entries: Sequence[Mapping[str, str]], side: Mapping[str, str]) -> str:
    """Return the ``insert:`` lines of a lesson, as they are pasted, and on which ``side`` of a spring its sensors sit."""
    if not entries:
        return ""
    lines = ["  - {" + ", ".join(f"{key}: {value}" for key, value in entry.items()) + "}" for entry in entries]
    sides = ["side: {" + ", ".join(f"{sensor}: {where}" for sensor, where in side.items()) + "}"] if side else []
    return "\n".join(["insert:", *lines, *sides])


def _over(size: float, floor: float) -> float:
    return size / floor if floor > 0.0 and math.isfinite(size) else 0.0


def _suspects(diagnosis: Diagnosis) -> dict[str, str]:
    """Return part -> ``first`` or ``other`` for the parts that are marked in the wiring."""
    hosts = [Place.of(effect.at).part for effect in diagnosis.effects]
    if diagnosis.verdict in ("no_mismatch", "parameters_only"):
        return {}
    located = list(diagnosis.location.components)
    if diagnosis.verdict == "recording_fault" and not located:
        located = [Place.of(channel).part for channel in diagnosis.location.channels]
    first = (hosts if diagnosis.names else []) or located[:1]
    return {**dict.fromkeys(located, "other"), **dict.fromkeys(first, "first")}


def _strip(diagnosis: Diagnosis) -> dict[str, Any] | None:
    """Return the time strip: where its marks and ticks stand [px]."""
    windows = diagnosis.location.windows
    if not windows:
        return None
    drawn = [item.time for item in diagnosis.evidence.traces] + [item.time for item in diagnosis.evidence.missing]
    begin = min([0.0, *[low for low, _ in windows]])
    end = max([high for _, high in windows] + [float(time[-1]) for time in drawn if len(time)])
    scale = 640.0 / max(end - begin, 1e-9)

    def at(time: float) -> float:
        return round(40.0 + (time - begin) * scale, 1)

    marks = [(at(low), round(max(1.5, (high - low) * scale), 1)) for low, high in windows]
    return {"windows": marks, "ticks": [(at(time), text) for time, text in _ticks(begin, end)]}


def _ticks(begin: float, end: float) -> list[tuple[float, str]]:
    rough = max(end - begin, 1e-9) / 8.0
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(power * factor for factor in (1.0, 2.0, 5.0, 10.0) if power * factor >= rough)
    first = math.ceil(begin / step - 1e-9)
    places = [step * (first + count) for count in range(math.floor(end / step + 1e-9) - first + 1)]
    return [(place, f"{place:.10g}" + (" s" if position == len(places) - 1 else "")) for position, place in enumerate(places)]


def _change(name: str, diagnosis: Diagnosis) -> dict[str, Any]:
    item = diagnosis.fit[name]
    return {
        "channel": words(name),
        "floor": quantity_text(item.floor, item.unit, 3),
        "before": quantity_text(item.before, item.unit, 3),
        "after": quantity_text(item.after, item.unit, 3),
        "worse": is_worse(diagnosis, name),
        "removed": _removed(item.before, item.after),
    }


def _removed(before: float, after: float) -> str:
    """Return the share of the mean square that went away."""
    if not (before > 0.0 and math.isfinite(after)):
        return NOTHING
    return percent(1.0 - (after / before) ** 2) if after <= before else "none"


def _missing(diagnosis: Diagnosis) -> list[MissingSignal]:
    """Return the missing force (or signal) to be shown: the one that is largest beside what acts there."""
    known = [item for item in diagnosis.evidence.missing if len(item.time) > 1 and np.isfinite(item.before).any()]
    return sorted(known, key=lambda item: -item.share_before if math.isfinite(item.share_before) else 0.0)[:1]


def _drawings(diagnosis: Diagnosis, order: Sequence[str]) -> list[Any]:
    """Return the two figures of the page: the worst channel and what is missing, or two channels where no force is."""
    from markupsafe import Markup

    from lathesim.diagnosis.reporting.figures import HALF, WHOLE, missing_svg, trace_svg

    evidence, windows = diagnosis.evidence, diagnosis.location.windows
    missing = _missing(diagnosis)
    rank = {name: place for place, name in enumerate(order)}
    traces = sorted(evidence.traces, key=lambda item: rank.get(item.channel, len(rank)))[: Shown.most_drawings - len(missing)]
    width = HALF if len(traces) + len(missing) > 1 else WHOLE
    drawn = []
    for place, trace in enumerate(traces):
        floor = diagnosis.fit[trace.channel].floor if trace.channel in diagnosis.fit else 0.0
        drawn.append(trace_svg(trace, floor, windows, f"trace{place}", width))
    drawn += [missing_svg(item, windows, f"missing{place}", width) for place, item in enumerate(missing)]
    return [Markup(text) for text in drawn]


def _baseline(name: str, item: BaselineValue, method: Method = STANDARD) -> dict[str, Any]:
    """Return a row of the table of refitted values, with the share by which the value fitted last differs from the lesson's."""
    change = item.refit_with - item.given
    value, interval = interval_texts(item.refit_with, item.low, item.high, item.unit, item.ends)
    deviation = 0.5 * (item.high - item.low) / CONFIDENCE
    share = change / abs(item.given) if item.given else math.nan
    return {
        "name": words(name),
        "given": quantity_text(item.given, item.unit),
        "without": quantity_text(item.refit_without, item.unit),
        "with_it": value,
        "interval": interval,
        "off": f"{'+' if share > 0.0 else ''}{percent(share)}" if math.isfinite(share) else NOTHING,
        "moved": math.isfinite(deviation) and abs(change) > method.errors * deviation > 0.0,
    }
