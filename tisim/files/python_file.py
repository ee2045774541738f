"""Python files of the user, imported under their own names with the text they had when first read.

Pickles refer to a class by module and name, so a worker imports the same texts under the same names before it
unpickles. The checksum of the text distinguishes physics and objectives of different versions of a file.
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

OWN_PACKAGES = ("tisim", "tisim.optimize", "tisim.cases")
"""Packages whose results are identified by their version. The last two may be installed beside the first."""


@dataclass(frozen=True)
class PythonFile:
    """A Python file as it was read.

    name : module name. path : location when it was read. text : its bytes.
    """

    name: str
    path: str
    text: bytes

    @property
    def checksum(self) -> str:
        """Return the SHA-256 of the text, hex."""
        return sha256(self.text)


def is_own(module: str) -> bool:
    """Return whether a module name belongs to tisim."""
    return module == "tisim" or module.startswith("tisim.")


@functools.cache
def own_folders() -> tuple[Path, ...]:
    """Return the folders of OWN_PACKAGES."""
    return tuple(Path(importlib.import_module(name).__path__[0]) for name in OWN_PACKAGES)


def sha256(text: bytes) -> str:
    """Return the SHA-256 of a text, hex."""
    return hashlib.sha256(text).hexdigest()


_modules: dict[PythonFile, ModuleType] = {}
_current: dict[str, PythonFile] = {}
_names: set[str] = set()


def load(path: str | Path) -> ModuleType:
    """Import a file under its own name, without .py; an unchanged file is not executed again.

    Raise InputError in one line if there is no such file, if it cannot be imported (with the line and the
    reason), or if another module has its name.
    """
    file_path = Path(path)
    must(file_path.suffix == ".py" and "." not in file_path.stem, "Python file", "named NAME.py", str(path))
    file = PythonFile(file_path.stem, str(file_path.absolute()), _read(file_path))
    existing = _existing_module(file)
    free = existing is None or Path(existing).resolve() == file_path.resolve()
    must(free, f"name of {path}", "one that no other module has", existing)
    return install(file)


def install(file: PythonFile) -> ModuleType:
    """Import a text under a module name, replacing an earlier text. Raise InputError if that fails."""
    # Taichi reads the source of compiled functions; without a modification time, linecache does not check the
    # disk.
    lines = file.text.decode(errors="replace").splitlines(keepends=True)
    linecache.cache[file.path] = (len(file.text), None, lines, file.path)
    _names.add(file.name)
    if file not in _modules:
        _modules[file] = _execute(file)
    sys.modules[file.name] = _modules[file]
    _current[file.name] = file
    return _modules[file]


def unload(name: str) -> None:
    """Undo the import of a file: its classes are no longer known."""
    sys.modules.pop(name, None)
    _modules.pop(_current.pop(name))


def loaded_files() -> tuple[PythonFile, ...]:
    """Return all imported files of the user, in order."""
    return tuple(_current.values())


def is_superseded(kind: type) -> bool:
    """Return whether a class is from a text that was replaced by a newer one."""
    if kind.__module__ not in _names:
        return False
    return vars(sys.modules.get(kind.__module__, object)).get(kind.__name__) is not kind


def module_checksums(*items: Any) -> dict[str, str]:
    """Return the checksum of each module outside of tisim that defines these functions, classes or bases.

    For a file loaded here, the checksums of other loaded files that it uses are included.
    """
    result: dict[str, str] = {}
    for item in items:
        while isinstance(item, functools.partial):
            item = item.func
        owner = item if inspect.isroutine(item) or isinstance(item, type) else type(item)
        for cls in inspect.getmro(owner) if isinstance(owner, type) else (owner,):
            _add(cls.__module__ or "builtins", cls, result)
    return result


def _add(module: str, item: Any, result: dict[str, str]) -> None:
    root = module.partition(".")[0]
    if is_own(module) or root in sys.stdlib_module_names or root == "pydantic" or module in result:
        return
    if module not in _current:
        result[module] = _file_checksum(module, item)
        return
    result[module] = _current[module].checksum
    for value in vars(sys.modules[module]).values():
        source = value.__name__ if inspect.ismodule(value) else getattr(value, "__module__", None)
        if source in _current:
            _add(source, value, result)


def _file_checksum(module: str, item: Any) -> str:
    """Return the SHA-256 of the file of a module that Python imported itself, or of the source in a
    notebook."""
    path = getattr(sys.modules.get(module), "__file__", None)
    try:
        text = Path(path).read_bytes() if path else inspect.getsource(item).encode()
    except (OSError, TypeError):
        return ""
    return sha256(text)


def _read(path: Path) -> bytes:
    try:
        # Folders and pipes are refused; reading a pipe may never end.
        must(path.is_file() or not path.exists(), "Python file", "a file", str(path))
        return path.read_bytes()
    except FileNotFoundError:
        raise InputError(f"Python file must exist; received {abbreviated(str(path))}") from None
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise InputError(f"Python file must be readable; received {abbreviated(str(path))} ({why})") from None


def _existing_module(file: PythonFile) -> str | None:
    """Return the location of the module of this name, imported or importable; None if there is none."""
    if file.name in _current:
        return _current[file.name].path
    if file.name in sys.modules:
        return getattr(sys.modules[file.name], "__file__", None) or "a module of Python"
    spec = importlib.util.find_spec(file.name)
    return None if spec is None else spec.origin or "a package"


class _TextLoader(importlib.abc.SourceLoader):
    """A loader that gives Python the text that was read, even if the file has changed."""

    def __init__(self, file: PythonFile) -> None:
        self.file = file

    def get_filename(self, fullname: str) -> str:
        return self.file.path

    def get_data(self, path: str) -> bytes:
        return self.file.text


def _execute(file: PythonFile) -> ModuleType:
    previous = sys.modules.get(file.name)
    if previous is not None and _imported_by_python(previous, file):
        return previous
    spec = importlib.util.spec_from_file_location(file.name, file.path, loader=_TextLoader(file))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[file.name] = module  # as dataclasses and pydantic look there while it runs
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        sys.modules.pop(file.name)
        if previous is not None:
            sys.modules[file.name] = previous
        raise InputError(_import_error(file, error)) from error
    return module


def _imported_by_python(module: ModuleType, file: PythonFile) -> bool:
    """Return whether Python's own import system has imported this text."""
    path = getattr(module, "__file__", None)
    return file.name not in _current and path is not None and Path(path).read_bytes() == file.text


def _import_error(file: PythonFile, error: BaseException) -> str:
    """Return the message that a file cannot be imported, with line and reason, on one line."""
    if isinstance(error, SyntaxError) and error.filename == file.path:
        line, why = error.lineno, error.msg
    else:
        frames = traceback.extract_tb(error.__traceback__)
        line = next((frame.lineno for frame in reversed(frames) if frame.filename == file.path), None)
        why = str(error)
    where = f"line {line}: " if line else ""
    fault = f"{type(error).__name__}: {printable(' '.join(why.split()))}"
    return f"{printable(file.path)} must be a file that Python can import; received {where}{fault}"
