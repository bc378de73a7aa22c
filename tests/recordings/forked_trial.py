"""The trial of a file that may be deadly, in a fork in the place of a process of its own."""

import os
import sys
import warnings
from pathlib import Path

import pytest

resource = pytest.importorskip("resource")


def trial_in_a_fork(path: Path, script: str) -> None:
    """Do what :func:`refuse_deadly_file` does, in a fork: that has the library already, which takes most of a second to import."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # a fork of a process with threads, of which only this one goes on
        child = os.fork()
    if child == 0:
        resource.setrlimit(resource.RLIMIT_CPU, (5, 5))
        for stream in (1, 2):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
        sys.argv = ["trial", str(path)]
        try:
            exec(script)  # noqa: S102 - the text of a reader
        except BaseException:
            os._exit(1)
        os._exit(0)
    if os.WIFSIGNALED(os.waitpid(child, 0)[1]):
        raise OSError("the library does not come back")
