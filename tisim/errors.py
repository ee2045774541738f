"""The errors that users see: a message says what was wrong, what it must be and what was received."""

from __future__ import annotations

import difflib
import numbers
import reprlib
from collections.abc import Iterable
from typing import Any

LONGEST = 200
"""The largest number of characters of a received value, or of a name, that a message repeats."""
MOST_NAMES, NEAR_NAMES = 40, 5
"""So many known names are listed; of more, those that are nearest to the one received."""


class InputError(ValueError):
    """The input of the user cannot be run. It is raised before anything runs; the CLI exits with code 2."""


class RunError(RuntimeError):
    """A run could not go on. The message says when, where and why; the last good state is kept."""


class RunWarning(UserWarning):
    """A run has failed, and its results are used, or dropped, without a look at its status."""


class StartWarning(UserWarning):
    """Grains of a start lie deep in each other, or behind a wall. The scene runs all the same."""


class MeshWarning(UserWarning):
    """A mesh has faces that are there twice, or have no area. The scene runs all the same."""


class Words(str):
    """What was received, in words: a message gives it without the quotes that a string gets."""


class _Short(reprlib.Repr):
    """This repr bounds the length and the depth of what it returns, however large the value is."""

    def __init__(self) -> None:
        super().__init__()
        self.maxstring = self.maxother = LONGEST
        self.maxlevel, self.maxdict = 3, 6

    def repr_int(self, x: int, level: int) -> str:
        # Python refuses to write out numbers of more than some thousand digits.
        digits = int(x.bit_length() * 0.30103) + 1
        return repr(x) if digits < LONGEST else f"a whole number of about {digits} digits"


_short = _Short()


def abbreviated(value: Any) -> str:
    """Return a value as a message repeats it: on one line, with at most LONGEST characters."""
    return printable(value if isinstance(value, Words) else _short.repr(value))


def printable(text: str) -> str:
    """Return text as a message repeats it: on one line, printable, with at most LONGEST characters."""
    if len(text) > LONGEST:
        text = f"{text[: LONGEST // 2]}...{text[-LONGEST // 2 + 3 :]}"
    return text if text.isprintable() else repr(text)[1:-1]


def must(condition: bool, what: str, rule: str, received: Any) -> None:
    """Raise ``InputError("<what> must be <rule>; received <received>")`` unless ``condition`` holds."""
    if not condition:
        raise InputError(f"{printable(what)} must be {rule}; received {abbreviated(received)}")


def is_whole(value: Any, least: int) -> bool:
    """Return whether a value is a whole number of Python or NumPy, at least ``least``; a flag is none."""
    return isinstance(value, numbers.Integral) and not isinstance(value, bool) and int(value) >= least


def is_number(value: Any) -> bool:
    """Return whether a value is a real number, of Python or NumPy; a flag is none."""
    return isinstance(value, numbers.Real) and not isinstance(value, bool)


def did_you_mean(received: str, known: Iterable[str]) -> str:
    """Return the end of a message that names the known name next to the one received; empty for none."""
    nearest = difflib.get_close_matches(received, known, n=1)
    return f"; did you mean {abbreviated(nearest[0])}?" if nearest else ""


def some_of(known: Iterable[str], received: Any, listed: str) -> str:
    """Return the known names as a message lists them: all of a few, else those next to the one received, and
    what lists all of them."""
    names = sorted(known)
    if len(names) <= MOST_NAMES:
        return ", ".join(names)
    near = difflib.get_close_matches(str(received), names, n=NEAR_NAMES, cutoff=0.0)
    return f"{len(names)} that {listed} lists, such as {', '.join(near)}"
