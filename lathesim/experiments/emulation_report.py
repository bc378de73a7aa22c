"""An emulation written down: the lesson that runs, the report for people, the JSON for programs."""

from __future__ import annotations

import html
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.analysis.display_unit import text_table
from lathesim.experiments.emulation import Emulation
from lathesim.experiments.free_values import FreeValue
from lathesim.json_text import written_json
from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.units import in_unit
from lathesim.whole_file import make_folder, write_text

_TOO_LARGE = 10
"""Metres from which a deviation is no length of a machine."""
_LOOSEST = 10.0
"""Times its value that an interval is wide at most, to be shown."""
SCHEMA = "lathesim-emulation/1"


def lesson_text(found: Emulation, folder: Path) -> str:
    """Return the lesson with the learnt values, for a file in ``folder``; what the structure brought is uncertain as it was before."""
    values = {item.name: f"{value:.10g} {item.unit}".removesuffix(" 1") for item, value in found.values}
    brought = [value for change in found.changes for value in change.brings]
    uncertain = {**found.lesson.settings.uncertain, **{value.name: _before(value) for value in brought}}
    return changed_lesson(found.lesson, [], values, folder, further={"uncertain": uncertain})


def _before(value: FreeValue) -> str:
    """Return as a lesson writes it how far a value may be off before anything is recorded."""
    return in_unit(value.spread, "%", "g") if value.is_ratio else f"{value.size:g} {value.unit}".removesuffix(" 1")


def as_json(found: Emulation) -> dict[str, Any]:
    """Return the emulation for programs, everything in SI."""
    names = [item.recorded.name for item in found.followed]
    return {
        "schema": SCHEMA,
        "lesson": found.lesson.name,
        "method": found.question.method,
        "lambda": found.question.weight,
        "structure": [change.title for change in found.changes],
        "values": {item.name: {"value": value, "unit": item.unit, "given": item.given} for item, value in found.values},
        "recordings": [
            {
                "name": item.recorded.name,
                "program": str(item.recorded.prepared.case.program) if item.recorded.prepared.case.program else None,
                "rms_given_m": item.given,
                "rms_m": item.fitted,
                "waypoints": item.recorded.time.size,
            }
            for item in found.followed
        ],
        "cross_design_m": {"rows": names, "columns": names, "rms": found.cross} if found.cross else None,
        "clocks": found.clocks,
        "clock_wandering_s2_per_s": found.band.wandering,
        "noise_m": found.band.noise,
        "model_error_share": found.band.share,
        "directions": {
            "known_to_10_percent": found.telling.known,
            "information": found.telling.information,
            "singular_values": found.telling.singular,
            "hidden": [{"powers": item.powers, "sentence": item.sentence} for item in found.telling.hidden],
            "loose": dict(found.telling.loose),
        },
        "importance": [{"name": item.name, "trees": item.trees, "profile_factor": item.profile} for item in found.importance],
        "unseen": [{"name": item.name, "rms": item.rms, "largest": item.largest, "in_band": item.covered} for _, item in found.unseen],
        "runs": found.search.runs,
        "wall_time_s": found.search.wall_time,
        "stopped": found.search.stopped,
    }


def told_lines(found: Emulation) -> Iterator[str]:
    """Yield the emulation as a person reads it at a terminal."""
    if found.search.stopped:
        yield "Stopped: this is the best machine so far."
    yield from text_table(_fit_rows(found), ruled=False)
    if found.changes:
        yield f"Structure: {', '.join(change.title for change in found.changes)}."
    if found.cross:
        yield ""
        yield "rms after 2 s, row: held against, column: fitted to"
        yield from text_table(_cross_rows(found), ruled=False)
    for _, item in found.unseen:
        yield f"Not fitted: {item.name}: {_rms(item.rms)}, {in_unit(item.covered, '%', '.1f')} of the way-points in the 95 % band."
    yield ""
    yield "What these recordings tell"
    yield from (f"  {sentence}" for sentence in telling_sentences(found))
    yield f"{found.search.runs} runs, {found.search.wall_time:.1f} s."


def telling_sentences(found: Emulation) -> Iterator[str]:
    """Yield what the recordings tell, and what they cannot."""
    told = found.telling
    count, noise = len(told.names), in_unit(found.band.noise, "um", ".3g")
    yield f"{told.known} of {count} combinations of values are known to 10 % or better, with {noise} of noise."
    for item in told.hidden:
        yield item.sentence
    if told.hidden:
        number = len(told.hidden)
        text, along = ("This combination does", "it") if number == 1 else (f"These {number} combinations do", "them")
        yield f"{text} not show, whatever the program: the readings stay still when the machine is run again along {along}."
    if found.band.wandering > 0.0:
        yield f"The control's clock wanders against the program by {in_unit(found.band.wandering**0.5, 'ms', '.2g')} in the first second."
    rest = count - told.known - len(told.hidden)
    if rest > 0:
        yield f"{rest} more could show and do not, or not to 10 %: another program would tell more (lathesim experiment)."
    sure = [name for name in told.names if name not in dict(told.loose)]
    if sure:
        yield f"Known by themselves to 10 %: {', '.join(sure)}."
    elif told.known:
        yield "No value is known to 10 % by itself: what is known are combinations, such as the lag behind the reference."


