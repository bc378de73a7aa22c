"""``lathesim wiring LESSON``: how the parts of a machine are wired, as text, as a Mermaid graph, or as the fused source."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from lathesim.cli.options import ChosenLesson, grouped, plugins_option, program_option, set_option, variant_option

if TYPE_CHECKING:
    from lathesim.engine.wiring import Plan


@click.command()
@click.argument("lesson")
@variant_option
@program_option
@set_option
@click.option("--source", "form", flag_value="source", help="The Python module the machine is fused into.")
@click.option("--mermaid", "form", flag_value="mermaid", help="A Mermaid graph of parts and wires.")
@plugins_option
@grouped(chosen=ChosenLesson)
def wiring(chosen: ChosenLesson, form: str | None) -> None:
    """Show what feeds each input of each part of LESSON's machine, in the order in which the parts are updated."""
    plan = chosen.prepared.plan
    if form == "source":
        from lathesim.engine.fuse import fuse

        click.echo(fuse(plan).source)
    else:
        click.echo(mermaid_graph(plan) if form == "mermaid" else wiring_text(plan))


def wiring_text(plan: Plan) -> str:
    """Return the parts in the order of their updates, each with what feeds its inputs, its parameters and what it gives."""
    from lathesim.component import Input, Output, Parameter

    lines = [
        f"sample period {plan.assembly.sample_period:g} s, {plan.steps_per_sample} RK4 steps each; {len(plan.channels)} channels recorded"
    ]
    order = dict.fromkeys([name for name, _ in plan.order] + list(plan.parts))
    for name in order:
        part = plan.parts[name]
        declared = part.component.declarations
        every = f", every {part.every} samples" if part.every > 1 else ""
        lines.append(f"\n{name}: {part.component.__name__}{every}")
        for item in declared:
            full = f"{name}.{item}"
            unit = f"[{declared[item].unit}]"
            if full in plan.feeds:
                lines.append(f"  {item:<22} {unit:<10} <- {_feeding(plan, full)}")
            elif isinstance(declared[item], Parameter):
                lines.append(f"  {item:<22} {unit:<10} = {plan.parameter_values[plan.parameters[full]]:g}")
            elif not isinstance(declared[item], Input) and isinstance(declared[item], Output):
                lines.append(f"  {item:<22} {unit:<10} -> {', '.join(_readers(plan, full)) or '(read by nobody)'}")
    return "\n".join(lines)


def _feeding(plan: Plan, target: str) -> str:
    """Return the source of an input, or its value; a default that is no value for a person is left out."""
    from lathesim.component import Input

    source = plan.feeds[target][1]
    if source != target:
        return source
    declared, value = plan.declaration(target), plan.parameter_values[plan.parameters[target]]
    return "(not wired)" if isinstance(declared, Input) and not declared.shown and value == declared.default else f"{value:g}"


def mermaid_graph(plan: Plan) -> str:
    """Return a Mermaid flow chart: a box for each part, an arrow for each wire with the name and unit of what it carries."""
    from lathesim.engine.assembly import Place

    lines = ["flowchart LR"]
    lines += [f'    {name}["{name}<br/><i>{part.component.__name__}</i>"]' for name, part in plan.parts.items()]
    for target, (kind, source) in plan.feeds.items():
        if source != target:
            start, item = Place.of(source)
            arrow = "-->" if kind == "output" else "-.->"
            lines.append(f'    {start} {arrow}|"{item} [{plan.unit(source)}]"| {Place.of(target).part}')
    return "\n".join(lines)


def _readers(plan: Plan, output: str) -> list[str]:
    return [target for target, (kind, source) in plan.feeds.items() if kind == "output" and source == output]
