"""Which package compiles the kernels: Taichi, or its maintained fork Quadrants.

Both give the same bits. TISIM_BACKEND names one of them; where it is not set, tisim takes one whose LLVM
knows the processor, as the other makes slower code for it.
"""

from __future__ import annotations

import importlib.util
import os
import sys
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from tisim.backend import processor
from tisim.errors import must

VARIABLE = "TISIM_BACKEND"
LLVM = {"taichi": 15, "quadrants": 22}
"""The packages and the major version of the LLVM inside each. The first one is taken where both know the
processor: they are about as fast there."""
INSTALL = {
    "taichi": "python -m pip install 'taichi>=1.7.4,<1.8'",
    "quadrants": "python -m pip install 'quadrants>=1.3,<1.5'",
}
"""The command that installs each package."""
ADVISED = "tisim.advised"
"""The name of the file that keeps that the user has been told."""


def installed() -> list[str]:
    """Return the packages that are installed, in the order of ``LLVM``. This imports none of them."""
    return [name for name in LLVM if importlib.util.find_spec(name) is not None]


def named() -> str:
    """Return the value of TISIM_BACKEND; empty where it is not set."""
    return os.environ.get(VARIABLE, "")


def automatic(there: Iterable[str], cpu: dict[str, str]) -> str:
    """Return the package to take of those that are there: the first whose LLVM knows the processor, else the
    one with the newest LLVM. It is Taichi where none is there."""
    known = [name for name in there if processor.knows(LLVM[name], cpu)]
    return known[0] if known else max(there, key=LLVM.__getitem__, default="taichi")


def chosen() -> str:
    """Return the package that compiles the kernels in this process: the one that TISIM_BACKEND names, or the
    automatic one where it names none that is installed. ``check`` refuses the latter where it was named."""
    there = installed()
    return named() if named() in there else automatic(there, processor.processor())


def check(taken: str = "") -> None:
    """Raise InputError unless TISIM_BACKEND is not set or names one of the two packages, and it is installed.

    taken : the package that has been imported, where one has; it must be the one that is named.
    The package is imported before anyone asks, so that this is said in a line where the runtime or a command
    starts.
    """
    must(named() in ("", *LLVM), VARIABLE, "taichi or quadrants", named())
    if named():
        rule = f"installed ({INSTALL[named()]}), or {VARIABLE} left out"
        must(named() in installed(), VARIABLE, rule, named())
        must(taken in ("", named()), VARIABLE, f"set before {taken} has been imported", named())


def lost(there: list[str], cpu: dict[str, str]) -> str:
    """Return a line that says what is lost as a package is not installed, and the command that installs it;
    empty where nothing is lost."""
    best, taken = automatic(LLVM, cpu), automatic(there, cpu)
    if best in there:
        return ""
    name, first = processor.first_llvm(cpu)
    knows = "does not know" if first else "may not know"
    return (
        f"{best} is not installed, and the LLVM {LLVM[taken]} of {taken} {knows} this processor"
        f"{f' ({name})' if name else ''}: runs may take up to 3 times as long as with {best}. To install it:"
        f" {INSTALL[best]}"
    )


def advise(folder: Path) -> None:
    """Print what is lost as a package is not installed, to standard error: once for each folder of compiled
    kernels, where a file keeps that it has been said. Nothing is said where TISIM_BACKEND names a package, or
    where the folder cannot be written.

    A Python warning would stop those who make errors of warnings, though nothing is wrong with their results.
    """
    line = "" if named() else lost(installed(), processor.processor())
    if line and sys.stderr:
        # A file that is there, a folder that cannot be written, a stream that is closed or full.
        with suppress(OSError, ValueError):
            (folder / ADVISED).touch(exist_ok=False)
            print(f"tisim: {line}", file=sys.stderr)
