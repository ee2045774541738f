"""How programs that are timed side by side take turns."""

from __future__ import annotations

import time
from collections.abc import Iterable

import numpy as np

REST = 0.05
"""Threads of GNU's OpenMP, which numba and LAMMPS have, look for more work for some ms, s."""


def rest() -> None:
    """Wait until the threads of the program that had its turn have gone to sleep: teams of tisim's threads
    part where others want the cores."""
    time.sleep(REST)


def spread(values: Iterable[float]) -> str:
    """Return median, and least and greatest."""
    values = list(values)
    return f"{np.median(values):.3g} ({min(values):.3g} .. {max(values):.3g})"
