"""The machine templates that are shipped, put together as a lesson would have them."""

from pathlib import Path

from lathesim.lessons.insertion import Machinery
from lathesim.lessons.lesson import load_machine
from lathesim.lessons.simulate import check_machine
from lathesim.plugins import load_registry

MACHINES = Path(__file__).parents[1] / "lesson_configs" / "machines"


def shipped_machine(name: str) -> Machinery:
    """Return the assembly of a template by its name, with the project's own parts only."""
    return check_machine(load_machine(MACHINES / f"{name}.yaml"), load_registry(installed=False)).assembly
