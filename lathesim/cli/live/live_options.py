"""Options that the live commands share."""

from __future__ import annotations

import click

STOPPED = 130

host_option = click.option(
    "--host", default="127.0.0.1", show_default=True, help="Another address of this machine, so that others can connect."
)
axis_option = click.option("--axis", "axis_texts", multiple=True, metavar="NAME=PART.INPUT", help="What follows an axis of the set-points.")


def read_axes(texts: tuple[str, ...]) -> dict[str, str]:
    """Return ``name -> part.item`` for the options ``--axis x=x_controller.reference``."""
    found = {}
    for text in texts:
        name, equals, item = text.partition("=")
        if not equals or not name.strip() or item.count(".") != 1:
            raise click.UsageError(f"--axis {text}: write it as --axis x=x_controller.reference.")
        found[name.strip()] = item.strip()
    return found
