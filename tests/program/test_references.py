"""The interpreter against exact motions that another interpreter produced."""

import importlib.util
import json
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from lathesim.errors import ProgramError
from lathesim.program.canonical_moves import canon
from lathesim.program.interpreter import interpret
from lathesim.program.path import lay_path
from lathesim.program.program_file import load_program
from lathesim.program.words import read_program_file
from tests.shared_data import SHARED, needs_shared

GCODE = SHARED / "gcode"

PAPER = ["paper_basic", "paper_css", "paper_inch_inc"]
LINUXCNC = [
    "arc_tolerance_ok", "arcs_ik", "arcs_inc", "arcs_r", "css", "dia_radius", "dwell_mcodes", "feed_modes", "g33_thread", "g92_offset",
    "lexical", "units_switch", "g76_lcnc",
]  # fmt: skip
FANUC = ["fanuc_modes", "fanuc_uw", "fanuc_g90_g94", "fanuc_g92_g32", "fanuc_g70_profile"]


def comparer(name: str = "compare_moves") -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, GCODE / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def events(canonical: dict) -> list:
    """What happens between moves; switching mist off is not told apart from switching coolant off here."""
    return [(e["type"], e["line"], e["before_move"], e.get("dir")) for e in canonical["events"] if e["type"] != "mist_off"]


@needs_shared
@pytest.mark.parametrize(
    ("name", "dialect"),
    [(n, "paper") for n in PAPER] + [(n, "linuxcnc") for n in LINUXCNC] + [(n, "fanuc") for n in FANUC],
)
def test_small_programs_move_as_their_references(name: str, dialect: str) -> None:
    source = next((GCODE / "micro").glob(f"{name}.*"))
    reference = json.loads((GCODE / "micro_reference" / f"{name}.json").read_text())
    program = load_program(source, dialect)
    made = canon(program)
    assert comparer().compare(reference, made["moves"]) == []
    if dialect != "fanuc" and name != "g76_lcnc":  # there moves of no length are counted otherwise, and with them the indices differ
        assert events(made) == events(reference)
    expanded = not any(move["type"] == "cycle" for move in reference["moves"])
    for length in ("cut_path_mm", "rapid_path_mm") if expanded else ():
        assert made["summary"][length] == pytest.approx(reference["summary"][length], abs=1e-5)
    assert lay_path(program).segments > 0


@needs_shared
@pytest.mark.parametrize(
    ("file", "reference", "dialect"),
    [
        ("nhsd_turn_two_diameters.nc", "nhsd_two_diameters", "linuxcnc"),
        ("pastebin_ZQ0SRN2f.ngc", "pastebin_arc", "linuxcnc"),
        ("easyplot_TEST_TURN.NC", "easyplot_turn", "fanuc"),
        ("enier_240916_20012_STEP_SHAFT_HP.nc", "enier_step_shaft_hp", "fanuc"),
        ("enier_240916_o20012.nc", "enier_o20012_step_shaft", "fanuc"),
        ("enier_240924_valve.nc", "enier_valve", "fanuc"),
        ("es_sim_g71_ej1.nc", "es_g71_negX", "fanuc"),
        ("pl_O2001_walek.nc", "pl_O2001_walek", "fanuc"),
    ],
)
def test_real_programs_move_as_their_references(file: str, reference: str, dialect: str) -> None:
    expected = json.loads((GCODE / "programs_reference" / f"{reference}.json").read_text())
    assert comparer().compare(expected, canon(load_program(GCODE / "programs" / file, dialect))["moves"]) == []


ROUGHED = [
    ("micro/fanuc_g70_profile.nc", "micro_reference/fanuc_g70_profile"),
    ("programs/enier_240916_o20012.nc", "programs_reference/enier_o20012_step_shaft"),
    ("programs/enier_240924_valve.nc", "programs_reference/enier_valve"),
    ("programs/es_sim_g71_ej1.nc", "programs_reference/es_g71_negX"),
    ("programs/pl_O2001_walek.nc", "programs_reference/pl_O2001_walek"),
]


@needs_shared
@pytest.mark.parametrize(("file", "reference"), ROUGHED)
def test_a_roughing_cycle_leaves_its_allowance_and_gouges_nothing(file: str, reference: str) -> None:
    expected = json.loads((GCODE / f"{reference}.json").read_text())
    made = canon(load_program(GCODE / file, "fanuc"))["moves"]
    cycles = [item for item in expected["moves"] if item["type"] == "cycle" and item["cycle"] == "G71"]
    assert cycles
    for item in cycles:
        moves = [move for move in made if move.get("cycle") == "G71" and move["cycle_line"] == item["line"]]
        assert comparer("check_cycle").check_g71(item, moves) == []


@needs_shared
@pytest.mark.parametrize(
    ("file", "sentence"),
    [
        ("blogspot_g72.nc", ":1: G96 needs a surface speed and has none."),
        ("easyplot_TEST_TURN.NC", ":1: T01 is not in the dialect 'paper'; 'linuxcnc' and 'fanuc' have it (tool and offset)."),
        ("enier_240916_20012_STEP_SHAFT_HP.nc", ":2: O20012 is not in the dialect 'paper'; 'fanuc' has it (program number)."),
        ("enier_240916_o20012.nc", ":2: O20012 is not in the dialect 'paper'; 'fanuc' has it (program number)."),
        ("enier_240924_valve.nc", ":2: O2003 is not in the dialect 'paper'; 'fanuc' has it (program number)."),
        ("es_sim_g71_ej1.nc", ":1: O0001 is not in the dialect 'paper'; 'fanuc' has it (program number)."),
        ("nhsd_turn_two_diameters.nc", ":10: G21 is not in the dialect 'paper'; 'linuxcnc' and 'fanuc' have it (millimetres)."),
        ("pastebin_ZQ0SRN2f.ngc", ":3: G21 is not in the dialect 'paper'; 'linuxcnc' and 'fanuc' have it (millimetres)."),
        ("pl_O2001_walek.nc", ":1: O2001 is not in the dialect 'paper'; 'fanuc' has it (program number)."),
    ],
)
def test_real_programs_outside_the_dialect_are_refused_where_they_first_go_wrong(file: str, sentence: str) -> None:
    with pytest.raises(ProgramError) as refused:
        load_program(GCODE / "programs" / file, "paper")
    assert f"{file}{sentence}" in str(refused.value)


@needs_shared
@pytest.mark.parametrize("dialect", ["paper", "linuxcnc", "fanuc"])
def test_no_file_of_the_reference_set_makes_anything_but_a_program_or_a_program_error(dialect: str) -> None:
    for source in [*(GCODE / "micro").iterdir(), *(GCODE / "programs").iterdir()]:
        try:
            interpret(read_program_file(source), dialect)
        except ProgramError as error:
            assert error.place.startswith(str(source)), error


USUAL = ("The program ends without M02 or M30.", "The tool feeds while the spindle stands still.")
"""What may be said of a program that comes along: the published ones end so, and an axis is exercised without a spindle."""


def test_the_programs_that_come_along_can_be_laid_as_paths() -> None:
    folder = Path(__file__).parents[2] / "part_programs"
    programs = sorted(folder.glob("*.nc"))
    assert len(programs) >= 7
    for source in programs:
        program = load_program(source, "auto")
        path = lay_path(program)
        assert tuple(path.table[0, 2:4]) == ((0.1, 0.2) if program.dialect == "fanuc" else (0.0, 0.0))
        assert np.isfinite(path.table).all()
        for warned in program.warnings:
            assert warned.sentence in USUAL, source.name
