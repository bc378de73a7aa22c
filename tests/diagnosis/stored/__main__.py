"""``python -m tests.diagnosis.stored``: compare every stored answer bit for bit, or store the answers of the program as it is."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from tests.diagnosis.stored.answers import NAMES, asked, differences, is_here, store, stored


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; 1 where an answer differs."""
    parser = argparse.ArgumentParser(prog="python -m tests.diagnosis.stored", description=__doc__)
    parser.add_argument("cases", nargs="*", default=[name for name in NAMES if is_here(name)], help="names of cases; all without any")
    parser.add_argument("--write", action="store_true", help="store what is answered now")
    parser.add_argument("--tolerance", type=float, default=0.0, help="relative difference of two numbers that is none")
    chosen = parser.parse_args(arguments)
    known, differ = stored(), 0
    for name in chosen.cases:
        answer = asked(name)
        found = list(differences(known.get(name, {}), answer, chosen.tolerance)) if name in known else ["nothing was stored"]
        differ += bool(found)
        print(f"{name}: {answer['verdict']}, {'; '.join(found[:3]) or 'equal'}", flush=True)
        known[name] = answer
    if chosen.write:
        store(known)
    return int(bool(differ) and not chosen.write)


if __name__ == "__main__":
    raise SystemExit(main())
