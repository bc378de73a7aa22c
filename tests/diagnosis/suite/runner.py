"""Runs the program under test on the cases: its own command line, in worker processes, a time limit for each case, answers kept as files.

An answer file holds the JSON of the program as it is, with the seconds the command took and what it wrote; the truth is not in it and not
shown to the program.
"""

from __future__ import annotations

import contextlib
import json
import os
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from tests.diagnosis.suite.generate import truth_of
from tests.diagnosis.suite.scoring import score
from tests.diagnosis.suite.traced import Margins, noting

TIME_LIMIT = 300.0
"""Seconds after which a case is given up."""
PROGRAM_FAULT = 3


@dataclass(frozen=True)
class Job:
    """One case to be answered: its folder, where the answer goes, and whether there is a second recording that resolves a poor one.

    ``without`` names steps of the method that the program is to leave out.
    """

    folder: str
    answer: str
    poor: bool = False
    trail: bool = False
    without: tuple[str, ...] = ()
    margins: bool = False
    """Whether to keep how near the diagnosis came to each limit, beside its answer."""


def margins_file(answers: Path, case: str) -> Path:
    """Return where it is kept how near a case came to each limit."""
    return answers / "margins" / f"{case}.json"


def answer_file(answers: Path, case: str) -> Path:
    """Return where the answer of a case is kept."""
    return answers / f"{case}.json"


def read_answer(answers: Path, case: str) -> dict[str, Any] | None:
    """Read what the program answered in a case; None where it was not asked yet."""
    path = answer_file(answers, case)
    if not path.is_file():
        return None
    told: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return told


def chosen(cases: Path, only: str = "", number: int | None = None) -> list[Path]:
    """Return the folders of the cases whose ``rig/category hidden`` has ``only`` in it, the first ``number`` of them."""
    folders = sorted(path.parent for path in cases.glob("case_*/truth.json"))
    if only:
        folders = [folder for folder in folders if only in f"{folder.name} {label(truth_of(folder))}"]
    return folders[:number]


def label(truth: dict[str, Any]) -> str:
    """Return the kind of a case and what it hides in a few words."""
    hidden = "+".join(one["key"] for one in truth["effects"]) or (truth["fault"]["kind"] if truth["fault"] else "")
    return " ".join(part for part in (f"{truth['rig']}/{truth['category']}", truth["poor"], hidden) if part)


def run(
    folders: Sequence[Path], answers: Path, *, jobs: int = 1, resume: bool = False, limit: float = TIME_LIMIT, trail: bool = False,
    without: Sequence[str] = (), margins: bool = False, tell: Callable[[str], None] = print, work: Callable[[Job], None] | None = None,
) -> None:  # fmt: skip
    """Ask the program about each case and keep its answers; with ``resume`` only what has none yet (or where the program failed)."""
    answers.mkdir(parents=True, exist_ok=True)
    waiting = []
    for folder in folders:
        told = read_answer(answers, folder.name) if resume else None
        if told is None or told.get("exit_code") == PROGRAM_FAULT:
            poor = "resolve" in truth_of(folder)["recordings"]
            waiting.append(Job(str(folder), str(answer_file(answers, folder.name)), poor, trail, tuple(without), margins))
    for done, job in enumerate(_finished(waiting, jobs, limit, work or answer_case), start=1):
        tell(f"[{done}/{len(waiting)}] {line(Path(job.folder), Path(job.answer))}")


def line(folder: Path, answer: Path) -> str:
    """Return a case, what it hides, what was answered, right or wrong and the seconds in one line."""
    truth, told = truth_of(folder), json.loads(answer.read_text(encoding="utf-8"))
    made = score(folder.name, truth, told)
    verdict = f"WRONG ({', '.join(made.missed)})" if made.missed else ("right" if made.asked else "not asked")
    return f"{folder.name} {truth['rig']}/{truth['category']} | {made.truth} | {made.answer} | {verdict} | {told['seconds']:.0f} s"


def answer_case(job: Job) -> None:
    """Ask the program about one case, and about the separating experiment of a poor one, and write the answer file."""
    folder, answer = Path(job.folder), Path(job.answer)
    kept_of: contextlib.AbstractContextManager[dict[str, Margins]] = noting() if job.margins else contextlib.nullcontext({})
    with kept_of as noted:
        told = _asked(folder, "fit.csv", "validate.csv", job.without, answer.with_suffix(".trail") if job.trail else None)
    if noted:
        file = margins_file(answer.parent, answer.stem)
        file.parent.mkdir(exist_ok=True)
        kept = {name: (one.below if one.times_below else None, one.above if one.times_above else None) for name, one in noted.items()}
        file.write_text(json.dumps(kept), encoding="utf-8")
    if job.poor:
        told["second"] = _asked(folder, "resolve.csv", "resolve_validate.csv", job.without, None)
    _write(answer, told)


