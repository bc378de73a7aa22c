"""Fifteen pairs that no motion tells apart: ``python -m tests.experiments.separation.alike --out DIR``.

Two pairs have one equation. Two need a current that is not recorded, four a scale that is not. Seven are of sizes far below what the
sensors resolve, as a diagnosis would hand them on: of every parameter that makes a force or a deviation. ``lathesim experiment`` must
call none of them decidable, and say what would tell.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any, NamedTuple

from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.lesson import load_lesson
from tests.experiments.separation.warm_command import command

LESSON = "22_what_is_wrong_with_this_machine"
CURRENT, SCALE = "x_drive.current", "x_scale.position"


class Pair(NamedTuple):
    """Two rivals, channels that are not recorded, and the largest size [SI] of each parameter that is known to be small."""

    first: str
    second: str
    missing: tuple[str, ...] = ()
    small: dict[str, float] = {}


PAIRS = (
    Pair("CumulativePitchError@x_scale", "ScaleFactorError@x_scale"),
    Pair("PeriodicPitchError@x_scale", "EncoderEccentricity@x_scale"),
    Pair("ForceOffset@x_axis", "ConverterOffset@x_drive", (CURRENT,)),
    Pair("DriveGainError@x_drive", "nothing", (CURRENT,), {"error": 1e-3, "sag": 1e-6}),
    Pair("Backlash@x_scale", "nothing", (SCALE,)),
    Pair("PeriodicPitchError@x_scale", "CumulativePitchError@x_scale", (SCALE,)),
    Pair("ThermalScrewGrowth@x_scale", "CumulativePitchError@x_scale", (SCALE,)),
    Pair("TorsionalWindUp@x_scale", "Backlash@x_scale", (SCALE,)),
    Pair("Backlash@x_scale", "nothing", (), {"width": 1e-10}),
    Pair("CoulombFriction@x_axis", "PreslidingFriction@x_axis", (), {"level": 1e-5, "excess": 1e-6, "bristle_damping": 1e-4}),
    Pair("TorqueRipple@x_axis", "Cogging@x_axis", (), {"share": 1e-8, "amplitude": 1e-6, "second": 1e-6}),
    Pair("EncoderEccentricity@x_encoder", "nothing", (), {"amplitude": 1e-11}),
    Pair("ForceOffset@x_axis", "ConverterOffset@x_drive", (), {"offset": 1e-9}),
    Pair("TransportDelay@x_drive", "CurrentLoopLag@x_drive", (), {"delay": 1e-9, "time_constant": 1e-9}),
    Pair("ThermalScrewGrowth@x_scale", "CumulativePitchError@x_scale", (), {"strain": 1e-10, "slope": 1e-10}),
)


def written_lesson(folder: Path, missing: tuple[str, ...]) -> Path:
    """Write the lesson without some of its channels, and return its place."""
    lesson = load_lesson(LESSON)
    data: dict[str, Any] = json.loads(json.dumps(lesson.source.data, default=str))
    recordings = data["recordings"]
    recordings["compare"] = {name: entry for name, entry in recordings["compare"].items() if name not in missing}
    place = folder / "lesson.yaml"
    place.write_text(changed_lesson(lesson, [], {}, folder, further={"recordings": recordings}), encoding="utf-8")
    return place


def answered(pair: Pair, folder: Path, at_most: str, programs: int) -> dict[str, Any]:
    """Return what the program says of a pair."""
    folder.mkdir(parents=True, exist_ok=True)
    lesson = written_lesson(folder, pair.missing)
    rivals: list[object] = ["--between", f"{pair.first},{pair.second}"]
    if pair.small:
        sizes = {name: {"value": size, "low": 0.1 * size, "high": size} for name, size in pair.small.items()}
        effects = [
            {"effect": name, "at": at, "parameters": sizes} for name, _, at in (text.partition("@") for text in (pair.first, pair.second))
        ]
        told = {"schema": "lathesim-diagnosis/1", "lesson": load_lesson(lesson).title, "verdict": "tied", "effects": effects}
        (folder / "tied.json").write_text(json.dumps(told), encoding="utf-8")
        rivals = [folder / "tied.json"]
    found = command(
        "experiment", lesson, *rivals, "--at-most", at_most, "--programs", programs, "--no-trial", "--out", folder / "next", "--json"
    )
    said = found.get("if_nothing_tells") or found.get("error", "")
    decidable = found.get("decidable", False)
    return {
        "pair": f"{pair.first}, {pair.second}",
        "missing": pair.missing,
        "decidable": decidable,
        "apart": [item["apart"] for item in found.get("pairs", [])],
        "said": said,
    }


def main() -> None:
    """Ask for all pairs and print how many are called decidable."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--pairs", type=int, default=len(PAIRS))
    parser.add_argument("--at-most", default="8 s")
    parser.add_argument("--programs", type=int, default=30)
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    for number, pair in list(enumerate(PAIRS))[asked.first : asked.first + asked.pairs]:
        folder = asked.out.resolve() / f"pair_{number:02d}"
        kept = folder / "result.json"
        if not kept.is_file():
            result = answered(pair, folder, asked.at_most, asked.programs)
            kept.write_text(json.dumps(result, indent=2), encoding="utf-8")
        print(kept.read_text(encoding="utf-8"), flush=True)
    results = [json.loads(kept.read_text(encoding="utf-8")) for kept in sorted(asked.out.glob("pair_*/result.json"))]
    print(f"called decidable: {sum(item['decidable'] for item in results)} of {len(results)} pairs that cannot be told")


if __name__ == "__main__":
    main()
