"""Exceptions and messages for users: a message names a quantity, the rule for it, and the received value."""

from __future__ import annotations

import difflib
import numbers
import reprlib
from collections.abc import Iterable
from typing import Any

LONGEST = 200
"""Largest number of characters of a received value, or of a name, in a message."""
MOST_NAMES, NEAR_NAMES = 40, 5
"""Largest number of known names in a message, and the number of nearest names given if there are more."""


class InputError(ValueError):
    """Invalid input. It is raised before anything runs; the CLI exits with code 2."""


class RunError(RuntimeError):
    """A failure during a run. The message says when, where and why; the last good state is kept."""


class RunWarning(UserWarning):
    """A run has failed, and its results are used, or dropped, without checking its status."""


class StartWarning(UserWarning):
    """Grains of a start overlap strongly, or are behind a wall. The scene runs nevertheless."""


class MeshWarning(UserWarning):
    """A mesh has duplicate faces, or faces without area. The scene runs nevertheless."""


class Words(str):
    """Text that describes a received value; messages show it without quotes."""


class _Short(reprlib.Repr):
    """A repr that limits the length and the depth of its result for values of any size."""

    def __init__(self) -> None:
        super().__init__()
        self.maxstring = self.maxother = LONGEST
        self.maxlevel, self.maxdict = 3, 6

    def repr_int(self, x: int, level: int) -> str:
        # Python refuses to convert integers with more than a few thousand digits.
        digits = int(x.bit_length() * 0.30103) + 1
        return repr(x) if digits < LONGEST else f"a whole number of about {digits} digits"


_short = _Short()


def abbreviated(value: Any) -> str:
    """Return a value as shown in a message: on one line, with at most LONGEST characters."""
    return printable(value if isinstance(value, Words) else _short.repr(value))


def printable(text: str) -> str:
    """Return text as shown in a message: on one line, printable, with at most LONGEST characters."""
    if len(text) > LONGEST:
        text = f"{text[: LONGEST // 2]}...{text[-LONGEST // 2 + 3 :]}"
    return text if text.isprintable() else repr(text)[1:-1]


def must(condition: bool, what: str, rule: str, received: Any) -> None:
    """Raise ``InputError("<what> must be <rule>; received <received>")`` unless ``condition`` holds."""
    if not condition:
        raise InputError(f"{printable(what)} must be {rule}; received {abbreviated(received)}")


def is_whole(value: Any, least: int) -> bool:
    """Return whether a value is an integer of Python or NumPy, at least ``least``; a boolean is not."""
    return isinstance(value, numbers.Integral) and not isinstance(value, bool) and int(value) >= least


def is_number(value: Any) -> bool:
    """Return whether a value is a real number of Python or NumPy; a boolean is not."""
    return isinstance(value, numbers.Real) and not isinstance(value, bool)


def did_you_mean(received: str, known: Iterable[str]) -> str:
    """Return the end of a message that suggests the nearest known name; empty if there is none."""
    nearest = difflib.get_close_matches(received, known, n=1)
    return f"; did you mean {abbreviated(nearest[0])}?" if nearest else ""


def some_of(known: Iterable[str], received: Any, listed: str) -> str:
    """Return the known names as text for a message. If there are many, only the nearest to the received name
    are given, with the command that lists all."""
    names = sorted(known)
    if len(names) <= MOST_NAMES:
        return ", ".join(names)
    near = difflib.get_close_matches(str(received), names, n=NEAR_NAMES, cutoff=0.0)
    return f"{len(names)} that {listed} lists, such as {', '.join(near)}"
