"""A Python file of the user's, imported under its own name with the text that it had then.

Pickles name a class by module and name, so a worker imports the same texts under the same names before it
reads one. A checksum of the text tells physics and objectives of one version of a file from those of another.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.abc
import importlib.util
import inspect
import linecache
import sys
import traceback
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from tisim.errors import InputError, abbreviated, must, printable

OURS = frozenset({"tisim", "optimize", "cases"})
"""Packages whose version says what they compute."""


@dataclass(frozen=True)
class PythonFile:
    """name : under which it is imported. path : where it was read. text : its bytes."""

    name: str
    path: str
    text: bytes

    @property
    def checksum(self) -> str:
        """SHA-256 of the text, hex."""
        return checksum(self.text)


def checksum(text: bytes) -> str:
    """SHA-256, hex."""
    return hashlib.sha256(text).hexdigest()


_modules: dict[PythonFile, ModuleType] = {}
_current: dict[str, PythonFile] = {}
_names: set[str] = set()


def load(path: str | Path) -> ModuleType:
    """Import a file under its own name, without .py; a file that has not changed since is not run again.

    InputError in one line when there is no such file, it cannot be imported (which line, and why), or another
    module has its name.
    """
    place = Path(path)
    must(place.suffix == ".py" and "." not in place.stem, "Python file", "named NAME.py", str(path))
    file = PythonFile(place.stem, str(place.absolute()), _read(place))
    other = _of_that_name(file)
    free = other is None or Path(other).resolve() == place.resolve()
    must(free, f"name of {path}", "one that no other module has", other)
    return install(file)


def install(file: PythonFile) -> ModuleType:
    """Import a text under a name, in place of any other text that had it. InputError when it cannot be."""
    # Taichi reads the source of what it compiles; without a time, it is not looked for on the disk.
    lines = file.text.decode(errors="replace").splitlines(keepends=True)
    linecache.cache[file.path] = (len(file.text), None, lines, file.path)
    _names.add(file.name)
    if file not in _modules:
        _modules[file] = _run(file)
    sys.modules[file.name] = _modules[file]
    _current[file.name] = file
    return _modules[file]


def forget(name: str) -> None:
    """Take a file back that has been imported: its classes are no longer known."""
    sys.modules.pop(name, None)
    _modules.pop(_current.pop(name))


def loaded() -> tuple[PythonFile, ...]:
    """All files of the user's that have been imported, in order."""
    return tuple(_current.values())


def superseded(kind: type) -> bool:
    """Whether a class is of a text that another has replaced since."""
    if kind.__module__ not in _names:
        return False
    return vars(sys.modules.get(kind.__module__, object)).get(kind.__name__) is not kind


def checksums(*things: Any) -> dict[str, str]:
    """Checksum of each module outside of this package that defines these functions, classes or their bases.

    For a file that was loaded here, also those of other loaded files that it takes something from.
    """
    found: dict[str, str] = {}
    for thing in things:
        while isinstance(thing, functools.partial):
            thing = thing.func
        owner = thing if inspect.isroutine(thing) or isinstance(thing, type) else type(thing)
        for one in inspect.getmro(owner) if isinstance(owner, type) else (owner,):
            _add(one.__module__ or "builtins", one, found)
    return found


def _add(module: str, thing: Any, found: dict[str, str]) -> None:
    root = module.partition(".")[0]
    if root in OURS or root in sys.stdlib_module_names or root == "pydantic" or module in found:
        return
    if module not in _current:
        found[module] = _checksum(module, thing)
        return
    found[module] = _current[module].checksum
    for value in vars(sys.modules[module]).values():
        used = value.__name__ if inspect.ismodule(value) else getattr(value, "__module__", None)
        if used in _current:
            _add(used, value, found)


def _checksum(module: str, thing: Any) -> str:
    """SHA-256 of the file of a module that Python has imported by itself, or of what a notebook defines."""
    path = getattr(sys.modules.get(module), "__file__", None)
    try:
        text = Path(path).read_bytes() if path else inspect.getsource(thing).encode()
    except (OSError, TypeError):
        return ""
    return checksum(text)


def _read(path: Path) -> bytes:
    try:
        # Neither a folder nor a pipe, which may never end.
        must(path.is_file() or not path.exists(), "Python file", "a file", str(path))
        return path.read_bytes()
    except FileNotFoundError:
        raise InputError(f"Python file must exist; received {abbreviated(str(path))}") from None
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise InputError(f"Python file must be readable; received {abbreviated(str(path))} ({why})") from None


def _of_that_name(file: PythonFile) -> str | None:
    """Where the module of this name is, imported already or to be found; None where there is none."""
    if file.name in _current:
        return _current[file.name].path
    if file.name in sys.modules:
        return getattr(sys.modules[file.name], "__file__", None) or "a module of Python"
    spec = importlib.util.find_spec(file.name)
    return None if spec is None else spec.origin or "a package"


class _Text(importlib.abc.SourceLoader):
    """Has Python import the text that was read, whatever has become of the file."""

    def __init__(self, file: PythonFile) -> None:
        self.file = file

    def get_filename(self, fullname: str) -> str:
        return self.file.path

    def get_data(self, path: str) -> bytes:
        return self.file.text


def _run(file: PythonFile) -> ModuleType:
    there = sys.modules.get(file.name)
    if there is not None and _of_python(there, file):
        return there
    spec = importlib.util.spec_from_file_location(file.name, file.path, loader=_Text(file))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[file.name] = module  # as dataclasses and pydantic look there while it runs
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        sys.modules.pop(file.name)
        if there is not None:
            sys.modules[file.name] = there
        raise InputError(_reported(file, error)) from error
    return module


def _of_python(module: ModuleType, file: PythonFile) -> bool:
    """Whether Python itself has imported this text."""
    path = getattr(module, "__file__", None)
    return file.name not in _current and path is not None and Path(path).read_bytes() == file.text


def _reported(file: PythonFile, error: BaseException) -> str:
    """That a file cannot be imported: where, and why; in one line."""
    if isinstance(error, SyntaxError) and error.filename == file.path:
        line, why = error.lineno, error.msg
    else:
        frames = traceback.extract_tb(error.__traceback__)
        line = next((frame.lineno for frame in reversed(frames) if frame.filename == file.path), None)
        why = str(error)
    where = f"line {line}: " if line else ""
    fault = f"{type(error).__name__}: {printable(' '.join(why.split()))}"
    return f"{printable(file.path)} must be a file that Python can import; received {where}{fault}"
