"""One rule says whether a command resumes what an earlier one has left in its folder.

The same command, given again, goes on where it was stopped. With ``--fresh`` it begins anew, with
``--overwrite`` also where results are lost by that, and with ``--resume`` it has to find something to go on
with. Whether what is there is of the same scene or search, each command sees for itself.
"""

from __future__ import annotations

from pathlib import Path

from tisim.errors import Words, must


def resumes(
    folder: Path, command: str, resumable: bool, results: str, fresh: bool | None, overwrite: bool
) -> bool:
    """Return whether a command resumes what is in its folder; raise InputError where it may not, nor begin
    anew.

    command : what it makes, for messages, such as "run". resumable : whether there is something to resume.
    results : in words, what would be lost by beginning anew; empty where that is nothing. fresh : True for
    ``--fresh``, False for ``--resume``, None where neither is given.
    """
    place = "output folder"
    must(fresh is not False or not overwrite, "--overwrite", "given without --resume", Words("both"))
    must(fresh is not False or resumable, place, f"one that an interrupted {command} has left", str(folder))
    resume = resumable and not fresh and not overwrite
    must(resume or overwrite or not results, place, f"without {results} (or give --overwrite)", str(folder))
    return resume


def resume_hint(fresh: bool | None, overwrite: bool, first: str = "") -> str:
    """Return the sentence that says which command resumes one that was stopped, given its options.

    first : what is to be done before.
    """
    omitted = [name for name, is_given in (("--fresh", fresh), ("--overwrite", overwrite)) if is_given]
    without = f", without {' and '.join(omitted)}" if omitted else ""
    return f"To go on, {first}give the same command again{without}."
