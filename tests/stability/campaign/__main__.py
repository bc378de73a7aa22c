"""Campaigns of the stability part.

    python -m tests.stability.campaign taps [--cases 100]
    python -m tests.stability.campaign chatter [--cases 150] [--half test|tuning]
    python -m tests.stability.campaign learning [--cases 50]
    python -m tests.stability.campaign cutting [--cases 6]
    python -m tests.stability.campaign network [--cases 3]

Each result is appended to a file under ``lathesim_runs/campaign/``; a second start goes on where the first ended.
"""

from __future__ import annotations

import argparse
from pathlib import Path


def main() -> None:
    """Run the campaign that the command line names."""
    parser = argparse.ArgumentParser(prog="python -m tests.stability.campaign", description="Measure the stability part on many cases.")
    parser.add_argument("campaign", choices=("taps", "chatter", "learning", "cutting", "network"))
    parser.add_argument("--cases", type=int, help="how many cases of each kind")
    parser.add_argument("--first", type=int, default=0, help="number of the first case: each is drawn by its number")
    parser.add_argument(
        "--half", choices=("tuning", "test"), default="test", help="rigs to derive limits on, or rigs that are only measured"
    )
    parser.add_argument("--only", default="", help="one group of learning; of taps: intervals")
    parser.add_argument("--out", type=Path, help="file of the results, appended")
    asked = parser.parse_args()
    path = asked.out or Path("lathesim_runs") / "campaign" / f"{asked.campaign}.jsonl"
    if asked.campaign == "chatter":
        from tests.stability.campaign import chatter

        chatter.run(range(asked.first, asked.first + (asked.cases or 150)), asked.half, path)
    if asked.campaign == "cutting":
        from tests.stability.campaign import cutting

        cutting.run(asked.cases or 6, path)
    if asked.campaign == "learning":
        from tests.stability.campaign import learning

        learning.run(range(asked.first, asked.first + (asked.cases or 50)), path, asked.only)
    if asked.campaign == "network":
        from tests.stability.campaign import slide_network

        slide_network.run(asked.cases or 3, path)
    if asked.campaign == "taps":
        from tests.stability.campaign import taps

        taps.run(range(asked.first, asked.first + (asked.cases or 100)), path, asked.only)


if __name__ == "__main__":
    main()
