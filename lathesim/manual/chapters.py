"""The chapters of the manual: Markdown files of this folder, in groups; and all of them as static HTML."""

from __future__ import annotations

import html
import json
import re
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from lathesim.errors import LatheSimError, nearest

GROUPS = {
    "Tutorials": ("first_hour", "writing_lessons", "your_recording", "backlash", "plugins"),
    "How to, on one screen": (
        "sweeps", "exporting", "grading", "goals", "classes", "sheets", "traces", "comparing", "diagnosing", "remedies", "circular_test",
        "lobes", "recording_live", "fmi", "speed",
    ),
    "Reference": ("app", "commands", "lessons", "programs", "python", "real_machines", "glossary"),
    "Explanations": ("diagnosis", "reliability", "experiments", "contour", "stability", "live", "house"),
}  # fmt: skip
"""The topics by kind, in the order in which they are read."""
TOPICS = tuple(topic for topics in GROUPS.values() for topic in topics)


@dataclass(frozen=True)
class Chapter:
    """A chapter: its topic, by which it is asked for, its title, and its text in Markdown."""

    topic: str
    title: str
    text: str


def chapters() -> list[Chapter]:
    """Return all chapters in order."""
    return [chapter(topic) for topic in TOPICS]


def chapter(topic: str) -> Chapter:
    """Return the chapter of a topic; :class:`LatheSimError` with the nearest topic where there is none."""
    if topic not in TOPICS:
        raise LatheSimError(f"the manual has no chapter '{topic}'.", remedy=nearest(topic, TOPICS) or f"It has {', '.join(TOPICS)}.")
    text = (Path(__file__).parent / f"{topic}.md").read_text(encoding="utf-8")
    return Chapter(topic, text.partition("\n")[0].removeprefix("# "), text)


_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>{title} - lathesim</title>
<link rel="stylesheet" href="manual.css"></head>
<body><nav><a href="index.html">lathesim</a><input id="search" type="search" placeholder="Search" aria-label="Search"><ul id="found"></ul>
<ul>{links}</ul></nav><main>{body}</main><script src="index.js"></script><script src="search.js"></script></body></html>
"""
_STYLE = """body{margin:0;display:flex;font:16px/1.5 system-ui,sans-serif;color:#222;background:#fff}
nav{flex:0 0 17em;padding:1em;background:#f3f4f6;height:100vh;overflow:auto;position:sticky;top:0;box-sizing:border-box}
nav ul{list-style:none;padding:0}main{padding:1em 2em;max-width:62em;min-width:0}input{width:100%;box-sizing:border-box}
pre{background:#f3f4f6;padding:.7em;overflow:auto;font-size:14px}
table{border-collapse:collapse}td,th{border:1px solid #ccc;padding:.2em .6em}
img{max-width:100%}@media(max-width:50em){body{display:block}nav{height:auto;position:static}}
@media(prefers-color-scheme:dark){body{color:#ddd;background:#17191c}nav,pre{background:#22252a}a{color:#8ab4f8}td,th{border-color:#444}}
"""
_SEARCH = """const box = document.getElementById("search"), list = document.getElementById("found");
box.addEventListener("input", () => {
  const words = box.value.toLowerCase().split(/\\s+/).filter(Boolean);
  const score = s => words.reduce((sum, w) => sum + (s.heading.toLowerCase().includes(w) ? 5 : 0), 0);
  const hits = words.length ? INDEX.filter(s => words.every(w => (s.heading + " " + s.text).toLowerCase().includes(w))) : [];
  list.replaceChildren(...hits.sort((a, b) => score(b) - score(a)).slice(0, 12).map(s => {
    const item = document.createElement("li"), link = document.createElement("a");
    link.href = s.href;
    link.textContent = s.page + ": " + s.heading;
    item.append(link);
    return item;
  }));
});
"""
_SECTION = re.compile(r'<h[1-3] id="([^"]+)">(.*?)</h[1-3]>(.*?)(?=<h[1-3] id=|\Z)', re.S)


def write_site(folder: Path, pages: Sequence[Chapter]) -> None:
    """Write pages as static HTML: one file a page, a list of them, a search that needs no server, and the pictures."""
    from lathesim.whole_file import make_folder, write_text

    make_folder(folder)
    shutil.copytree(Path(__file__).parent / "pictures", folder / "pictures", dirs_exist_ok=True)
    titles = {page.topic: page.title for page in pages}
    links = "".join(
        f"<li><b>{group}</b></li>" + "".join(f'<li><a href="{topic}.html">{html.escape(titles[topic])}</a></li>' for topic in topics)
        for group, topics in {**GROUPS, "Made from the program": tuple(topic for topic in titles if topic not in TOPICS)}.items()
    )
    bodies = {page.topic: _body(page.text, {other.topic for other in pages}) for page in pages}
    sections = [
        {"page": page.title, "href": f"{page.topic}.html#{place}", "heading": _text(heading), "text": _text(text)}
        for page in pages
        for place, heading, text in _SECTION.findall(bodies[page.topic])
    ]
    for page in pages:
        write_text(folder / f"{page.topic}.html", _PAGE.format(title=html.escape(page.title), links=links, body=bodies[page.topic]))
    write_text(folder / "index.html", _PAGE.format(title="Manual", links=links, body=f"<h1>The manual of lathesim</h1><ul>{links}</ul>"))
    write_text(folder / "index.js", f"const INDEX = {json.dumps(sections)};\n")
    write_text(folder / "search.js", _SEARCH)
    write_text(folder / "manual.css", _STYLE)


def _body(text: str, topics: set[str]) -> str:
    """Return Markdown as HTML, each heading with its own place, and each chapter that is named with a link to it."""
    from markdown_it import MarkdownIt

    reader = MarkdownIt("commonmark", {"html": False}).enable("table")
    tokens = reader.parse(re.sub(r"<!--.*?-->", "", text, flags=re.S))
    for place, token in enumerate(tokens):
        if token.type == "heading_open":
            token.attrSet("id", re.sub(r"\W+", "-", tokens[place + 1].content.lower()).strip("-"))
    made: str = reader.renderer.render(tokens, reader.options, {})

    def link(found: re.Match[str]) -> str:
        return f'{found[1]}<a href="{found[2]}.html">{found[2]}</a>{found[3]}' if found[2] in topics else found[0]

    return re.sub(r"((?:chapters? |pages? |tutorials? |and )<code>|<code>lathesim help )(\w+)(</code>)", link, made)


def _text(marked: str) -> str:
    """Return the words of HTML."""
    return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", marked)).split())
