"""What the process does when it is stopped and continued from outside (SIGTSTP, SIGCONT)."""

from __future__ import annotations

import signal
from types import FrameType


def resume_only_after_a_stop() -> None:
    """Let a SIGCONT resume the terminal only after a SIGTSTP suspended it.

    A terminal that is closed sends SIGHUP and SIGCONT. Textual 8.2 answers each SIGCONT with new threads for input and output. Those of an
    app that was never suspended have nobody to end them, and the process outlives its app.
    """
    if not hasattr(signal, "SIGCONT"):
        return
    suspend, resume = signal.getsignal(signal.SIGTSTP), signal.getsignal(signal.SIGCONT)
    if not callable(suspend) or not callable(resume):
        return
    is_suspended = False

    def stopped(number: int, frame: FrameType | None) -> None:
        nonlocal is_suspended
        is_suspended = True
        suspend(number, frame)

    def continued(number: int, frame: FrameType | None) -> None:
        nonlocal is_suspended
        if is_suspended:
            is_suspended = False
            resume(number, frame)

    signal.signal(signal.SIGTSTP, stopped)
    signal.signal(signal.SIGCONT, continued)
