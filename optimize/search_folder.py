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
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from optimize.search_records import searches
from optimize.settings import IDENTITY_FORMAT, search_name
from optimize.storage.cache import Cache
from optimize.storage.record import canonical
from tisim import InputError
from tisim.errors import must
from tisim.files import lock, ownership
from tisim.files.atomic import locked
from tisim.files.regular_file import status

FILE = "search.h5"
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
MAIN = (FILE, f"{FILE}.journal")
"""The files that a search goes on from."""
SEARCH_FILES = (*MAIN, f"{FILE}.lock", *BESIDE, lock.LOCK)
HOW = "--fresh --overwrite"
"""The options that let a search replace what is there."""


def clear(folder: Path, overwrite: bool) -> None:
    """Make way for a new search; InputError when there is one already that goes on, or is to be kept."""
    ownership.check(folder, SEARCH_FILES, overwrite, HOW)
    begun = any(status(folder / name) is not None for name in MAIN)
    must(overwrite or not begun, "--fresh", "given with --overwrite where there is a search", str(folder))
    # The lock file stays: without it two processes could lock two different files.
    if begun:
        with lock.held(folder), locked(folder / f"{FILE}.lock", exclusive=True) as handle:
            for name in (*MAIN, *BESIDE):
                (folder / name).unlink(missing_ok=True)
            os.ftruncate(handle, 0)


def check(folder: Path, cache: Cache, wished: Mapping[str, Any]) -> None:
    """InputError when the file in the folder is of another search than the one wished, by their identity."""
    stored = searches(cache)
    if stored and search_name(wished) not in stored:
        old = json.loads(next(iter(stored.values()))["identity"])
        must(
            old.get("format") == IDENTITY_FORMAT,
            "output folder",
            "of a search of this version of the program (or give --out, or --fresh --overwrite)",
            str(folder),
        )
        there = _leaves(old)
        here = _leaves(json.loads(canonical(wished)))
        names = [name for name in {**there, **here} if there.get(name) != here.get(name)]
        differ = ", ".join(f"{name} = {there.get(name)} and not {here.get(name)}" for name in names)
        raise InputError(
            "output folder must be without another search (or give --out, or --fresh --overwrite); "
            f"received {str(folder)!r}, where one has {differ}"
        )


def _leaves(settings: Mapping[str, Any], above: str = "") -> dict[str, Any]:
    """Nested settings by their dotted names."""
    leaves: dict[str, Any] = {}
    for name, value in settings.items():
        inside = isinstance(value, Mapping)
        leaves |= _leaves(value, f"{above}{name}.") if inside else {f"{above}{name}": value}
    return leaves
