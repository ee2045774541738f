"""The folder of a search: it belongs to one search, and to no other until that is to be overwritten.

search.h5         every evaluation, the settings, logbooks and best designs; all that is needed to go on
best.csv          the best designs, all digits
met.csv           all that meet what is asked, where the problem says which do
calibration.csv   (and .png, .pdf) each gene with its 95 % interval, where the objective is the misfit of what
                  was measured
sensitivity.csv   (and .png, .pdf) what each gene does to each objective, around the best and over all
convergence.png   (and .pdf) best and mean fitness by generation; of several objectives the best of each
front.png         (and .pdf) the front of several objectives
best_scene.toml   the best design from the first random start, for ``tisim run``; none of a plain function
best_cloud.png    that run at start and end, where the problem says how to draw it
best_run.csv      what that run shows beside what was wanted, where the problem says what
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

from optimize.search_records import searches
from optimize.settings import IDENTITY_FORMAT, search_name
from optimize.storage.cache import Cache
from optimize.storage.record import canonical
from tisim import InputError
from tisim.errors import abbreviated, must
from tisim.files import lock, ownership
from tisim.files.atomic import locked
from tisim.files.regular_file import file_status
from tisim.files.resuming import resumes

SEARCH_FILE = "search.h5"
"""Name of the cache file of a search."""
RESULT_FILES = (
    "best.csv",
    "met.csv",
    "calibration.csv",
    "calibration.png",
    "calibration.pdf",
    "sensitivity.csv",
    "sensitivity.png",
    "sensitivity.pdf",
    "convergence.png",
    "convergence.pdf",
    "front.png",
    "front.pdf",
    "best_scene.toml",
    "best_cloud.png",
    "best_run.csv",
)
"""Names of the files that a search writes at its end."""
SEARCH_FILES = (SEARCH_FILE, f"{SEARCH_FILE}.journal", f"{SEARCH_FILE}.lock", *RESULT_FILES, lock.LOCK)
"""Names of all files that a search writes into its folder."""


def resume_or_clear(
    folder: Path, fresh: bool | None, overwrite: bool,
    command: str = "search", file: str = SEARCH_FILE, result_files: Sequence[str] = RESULT_FILES,
) -> bool:  # fmt: skip
    """Return whether a command resumes what is in its folder (``resuming.resumes``); if not, remove that.

    command : "search", or the name of another one that keeps evaluations. file : its cache file.
    result_files : its other files. InputError where it may do neither, or where one is still at work there
    whose files would be removed.
    """
    journal, lock_file = f"{file}.journal", f"{file}.lock"
    resumable = any(file_status(folder / name) is not None for name in (file, journal))
    results = f"results of a {command}" if resumable else ""
    resume = resumes(folder, command, resumable, results, fresh, overwrite)
    ownership.check(folder, (file, journal, lock_file, *result_files, lock.LOCK), overwrite)
    if resumable and not resume:
        # The lock file stays: without it two processes could lock two different files.
        with lock.acquire(folder), locked(folder / lock_file, exclusive=True) as handle:
            for name in (file, journal, *result_files):
                (folder / name).unlink(missing_ok=True)
            os.ftruncate(handle, 0)
    return resume


def check(folder: Path, cache: Cache, requested: Mapping[str, Any]) -> bool:
    """Return whether the cache file has the search of this identity; InputError when it has another."""
    stored_searches = searches(cache)
    if stored_searches and search_name(requested) not in stored_searches:
        refuse(folder, "search", json.loads(next(iter(stored_searches.values()))["identity"]), requested)
    return bool(stored_searches)


def refuse(folder: Path, command: str, stored: Mapping[str, Any], requested: Mapping[str, Any]) -> NoReturn:
    """Raise the InputError that says in what the identities of the stored and the requested search differ.

    command : "search", or what else the folder is of.
    """
    must(
        stored.get("format") == IDENTITY_FORMAT,
        "output folder",
        f"of a {command} of this version of the program (or give --out or --overwrite)",
        str(folder),
    )
    old = _leaves(stored)
    new = _leaves(json.loads(canonical(requested)))
    names = [name for name in {**old, **new} if old.get(name) != new.get(name)]
    # Of the functions only a checksum is kept.
    differences = "; ".join(
        "the problem file, or a value that its functions use, has changed"
        if name == "problem_code"
        else f"{name} is {_shown(old, name)} there and {_shown(new, name)} here"
        for name in names
    )
    raise InputError(
        f"output folder must be free of another {command}; received {str(folder)!r}, which holds one that "
        f"differs ({differences}). Use another --out, or --overwrite to replace it"
    )


def _shown(leaves: Mapping[str, Any], name: str) -> str:
    """Return the value of a setting as a message gives it."""
    return abbreviated(leaves[name]) if name in leaves else "not given"


def _leaves(settings: Mapping[str, Any], above: str = "") -> dict[str, Any]:
    """Return nested settings by their dotted names."""
    leaves: dict[str, Any] = {}
    for name, value in settings.items():
        inside = isinstance(value, Mapping)
        leaves |= _leaves(value, f"{above}{name}.") if inside else {f"{above}{name}": value}
    return leaves
