"""What is wrong with a law that cannot be compiled, in a line of its author's file.

Taichi compiles a law when a scene is first run, and shows every place from the loop of a step down to the
fault.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tisim.errors import InputError

PACKAGE = Path(__file__).parents[1]
PLACE = re.compile(r'File "(.+?)", line (\d+), in (\w+):')


@contextmanager
def in_a_line() -> Iterator[None]:
    """Raise InputError, naming file and line, where a law outside of this package cannot be compiled."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        said = str(error)
        places = PLACE.findall(said)
        file, line, function = places[-1] if places else ("", "", "")
        if not places or PACKAGE in Path(file).parents:
            raise
        what = " ".join(said.strip().splitlines()[-1].split())
        raise InputError(
            f"{file}, line {line}, in {function}, must be what Taichi can compile; received {what}"
        ) from error
