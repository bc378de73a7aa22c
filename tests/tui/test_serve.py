"""The app in a browser: it answers its own page alone, caps the pages, and its children end with it."""

from __future__ import annotations

import asyncio
import os
import shutil
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import aiohttp
import pytest

from lathesim.cli.main import run_command_line
from tests.cli.command import environment
from tests.live.servo import free_port
from tests.tui.terminal import wait

pytestmark = [pytest.mark.skipif(not Path("/proc").is_dir(), reason="asks /proc for the children"), pytest.mark.timeout(120)]
BROWSER = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
]  # fmt: skip


def children(pid: int) -> list[int]:
    try:
        return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii").split()]
    except OSError:
        return []


def is_alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="ascii").split()[2] != "Z"
    except OSError:
        return False


class Served:
    """A server under test."""

    def __init__(self, folder: Path) -> None:
        self.port = free_port()
        words = [sys.executable, "-m", "lathesim", "serve", "--port", str(self.port), "--sessions", "1"]
        self.process = subprocess.Popen(words, cwd=folder, env=environment(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        assert wait(self.answers)

    def answers(self) -> bool:
        with socket.socket() as trial:
            return trial.connect_ex(("127.0.0.1", self.port)) == 0

    @property
    def children(self) -> list[int]:
        return children(self.process.pid)

    def end(self) -> None:
        self.process.kill()
        self.process.wait()


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Served]:
    found = Served(tmp_path)
    yield found
    found.end()


async def page_status(port: int, origin: str, host: str = "127.0.0.1") -> int:
    """Return what a page of ``origin`` is answered when it asks for the app: 101 where it gets it."""
    headers = {"Origin": origin, "Host": f"{host}:{port}"}
    async with aiohttp.ClientSession() as session:
        try:
            async with session.ws_connect(f"http://127.0.0.1:{port}/ws?width=80&height=24", headers=headers):
                return 101
        except aiohttp.WSServerHandshakeError as refused:
            return refused.status


def test_a_page_of_another_site_is_refused(served: Served) -> None:
    own = f"http://127.0.0.1:{served.port}"
    assert asyncio.run(page_status(served.port, "http://evil.example")) == 403
    assert asyncio.run(page_status(served.port, own, host="evil.example")) == 403
    assert served.children == []
    assert asyncio.run(page_status(served.port, own)) == 101


def test_pages_are_capped_and_end_with_a_server_that_is_killed(served: Served) -> None:
    own = f"http://127.0.0.1:{served.port}"

    async def two_pages() -> tuple[int, list[int]]:
        async with aiohttp.ClientSession() as session, session.ws_connect(f"{own}/ws?width=80&height=24", headers={"Origin": own}):
            for _ in range(100):
                if served.children:
                    break
                await asyncio.sleep(0.1)
            second = await page_status(served.port, own)
            apps = served.children
            await asyncio.sleep(2.0)
            served.end()
            return second, apps

    second, apps = asyncio.run(two_pages())
    assert second == 503
    assert len(apps) == 1
    assert wait(lambda: not any(is_alive(app) for app in apps))


def test_a_port_that_is_taken_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert run_command_line(["serve", "--port", str(port)]) == 1
    assert f"127.0.0.1:{port} cannot be opened" in capsys.readouterr().err


def test_a_browser_opens_the_app(served: Served, tmp_path: Path) -> None:
    browser = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if browser is None:
        pytest.skip("there is no Chromium on this machine")
    words = [browser, *BROWSER, f"--user-data-dir={tmp_path / 'profile'}", "--remote-debugging-port=0", f"http://127.0.0.1:{served.port}"]
    with subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True) as page:
        try:
            assert wait(lambda: len(served.children) == 1)
            (app,) = served.children
        finally:
            os.killpg(page.pid, 9)
    assert wait(lambda: not is_alive(app))
