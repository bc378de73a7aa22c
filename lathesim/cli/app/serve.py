"""``lathesim serve``: the terminal app in a browser."""

from __future__ import annotations

import click

_PUBLIC = ("0.0.0.0", "::")


@click.command()
@click.argument("opened", metavar="[LESSON | RUN.h5]", required=False)
@click.option("--port", type=click.IntRange(1, 65535), default=8000, show_default=True, help="Where the page is: http://127.0.0.1:PORT.")
@click.option("--host", default="127.0.0.1", show_default=True, help="Another address of this machine, so that others can open it.")
@click.option("--sessions", type=click.IntRange(1, 64), default=4, show_default=True, help="Pages that may be open at once.")
def serve(opened: str | None, port: int, host: str, sessions: int) -> int:
    """Serve the terminal app to browsers of this machine, one app for each page.

    Whoever can open the page can run simulations and write files here as you: with --host, let in only whom you trust.
    """
    import socket

    from lathesim.errors import LatheSimError

    try:
        from lathesim.tui.served import AppServer
    except ModuleNotFoundError as error:
        remedy = "Install it with: python -m pip install 'lathesim[web]'"
        raise LatheSimError(f"the app in a browser needs the package '{error.name}'.", remedy=remedy) from None
    with socket.socket() as trial:
        trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            trial.bind((host, port))
        except OSError as error:
            raise LatheSimError(f"{host}:{port} cannot be opened: {error.strerror}.", remedy="Choose another with --port.") from None
    if host in _PUBLIC:
        click.echo("Everybody in the network can now run simulations and write files here as you.", err=True)
    click.echo(f"Open http://{host}:{port} in a browser; Ctrl-C ends it.")
    AppServer([opened] if opened else [], host, port, sessions).serve()
    return 0
