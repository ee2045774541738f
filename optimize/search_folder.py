"""The folder of the searches of one problem. They share their runs; another problem is refused there.

search.h5         every run, and of each search settings, logbook and best designs: all that it takes to go on

All others are of the search that ended last with a design:

shown.json        its name in search.h5
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
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tisim.optimize.search_records import searches
from tisim.optimize.settings import IDENTITY_FORMAT, of_the_problem, search_name
from tisim.optimize.storage.cache import Cache
from tisim.optimize.storage.record import canonical

from tisim import InputError
from tisim.errors import abbreviated, must
from tisim.files import lock, ownership, regular_file
from tisim.files.atomic import locked, replace_file
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
"""Names of the files that a search writes at its end, beside SHOWN_FILE."""
SHOWN_FILE = "shown.json"
"""Name of the file that says which search the result files are of."""
SEARCH_FILES = (
    SEARCH_FILE, f"{SEARCH_FILE}.journal", f"{SEARCH_FILE}.lock", SHOWN_FILE, *RESULT_FILES, lock.LOCK,
)  # fmt: skip
"""Names of all files that a search writes into its folder."""


def resume_or_clear(
    folder: Path, fresh: bool | None, overwrite: bool,
    command: str = "search", file: str = SEARCH_FILE,
    result_files: Sequence[str] = (SHOWN_FILE, *RESULT_FILES),
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


def check(folder: Path, cache: Cache, requested: Mapping[str, Any], begun: bool = False) -> bool:
    """Return whether the cache file has the search of this identity, which is then gone on with.

    The file has none of another problem (``check_problem``). begun : whether it has to; InputError where it
    has not.
    """
    stored = {name: json.loads(attributes["identity"]) for name, attributes in searches(cache).items()}
    known = search_name(requested) in stored
    if begun and stored and not known:
        nearest = min((_differences(one, requested) for one in stored.values()), key=len)
        raise InputError(
            f"output folder must be one in which this search has begun; received {str(folder)!r}, where the "
            f"most similar one differs ({'; '.join(nearest)})"
        )
    return known


def check_problem(folder: Path, command: str, cache: Cache, requested: Mapping[str, Any]) -> None:
    """Raise InputError where the cache file has searches of another problem than that of an identity, and say
    in what it differs. command : "search", or what else the folder is of."""
    for attributes in searches(cache).values():
        stored = json.loads(attributes["identity"])
        must(
            stored.get("format") == IDENTITY_FORMAT,
            "output folder",
            f"of a {command} of this version of the program (or give --out or --overwrite)",
            str(folder),
        )
        differences = _differences(of_the_problem(stored), of_the_problem(requested))
        if differences:
            raise InputError(
                f"output folder must be free of a {command} of another problem; received {str(folder)!r}, "
                f"which holds one that differs ({'; '.join(differences)}). Use another --out, or --overwrite "
                "to replace it"
            )


@contextmanager
def results_of(folder: Path, name: str) -> Iterator[None]:
    """Write result files of the search of that name within this context, which other processes wait for.
    SHOWN_FILE says that they are of it; those of another search are removed. RunError if the disk is full."""
    content = (json.dumps({"search": name.removeprefix("searches/")}) + "\n").encode()
    with locked(folder / ownership.MARKER, exclusive=True):
        if regular_file.content(folder / SHOWN_FILE) != content:
            for file in RESULT_FILES:
                (folder / file).unlink(missing_ok=True)
            replace_file(folder / SHOWN_FILE, content)
        yield


def _differences(stored: Mapping[str, Any], requested: Mapping[str, Any]) -> list[str]:
    """Return in what two identities differ, in words."""
    old, new = _leaves(stored), _leaves(json.loads(canonical(requested)))
    names = [name for name in {**old, **new} if old.get(name) != new.get(name)]
    # Of the functions only a checksum is kept.
    return [
        "the problem file, or a value that its functions use, has changed"
        if name == "problem_code"
        else f"{name} is {_shown(old, name)} there and {_shown(new, name)} here"
        for name in names
    ]


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
