"""``python -m tests.house.sentences [TOPIC ...]``: the long sentences of manual, README, lessons and helps, and private words."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator

import click

from lathesim.cli.main import group, stock_commands
from lathesim.lessons.lesson import load_lesson
from lathesim.manual.chapters import chapters
from lathesim.shipped import shipped_files
from tests.cli.command import ROOT
from tests.house.counts import nodes, parsed

LONG, LONGEST = 25, 30
"""Words above which a sentence is long, and above which none may be."""
PRIVATE = re.compile(
    r"\bdear(er|est)?\b|\b(is|are|was|were|be|been|being) told\b(?! apart)|\bTold (are|is)\b|\bforetold\b"
    r"|\b(is|are|was|were|be|been|being) asked\b|\basked for\b|\b(is|are|plug-ins?) in order\b|\bfloors off\b|' is no quantity\b"
    r"|\bnull maximum\b|\bshaken limits\b|\bthat of which\b|\bone that shows it may\b|\bwalks in the loop\b|\b(is|are) due\.|^Leave$|^Take$"
)
"""Phrases that only the authors understand: "dear" for expensive, "told" for reported, "asked" for required."""
NOTES = ("thresholds.py", "stability_thresholds.py")
"""Modules whose texts are the evidence of limits, which nobody but their authors reads."""
ANSWER = re.compile(r"<!-- answer of .*?^```.*?^```", re.S | re.M)
SHORT = re.compile(r"\b(e\.g|i\.e|etc|vs|Fig|Eq|No|al|approx|cf|St)\.")


def plain(markdown: str) -> Iterator[str]:
    """Yield the paragraphs, list items and cells of tables of a page, without code, pictures and headings."""
    text = re.sub(r"^( *)```.*?^\1```$", "", ANSWER.sub("", markdown), flags=re.S | re.M)
    text = re.sub(r"(?<=\n\n) {4}\S.*(\n {4}.*)*", "", text)
    text = re.sub(r"!\[[^\]]*\]\([^)]*\)|^#+ .*$|^[-|: ]+$|<!--.*?-->", "", text, flags=re.M)
    text = re.sub(r"\[([^\]]+)\]\([^)]*\)", r"\1", text)
    for block in re.split(r"\n\s*\n|\n(?= *(?:[-*>]|\d+\.) )", text):
        if block.lstrip().startswith("|"):
            yield from (cell for cell in re.split(r"(?<!\\)\||\n", block) if cell.strip())
        else:
            yield re.sub(r"^\s*([-*>]|\d+\.)\s+|\n> ?", " ", block)


def sentences(paragraph: str) -> Iterator[str]:
    """Yield the sentences of a paragraph; code in it counts as one word."""
    text = re.sub(r"`[^`]*`", "CODE", SHORT.sub(r"\1", " ".join(paragraph.split())))
    yield from (
        part.strip() for part in re.split(r"(?<=[.!?:;])[\"')]*\s+(?=[A-Z(\"'*])|(?<=[.!?])[\"')]*$", text) if part and part.strip()
    )


def words(sentence: str) -> int:
    """Return how many words a sentence has; a sign or a lone number is none."""
    return len(re.findall(r"[A-Za-zÀ-ÿ][\w'.-]*", sentence))


def pages() -> dict[str, list[str]]:
    """Return the paragraphs that a person reads, by the page on which they stand."""
    found = {f"manual/{chapter.topic}": list(plain(chapter.text)) for chapter in chapters()}
    found["README"] = list(plain((ROOT / "README.md").read_text(encoding="utf-8")))
    found |= {f"lesson/{path.stem}": list(of_lesson(path.stem)) for path in shipped_files("lesson_configs", "*.yaml")}
    return found | {f"help/{name}": list(of_command(name)) for name in stock_commands()}


def of_lesson(name: str) -> Iterator[str]:
    """Yield what a student reads of a lesson."""
    data = load_lesson(name).source.data
    yield from plain(str(data.get("text", "")))
    yield from (str(data.get("learn", "")), *map(str, data.get("try", ())))
    yield from (str(variant.get("text", "")) for variant in data.get("variants", {}).values())
    for goal in data.get("goals", ()):
        hint = goal.get("hint", ())
        yield from [str(hint)] if isinstance(hint, str) else map(str, hint)
    yield from (str(question["ask"]) for question in data.get("questions", ()))


def of_command(name: str) -> Iterator[str]:
    """Yield the page of help of a command and of its options."""
    command = group.get_command(click.Context(group), name)
    assert command is not None
    yield from plain(command.help or "")
    yield from (option.help or "" for option in command.params if isinstance(option, click.Option))


def counted() -> dict[str, list[tuple[int, str]]]:
    """Return the sentences of each page with their words."""
    return {page: [(words(one), one) for block in blocks for one in sentences(block) if words(one)] for page, blocks in pages().items()}


def suspect_messages() -> Iterator[tuple[str, str]]:
    """Yield the texts that are no docstrings, with their places, of the modules in which a private word stands anywhere."""
    for path in (path for path in sorted((ROOT / "lathesim").rglob("*.py")) if path.name not in NOTES):
        source = path.read_text(encoding="utf-8")
        if not PRIVATE.search(source) and not re.search(r"[\"'](Leave|Take)[\"']", source):
            continue  # no text of it can hold one
        every = nodes(parsed(path))
        notes = {id(node.value) for node in every if isinstance(node, ast.Expr)}
        for node in every:
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in notes:
                yield f"{path.relative_to(ROOT)}:{node.lineno}", node.value


def private_words() -> list[str]:
    """Return where a private word stands."""
    every = [*suspect_messages(), *((page, block) for page, blocks in pages().items() for block in blocks)]
    return [f"{place}: {match[0]}: {text.strip()[:100]}" for place, text in every if (match := PRIVATE.search(text.strip()))]


if __name__ == "__main__":
    made = counted()
    for page, list_of in made.items():
        if not sys.argv[1:] or any(page.startswith(begin) for begin in sys.argv[1:]):
            for count, one in list_of:
                if count > LONG:
                    print(f"{page} {count}: {one}")
    every = [count for list_of in made.values() for count, _ in list_of]
    above = sum(count > LONG for count in every)
    longest = sum(count > LONGEST for count in every)
    print(f"{len(every)} sentences, {above} above {LONG} words ({100 * above / len(every):.1f} %), {longest} above {LONGEST}")
    print("\n".join(private_words()))
