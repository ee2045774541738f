"""A flag for progress displays: whether kernels of a step are being compiled."""

from collections.abc import Iterator
from contextlib import contextmanager

_now = 0


@contextmanager
def compiling() -> Iterator[None]:
    """Make ``is_compiling`` return True within this context, in every thread."""
    global _now
    _now += 1
    try:
        yield
    finally:
        _now -= 1


def is_compiling() -> bool:
    """Return whether kernels of a step are being compiled in this process."""
    return _now > 0
