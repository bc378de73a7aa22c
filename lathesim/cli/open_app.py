"""``lathesim``, ``lathesim tui`` and ``lathesim serve``: the app in the terminal and in a browser."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from lathesim.cli.options import plugins_option
from lathesim.workspace import load_with_workspace

if TYPE_CHECKING:
    from lathesim.tui.app import LathesimApp

FIRST_LESSON = "01_contour_error"
_PUBLIC = ("0.0.0.0", "::")


@click.command()
@click.argument("opened", metavar="[LESSON | RUN.h5]", required=False)
@click.option("--variant", metavar="NAME", help="One of the lesson's variants.")
@plugins_option
def tui(opened: str | None, variant: str | None, plugin_folders: tuple[Path, ...]) -> int:
    """Open the terminal app, with a lesson or a record where one is named."""
    import os
    import sys

    served = "TEXTUAL_DRIVER" in os.environ
    if served:
        from lathesim.tui.served import end_with_parent

        end_with_parent()
    if not served and not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise click.UsageError("the app needs a terminal. In scripts use the commands, see 'lathesim --help'.")
    return open_app(opened, variant, plugin_folders)


def open_app(opened: str | None = None, variant: str | None = None, plugin_folders: tuple[Path, ...] = ()) -> int:
    """Open the app and return its exit code once it is left."""
    import os

    app = make_app(opened, variant, plugin_folders)
    app.run()
    code = app.return_code or 0
    if app.droppable and app.workbench.live is None:
        os._exit(code)  # a search goes on in its thread for seconds; runs and files are written by now
    return code


def make_app(opened: str | None = None, variant: str | None = None, plugin_folders: tuple[Path, ...] = ()) -> LathesimApp:
    """Return the app with what shall be opened on its bench."""
    from lathesim.engine.module_cache import tell_compiling_to
    from lathesim.tui.app import LathesimApp
    from lathesim.tui.model.student_book import KeptState
    from lathesim.tui.model.workbench import Workbench

    workbench, kept = Workbench(lambda: load_with_workspace(plugin_folders)), KeptState.read()
    if opened is None:
        lessons = [(kept.lesson, kept.variant), (kept.lesson, ""), (FIRST_LESSON, "")]
        app = LathesimApp(workbench, kept.screen, lessons=lessons, theme=kept.theme)
        tell_compiling_to(app.tell)
        return app
    first = ""
    if Path(opened).suffix in (".h5", ".hdf5"):
        workbench.open_record(Path(opened))
        first = "results"
    else:
        workbench.open_lesson(opened, variant)
    app = LathesimApp(workbench, first, theme=kept.theme)
    tell_compiling_to(app.tell)
    return app


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
