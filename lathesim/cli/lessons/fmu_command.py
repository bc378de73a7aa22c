"""``lathesim fmu LESSON --out F.fmu``: a machine or one of its parts for other tools."""

from __future__ import annotations

from pathlib import Path

import click

from lathesim.cli.options import ChosenLesson, OutputPath, of_program


@click.command()
@click.argument("lesson")
@click.option("--out", type=OutputPath(makes_folder=True), required=True, metavar="F.fmu", help="Where the FMU goes.")
@click.option("--part", metavar="NAME", help="Export this part of the machine alone.")
@of_program
def fmu(chosen: ChosenLesson, out: Path, part: str | None) -> int:
    """Write the machine of LESSON as an FMU: FMI 3.0, co-simulation, a library for this kind of system.

    Other tools run it without lathesim. Its variables are called PART.PORT and are in SI units. A communication step is a whole number of
    the lesson's sample periods. A C compiler (cc, gcc or clang) links the library.
    """
    from lathesim.errors import LatheSimError
    from lathesim.fmi.exporting import one_part, whole_machine, write_fmu

    if out.suffix != ".fmu":
        raise LatheSimError("the name of an FMU ends with .fmu.", place=str(out), remedy=f"Write --out {out.with_suffix('.fmu')}.")
    case = chosen.prepared
    duration, seed = case.expected_time or 0.0, case.case.seed
    made = one_part(case.plan, part, duration, seed) if part else whole_machine(case.plan, case.name, duration, seed)
    write_fmu(made, out)
    counts = f"inputs: {len(made.inputs)}, outputs: {len(made.plan.channels)}, parameters: {len(made.parameters)}"
    click.echo(f"{out}: FMI 3.0, co-simulation, {made.platform}; {counts}; steps of {made.plan.assembly.sample_period:g} s.")
    for name in made.held:
        moves = f"{name} moves between two samples in the lesson."
        click.echo(f"{moves} The FMU holds it for a step, so a run with the FMU may differ.", err=True)
    if made.plan.arrays.noises:
        click.echo(f"The noise of seed {seed} is stored for {duration:.4g} s; it begins anew after that.", err=True)
    return 0
