"""Connections: addresses of peers as a person writes them, and a TCP port with a bounded number of peers."""

from __future__ import annotations

import asyncio
from abc import ABC, abstractmethod
from dataclasses import dataclass
from urllib.parse import urlsplit

from lathesim.live.samples import LiveError

LOOPBACK = "127.0.0.1"


@dataclass(frozen=True)
class Address:
    """A peer."""

    host: str
    port: int


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
    return Address(parts.hostname, given)


class Listening(ABC):
    """Answers up to ``most`` connections at once; lines and heads have up to ``longest`` bytes, and ``option`` names the port's option.

    A connection beyond ``most`` is refused and closed as it comes. A peer that goes away ends its own connection and nothing else.
    """

    def __init__(self, *, most: int, longest: int, option: str) -> None:
        self._most, self._longest, self._option = most, longest, option
        self._tasks: set[asyncio.Task[None]] = set()
        self._closing = False

    async def serve(self, host: str, port: int) -> asyncio.Server:
        """Begin to listen. Raises :class:`LiveError` if the port cannot be opened."""
        try:
            return await asyncio.start_server(self._accept, host, port, limit=self._longest)
        except OSError as failure:
            remedy = f"Choose another port with {self._option}."
            raise LiveError(f"{host}:{port} cannot be opened: {failure.strerror}.", remedy=remedy) from None

    async def close(self) -> None:
        """End all connections and wait until each has finished."""
        self._closing = True
        while tasks := set(self._tasks):  # wait_for of Python 3.11 loses a cancellation that arrives as its work ends: cancel again
            for task in tasks:
                task.cancel()
            await asyncio.wait(tasks, timeout=0.1)

    @abstractmethod
    async def _answer(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Serve a connection until it ends."""

    async def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        own = asyncio.current_task()
        assert own is not None
        self._tasks.add(own)
        try:
            if len(self._tasks) <= self._most:
                await self._answer(reader, writer)
            else:
                writer.close()  # a connection beyond the bound
        except (OSError, TimeoutError, asyncio.IncompleteReadError):
            pass
        except asyncio.CancelledError:
            if not self._closing:
                raise
        finally:
            self._tasks.discard(own)
            writer.close()