def _asked(folder: Path, fitted: str, held_out: str, without: Sequence[str], trail: Path | None) -> dict[str, Any]:
    """Call ``lathesim diagnose`` as a person does."""
    from lathesim.cli.main import run_command_line

    began, computed = time.perf_counter(), time.process_time()
    with tempfile.TemporaryDirectory() as scratch, (Path(scratch) / "said.txt").open("w+", encoding="utf-8") as said:
        file = Path(scratch) / "answer.json"
        words = ["diagnose", folder / "lesson.yaml", folder / fitted, "--validate", folder / held_out]
        words += ["--json", file, "--no-report", "--out", scratch, *[word for step in without for word in ("--without", step)]]
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said), _trail(trail):
            code = run_command_line([str(word) for word in words])
        seconds, computed = time.perf_counter() - began, time.process_time() - computed
        said.seek(0)
        text = said.read()
        answer = json.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
    error = "" if answer else (text.strip() or f"nothing was said, exit code {code}")
    return {"seconds": seconds, "computed_seconds": computed, "exit_code": code, "error": error, "answer": answer}


@contextlib.contextmanager
def _trail(file: Path | None) -> Iterator[None]:
    """Keep what the program says of its steps in a file, for whoever looks into a miss."""
    if file is None:
        yield
        return
    from lathesim.diagnosis import diagnose as steps

    asked = steps.diagnose
    with file.open("w", encoding="utf-8") as lines:

        def told(question: steps.Question, tell: steps.Progress | None = None) -> Any:
            began = time.perf_counter()
            return asked(question, lambda text: print(f"{time.perf_counter() - began:7.1f}  {text}", file=lines, flush=True))

        steps.diagnose = told
        try:
            yield
        finally:
            steps.diagnose = asked


def _write(answer: Path, told: dict[str, Any]) -> None:
    answer.write_text(json.dumps(told, indent=1), encoding="utf-8")


@dataclass
class _Worker:
    """A process that answers one case after the other, so that what is compiled stays; ``job`` is what it is at, since ``began``."""

    process: BaseProcess
    line: Connection
    job: Job | None = None
    began: float = field(default_factory=time.monotonic)


def _finished(waiting: Sequence[Job], jobs: int, limit: float, work: Callable[[Job], None]) -> Iterator[Job]:
    """Return the jobs as they are done; a worker that takes too long or dies is replaced, and the answer says so."""
    left, workers = list(waiting), [_started(work) for _ in range(min(jobs, len(waiting)))]
    try:
        while left or any(worker.job for worker in workers):
            for place, worker in enumerate(workers):
                if worker.job is None and left:
                    worker.job, worker.began = left.pop(0), time.monotonic()
                    worker.line.send(worker.job)
                job, spent = worker.job, time.monotonic() - worker.began
                if job is None:
                    continue
                if worker.line.poll():
                    worker.job = None if _received(worker, job) else job
                    if worker.job is None:
                        yield job
                        continue
                # a poor case asks twice
                if spent > limit * (2 if job.poor else 1) or not worker.process.is_alive():
                    why = f"no answer within {spent:.0f} s" if worker.process.is_alive() else "the process ended without an answer"
                    _write(Path(job.answer), {"seconds": spent, "exit_code": None, "error": why, "answer": {}})
                    worker.process.kill()
                    workers[place] = _started(work)
                    yield job
            wait([worker.line for worker in workers if worker.job], timeout=1.0)
    finally:
        for worker in workers:
            worker.process.kill()


def _received(worker: _Worker, job: Job) -> bool:
    """Take a worker's word that its job is done; False where the line broke off."""
    try:
        error = worker.line.recv()
    except EOFError:
        return False
    if error:
        _write(Path(job.answer), {"seconds": time.monotonic() - worker.began, "exit_code": PROGRAM_FAULT, "error": error, "answer": {}})
    return True


def _started(work: Callable[[Job], None]) -> _Worker:
    context = get_context("spawn")
    here, there = context.Pipe()
    # before numpy is loaded there: two processes of two threads each would stand in one another's way
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    process = context.Process(target=_serve, args=(there, work), daemon=True)
    process.start()
    there.close()
    here.recv()  # it stands: the clock of its first case does not count its start
    return _Worker(process, here)


def _serve(line: Connection, work: Callable[[Job], None]) -> None:
    """Answer jobs until the parent is gone."""
    line.send("ready")
    while True:
        try:
            job = line.recv()
        except EOFError:
            return
        try:
            work(job)
        except Exception:
            line.send(traceback.format_exc())
        else:
            line.send("")
