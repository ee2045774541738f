"""The folder of the searches of one problem. They share their runs; a search of another problem is refused.

search.h5         every run; settings, logbook and best designs of each search: all that is needed to resume

The other files belong to the last finished search that found a design:

shown.json        the name of that search in search.h5
best.csv          the best designs, all digits
met.csv           all designs with a fitness of ``met_at`` or better, if the problem defines it
calibration.csv   (and .png, .pdf) each gene with its 95 % interval, if the objective is a Misfit
sensitivity.csv   (and .png, .pdf) effect of each gene on each objective, around the best design and over the
                  whole range
convergence.png   (and .pdf) best and mean fitness by generation; best value of each of several objectives
front.png         (and .pdf) the front of several objectives
best_scene.toml   the best design from the first random start, for ``tisim run``; not for a plain function
best_cloud.png    the start and end of that run, if the problem has a ``picture``
best_run.csv      further quantities of that run, if the problem has ``details``
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tisim import InputError
from tisim.errors import abbreviated, must
from tisim.files import output_folder, regular_file
from tisim.files.atomic import locked, replace_file
from tisim.files.output_folder import resumes
from tisim.files.regular_file import file_status
from tisim.optimize.search_records import searches
from tisim.optimize.settings import IDENTITY_FORMAT, of_the_problem, search_name
from tisim.optimize.storage.cache import Cache
from tisim.optimize.storage.record import canonical

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
"""Names of the files that a search writes at its end, in addition to SHOWN_FILE."""
SHOWN_FILE = "shown.json"
"""Name of the file with the name of the search that the result files belong to."""
SEARCH_FILES = (
    SEARCH_FILE, f"{SEARCH_FILE}.journal", f"{SEARCH_FILE}.lock", SHOWN_FILE, *RESULT_FILES,
    output_folder.LOCK,
)  # fmt: skip
"""Names of all files that a search writes into its folder."""


def resume_or_clear(
    folder: Path, fresh: bool | None, overwrite: bool,
    command: str = "search", file: str = SEARCH_FILE,
    result_files: Sequence[str] = (SHOWN_FILE, *RESULT_FILES),
) -> bool:  # fmt: skip
    """Return whether a command resumes the evaluations in its folder (``output_folder.resumes``); if not,
    delete them.

    command : "search", or the name of another command that stores evaluations.
    file : its cache file. result_files : its other files.

    InputError if neither is allowed, or if a running command still uses files that would be deleted.
    """
    journal, lock_file = f"{file}.journal", f"{file}.lock"
    resumable = any(file_status(folder / name) is not None for name in (file, journal))
    results = f"results of a {command}" if resumable else ""
    resume = resumes(folder, command, resumable, results, fresh, overwrite)
    output_folder.check(folder, (file, journal, lock_file, *result_files, output_folder.LOCK), overwrite)
    if resumable and not resume:
        # The lock file stays: without it two processes could lock two different files.
        with output_folder.lock(folder), locked(folder / lock_file, exclusive=True) as handle:
            for name in (file, journal, *result_files):
                (folder / name).unlink(missing_ok=True)
            os.ftruncate(handle, 0)
    return resume


def check(folder: Path, cache: Cache, requested: Mapping[str, Any], begun: bool = False) -> bool:
    """Return whether the cache file contains the search of this identity, which is then resumed.

    The file must not contain another problem (``check_problem``). begun : whether the search must be there;
    if it is not, and others are, InputError.
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
    """Raise InputError if the cache file has searches of another problem; the message lists the differences.

    command : "search", or the name of another command that the folder belongs to.
    """
    for attributes in searches(cache).values():
        stored = json.loads(attributes["identity"])
        must(
            stored.get("format") == IDENTITY_FORMAT,
            "output folder",
            f"of a {command} of this version of the program (or give --out or --overwrite)",
            str(folder),
        )
        differences = different_problem(stored, requested)
        if differences:
            raise InputError(
                f"output folder must be free of a {command} of another problem; received {str(folder)!r}, "
                f"which holds one that differs ({'; '.join(differences)}). Use another --out, or --overwrite "
                "to replace it"
            )


def different_problem(stored: Mapping[str, Any], requested: Mapping[str, Any]) -> list[str]:
    """Return the differences between the problems of two identities of searches, in words."""
    return _differences(of_the_problem(stored), of_the_problem(requested))


@contextmanager
def results_of(folder: Path, name: str) -> Iterator[None]:
    """Write the result files of the named search within this context; other processes wait until it ends.

    SHOWN_FILE then names this search, and result files of other searches are deleted. RunError if the disk is
    full.
    """
    content = (json.dumps({"search": name.removeprefix("searches/")}) + "\n").encode()
    with locked(folder / output_folder.MARKER, exclusive=True):
        if regular_file.content(folder / SHOWN_FILE) != content:
            for file in RESULT_FILES:
                (folder / file).unlink(missing_ok=True)
            replace_file(folder / SHOWN_FILE, content)
        yield


def _differences(stored: Mapping[str, Any], requested: Mapping[str, Any]) -> list[str]:
    """Return the differences between two identities, in words."""
    old, new = _leaves(stored), _leaves(json.loads(canonical(requested)))
    names = [name for name in {**old, **new} if old.get(name) != new.get(name)]
    # Only a checksum of the functions is stored.
    return [
        "the problem file, or a value that its functions use, has changed"
        if name == "problem_code"
        else f"{name} is {_shown(old, name)} there and {_shown(new, name)} here"
        for name in names
    ]


def _shown(leaves: Mapping[str, Any], name: str) -> str:
    """Return the value of a setting as shown in a message."""
    return abbreviated(leaves[name]) if name in leaves else "not given"


def _leaves(settings: Mapping[str, Any], above: str = "") -> dict[str, Any]:
    """Return nested settings by their dotted names."""
    leaves: dict[str, Any] = {}
    for name, value in settings.items():
        inside = isinstance(value, Mapping)
        leaves |= _leaves(value, f"{above}{name}.") if inside else {f"{above}{name}": value}
    return leaves
