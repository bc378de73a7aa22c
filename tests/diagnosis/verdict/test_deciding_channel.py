"""Where effects are tied, the channel that would tell them apart is named."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from lathesim.diagnosis.diagnose import ask, diagnose
from lathesim.effects.offset_and_gain import ConverterOffset, ForceOffset
from lathesim.identification.replay.loading import load_case
from lathesim.lessons.lesson import load_lesson
from lathesim.plugins import load_registry
from tests.diagnosis.rigs.cases import schedule, write_case


@pytest.mark.slow
def test_a_current_tells_an_offset_of_a_force_from_one_of_a_converter(tmp_path: Path) -> None:
    """From command and place alone they are the same; the current shows which of the two it is."""
    case = next(case for case in schedule(1, {"single": 12}) if case.rig.name == "screw_tacho_1k" and case.keys == ("gravity",))
    folder = write_case(replace(case, rig=replace(case.rig, seconds=3.0)), tmp_path)[0]
    lesson = folder / "lesson.yaml"
    without = folder / "without.yaml"
    without.write_text("".join(line for line in lesson.read_text().splitlines(keepends=True) if "current" not in line))
    told = {}
    for file in (lesson, without):
        loaded = load_case(load_lesson(file), [folder / "fit.csv", folder / "validate.csv"], load_registry())
        told[file] = diagnose(ask("a rig", loaded.machine, loaded.recordings, (ForceOffset, ConverterOffset)))
    assert [told[lesson].verdict, told[without].verdict] == ["named", "tied"]
    (effect,) = told[without].effects
    assert (effect.separating_experiment or "").startswith("Not isolable with these channels: record x_drive.current too, where ")
    assert told[lesson].effects[0].effect == "ForceOffset"
