"""The rule for resuming earlier work in an output folder, the same for all commands.

By default the same command, given again, resumes where it was stopped. ``--fresh`` starts from the beginning,
but not if results would be lost; ``--overwrite`` does so even then. ``--resume`` requires something to
resume. Each command checks itself whether the stored work is of the same scene or search.
"""

from __future__ import annotations

from pathlib import Path

from tisim.errors import Words, must


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
