"""The app in a terminal of tmux: keys in, the screen out."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from tests.cli.command import environment

PATIENCE = 100.0
"""Seconds to wait for what shows up within a second on a machine that has nothing else to do."""


def wait(holds: Callable[[], bool], patience: float = PATIENCE, every: float = 0.1) -> bool:
    """Return whether something holds before ``patience`` seconds have passed."""
    end = time.monotonic() + patience
    while time.monotonic() < end:
        if holds():
            return True
        time.sleep(every)
    return False


class Terminal:
    """A terminal of tmux with the app in it, opened in ``folder``."""

    def __init__(self, folder: Path, size: tuple[int, int] = (100, 30)) -> None:
        self._call = ["tmux", "-L", f"lathesim-{os.getpid()}-{folder.name}", "-f", "/dev/null"]
        command = f"{sys.executable} -m lathesim; echo LEFT $?; sleep 60"
        place = ["-x", str(size[0]), "-y", str(size[1]), "-c", str(folder)]
        environ = {**environment(), "TERM": "xterm-256color"}
        subprocess.run([*self._call, "new-session", "-d", *place, command], check=True, env=environ)

    def send(self, *keys: str) -> None:
        """Press keys, as tmux names them."""
        subprocess.run([*self._call, "send-keys", *keys], check=True)

    def screen(self) -> str:
        """Return the text that stands on the screen."""
        return subprocess.run([*self._call, "capture-pane", "-p"], check=True, capture_output=True, text=True).stdout

    def shows(self, text: str) -> bool:
        """Return whether a text appears."""
        return wait(lambda: text in self.screen())

    def pid(self) -> int:
        """Return the process of the app."""
        found = subprocess.run([*self._call, "list-panes", "-F", "#{pane_pid}"], check=True, capture_output=True, text=True).stdout
        shell = int(found.split()[0])
        children = Path(f"/proc/{shell}/task/{shell}/children").read_text(encoding="ascii").split()
        return int(children[0])

    def end(self) -> None:
        """Close the terminal."""
        subprocess.run([*self._call, "kill-server"], check=False, capture_output=True)
