"""Connections: addresses of peers as a person writes them, and a TCP port with a bounded number of peers."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from urllib.parse import urlsplit

from lathesim.live.samples import LiveError

LOOPBACK = "127.0.0.1"


@dataclass(frozen=True)
class Address:
    """A peer: ``scheme``, ``host``, ``port``, and what stands behind them."""

    scheme: str
    host: str
    port: int
    path: str = ""


def read_address(text: str, scheme: str, port: int | None = None) -> Address:
    """Return an address written as ``tcp://host:port``, ``host:port`` or ``port``; ``scheme`` and ``port`` stand where they are left out.

    Raises :class:`LiveError` where it cannot be read or has no port.
    """
    whole = text if "://" in text else f"{scheme}://{LOOPBACK}:{text}" if text.isdigit() else f"{scheme}://{text}"
    try:
        parts = urlsplit(whole)
        given = parts.port if parts.port is not None else port
    except ValueError:
        raise LiveError(f"'{text}' is no address.", remedy=f"Write it as {scheme}://127.0.0.1:5600.") from None
    if given is None or not parts.hostname:
        raise LiveError(f"'{text}' names no port.", remedy=f"Write it as {scheme}://127.0.0.1:5600.")
    return Address(parts.scheme, parts.hostname, given, parts.path)


Serve = Callable[[asyncio.StreamReader, asyncio.StreamWriter], Awaitable[None]]


class Listening:
    """Serves up to ``most`` connections at once with ``serve``; lines and heads have up to ``longest`` bytes.

    A connection beyond ``most`` is closed as it comes, and ``refused`` is called with its writer before. A peer that goes away ends its own
    connection and nothing else.
    """

    def __init__(self, serve: Serve, *, most: int, longest: int, refused: Callable[[asyncio.StreamWriter], None] | None = None) -> None:
        self._serve, self._most, self._longest, self._refused = serve, most, longest, refused
        self._tasks: set[asyncio.Task[None]] = set()
        self._closing = False

    async def serve(self, host: str, port: int, *, option: str, backlog: int = 100) -> asyncio.Server:
        """Begin to listen. Raises :class:`LiveError` if the port cannot be opened; ``option`` names the option for another port."""
        try:
            return await asyncio.start_server(self._accept, host, port, limit=self._longest, backlog=backlog)
        except OSError as failure:
            raise LiveError(f"{host}:{port} cannot be opened: {failure.strerror}.", remedy=f"Choose another port with {option}.") from None

    async def close(self) -> None:
        """End all connections and wait until each has finished."""
        self._closing = True
        while tasks := set(self._tasks):  # wait_for of Python 3.11 loses a cancellation that arrives as its work ends: cancel again
            for task in tasks:
                task.cancel()
            await asyncio.wait(tasks, timeout=0.1)

    async def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        own = asyncio.current_task()
        assert own is not None
        self._tasks.add(own)
        try:
            if len(self._tasks) <= self._most:
                await self._serve(reader, writer)
            elif self._refused is not None:
                self._refused(writer)
        except (OSError, TimeoutError, asyncio.IncompleteReadError):
            pass
        except asyncio.CancelledError:
            if not self._closing:
                raise
        finally:
            self._tasks.discard(own)
            writer.close()
