"""A lesson on paper, as HTML or PDF: what it says, tasks and questions with room for answers, its plot; and for the teacher its solution.

Both forms are made of the same blocks. The PDF is set by matplotlib, and a plot has a page of its own there.
"""

from __future__ import annotations

import base64
import html
import io
import re
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from lathesim.analysis.figure_style import ALERT, INK, QUIET, new_figure
from lathesim.analysis.plots import channels_figure, overview_figure
from lathesim.classroom.teacher_notes import TeacherNotes
from lathesim.errors import RecordError
from lathesim.lessons.lesson import Lesson
from lathesim.lessons.schema import LessonQuestion
from lathesim.lessons.simulate import simulate
from lathesim.plugins import Registry
from lathesim.units import split_quantity
from lathesim.whole_file import whole_file, write_text

FORMS = (".html", ".pdf")
Kind = Literal["title", "heading", "text", "code", "item", "choice", "room", "answer"]
_PAGE, _MARGIN = (8.27, 11.69), 0.7
"""A4 and its margin [inch]."""
_LOOK: dict[Kind, tuple[float, int, str, dict[str, Any]]] = {
    "title": (15.0, 62, INK, {"fontweight": "bold"}),
    "heading": (11.5, 80, INK, {"fontweight": "bold"}),
    "text": (9.5, 98, INK, {}),
    "code": (8.0, 96, INK, {"family": "monospace"}),
    "item": (9.5, 96, INK, {}),
    "choice": (9.5, 92, INK, {}),
    "room": (14.0, 62, QUIET, {}),
    "answer": (9.5, 96, ALERT, {}),
}
"""Font size [pt], letters of a line, colour and style of each kind of block in the PDF."""
_LEAD, _GAP, _NARROW = 1.35, 0.6, 0.1
"""Height of a line, and space above a block and above one that belongs to the block before, in font sizes."""
_TOGETHER = 5.0
"""Lines below a heading or a question that must fit on its page."""
_LINE = "_" * 80
_STYLE = """
body { font: 15px/1.5 sans-serif; max-width: 46em; margin: 2em auto; padding: 0 1em; color: #22262b }
pre { background: #f3f5f7; padding: .6em; overflow: auto }  img { max-width: 100% }
.room { height: 2.6em; border-bottom: 1px solid #8a929c }  .answer { color: #c0272d; white-space: pre-wrap }
@media print { body { margin: 0 }  h2, img { break-inside: avoid } }
"""


@dataclass(frozen=True)
class SheetBlock:
    """A piece of a sheet."""

    kind: Kind
    text: str = ""


def sheet_blocks(lesson: Lesson, notes: TeacherNotes | None) -> list[SheetBlock]:
    """Return the blocks of a sheet; with ``notes`` those for the teacher, who sees answers, solution and marks."""
    settings = lesson.settings
    minutes = f"{settings.minutes} minutes" if settings.minutes else ""
    course = " · ".join(word for word in (settings.unit, minutes, settings.level) if word)
    to_fill = SheetBlock("text", f"Name: {_LINE[:40]}  Date: {_LINE[:12]}")
    blocks = [
        SheetBlock("title", settings.lesson),
        to_fill if notes is None else SheetBlock("answer", "For teachers: not to be handed out"),
    ]
    blocks += [SheetBlock("text", course), SheetBlock("text", settings.learn)]
    for part in re.split(r"\n\s*\n", settings.text.strip("\n")):
        is_code = all(line.startswith("    ") for line in part.splitlines())
        blocks.append(SheetBlock("code", textwrap.dedent(part)) if is_code else SheetBlock("text", " ".join(part.split())))
    tasks = [(SheetBlock("item", f"{number}. {text}"), SheetBlock("room")) for number, text in enumerate(settings.try_, 1)]
    blocks += _listed("Tasks", [block for pair in tasks for block in pair])
    blocks += _listed("Goals of your run", [SheetBlock("item", f"• {goal}") for goal in goal_texts(lesson)])
    answers = [note.answer for note in notes.answers] if notes is not None else []
    asked = zip(settings.questions, [*answers, *[""] * len(settings.questions)], strict=False)
    blocks += _listed("Questions", [block for question, answer in asked for block in _asked(question, answer)])
    return [block for block in [*blocks, *(_solution(notes) if notes is not None else ())] if block.text or block.kind == "room"]


def goal_texts(lesson: Lesson) -> list[str]:
    """Return the goals of a lesson as phrases: "max contour error at most 0.2 mm"."""
    senses = ("at_most", "at_least")
    limits = [(goal.metric, sense, getattr(goal, sense)) for goal in lesson.settings.goals for sense in senses]
    return [f"{metric} {sense} ".replace("_", " ") + text for metric, sense, text in limits if text is not None]


def _listed(heading: str, blocks: list[SheetBlock]) -> list[SheetBlock]:
    return [SheetBlock("heading", heading), *blocks] if blocks else []


