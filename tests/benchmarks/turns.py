"""Turns of programs that are timed side by side."""

from __future__ import annotations

import time
from collections.abc import Iterable

import numpy as np

REST = 0.05
"""Seconds. Idle threads of GNU's OpenMP, which numba and LAMMPS use, keep polling for work for some ms."""


def rest() -> None:
    """Wait until the threads of the program before have gone to sleep: while other threads want the cores,
    tisim's threads do not work as a team."""
    time.sleep(REST)


def spread(values: Iterable[float]) -> str:
    """Return median, smallest and largest."""
    values = list(values)
    return f"{np.median(values):.3g} ({min(values):.3g} .. {max(values):.3g})"
