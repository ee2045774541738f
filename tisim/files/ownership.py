"""Protection of files that tisim has not written: they are replaced only with ``--overwrite``.

The marker file ``.tisim`` in a folder lists the files that tisim has written there, one per line; all other
files are foreign. Version 0.1.0 wrote no marker: its folders are recognised by their main files.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from tisim.errors import InputError
from tisim.files import framing, regular_file
from tisim.files.atomic import append_at, locked, temporary_name
from tisim.files.lock import LOCK
from tisim.files.superblock import SIGNATURE

MARKER = ".tisim"
NAMES_SHOWN = 5
"""Largest number of file names in a message."""
_HEAD = 1 << 20
"""The attributes of an HDF5 file lie within this many bytes of its beginning."""


@dataclass(frozen=True)
class LegacyFiles:
    """Names of files that version 0.1.0 wrote to a folder.

    main : files from which it could resume or draw. If one of them exists without a marker, these and the
        others are taken as written by tisim.
    """

    main: tuple[str, ...]
    others: tuple[str, ...]


LEGACY_FILES = (
    LegacyFiles(
        ("result.h5", "checkpoint.h5", "trajectory.h5"),
        (
            "scene.toml", "versions.json", "cloud.png", "courses.png", "sequence.png", "velocities.png",
            "envelope.png", "trajectories.png", "chains.png", "response.png",
        ),
    ),
    LegacyFiles(("cost.h5",), ("cost.csv", "cost.png")),
    LegacyFiles(
        ("search.h5", "search.h5.journal"),
        (
            "search.h5.lock", "best.csv", "convergence.png", "convergence.pdf", "front.png", "front.pdf",
            "best_scene.toml", "best_cloud.png", "best_run.csv",
        ),
    ),
    LegacyFiles(("compare.h5", "compare.h5.journal"), ("compare.h5.lock", "compare.csv")),
)  # fmt: skip
"""When a marker is created in such a folder, it lists these names too."""


def check(folder: Path, names: Iterable[str], overwrite: bool = False) -> None:
    """Raise InputError if files of these names would replace files that tisim has not written; nothing is
    changed.

    overwrite : replace them nevertheless. A link, folder, fifo or device of such a name is always refused.
    """
    owned, foreign = _owned_names(folder), []
    for name in names:
        for file in (name, temporary_name(name)):
            if regular_file.file_status(folder / file) is not None and name not in owned:
                foreign.append(file)
    if foreign and not overwrite:
        raise _foreign_files_error(folder, foreign, "would replace (or give --overwrite)")


def check_all(folder: Path, overwrite: bool = False) -> None:
    """Raise InputError unless tisim has written all files in a folder; nothing is changed.

    This is the ``check`` of a command whose file names are known only at its end.
    """
    if overwrite or not regular_file.is_folder(folder):
        return
    owned = {MARKER, *_owned_names(folder)}
    owned |= {temporary_name(name) for name in owned}
    try:
        foreign = sorted({path.name for path in folder.iterdir()} - owned)
    except OSError as error:
        raise InputError(
            f"output folder must be readable; received {str(folder)!r} ({error.strerror})"
        ) from None
    if foreign:
        raise _foreign_files_error(folder, foreign, "might replace (or give --overwrite)")


def claim(folder: Path, names: Iterable[str], overwrite: bool = False) -> None:
    """Create the folder, and record these file names in its marker as written by tisim.

    Raise InputError if a foreign file would be replaced (see ``check``), or if the folder cannot be written
    to.
    """
    claimed = list(names)
    check(folder, claimed, overwrite)
    ensure_writable(folder)
    if set(claimed) <= _marked_names(folder):
        return
    with locked(folder / MARKER, exclusive=True):
        # Another process may have written to the folder since the first check.
        check(folder, claimed, overwrite)
        content = regular_file.content(folder / MARKER) or b""
        # The last line may lack its end if the writer was killed.
        newline = b"\n" if content and not content.endswith(b"\n") else b""
        added = sorted({*claimed, *_owned_names(folder)} - _marked_names(folder))
        append_at(folder / MARKER, len(content), newline + "".join(f"{name}\n" for name in added).encode())


def has_results(folder: Path) -> bool:
    """Return whether the folder has a file that is listed in the marker."""
    return any(regular_file.exists(folder / name) for name in _marked_names(folder) - {LOCK})


def ensure_writable(folder: Path) -> None:
    """Create a folder, and raise InputError unless files can be created in it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InputError(
            f"output folder must be writable; received {str(folder)!r} ({error.strerror})"
        ) from None


def _foreign_files_error(folder: Path, foreign: Sequence[str], why: str) -> InputError:
    more = f" and {len(foreign) - NAMES_SHOWN} more" if len(foreign) > NAMES_SHOWN else ""
    return InputError(
        f"output folder must be without files that tisim has not written and {why}; "
        f"received {str(folder)!r} with {', '.join(foreign[:NAMES_SHOWN])}{more}"
    )


def _owned_names(folder: Path) -> set[str]:
    """Return the names of files that tisim has written, or may have written."""
    marked = _marked_names(folder)
    if marked:
        return marked
    present = [
        legacy for legacy in LEGACY_FILES if any(_written_by_tisim(folder / name) for name in legacy.main)
    ]
    # If there is a lock file, there was a marker that somebody has removed.
    return {LOCK for _ in present} | {name for legacy in present for name in (*legacy.main, *legacy.others)}


def _marked_names(folder: Path) -> set[str]:
    return set((regular_file.content(folder / MARKER) or b"").decode(errors="replace").splitlines())


def _written_by_tisim(path: Path) -> bool:
    """Return whether tisim has written an HDF5 file or a journal; only the first MiB is read,
    and its HDF5 structure is not interpreted."""
    head = regular_file.content(path, _HEAD) or b""
    return head.startswith(framing.MAGIC) or (head.startswith(SIGNATURE) and b"tisim" in head)
