"""The table with others beside the program: comparators, and the program with a step left out, each on the cases that it answered too."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tests.diagnosis.suite.scoring import Score
from tests.diagnosis.suite.table import Row, rows, scores_of

_BELOW = "beside"
PROGRAM = "lathesim"


def folder_beside(answers: Path, name: str) -> Path:
    """Return where answers that are not those of the whole program are kept."""
    return answers / _BELOW / name.replace(" ", "_")


def others(answers: Path) -> dict[str, Path]:
    """Return what has been answered beside the program, by name."""
    return {folder.name.replace("_", " "): folder for folder in sorted((answers / _BELOW).glob("*")) if folder.is_dir()}


def groups(folders: Sequence[Path], answers: Path) -> list[dict[str, list[Score]]]:
    """Return scores by name, in groups that answered the same cases; the program is in each, on those cases only."""
    program = {score.case: score for score in scores_of(folders, answers)}
    made: dict[tuple[str, ...], dict[str, list[Score]]] = {}
    for name, folder in others(answers).items():
        scores = [score for score in scores_of(folders, folder) if score.case in program]
        cases = tuple(score.case for score in scores)
        if cases:
            made.setdefault(cases, {PROGRAM: [program[case] for case in cases]})[name] = scores
    return sorted(made.values(), key=lambda group: -len(group[PROGRAM]))


def lines_of(group: dict[str, list[Score]]) -> list[tuple[str, ...]]:
    """Return the table of a group: a head, and for each question that arises what each has measured and over how many."""
    columns = [rows(scores) for scores in group.values()]
    lines: list[tuple[str, ...]] = [("question", *group)]
    for row in zip(*columns, strict=True):
        if any(one.over != "0" for one in row):
            lines.append((row[0].question, *[_cell(one) for one in row]))
    return lines


def _cell(row: Row) -> str:
    return "-" if row.over == "0" else f"{row.measured} ({row.over})"


def print_beside(folders: Sequence[Path], answers: Path, markdown: Path | None = None) -> None:
    """Print the tables of all groups; add them to a Markdown file."""
    written = []
    for group in groups(folders, answers):
        lines, title = lines_of(group), f"Beside others, on the same {len(group[PROGRAM])} cases"
        widths = [max(len(line[column]) for line in lines) for column in range(len(lines[0]))]
        print(f"\n{title}")
        print("\n".join("  ".join(text.ljust(width) for text, width in zip(line, widths, strict=True)).rstrip() for line in lines))
        rule = "|---" * len(lines[0]) + "|"
        written += ["", f"{title}:", "", _markdown(lines[0]), rule, *[_markdown(line) for line in lines[1:]]]
    if markdown is not None and written:
        with markdown.open("a", encoding="utf-8") as text:
            text.write("\n".join([*written, ""]))


def _markdown(line: Sequence[str]) -> str:
    return f"| {' | '.join(line)} |"
