"""A check that workers run the same program, so that their results agree bit by bit."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.metadata import version
from textwrap import shorten

from tisim import InputError, __version__
from tisim.backend import runtime
from tisim.errors import must
from tisim.files.python_file import OWN_PACKAGES, own_folders
from tisim.scene import plugins
from tisim.scene.scene import PHYSICS_VERSION


def program() -> dict[str, str]:
    """Return all properties of the program and machine that affect the bits of a result.

    Scene, precision, device and arithmetic are not included. NumPy and SciPy draw the starts; ``sum`` of
    Python 3.12 rounds differently from Python 3.11; mathematical functions differ between processors.
    """
    return {
        "tisim": __version__,
        "physics": str(PHYSICS_VERSION),
        "code": source(),
        "backend": runtime.backend(),
        "Python": ".".join(platform.python_version_tuple()[:2]),
        "NumPy": version("numpy"),
        "SciPy": version("scipy"),
        "machine": platform.machine(),
        **plugins.installed(),
    }


@cache
def source() -> str:
    """Return the first 12 digits of a SHA-256 of all source files, because files of a version may have been
    edited."""
    files = {
        f"{package.replace('.', '/')}/{path.relative_to(folder).as_posix()}": path
        for package, folder in zip(OWN_PACKAGES, own_folders(), strict=True)
        for path in folder.rglob("*.py")
    }
    digest = hashlib.sha256()
    for name, path in sorted(files.items()):
        digest.update(name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:12]


def agree(ours: Mapping[str, str], theirs: Mapping[str, str], who: str) -> None:
    """Raise an InputError that names both sides unless they are the same."""
    differ = [name for name in {**ours, **theirs} if ours.get(name) != theirs.get(name)]
    must(not differ, who, f"of {_versions_of(ours, differ)}, as the search is", _versions_of(theirs, differ))


def stranger(answer: object, who: str) -> InputError:
    """Return the error for a worker that sent no valid description of its program."""
    ours = program()
    rule = f"one with the program of the search ({_versions_of(ours, ours)})"
    return InputError(f"{who} must be {rule}; received {shorten(repr(answer), 200)}")


def _versions_of(program: Mapping[str, str], names: Iterable[str]) -> str:
    return ", ".join(f"{name} {program.get(name, 'unknown')}" for name in names)
