"""The output folder of a command: which files tisim has written there, who works there, and what is resumed.

The marker file ``.tisim`` in a folder lists the files that tisim has written there, one per line. All other
files are foreign, and replaced only with ``--overwrite``.

One command at a time writes files in a folder, and holds its lock while it works. The lock is on a separate
file that is never removed (see tisim.files.atomic.locked), and is released if the process is killed. Commands
that draw or copy results do not take it, so that a run can be viewed while it continues.

By default the same command, given again, resumes where it was stopped. ``--fresh`` starts from the beginning,
but not if results would be lost; ``--overwrite`` does so even then. ``--resume`` requires something to
resume. Each command checks itself whether the stored work is of the same scene or search.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

from tisim.errors import InputError, RunError, Words, must
from tisim.files import regular_file
from tisim.files.atomic import append_at, locked, temporary_name

MARKER, LOCK = ".tisim", ".tisim.lock"
"""Names of the marker and of the lock file in a folder."""
NAMES_SHOWN = 5
"""Largest number of file names in a message."""
AT_WORK_TIMEOUT = 1.0
"""Default timeout of a lock in s. It is much longer than a test for another process, which also holds the
lock."""


def check(folder: Path, names: Iterable[str], overwrite: bool = False) -> None:
    """Raise InputError if files of these names would replace files that tisim has not written; nothing is
    changed.

    overwrite : replace them nevertheless. A link, folder, fifo or device of such a name is always refused.
    """
    owned, foreign = _marked_names(folder), []
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
    owned = {MARKER, *_marked_names(folder)}
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
        added = sorted(set(claimed) - _marked_names(folder))
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


def _marked_names(folder: Path) -> set[str]:
    return set((regular_file.content(folder / MARKER) or b"").decode(errors="replace").splitlines())


def check_unlocked(folder: Path, timeout: float = AT_WORK_TIMEOUT) -> None:
    """Raise InputError if another process works in the folder; nothing is changed."""
    if regular_file.file_status(folder / LOCK) is not None:
        with lock(folder, exclusive=False, timeout=timeout):
            pass


@contextmanager
def lock(folder: Path, *, exclusive: bool = True, timeout: float = AT_WORK_TIMEOUT) -> Iterator[None]:
    """Hold the lock of an existing folder; raise InputError if another process holds it.

    exclusive : False to share the lock with readers. timeout : time to wait for another process, s.
    """
    with ExitStack() as stack:
        try:
            stack.enter_context(locked(folder / LOCK, exclusive=exclusive, timeout=timeout))
        except RunError:
            raise InputError(
                "output folder must be without a command that is still at work there; "
                f"received {str(folder)!r}, where another process is running"
            ) from None
        yield


def resumes(
    folder: Path, command: str, resumable: bool, results: str, fresh: bool | None, overwrite: bool
) -> bool:
    """Return whether a command resumes the work in its folder; raise InputError if it may neither resume nor
    start from the beginning.

    command : product of the command, for messages, such as "run".
    resumable : whether there is something to resume.
    results : description of the results that would be lost by starting from the beginning; empty if there are
        none.
    fresh : True for ``--fresh``, False for ``--resume``, None if neither is given.
    """
    place = "output folder"
    must(fresh is not False or not overwrite, "--overwrite", "given without --resume", Words("both"))
    must(fresh is not False or resumable, place, f"one that an interrupted {command} has left", str(folder))
    resume = resumable and not fresh and not overwrite
    must(resume or overwrite or not results, place, f"without {results} (or give --overwrite)", str(folder))
    return resume


def resume_hint(fresh: bool | None, overwrite: bool, first: str = "") -> str:
    """Return the sentence that tells how to resume a stopped command with these options.

    first : an action to take before, as text.
    """
    omitted = [name for name, is_given in (("--fresh", fresh), ("--overwrite", overwrite)) if is_given]
    without = f", without {' and '.join(omitted)}" if omitted else ""
    return f"To go on, {first}give the same command again{without}."
