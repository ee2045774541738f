"""What a command does in a folder where an earlier one has left something: one rule for all commands.

The same command, given again, goes on where it was stopped. With ``--fresh`` it begins anew, with
``--overwrite`` also where results are lost by that, and with ``--resume`` it has to find something to go on
with. Whether what is there is of the same scene or search, each command sees for itself.
"""

from __future__ import annotations

from pathlib import Path

from tisim.errors import must


def resumes(
    folder: Path, command: str, begun: bool, results: str, fresh: bool | None, overwrite: bool
) -> bool:
    """Whether a command goes on with what is in its folder; InputError where it may not, nor begin anew.

    command : what it makes, for messages, such as "run". begun : whether there is something to go on with.
    results : in words, what would be lost by beginning anew; empty where that is nothing. fresh : True for
    ``--fresh``, False for ``--resume``, None where neither is given.
    """
    what = "output folder"
    must(fresh is not False or not overwrite, "--overwrite", "given without --resume", "both")
    must(fresh is not False or begun, what, f"one that an interrupted {command} has left", str(folder))
    goes_on = begun and not fresh and not overwrite
    must(goes_on or overwrite or not results, what, f"without {results} (or give --overwrite)", str(folder))
    return goes_on


def how_to_go_on(fresh: bool | None, overwrite: bool, first: str = "") -> str:
    """What a command with these options says when it was stopped: which command goes on.

    first : what is to be done before.
    """
    left_out = [name for name, given in (("--fresh", fresh), ("--overwrite", overwrite)) if given]
    without = f", without {' and '.join(left_out)}" if left_out else ""
    return f"To go on, {first}give the same command again{without}."
