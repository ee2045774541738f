"""The folder of a search: it belongs to one search, and to no other until that is to be overwritten.

search.h5         every evaluation, the settings, logbooks and best designs; all that is needed to go on
best.csv          the best designs, all digits
convergence.png   (and .pdf) best and mean fitness by generation; of several objectives the best of each
front.png         (and .pdf) the front of several objectives
best_scene.toml   the best design from the first random start, for ``tisim run``
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
from tisim.errors import must
from tisim.files import lock, ownership
from tisim.files.atomic import locked
from tisim.files.regular_file import file_status
from tisim.files.resuming import resumes

SEARCH_FILE = "search.h5"
BESIDE = (
    "best.csv",
    "convergence.png",
    "convergence.pdf",
    "front.png",
    "front.pdf",
    "best_scene.toml",
    "best_cloud.png",
    "best_run.csv",
)
SEARCH_FILES = (SEARCH_FILE, f"{SEARCH_FILE}.journal", f"{SEARCH_FILE}.lock", *BESIDE, lock.LOCK)
"""The files that a search writes into its folder."""


def resume_or_clear(
    folder: Path, fresh: bool | None, overwrite: bool,
    what: str = "search", file: str = SEARCH_FILE, beside: Sequence[str] = BESIDE,
) -> bool:  # fmt: skip
    """Whether a search goes on with what is in the folder (``resuming.resumes``); if not, that is removed.

    what, file, beside : of another command that keeps evaluations what it is, its cache file, and its other
    files. InputError where it may do neither; also when one is at work there that would be removed.
    """
    journal, guard = f"{file}.journal", f"{file}.lock"
    begun = any(file_status(folder / name) is not None for name in (file, journal))
    goes_on = resumes(folder, what, begun, f"what a {what} has found" * begun, fresh, overwrite)
    ownership.check(folder, (file, journal, guard, *beside, lock.LOCK), overwrite)
    if begun and not goes_on:
        # The lock file stays: without it two processes could lock two different files.
        with lock.acquire(folder), locked(folder / guard, exclusive=True) as handle:
            for name in (file, journal, *beside):
                (folder / name).unlink(missing_ok=True)
            os.ftruncate(handle, 0)
    return goes_on


def check(folder: Path, cache: Cache, wished: Mapping[str, Any]) -> bool:
    """Whether the file in the folder has the search wished; InputError when it is of another, by identity."""
    stored_searches = searches(cache)
    if stored_searches and search_name(wished) not in stored_searches:
        refuse(folder, "search", json.loads(next(iter(stored_searches.values()))["identity"]), wished)
    return bool(stored_searches)


def refuse(folder: Path, what: str, old: Mapping[str, Any], wished: Mapping[str, Any]) -> NoReturn:
    """InputError that says in what the search (or ``what`` else) in the folder differs from that wished."""
    must(
        old.get("format") == IDENTITY_FORMAT,
        "output folder",
        f"of a {what} of this version of the program (or give --out or --overwrite)",
        str(folder),
    )
    there = _leaves(old)
    here = _leaves(json.loads(canonical(wished)))
    names = [name for name in {**there, **here} if there.get(name) != here.get(name)]
    differ = ", ".join(f"{name} = {there.get(name)} and not {here.get(name)}" for name in names)
    raise InputError(
        f"output folder must be without another {what} (or give --out or --overwrite); "
        f"received {str(folder)!r}, where one has {differ}"
    )


def _leaves(settings: Mapping[str, Any], above: str = "") -> dict[str, Any]:
    """Nested settings by their dotted names."""
    leaves: dict[str, Any] = {}
    for name, value in settings.items():
        inside = isinstance(value, Mapping)
        leaves |= _leaves(value, f"{above}{name}.") if inside else {f"{above}{name}": value}
    return leaves
