"""Errors for people: what was wrong, what it must be, what was received."""

from __future__ import annotations

import reprlib
from typing import Any

LONGEST = 200
"""Characters of what was received, and of a name, that a message repeats."""


class InputError(ValueError):
    """Something the user wrote cannot be run; raised before anything runs. The CLI exits with code 2."""


class RunError(RuntimeError):
    """A run could not go on. Says when, where and why; the last good state is kept."""


class _Short(reprlib.Repr):
    """The representation of a value whose length and depth are bounded, however large the value is."""

    def __init__(self) -> None:
        super().__init__()
        self.maxstring = self.maxother = LONGEST
        self.maxlevel, self.maxdict = 3, 6

    def repr_int(self, x: int, level: int) -> str:
        # Python refuses to write out numbers of more than some thousand digits.
        digits = int(x.bit_length() * 0.30103) + 1
        return repr(x) if digits < LONGEST else f"a whole number of about {digits} digits"


_short = _Short()


def shown(value: Any) -> str:
    """A value as a message repeats it: on one line, of at most LONGEST characters."""
    return named(_short.repr(value))


def named(text: str) -> str:
    """Text as a message repeats it: on one line, printable, of at most LONGEST characters."""
    if len(text) > LONGEST:
        text = f"{text[: LONGEST // 2]}...{text[-LONGEST // 2 + 3 :]}"
    return text if text.isprintable() else repr(text)[1:-1]


def must(condition: bool, what: str, rule: str, received: Any) -> None:
    """Raise ``InputError("<what> must be <rule>; received <received>")`` unless ``condition`` holds."""
    if not condition:
        raise InputError(f"{named(what)} must be {rule}; received {shown(received)}")
