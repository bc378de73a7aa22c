"""``lathesim`` and ``lathesim tui``: the terminal app."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from lathesim.cli.options import plugins_option
from lathesim.cli.registry import load_with_workspace

if TYPE_CHECKING:
    from lathesim.tui.app import LathesimApp

FIRST_LESSON = "01_contour_error"


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
    from lathesim.engine.compiling.compile_notice import tell_compiling_to
    from lathesim.tui.app import LathesimApp
    from lathesim.tui.model.workbench import Workbench

    workbench = Workbench(lambda: load_with_workspace(plugin_folders))
    if opened is None:
        app = LathesimApp(workbench, lesson=FIRST_LESSON)
        tell_compiling_to(app.tell)
        return app
    first = "bench"
    if Path(opened).suffix in (".h5", ".hdf5"):
        workbench.open_record(Path(opened))
        first = "results"
    else:
        workbench.open_lesson(opened, variant)
    app = LathesimApp(workbench, first)
    tell_compiling_to(app.tell)
    return app