def _asked(question: LessonQuestion, answer: str) -> Iterator[SheetBlock]:
    yield SheetBlock("item", question.ask)
    if question.choices is not None:
        yield from (SheetBlock("choice", f"☐ {choice}") for choice in question.choices)
    else:
        yield SheetBlock("choice", f"Answer: {_LINE[:20]} {split_quantity(question.within or '1')[1]}")
    yield SheetBlock("answer", f"Answer: {answer}" if answer else "")


def _solution(notes: TeacherNotes) -> Iterator[SheetBlock]:
    yield SheetBlock("heading", "Solution and marks")
    if notes.solution is not None:
        case = f"Case {notes.solution.variant}" if notes.solution.variant else "The lesson itself"
        values = ", ".join(f"{name} = {value}" for name, value in {**notes.solution.set, **notes.solution.tables}.items())
        yield SheetBlock("answer", f"{case}{' with ' + values if values else ''}{' with this program:' if notes.solution.program else ''}")
        yield SheetBlock("code", notes.solution.program)
    yield SheetBlock("answer", notes.notes)
    yield SheetBlock(
        "answer",
        "Marks, for the kinds of work that the lesson has: "
        + ", ".join(f"{kind} {weight:g}" for kind, weight in notes.weights.model_dump().items()),
    )


def sheet_figure(lesson: Lesson, registry: Registry, variant: str | None) -> Any:
    """Return the plot of a lesson's case, drawn from a run: the channels that the lesson plots, else what matters of a run."""
    chosen = variant if variant is not None else next(iter(lesson.variants), None)
    record = simulate(lesson, registry, chosen)
    title = f"{lesson.title}{f', case {chosen}' if chosen else ''}"
    return channels_figure(record, lesson.settings.plot, title) if lesson.settings.plot else overview_figure(record, title)


def write_sheet(path: Path, blocks: list[SheetBlock], figure: Any = None) -> None:
    """Write a sheet as HTML or PDF, by the ending of the name; :class:`RecordError` where it is another one."""
    if path.suffix.lower() == ".html":
        write_text(path, _page(blocks, figure))
    elif path.suffix.lower() == ".pdf":
        with whole_file(path) as part:
            _write_pdf(part, blocks, figure)
    else:
        raise RecordError(f"a sheet cannot be written as '{path.suffix}'.", place=str(path), remedy="Use .html or .pdf.")


def _page(blocks: list[SheetBlock], figure: Any) -> str:
    tags: dict[Kind, str] = {"title": "h1", "heading": "h2", "code": "pre"}
    body = []
    for block in blocks:
        text = html.escape(block.text)
        if block.kind in ("text", "item"):
            for mark, tag in ((r"\*\*", "b"), (r"\*", "i"), ("`", "code")):
                text = re.sub(rf"(?<!\w){mark}(\S(?:[^*`]*\S)?){mark}(?!\w)", rf"<{tag}>\1</{tag}>", text)
        tag = tags.get(block.kind, "p")
        body.append(f'<{tag} class="{block.kind}">{text}</{tag}>')
    if figure is not None:
        picture = io.BytesIO()
        figure.savefig(picture, format="png", dpi=130)
        body.append(f'<img alt="plot of the lesson" src="data:image/png;base64,{base64.b64encode(picture.getvalue()).decode()}">')
    head = f'<meta charset="utf-8"><title>{html.escape(blocks[0].text)}</title><style>{_STYLE}</style>'
    return "\n".join([f'<!doctype html><html lang="en"><head>{head}</head><body>', *body, "</body></html>", ""])


def _write_pdf(path: Path, blocks: list[SheetBlock], figure: Any) -> None:
    from matplotlib.backends.backend_pdf import PdfPages

    with PdfPages(path, metadata={"Title": blocks[0].text, "CreationDate": None}) as pages:
        page, below = new_figure(*_PAGE), _MARGIN
        for block in blocks:
            size, letters, color, style = _LOOK[block.kind]
            lines = _lines(block, letters)
            height, gap = _LEAD * size / 72.0, (_NARROW if block.kind in ("choice", "room") else _GAP) * size / 72.0
            for number, line in enumerate(lines):
                below += height + (gap if number == 0 else 0.0)
                keep = _TOGETHER * height if block.kind in ("heading", "item") and number == 0 else 0.0
                if below + keep > _PAGE[1] - _MARGIN:
                    pages.savefig(page)
                    page, below = new_figure(*_PAGE), _MARGIN + height
                left = _MARGIN + (0.25 if block.kind in ("choice", "code") else 0.0)
                place = (left / _PAGE[0], 1.0 - below / _PAGE[1])
                page.text(*place, line, fontsize=size, color=color, parse_math=False, **style)
        pages.savefig(page)
        if figure is not None:
            pages.savefig(figure)


def _lines(block: SheetBlock, letters: int) -> list[str]:
    if block.kind == "room":
        return [_LINE[:62]] * 2
    text = block.text if block.kind in ("code", "answer") else re.sub(r"[*`]", "", block.text)
    return [line for given in text.splitlines() for line in textwrap.wrap(given, letters) or [""]]
