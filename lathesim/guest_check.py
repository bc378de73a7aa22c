"""The conformance test a guest's component passes before it is let in, given up where a law runs on without end."""

from __future__ import annotations

import contextlib
import inspect
import signal
import threading
import traceback
from collections.abc import Iterator
from pathlib import Path
from types import FrameType

from lathesim.component import Component
from lathesim.conformance import check_component
from lathesim.plugins import shown_path

PATIENCE = 5.0
"""Seconds of computing after which a law counts as endless; the whole test of a part takes some hundredths."""
_ASLEEP = 60.0
"""Seconds by the clock after which one that computes nothing does: a busy machine may take ten times as long as an idle one."""


class _RunsOn(BaseException):
    """Raised out of an endless law; no ``except Exception`` on the way takes it for the law's own."""


def guest_fault(component: type[Component]) -> str:
    """Return what is wrong with a guest's component as ``file:line: sentence``, empty where it keeps the contract."""
    if not hasattr(signal, "setitimer") or threading.current_thread() is not threading.main_thread():
        return _first_fault(component)
    with _given_up(signal.ITIMER_PROF, signal.SIGPROF, PATIENCE), _given_up(signal.ITIMER_REAL, signal.SIGALRM, _ASLEEP):
        try:
            return _first_fault(component)
        except _RunsOn as stopped:
            frame = traceback.extract_tb(stopped.__traceback__)[-2]
            return f"{shown_path(frame.filename)}:{frame.lineno}: {component.__name__}: a law runs on without end. Let every loop end."


@contextlib.contextmanager
def _given_up(timer: int, alarm: int, patience: float) -> Iterator[None]:
    """Raise :class:`_RunsOn` in what takes longer than ``patience`` [s] by a timer; an earlier use of the timer goes on afterwards."""
    before = signal.signal(alarm, _give_up)
    remaining, interval = signal.setitimer(timer, patience)
    try:
        yield
    finally:
        signal.setitimer(timer, remaining, interval)
        signal.signal(alarm, before)


def _first_fault(component: type[Component]) -> str:
    faults = check_component(component)
    if not faults:
        return ""
    text = str(faults[0])
    path = shown_path(inspect.getsourcefile(component) or "")
    return f"{path}{text[len(Path(path).name) :]}" if path and text.startswith(f"{Path(path).name}:") else text


def _give_up(number: int, frame: FrameType | None) -> None:
    raise _RunsOn
