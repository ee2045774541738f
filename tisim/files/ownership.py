"""Who may write to a folder: what tisim has written there it may replace, anything else only if it is to.

The marker ``.tisim`` in a folder names the files that tisim has written to it, one a line; a file that it
does not name is of another origin. A folder without a marker may be of version 0.1.0, which made none: it is
known by its main files.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from tisim.errors import InputError
from tisim.files import framing, regular_file
from tisim.files.atomic import append_at, locked, unfinished
from tisim.files.lock import LOCK
from tisim.files.superblock import SIGNATURE

MARKER = ".tisim"
NAMES_SHOWN = 5
"""Names of files that a message spells out."""
_HEAD = 1 << 20
"""Bytes of an HDF5 file in which its attributes are."""


@dataclass(frozen=True)
class Leavings:
    """What version 0.1.0 left in a folder. main : files from which it could go on or draw; where there is one
    but no marker, these and the others are of tisim's writing."""

    main: tuple[str, ...]
    others: tuple[str, ...]


LEFT_UNMARKED = (
    Leavings(
        ("result.h5", "checkpoint.h5", "trajectory.h5"),
        (
            "scene.toml", "versions.json", "cloud.png", "courses.png", "sequence.png", "velocities.png",
            "envelope.png", "trajectories.png", "chains.png", "response.png",
        ),
    ),
    Leavings(("cost.h5",), ("cost.csv", "cost.png")),
    Leavings(
        ("search.h5", "search.h5.journal"),
        (
            "search.h5.lock", "best.csv", "convergence.png", "convergence.pdf", "front.png", "front.pdf",
            "best_scene.toml", "best_cloud.png", "best_run.csv",
        ),
    ),
    Leavings(("compare.h5", "compare.h5.journal"), ("compare.h5.lock", "compare.csv")),
)  # fmt: skip
"""Whatever is written to a folder first, it is all in the marker that is then made."""


def check(folder: Path, names: Iterable[str], overwrite: bool = False) -> None:
    """InputError when writing files of these names would replace what tisim has not written; touches nothing.

    overwrite : replace it all the same. A link, folder, fifo or device of such a name is refused always.
    """
    mine, others = _ours(folder), []
    for name in names:
        for file in (name, unfinished(name)):
            if regular_file.status(folder / file) is not None and name not in mine:
                others.append(file)
    if others and not overwrite:
        raise _refusal(folder, others, "would replace (or give --overwrite)")


def check_all(folder: Path, overwrite: bool = False) -> None:
    """As check for a command that does not know its names before it ends: all that is there must be ours."""
    if overwrite or not regular_file.is_folder(folder):
        return
    mine = {MARKER, *_ours(folder)}
    mine |= {unfinished(name) for name in mine}
    try:
        others = sorted({path.name for path in folder.iterdir()} - mine)
    except OSError as error:
        raise InputError(
            f"output folder must be readable; received {str(folder)!r} ({error.strerror})"
        ) from None
    if others:
        raise _refusal(folder, others, "might replace (or give --overwrite)")


def take(folder: Path, names: Iterable[str], overwrite: bool = False) -> None:
    """Make the folder, and mark it: from now on files of these names are of tisim's writing.

    InputError as of check, and when the folder cannot be written to.
    """
    wanted = list(names)
    check(folder, wanted, overwrite)
    writable(folder)
    if set(wanted) <= _marked(folder):
        return
    with locked(folder / MARKER, exclusive=True):
        check(folder, wanted, overwrite)  # another process may have come first
        text = regular_file.content(folder / MARKER) or b""
        whole = b"\n" if text and not text.endswith(b"\n") else b""  # a killed writer's last name is not
        new = sorted({*wanted, *_ours(folder)} - _marked(folder))
        append_at(folder / MARKER, len(text), whole + "".join(f"{name}\n" for name in new).encode())


def results(folder: Path) -> bool:
    """Whether there is a file that tisim has written, by the marker."""
    return any(regular_file.exists(folder / name) for name in _marked(folder) - {LOCK})


def writable(folder: Path) -> None:
    """Make a folder and see that files can be made in it; InputError otherwise."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InputError(
            f"output folder must be writable; received {str(folder)!r} ({error.strerror})"
        ) from None


def _refusal(folder: Path, others: Sequence[str], why: str) -> InputError:
    more = f" and {len(others) - NAMES_SHOWN} more" if len(others) > NAMES_SHOWN else ""
    return InputError(
        f"output folder must be without files that tisim has not written and {why}; "
        f"received {str(folder)!r} with {', '.join(others[:NAMES_SHOWN])}{more}"
    )


def _ours(folder: Path) -> set[str]:
    """Names of files that tisim has written, or would have."""
    marked = _marked(folder)
    if marked:
        return marked
    found = [left for left in LEFT_UNMARKED if any(_is_ours(folder / name) for name in left.main)]
    # A lock file is there only where a marker was, which somebody has removed.
    return {LOCK for _ in found} | {name for left in found for name in (*left.main, *left.others)}


def _marked(folder: Path) -> set[str]:
    return set((regular_file.content(folder / MARKER) or b"").decode(errors="replace").splitlines())


def _is_ours(path: Path) -> bool:
    """Whether tisim has written an HDF5 file or a journal; its structure is not looked at."""
    head = regular_file.content(path, _HEAD) or b""
    return head.startswith(framing.MAGIC) or (head.startswith(SIGNATURE) and b"tisim" in head)
