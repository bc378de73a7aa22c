"""A process that is continued without having been stopped: a closed terminal sends that."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator

import pytest

from lathesim.tui.textual_corrections import resume_only_after_a_stop

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGCONT"), reason="this system has no SIGCONT")


@pytest.fixture
def calls() -> Iterator[list[str]]:
    """Signal handlers as Textual sets them, which note that they were called."""
    noted: list[str] = []
    before = {number: signal.getsignal(number) for number in (signal.SIGTSTP, signal.SIGCONT)}
    signal.signal(signal.SIGTSTP, lambda *_: noted.append("suspend"))
    signal.signal(signal.SIGCONT, lambda *_: noted.append("resume"))
    yield noted
    for number, handler in before.items():
        signal.signal(number, handler)


def test_only_a_suspended_app_is_resumed_and_only_once(calls: list[str]) -> None:
    resume_only_after_a_stop()
    os.kill(os.getpid(), signal.SIGCONT)
    assert calls == []
    os.kill(os.getpid(), signal.SIGTSTP)
    os.kill(os.getpid(), signal.SIGCONT)
    os.kill(os.getpid(), signal.SIGCONT)
    assert calls == ["suspend", "resume"]


def test_a_driver_without_such_handlers_is_left_alone() -> None:
    resume_only_after_a_stop()
    assert signal.getsignal(signal.SIGCONT) is signal.SIG_DFL
