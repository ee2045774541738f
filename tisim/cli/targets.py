"""The target of a command: a case of 'tisim cases', or a case of the user in a Python file.

Such a file is named NAME.py. Its CASE is used like the cases of the package ``cases``. Instead of CASE, or
besides it, the file may define PROBLEM, an inverse problem without a case, and SEARCH, the settings of its
search.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from tisim.errors import InputError, abbreviated, did_you_mean, must
from tisim.files import python_file
from tisim.scene import plugins

if TYPE_CHECKING:
    from tisim.cases.case import Case
    from tisim.optimize.problem.problem import Problem


OWN_FILE = "or your own NAME.py with a CASE"
SCENE_FILE = f"or a scene file ending in .toml, {OWN_FILE}"


def case(target: str, alternatives: str = OWN_FILE) -> Case:
    """Return the case of this name or in this file; InputError if there is none.

    alternatives : the targets other than a name, for the message.
    """
    from tisim.cases.case import Case, every

    if not is_python_file(target):
        known = every()
        if target not in known:
            rule, nearest = f"one of {', '.join(known)}, {alternatives}", did_you_mean(target, known)
            raise InputError(f"case must be {rule}; received {abbreviated(target)}{nearest}")
        return known[target]
    module = plugins.load(target)
    must(hasattr(module, "CASE"), target, "a file with a CASE", _module_names(module))
    must(isinstance(module.CASE, Case), f"CASE of {target}", "a cases.case.Case", module.CASE)
    return module.CASE


def inverse_problem(
    target: str, size: str | None, variant: str | None, measured: Path | None = None
) -> tuple[Problem, Mapping[str, Any]]:
    """Return the inverse problem of a case or a file, and the settings of its search; InputError if there is
    none.

    measured : a file of measurements to calibrate against.
    """
    if not is_python_file(target):
        return case(target, f"{OWN_FILE} or a PROBLEM").inverse(size or "default", variant, measured)
    module = plugins.load(target)
    if hasattr(module, "PROBLEM"):
        must(measured is None, "--measured", "given for a case only", measured)
        problem, settings = _problem(module, target, size, variant)
    else:
        must(hasattr(module, "CASE"), target, "a file with a PROBLEM or a CASE", _module_names(module))
        problem, settings = case(target).inverse(size or "default", variant, measured)
    # The checksum covers all loaded files: an objective may be defined elsewhere and use numbers from this
    # file, and it changes when they change.
    checksums = [file.checksum[:12] for file in python_file.loaded_files()]
    return dataclasses.replace(problem, code=problem.code or "-".join(checksums)), settings


def is_python_file(target: str) -> bool:
    """Return whether the target is a Python file by its name."""
    return target.endswith(".py")


def _problem(
    module: ModuleType, target: str, size: str | None, variant: str | None
) -> tuple[Problem, Mapping[str, Any]]:
    from tisim.optimize.problem.problem import Problem

    must(isinstance(module.PROBLEM, Problem), f"PROBLEM of {target}", "an optimize.Problem", module.PROBLEM)
    must(size is None, "--size", "given for a case only", size)
    must(variant is None, "--variant", "given for a case only", variant)
    settings = getattr(module, "SEARCH", {})
    must(isinstance(settings, Mapping), f"SEARCH of {target}", "settings of the search, by name", settings)
    return module.PROBLEM, settings


def _module_names(module: ModuleType) -> list[str]:
    """Return the names defined in a file, without those that every module has."""
    return [name for name in vars(module) if not name.startswith("__")]
