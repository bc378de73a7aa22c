"""``lathesim schema``: the JSON Schema of lessons and machine templates."""

from __future__ import annotations

import click


@click.command()
@click.argument("kind", type=click.Choice(["lesson", "machine"]), default="lesson")
def schema(kind: str) -> None:
    """Print the JSON Schema of a lesson (or of a machine template), for editors that check YAML while you type."""
    import json

    from lathesim.lessons.schema import json_schema

    click.echo(json.dumps(json_schema(kind), indent=2))
