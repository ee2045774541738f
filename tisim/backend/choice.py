"""The choice of the kernel compiler: Taichi, or its maintained fork Quadrants.

Both give the same bits. TISIM_BACKEND names one of them; if it is not set, tisim takes one whose LLVM knows
the processor, as the other one makes slower code for it.
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
"""The packages and the major version of the LLVM in each. The first one is taken if both know the processor,
as they are then about equally fast."""
INSTALL = {
    "taichi": "python -m pip install 'taichi>=1.7.4,<1.8'",
    "quadrants": "python -m pip install 'quadrants>=1.3,<1.5'",
}
"""The command that installs each package."""
ADVISED = "tisim.advised"
"""Name of the file that records that the user has been advised."""


def installed() -> list[str]:
    """Return the installed packages, in the order of ``LLVM``, without importing them."""
    return [name for name in LLVM if importlib.util.find_spec(name) is not None]


def named() -> str:
    """Return the value of TISIM_BACKEND; empty if it is not set."""
    return os.environ.get(VARIABLE, "")


def automatic(there: Iterable[str], cpu: dict[str, str]) -> str:
    """Return the one of the given packages to use: the first whose LLVM knows the processor, else the one
    with the newest LLVM.

    It is Taichi if none is given.
    """
    known = [name for name in there if processor.knows(LLVM[name], cpu)]
    return known[0] if known else max(there, key=LLVM.__getitem__, default="taichi")


def chosen() -> str:
    """Return the package that compiles the kernels in this process.

    It is the one named by TISIM_BACKEND if that is installed, else the automatic choice. ``check`` then
    refuses a name that is not installed.
    """
    there = installed()
    return named() if named() in there else automatic(there, processor.processor())


def check(taken: str = "") -> None:
    """Raise InputError unless TISIM_BACKEND is unset, or names one of the two packages and it is installed.

    taken : the package that has been imported already, if any; it must be the named one.

    The package is imported before this check, so that the runtime or a command can report the error in one
    line when it starts.
    """
    must(named() in ("", *LLVM), VARIABLE, "taichi or quadrants", named())
    if named():
        rule = f"installed ({INSTALL[named()]}), or {VARIABLE} left out"
        must(named() in installed(), VARIABLE, rule, named())
        must(taken in ("", named()), VARIABLE, f"set before {taken} has been imported", named())


def lost(there: list[str], cpu: dict[str, str]) -> str:
    """Return advice on a package whose absence makes runs slower, with the command that installs it; empty if
    there is none."""
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
    """Print the advice on a missing package to standard error, once for each folder of compiled kernels.

    A file in the folder records that it has been printed. Nothing is printed if TISIM_BACKEND names a
    package, or if the folder cannot be written. A Python warning is not used: it would stop users who turn
    warnings into errors, although their results are correct.
    """
    line = "" if named() else lost(installed(), processor.processor())
    if line and sys.stderr:
        # The file exists, the folder cannot be written, or the stream is closed or full.
        with suppress(OSError, ValueError):
            (folder / ADVISED).touch(exist_ok=False)
            print(f"tisim: {line}", file=sys.stderr)
