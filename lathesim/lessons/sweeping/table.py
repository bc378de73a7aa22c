"""The table of a sweep: a CSV file that grows a row a run, and tells a later call what is done already."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from lathesim.errors import RecordError
from lathesim.lessons.sweeping.members import Member
from lathesim.whole_file import check_place, make_folder, refusal, write_text

FORMAT = "# lathesim-sweep/1"


@dataclass(frozen=True)
class SweepTable:
    """The file of a sweep.

    Its first lines are comments (``header``: what was swept, and the fingerprint of the machine); then one heading and one row a run: its
    number, its values (``given``, as text), its metrics, how it ended. Rows come as runs end; :meth:`finish` puts them in order.
    """

    path: Path
    header: tuple[str, ...]
    columns: tuple[str, ...]
    given: tuple[tuple[str, ...], ...]

    def open(self) -> dict[int, Member]:
        """Return the runs that are in the file already; begin the file where there is none.

        A last row that was cut off while it was written is dropped. Raises :class:`RecordError` where the file is of another sweep, is no
        table of a sweep, or cannot be written.
        """
        try:
            make_folder(self.path.parent)
            check_place(self.path)
            if not self.path.exists():
                write_text(self.path, self._head())
                return {}
            written = self.path.read_bytes()
        except OSError as error:
            raise refusal(self.path, error) from None
        whole = written[: written.rfind(b"\n") + 1]
        if self._head().encode().startswith(written):
            write_text(self.path, self._head())
            return {}
        try:
            text = whole.decode("utf-8")
        except UnicodeDecodeError:
            raise self._foreign() from None
        self._check_head(text)
        try:
            found = {member.number: member for member in map(self._member, csv.reader(io.StringIO(text[len(self._head()) :])))}
        except csv.Error:
            raise self._foreign() from None
        if whole != written:
            write_text(self.path, text)
        return found

    def add(self, member: Member) -> None:
        """Write the row of a run, at once and whole."""
        try:
            with self.path.open("ab") as file:
                file.write(self._row(member).encode())
        except OSError as error:
            raise refusal(self.path, error) from error

    def finish(self, members: dict[int, Member]) -> None:
        """Write the whole table anew, in the order given."""
        write_text(self.path, self._head() + "".join(self._row(member) for member in members.values()))

    def _head(self) -> str:
        return "\n".join([FORMAT, *(f"# {line}" for line in self.header), _joined(self.columns)]) + "\n"

    def _row(self, member: Member) -> str:
        metrics = ["" if math.isnan(value) else repr(value) for value in member.metrics]
        return _joined([str(member.number), *self.given[member.number], *metrics, member.status]) + "\n"

    def _member(self, row: Sequence[str]) -> Member:
        first = 1 + len(self.given[0])
        try:
            number = int(row[0])
            if tuple(row[1:first]) != self.given[number] or len(row) != len(self.columns) or number < 0:
                raise ValueError
            return Member(number, tuple(float(cell) if cell else math.nan for cell in row[first:-1]), row[-1])
        except (ValueError, IndexError):
            fact = f"the row '{','.join(row)}' does not belong to this sweep."
            raise RecordError(fact, place=str(self.path), remedy="Choose another --out.") from None

    def _check_head(self, text: str) -> None:
        if not text.startswith(f"{FORMAT}\n"):
            raise self._foreign()
        wanted, there = self._head().splitlines(), text.splitlines()
        for here, line in zip(wanted, [*there, *[""] * len(wanted)], strict=False):
            if here != line:
                fact = f"the table is of another sweep: it has '{line}' where this one has '{here}'."
                raise RecordError(fact, place=str(self.path), remedy="Choose another --out, or delete the file.")

    def _foreign(self) -> RecordError:
        return RecordError("the file is there already and is no table of a sweep.", place=str(self.path), remedy="Choose another --out.")


def _joined(cells: Sequence[str]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="").writerow([cell.replace("\n", " ") for cell in cells])
    return text.getvalue()
