"""Values of the lesson that are off by far are an answer of their own, asked before any effect; beside a friction they are not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from lathesim.diagnosis.selection.search import search
from lathesim.engine.assembly import Assembly
from lathesim.identification.replay.loading import read_for
from lathesim.identification.replay.validation_split import parted
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare
from lathesim.plugins import load_registry
from tests.diagnosis.driven_axis import GAIN as FORCE_CONSTANT
from tests.diagnosis.driven_axis import MASS as TABLE
from tests.diagnosis.driven_axis import VISCOUS as DRAG
from tests.diagnosis.driven_axis import write_recording
from tests.diagnosis.pushed_table import EFFECTS, MASS, VISCOUS, Hidden, experiments, machine, recording


def test_two_values_that_are_off_by_far_are_told_together() -> None:
    hidden = Hidden(mass=1.4 * MASS, viscous=0.5 * VISCOUS)
    found = search(*experiments(recording(hidden, seed=1), recording(hidden, seed=2), effects=EFFECTS, of=machine(sure=0.05)))
    assert found.model.candidates == ()
    assert set(found.jointly_off) == {"x_axis.mass", "x_axis.viscous"}
    values = found.model.fitted.by_name
    assert values["x_axis.mass"] == pytest.approx(1.4 * MASS, rel=0.03)
    assert values["x_axis.viscous"] == pytest.approx(0.5 * VISCOUS, rel=0.1)
    assert found.complete


def test_a_friction_that_a_viscosity_makes_up_for_is_no_value_far_off() -> None:
    hidden = Hidden(dry=15.0)
    found = search(*experiments(recording(hidden, seed=1), recording(hidden, seed=2), effects=EFFECTS, of=machine(sure=0.05)))
    assert found.jointly_off == ()
    assert [candidate.name for candidate in found.model.candidates] == ["CoulombFriction"]


def test_a_value_that_is_off_takes_no_other_along(tmp_path: Path) -> None:
    """A motion shows mass and friction over the force constant: one that is right stays where it was declared."""
    lesson, file = write_recording(tmp_path)
    prepared = prepare(load_lesson(lesson), load_registry(installed=False))
    loaded, recorded = read_for(prepared, file, load_registry(installed=False))
    sure = {"x_axis.mass": 0.05 * 2.0 * TABLE, "x_axis.viscous": 0.15 * DRAG, "x_drive.effort_constant": 0.02 * FORCE_CONSTANT}
    given = {"x_axis.mass": 2.0 * TABLE, "x_axis.viscous": DRAG, "x_drive.effort_constant": FORCE_CONSTANT}
    machine_as_given = replace(loaded, assembly=with_values(loaded.assembly, given), uncertain=sure)
    experiment, validation, _ = parted(machine_as_given, file.name, recorded.record, ())
    found = search(experiment, validation)
    assert found.jointly_off == ("x_axis.mass",)
    values = found.model.fitted.by_name
    assert values["x_axis.mass"] == pytest.approx(TABLE, rel=0.01)
    assert values["x_drive.effort_constant"] == pytest.approx(FORCE_CONSTANT, rel=2e-3)


def with_values(assembly: Assembly, values: dict[str, float]) -> Assembly:
    parts = []
    for part in assembly.parts:
        own = {name.partition(".")[2]: value for name, value in values.items() if name.partition(".")[0] == part.name}
        parts.append(replace(part, parameters={**part.parameters, **own}))
    return replace(assembly, parts=tuple(parts))
