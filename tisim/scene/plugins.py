"""Parts of scenes that are not tisim's own: of a Python file, or of a package that is installed.

A package names its modules under the entry point group ``tisim.effects``; they are imported when a scene is
read from plain data. What a plugin defines is found by its kind, as what tisim itself has; the digest of a
scene that uses it has a checksum of its file.
"""

from __future__ import annotations

import sys
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

from tisim import components, effects, operators, packing, scene, sources, steppers
from tisim.components import serialization
from tisim.components.component import Component
from tisim.errors import InputError, Words, must, printable
from tisim.files import python_file

GROUP = "tisim.effects"


def load(path: str | Path) -> ModuleType:
    """Import a Python file of the user's, so that the parts in it can be found by name.

    InputError is raised when it cannot be imported, or defines a kind whose name is taken; nothing of it is
    then known.
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
    """Import all parts of scenes that are installed, so that they can be found."""
    _load_own()
    _load_installed()


def versions() -> dict[str, str]:
    """Return a checksum of the file of each plugin, by its name: of those loaded, and of packages
    installed."""
    own = {f"plugin {file.name}": file.checksum[:12] for file in python_file.loaded_files()}
    return own | installed()


def installed() -> dict[str, str]:
    """Return the plugins of installed packages alone; they are not imported."""
    return {f"plugin {entry.module}": _checksum(entry) for entry in entry_points(group=GROUP)}


@cache
def _load_own() -> None:
    for package in (components, effects, operators, packing, scene, sources, steppers):
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
    """Raise InputError for a kind of a module that another one of the same family has."""
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
