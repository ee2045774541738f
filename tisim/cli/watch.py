"""The command ``tisim watch`` shows a run in the browser while it is running."""

from __future__ import annotations

import os
import tempfile
import threading
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tisim.cli.inspect import World
from tisim.cli.options import Plugins, nameable
from tisim.errors import must
from tisim.files import regular_file
from tisim.streams import say

if TYPE_CHECKING:
    from tisim.watch.folder import Kind
    from tisim.watch.watched import Watched

Folder = Annotated[
    Path,
    typer.Argument(
        help="The folder of a run, of a search or of 'tisim cost', or a file in it.",
        metavar="OUT",
        callback=nameable,
    ),
]


def watch(
    folder: Folder,
    port: Annotated[int, typer.Option(help="Port of this machine; 0 for one that is free.")] = 0,
    open_: Annotated[
        bool, typer.Option("--open/--no-open", help="Open the page in the browser of the system.")
    ] = True,
    world: World = 0,
    plugins: Plugins = None,
) -> None:
    """Show a run, a search or a study of costs in the browser while it goes on: the page of 'tisim report',
    kept up to date.

    The page is served to this machine alone, at an address with a random token, until Ctrl-C. Nothing is
    written. After the first page it takes less than 1 % of the cores.
    """
    from tisim.watch.folder import WatchedFolder
    from tisim.watch.server import WatchServer

    exists = regular_file.is_folder(folder) or regular_file.exists(folder)
    must(exists, "folder to watch", "an existing folder or file", str(folder))
    watched = WatchedFolder(folder, lambda kind: _begin(kind, folder, world))
    with WatchServer(watched.answers, port) as server, _link(server.address) as link:
        print(server.address, flush=True)
        say("watching until Ctrl-C")
        if open_:
            webbrowser.open(link.as_uri())
        try:
            threading.Event().wait()
        except KeyboardInterrupt:
            say("stopped")


def _begin(kind: Kind, path: Path, world: int) -> Watched:
    """Begin to watch a search, a study of costs or a run."""
    if kind == "search":
        from tisim.optimize.report.watched_search import WatchedSearch

        return WatchedSearch(path)
    if kind == "cost":
        from tisim.watch.cost_study import WatchedStudy

        return WatchedStudy(path)
    from tisim.watch.run import WatchedRun

    run = WatchedRun(path, world)
    run.check()
    return run


@contextmanager
def _link(address: str) -> Iterator[Path]:
    """Yield a page that leads to an address, and that only this user can read.

    The command that opens a browser has its argument in the list of processes, which all users see.
    """
    handle, name = tempfile.mkstemp(prefix="tisim_watch_", suffix=".html")
    path = Path(name)
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            url = escape(address)
            file.write(f'<!doctype html><meta http-equiv="refresh" content="0;url={url}">')
            file.write(f'<title>tisim</title><a href="{url}">to the page</a>')
        yield path
    finally:
        path.unlink(missing_ok=True)
