"""The app in a browser: a server on this machine that runs one app for each page that is open."""

from __future__ import annotations

import os
import shlex
import signal
import sys
import threading
import time
from collections.abc import Sequence
from urllib.parse import urlsplit

from aiohttp import web
from textual_serve.server import Server

MOST_SESSIONS = 4
"""Pages that may be open at once, assumed: each takes a process of about 150 MB, and two cores run no more than a few."""
_LOOK_EVERY = 1.0
"""Seconds after which an app looks whether its server is still there."""


class AppServer(Server):
    """Serves the app to pages of this server alone, at most ``most`` at once.

    A page of another site could open a socket to this machine and drive the app in somebody's name; so the request must come from the
    server's own page, by its ``Origin``, and ask for it by its own name, by its ``Host``.
    """

    def __init__(self, arguments: Sequence[str], host: str, port: int, most: int = MOST_SESSIONS) -> None:
        command = f"exec {shlex.join([sys.executable, '-m', 'lathesim', 'tui', *arguments])}"
        super().__init__(command, host=host, port=port, title="lathesim")
        self.sessions = 0
        self._most = most

    async def handle_websocket(self, request: web.Request) -> web.WebSocketResponse:
        """Run an app for a page, until the page is closed."""
        if not self._is_own(request):
            raise web.HTTPForbidden(text="Open the page of this server itself.")
        if self.sessions >= self._most:
            raise web.HTTPServiceUnavailable(text=f"{self._most} pages are open already. Close one.")
        self.sessions += 1
        try:
            return await super().handle_websocket(request)
        finally:
            self.sessions -= 1

    def _is_own(self, request: web.Request) -> bool:
        known = {f"{name}:{self.port}" for name in (self.host, "localhost", "127.0.0.1")}
        return request.host in known and urlsplit(request.headers.get("Origin", "")).netloc in known


def end_with_parent() -> None:
    """Let this process end as if asked to when the one that started it is gone, killed or not."""
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_LOOK_EVERY)
        os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=watch, daemon=True).start()
