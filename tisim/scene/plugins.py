"""Plugins: parts of scenes defined outside tisim, in a Python file or an installed package.

A package names its modules under the entry point group ``tisim.effects``; they are imported when a scene is
read from plain data. The components of a plugin are found by their kind, like tisim's own. The digest of a
scene that uses a plugin includes a checksum of its file.
"""

from __future__ import annotations

import sys
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

from tisim import components, effects, geometry, operators, packing, scene, sources, steppers
from tisim.components import serialization
from tisim.components.component import Component
from tisim.errors import InputError, Words, must, printable
from tisim.files import python_file

GROUP = "tisim.effects"


def load(path: str | Path) -> ModuleType:
    """Import a Python file of the user, so that the parts in it can be found by name.

    InputError is raised if it cannot be imported, or if it defines a kind whose name is taken; none of its
    parts are then known.
    """
    _load_own()
    module = python_file.load(path)
    try:
        _check(module)
    except InputError:
        python_file.unload(module.__name__)
        raise
    return module


def load_parts() -> None:
    """Import all installed parts of scenes, so that they can be found."""
    _load_own()
    _load_installed()


def versions() -> dict[str, str]:
    """Return a checksum of the file of each plugin by name, for loaded files and installed packages."""
    own = {f"plugin {file.name}": file.checksum[:12] for file in python_file.loaded_files()}
    return own | installed()


def installed() -> dict[str, str]:
    """Return the plugins of installed packages only, without importing them."""
    return {f"plugin {entry.module}": _checksum(entry) for entry in entry_points(group=GROUP)}


@cache
def _load_own() -> None:
    for package in (components, effects, geometry, operators, packing, scene, sources, steppers):
        serialization.load(package)


@cache
def _load_installed() -> None:
    for entry in entry_points(group=GROUP):
        package = entry.dist.name if entry.dist else entry.value
        try:
            entry.load()
        except Exception as error:
            why = f"{type(error).__name__}: {printable(' '.join(str(error).split()))}"
            raise InputError(
                f"plugin {entry.name} of {package} must be importable; received {why}"
            ) from error
        _check(sys.modules[entry.module])


def _checksum(entry: EntryPoint) -> str:
    spec = find_spec(entry.module)
    path = spec.origin if spec else None
    return python_file.sha256(Path(path).read_bytes())[:12] if path else ""


def _check(module: ModuleType) -> None:
    """Raise InputError if a module defines a kind that exists already in the same family."""
    for kind in list(vars(module).values()):
        if not (isinstance(kind, type) and issubclass(kind, Component)) or kind.__dict__.get("contract"):
            continue
        if kind.__module__ != module.__name__:
            continue
        family = [base for base in kind.__mro__ if issubclass(base, Component)][-2]
        for other in family.kinds():
            must(
                other is kind or other.kind() != kind.kind(),
                f"name of {module.__name__}.{kind.__name__}",
                "one that no other kind has",
                Words(f"{kind.kind()}, as {other.__module__}.{other.__name__} has"),
            )