def _fit_rows(found: Emulation) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = [("recording", "way-points", "as given, rms", "emulated, rms")]
    for item in found.followed:
        sizes = (in_unit(item.given, "mm", ".4f"), in_unit(item.fitted, "mm", ".4f"))
        rows.append((item.recorded.name, str(item.recorded.time.size), *sizes))
    return rows


def _cross_rows(found: Emulation) -> list[tuple[str, ...]]:
    names = [item.recorded.name for item in found.followed]
    return [("", *names), *((name, *(in_unit(size, "mm", ".4f") for size in row)) for name, row in zip(names, found.cross, strict=True))]


def _rms(sizes: dict[str, float]) -> str:
    return ", ".join(
        f"{name} {in_unit(size, 'mm', '.4f')} rms" if size < _TOO_LARGE else f"{name} {size:.4g}" for name, size in sizes.items()
    )


def report_html(found: Emulation, picture: str) -> str:
    """Return the report as one HTML page, with a picture that stands beside it."""
    parts = [
        "<!doctype html><html lang='en'><head><meta charset='utf-8'>",
        f"<title>Emulation of {html.escape(found.lesson.title)}</title>",
        "<style>body{font-family:sans-serif;max-width:60rem;margin:2rem auto;color:#22262b;line-height:1.45}"
        "td,th{padding:.2rem .8rem;text-align:left;border-bottom:1px solid #e4e7eb}img{max-width:100%}</style></head><body>",
        f"<h1>Emulation of {html.escape(found.lesson.title)}</h1>",
        f"<p>Search: {found.question.method}; weight of speeds (lambda): {found.question.weight:g}; {found.search.runs} runs.</p>",
        "<h2>How well it follows</h2>", _html_table(_fit_rows(found)),
    ]  # fmt: skip
    parts += [f"<p>{html.escape(sentence)}</p>" for sentence in found.clocks]
    if found.changes:
        parts.append(f"<p>Structure changed: {html.escape(', '.join(change.title for change in found.changes))}.</p>")
    if found.cross:
        parts += ["<h2>Cross-design table</h2><p>rms after 2 s; row: held against, column: fitted to.</p>", _html_table(_cross_rows(found))]
    if found.unseen:
        rows = [("not fitted", "deviation", "in the 95 % band")]
        rows += [(item.name, _rms(item.rms), in_unit(item.covered, "%", ".1f")) for _, item in found.unseen]
        parts += ["<h2>Programs that were not fitted</h2>", _html_table(rows)]
    parts += [f"<p><img src='{html.escape(picture)}' alt='deviations at the way-points'></p>"]
    parts += ["<h2>What these recordings tell, and what they cannot</h2><ul>"]
    parts += [f"<li>{html.escape(sentence)}</li>" for sentence in telling_sentences(found)] + ["</ul>"]
    parts += ["<h2>Values</h2>", _html_table(_value_rows(found))]
    parts += ["</body></html>"]
    return "\n".join(parts)


def _value_rows(found: Emulation) -> list[tuple[str, ...]]:
    rank = {item.name: item for item in found.importance}
    loose = dict(found.telling.loose)
    rows: list[tuple[str, ...]] = [
        ("value", "given", "emulated", "unit", "relative error", "importance (trees)", "may be off by (profile)")
    ]
    for item, value in found.values:
        error = (
            in_unit(loose[item.name], "%", ".3g")
            if item.name in loose and loose[item.name] < _LOOSEST
            else "not told"
            if item.name in loose
            else "below 10 %"
        )
        trees = f"{rank[item.name].trees:.3f}" if item.name in rank and not np.isnan(rank[item.name].trees) else "-"
        profile = rank[item.name].profile if item.name in rank else None
        rows.append((item.name, f"{item.given:.5g}", f"{value:.5g}", item.unit, error, trees, f"x {profile:.3g}" if profile else "any"))
    return rows


def _html_table(rows: Sequence[tuple[str, ...]]) -> str:
    head = "".join(f"<th>{html.escape(cell)}</th>" for cell in rows[0])
    body = "".join("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in rows[1:])
    return f"<table><tr>{head}</tr>{body}</table>"


def write_emulation(found: Emulation, folder: Path) -> dict[str, Path]:
    """Write lesson.yaml, report.html with its picture, and emulation.json into a folder; nothing stays half written."""
    from lathesim.analysis.experiment_figures import emulation_figure
    from lathesim.analysis.plots import save_figure

    lesson, report = lesson_text(found, folder), report_html(found, "emulation.png")
    told = written_json(as_json(found))
    make_folder(folder)
    panels = [(item.name, item.time, item.values, judged.deviation, judged.band) for item, judged in found.unseen]
    if not panels:
        panels = [(item.recorded.name, item.recorded.time, item.recorded.values, {}, {}) for item in found.followed]
    save_figure(emulation_figure(found.lesson.title, panels, found.telling.singular), folder / "emulation.png")
    places = {"lesson": folder / "lesson.yaml", "report": folder / "report.html", "json": folder / "emulation.json"}
    for name, text in (("lesson", lesson), ("report", report), ("json", told)):
        write_text(places[name], text)
    return places
