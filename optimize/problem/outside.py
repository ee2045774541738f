"""The files, programs and connections that a user's function reads while it runs.

Its stored values are used again as long as its code and the declared data files are the same, so anything
else that it reads must be noticed. Python reports opened files, databases, programs and connections as audit
events; HDF5 opens files by itself, so the two functions of h5py that open them are replaced by ones that
report the name.
"""

from __future__ import annotations

import _thread
import functools
import importlib
import multiprocessing.process
import os
import sys
import threading
import urllib.parse
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tisim.files.python_file import own_folders

SOURCES = (".py", ".pyc", ".so", ".pyd")
"""Endings of files that are opened by imports."""
IMPORTERS = ("importlib._bootstrap_external", "_frozen_importlib_external", "zipimport", "tokenize")
"""Modules that open sources to import them, or to print a line of them."""
INQUIRERS = ("platform", "ctypes.util")
"""Modules of Python that start programs to learn about the machine."""
SYSTEM = tuple(map(Path, ("/usr", "/lib", "/etc", "/dev", "/proc", "/sys")))
"""System folders, which contain no data of a user."""


@dataclass
class Outside:
    """What a function has read.

    files : of the user, links resolved. sources : programs and connections, as words for a message.
    written : files that it made itself; reading them back does not count.
    """

    files: set[Path] = field(default_factory=set)
    sources: list[str] = field(default_factory=list)
    written: set[Path] = field(default_factory=set)


_own = threading.local()
_active: list[Outside] = []
_started: weakref.WeakSet[threading.Thread] = weakref.WeakSet()


@contextmanager
def noticed() -> Iterator[Outside]:
    """Collect what is read in the block, by this thread and by those that it starts."""
    _install()
    outer: Outside | None = getattr(_own, "outside", None)
    found = Outside()
    _own.outside = found
    _active.append(found)
    try:
        yield found
    finally:
        _active[:] = [one for one in _active if one is not found]
        _own.outside = outer
        if outer is not None:  # a search within a function
            outer.files |= found.files - outer.written
            outer.sources += found.sources
            outer.written |= found.written


def is_of_user(path: Path) -> bool:
    """Return whether a file is neither installed, nor part of the system, nor in a program's folder in the
    home."""
    installed = Path(sys.prefix), Path(sys.base_prefix), *own_folders()
    home = os.environ.get("HOME") or os.environ.get("USERPROFILE") or "."
    kept = tuple(Path(home) / name for name in (".cache", ".config", ".local", ".matplotlib"))
    metadata = any(part.endswith((".egg-info", ".dist-info")) for part in path.parts)
    return not metadata and not any(path.is_relative_to(base) for base in (*installed, *SYSTEM, *kept))


def _audit(event: str, arguments: tuple[Any, ...]) -> None:
    """Record an event in the blocks to which its thread belongs."""
    if not _active or event not in _EVENTS:
        return
    for outside in _concerned():
        _EVENTS[event](outside, *arguments)


def _concerned() -> list[Outside]:
    """Return the block of this thread; for a thread that was started in a block, all blocks, as it may work
    for a later one."""
    own: Outside | None = getattr(_own, "outside", None)
    if own is not None:
        return [own]
    here = threading.get_ident()
    inside = any(thread.ident == here and thread.is_alive() for thread in list(_started))
    return list(_active) if inside else []


def _opened(outside: Outside, path: Any, _mode: Any, flags: Any) -> None:
    if not isinstance(path, str | bytes) or not isinstance(flags, int):
        return
    if os.fsdecode(path).endswith(SOURCES) and _caller() in IMPORTERS:
        return
    emptied = bool(flags & os.O_TRUNC)
    _file(outside, path, new=emptied, made=bool(flags & os.O_CREAT), read=not flags & os.O_WRONLY)


def _file(outside: Outside, path: Any, new: bool = False, made: bool = True, read: bool = True) -> None:
    """Record a file that is opened.

    new : whether it is emptied. made : whether it is made if there is none. read : whether its content can be
    read.
    """
    name = Path(os.fsdecode(path)).resolve()
    content = name.is_file() and name.stat().st_size > 0
    if new or (made and not content):
        outside.written.add(name)
    elif content and read and name not in outside.written and is_of_user(name):
        outside.files.add(name)


def _connected_database(outside: Outside, database: Any) -> None:
    if not isinstance(database, str | bytes | os.PathLike):
        return
    name = os.fsdecode(database)
    if name.startswith("file:"):
        address = urllib.parse.urlsplit(name)
        name = "" if "mode=memory" in address.query else urllib.parse.unquote(address.path)
    if name not in ("", ":memory:"):
        _file(outside, name)


def _program(outside: Outside, *arguments: Any) -> None:
    if _caller() not in INQUIRERS:
        first = next((one for one in arguments if isinstance(one, str | bytes | os.PathLike)), "a process")
        listed = next((one for one in arguments if isinstance(one, list | tuple) and one), (first,))
        name = first if isinstance(first, os.PathLike) or first else listed[0]
        outside.sources.append(f"the program {os.fsdecode(name)}" if name != "a process" else name)


def _connection(outside: Outside, _socket: Any, address: Any) -> None:
    outside.sources.append(f"the connection {address!r}")


def _low_thread(outside: Outside) -> None:
    outside.sources.append("a thread of the module _thread")


_EVENTS: dict[str, Callable[..., None]] = {
    "open": _opened,
    "sqlite3.connect": _connected_database,
    "tisim.hdf5.open": _file,
    "tisim.hdf5.create": lambda outside, path: _file(outside, path, new=True),
    **dict.fromkeys(
        ("subprocess.Popen", "os.system", "os.posix_spawn", "os.exec", "os.spawn", "os.fork", "os.forkpty",
         "os.startfile", "pty.spawn", "tisim.process"), _program,
    ),
    "socket.connect": _connection,
    "socket.sendto": _connection,
    "tisim.thread": lambda _outside, thread: _started.add(thread),
    "tisim.low_thread": _low_thread,
    "builtins.input": lambda outside, _: outside.sources.append("the keyboard"),
}  # fmt: skip


def _caller() -> str:
    """Return the name of the module that opens a file or starts a program."""
    frame = sys._getframe(1)
    while frame.f_back is not None and frame.f_globals.get("__name__") in (__name__, "subprocess", "os"):
        frame = frame.f_back
    return str(frame.f_globals.get("__name__"))


_installed: list[str] = []


def _install() -> None:
    """Add the audit hook, which cannot be removed, and report what Python does not report itself."""
    if _installed:
        return
    _installed.append(__name__)
    sys.addaudithook(_audit)
    hdf5 = importlib.import_module("h5py.h5f")
    for name in ("open", "create"):
        _report(hdf5, name, f"tisim.hdf5.{name}", arguments=1)
    _report(threading.Thread, "start", "tisim.thread", arguments=1)
    _report(_thread, "start_new_thread", "tisim.low_thread", arguments=0)
    # A process that is spawned, unlike a forked one, gives no event.
    _report(multiprocessing.process.BaseProcess, "start", "tisim.process", arguments=0)


def _report(owner: Any, name: str, event: str, arguments: int) -> None:
    """Replace a function of a module or class by one that first reports its first arguments as an event."""
    function = getattr(owner, name)

    @functools.wraps(function)
    def reporting(*given: Any, **options: Any) -> Any:
        sys.audit(event, *(given or tuple(options.values()))[:arguments])
        return function(*given, **options)

    setattr(owner, name, reporting)
