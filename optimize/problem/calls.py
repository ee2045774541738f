"""Calls of the functions of a problem: whatever is wrong with one is said in a line, with its place."""

from __future__ import annotations

import numbers
import sys
import threading
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tisim.errors import InputError, abbreviated, printable
from tisim.files.python_file import OWN_PACKAGES

if TYPE_CHECKING:
    from optimize.problem.objective import Objective
    from optimize.problem.problem import Problem
    from tisim import Result, Scene

PACKAGES = tuple(Path(__file__).parents[2] / name for name in sorted(OWN_PACKAGES))
SOURCES = (".py", ".pyc", ".so", ".pyd")
"""Files with these endings are opened by imports."""
SYSTEM = tuple(map(Path, ("/usr", "/lib", "/etc", "/dev", "/proc", "/sys")))
"""What is in these folders, or in hidden ones such as ~/.cache, is no data of a user."""


def make_scene(problem: Problem, design: Mapping[str, float], seed: int) -> Scene:
    """Return the scene of a design. InputError where its function refuses the design, which is its right;
    FaultyProblem where the function is at fault."""
    rule = f"scene of problem {problem.name} must return a Scene, or raise InputError to refuse a design"
    try:
        scene = problem.scene(design, seed)
    except InputError:
        raise
    except Exception as error:
        raise FaultyProblem(f"{rule}; received {_told(error)}") from error
    if not callable(getattr(scene, "digest", None)):
        raise FaultyProblem(f"{rule}; received {abbreviated(scene)}")
    return scene


def value_of(objective: Objective, result: Result, problem: Problem) -> float:
    """Return the value of an objective. FaultyProblem unless it is a real number, NaN and infinity among
    them, and no file was read for it that is not in the files of the problem."""
    rule = f"objective {objective.name} must return a number"
    known = {Path(file).resolve() for file in problem.files}
    try:
        with _files_read() as read:
            value: Any = objective.of(result)
    except Exception as error:
        raise FaultyProblem(f"{rule}; received {_told(error)}") from error
    if unknown := sorted(str(path) for path in read - known):
        rule = f"objective {objective.name} must read only `files` of its problem, as its values are kept"
        raise FaultyProblem(f"{rule}; received {printable(unknown[0])}")
    if isinstance(value, np.ndarray) and value.shape == () and not np.ma.isMaskedArray(value):
        value = value[()]
    if isinstance(value, bool | np.bool_) or not isinstance(value, numbers.Real):
        raise FaultyProblem(f"{rule}; received {abbreviated(value)}")
    return float(value)


class FaultyProblem(InputError):
    """A function of a problem is at fault: the search ends, and what it has found so far stays."""


def _told(error: Exception) -> str:
    """Return an error of a function of the user in a line, with its place in the user's file."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [one for one in frames if not any(Path(one.filename).is_relative_to(p) for p in PACKAGES)]
    place = f" ({Path(own[-1].filename).name}, line {own[-1].lineno})" if own else ""
    return printable(f"{type(error).__name__}: {' '.join(str(error).split())}") + printable(place)


_reading = threading.local()


def _note(event: str, arguments: tuple[Any, ...]) -> None:
    """Note a file that is opened for reading while an objective is called in this thread."""
    files: set[Path] | None = getattr(_reading, "files", None)
    if files is None or event != "open":
        return
    path, mode, *_ = arguments
    if isinstance(path, str | bytes) and (mode is None or "r" in str(mode)):
        name = path.decode(errors="surrogateescape") if isinstance(path, bytes) else path
        if not name.endswith(SOURCES):
            files.add(Path(name))


_hook: list[Callable[..., Any]] = []


@contextmanager
def _files_read() -> Iterator[set[Path]]:
    """Collect the paths of the user's files that are opened for reading within, links followed."""
    if not _hook:
        # A hook is for ever.
        sys.addaudithook(_note)
        _hook.append(_note)
    found: set[Path] = set()
    _reading.files = found
    try:
        yield found
    finally:
        _reading.files = None
        resolved = {path.resolve() for path in found if path.is_file()}
        found.clear()
        found.update(filter(_is_of_user, resolved))


def _is_of_user(path: Path) -> bool:
    """Return whether a file is neither installed nor the system's."""
    installed = Path(sys.prefix).resolve(), Path(sys.base_prefix).resolve(), *PACKAGES
    hidden = any(part.startswith(".") for part in path.parts)
    return not hidden and not any(path.is_relative_to(base) for base in (*installed, *SYSTEM))
