"""Errors for people: what was wrong, what it must be, what was received."""

from __future__ import annotations

from typing import Any


class InputError(ValueError):
    """Something the user wrote cannot be run; raised before anything runs. The CLI exits with code 2."""


class RunError(RuntimeError):
    """A run could not go on. Says when, where and why; the last good state is kept."""


def must(condition: bool, what: str, rule: str, received: Any) -> None:
    """Raise ``InputError("<what> must be <rule>; received <received>")`` unless ``condition`` holds."""
    if not condition:
        raise InputError(f"{what} must be {rule}; received {received!r}")
