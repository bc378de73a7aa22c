"""A discovered formula written as an effect in a plug-in file, to be read, doubted, improved and inserted into a lesson."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence

from lathesim.diagnosis.discovery.sparse_regression import Discovered

_INPUTS = (("flow", "v", "velocity"), ("displacement", "q", "position"))
_BELOW = {"v": "{flow}", "q": "{displacement}", "t": "s"}
_FUNCTIONS = re.compile(r"\b(tanh|sin|cos)\(")
_LETTER = re.compile(r"\b[vqt]\b")


def plugin_text(found: Discovered) -> str:
    """Return a plug-in file with the discovered candidate as an effect, ready for ``insert: [{effect: DiscoveredTerm, at: ...}]``.

    Its coefficients stand as found; with all of them 0 the effect vanishes.
    """
    used = set(_LETTER.findall(" ".join(item.text for item in found.addends)))
    inputs = [(role, letter, word) for role, letter, word in _INPUTS if letter in used]
    names = [f"coefficient_{number}" for number in range(1, len(found.addends) + 1)]
    law = _law(found, names, inputs, timed="t" in used)
    lines = [
        '"""' + "\n".join(line for sentence in _told(found) for line in textwrap.wrap(sentence, 130)) + '\n"""',
        "",
        *(["import math", ""] if _FUNCTIONS.search(law[-1]) else []),
        "from lathesim.component import Input, Output, Parameter",
        "from lathesim.effects.effect import Effect",
        "from lathesim.hookspecs import hookimpl",
        "",
        "",
        "class DiscoveredTerm(Effect):",
        *_declarations(found, names, inputs),
        *law,
        "",
        "",
        "@hookimpl",
        "def register_effects() -> list[type[Effect]]:",
        '    """Return the effect of the discovered term."""',
        "    return [DiscoveredTerm]",
        "",
    ]
    return "\n".join(lines)


def _told(found: Discovered) -> list[str]:
    """Return what the file says of the formula: where it comes from, and how far it goes."""
    domain = ", ".join(f"{item.letter} {item.low:.3g} to {item.high:.3g} {item.unit}" for item in found.domain)
    return [
        "A term that was discovered in a recording: empirical, and unverified.",
        f"F = {found.formula}, at {found.at}.",
        f"It explains {found.share:.0%} of what was missing in a recording that it was not fitted to.",
        f"Found for {domain or 'one recording'}; it says nothing beyond.",
    ]


def _declarations(found: Discovered, names: Sequence[str], inputs: Sequence[tuple[str, str, str]]) -> list[str]:
    """Return the lines of the class that declare its inputs and coefficients."""
    neutral = [f'"{item}": 0.0' for item in names]
    return [
        '    """Adds what was missing in a recording: an empirical formula of the motion, unverified."""',
        "",
        f'    catalogue, family, site = 0, "discovered", "{found.role or "effort"}"',
        f"    neutral = {{{', '.join(neutral)}}}",
        '    fingerprint = "What the formula says."',
        '    experiment = "Repeat the recording at other speeds and positions, and see whether the formula still holds."',
        '    source = "Regression of a recording."',
        "",
        '    incoming = Input("{signal}", doc="what the wire carries")',
        *[f'    {role} = Input("{{{role}}}", doc="{word} of the host")' for role, _, word in inputs],
        '    outgoing = Output("{signal}", doc="with the discovered term")',
        *[
            f'    {label} = Parameter("{_unit(item.of)}", {item.coefficient!r}, doc="times {item.text}")'
            for label, item in zip(names, found.addends, strict=True)
        ],
        "",
    ]


def _law(found: Discovered, names: Sequence[str], inputs: Sequence[tuple[str, str, str]], *, timed: bool) -> list[str]:
    """Return the lines of the method that gives the output."""
    arguments = ["incoming", *[role for role, _, _ in inputs], *(["time"] if timed else []), *names]
    laws = [_FUNCTIONS.sub(r"math.\1(", item.text) for item in found.addends]
    addends = [f"{label} * ({law})" for label, law in zip(names, laws, strict=True)]
    return [
        "    @staticmethod",
        f"    def output({', '.join(f'{item}: float' for item in arguments)}) -> float:",
        f"        if {' and '.join(f'{item} == 0.0' for item in names)}:",
        "            return incoming",
        *[f"        {letter} = {role}" for role, letter, _ in inputs],
        *(["        t = time"] if timed else []),
        f"        return incoming + {' + '.join(addends)}",
    ]


def _unit(of: str) -> str:
    """Return a coefficient's unit in the placeholders of an effect: that of the wire over that of the function (``v^2``, ``q*v``)."""
    if of == "1":
        return "{signal}"
    factors = []
    for factor in of.split("*"):
        letter, _, power = factor.partition("^")
        factors.append(f"({_BELOW[letter]})" + (f"^{power}" if power else ""))
    return f"{{signal}}/({'*'.join(factors)})"
