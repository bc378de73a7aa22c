"""``lathesim couple ASSEMBLY.yaml``: the receptance of the tip of parts put together."""

from __future__ import annotations

import json
from pathlib import Path

import click


@click.command()
@click.argument("assembly", type=click.Path(path_type=Path), metavar="ASSEMBLY.yaml")
@click.option("--frequency", default="100..5000:50", show_default=True, metavar="LOW..HIGH:N", help="Frequencies [Hz].")
@click.option("--json", "as_json", is_flag=True, help="Write the result as JSON (schema lathesim-couple/1) and nothing else.")
def couple(assembly: Path, frequency: str, as_json: bool) -> None:
    """Show the receptance of the free tip of the beams in ASSEMBLY.yaml, the first part at the tip, the last one free at its far end."""
    from lathesim.cli.lobes import read_range
    from lathesim.stability.assembly import load_assembly
    from lathesim.stability.coupling import assembly_tip

    loaded = load_assembly(assembly)
    asked = read_range("--frequency", frequency)
    tips = [assembly_tip(loaded.beams, value, model=loaded.model, joints=loaded.joints) for value in asked]
    if as_json:
        rows = [
            {
                "frequency_hz": value,
                "receptance": [[[float(item.real), float(item.imag)] for item in row] for row in tip],
            }
            for value, tip in zip(asked, tips, strict=True)
        ]
        click.echo(json.dumps({"schema": "lathesim-couple/1", "model": loaded.model, "rows": rows}, indent=2))
        return
    click.echo(f"{loaded.title}: displacement over force at the tip, model {loaded.model}\n")
    click.echo(f"{'f [Hz]':>10}{'Re H [m/N]':>16}{'Im H [m/N]':>16}{'|H| [m/N]':>16}")
    for value, tip in zip(asked, tips, strict=True):
        h = complex(tip[0, 0])
        click.echo(f"{value:>10.1f}{h.real:>16.5e}{h.imag:>16.5e}{abs(h):>16.5e}")
