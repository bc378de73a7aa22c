"""``lathesim help [TOPIC]``: the manual."""

from __future__ import annotations

import sys

import click


@click.command("help")
@click.argument("topic", required=False)
def help_(topic: str | None) -> None:
    """List the chapters of the manual, or print one."""
    from lathesim.manual.chapters import chapter, chapters

    if topic is None:
        for found in chapters():
            click.echo(f"{found.topic:<18} {found.title}")
        click.echo("\n'lathesim help TOPIC' prints a chapter, 'lathesim COMMAND --help' tells the options of a command.")
        return
    text = chapter(topic).text
    if not sys.stdout.isatty():
        click.echo(text)
        return
    from rich.console import Console
    from rich.markdown import Markdown

    Console(width=min(110, Console().width)).print(Markdown(text))
