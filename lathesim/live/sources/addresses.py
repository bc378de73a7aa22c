"""Addresses of peers as a person writes them: ``tcp://host:port`` and the like, loopback unless told otherwise."""

from __future__ import annotations

from dataclasses import dataclass
from urllib.parse import urlsplit

from lathesim.live.sources.samples import LiveError

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
