"""Private random state for DEAP, which draws from Python's global random module."""

from __future__ import annotations

import random

import numpy as np


class OwnRandom:
    """Within ``with``, the modules random and numpy.random have this object's states; afterwards the
    caller's.

    DEAP uses random; operators of the user may use numpy.random.
    """

    def __init__(self, seed: int) -> None:
        legacy = np.random.RandomState(seed % 2**32)
        self.state = random.Random(seed).getstate(), legacy.get_state()

    def __enter__(self) -> None:
        self._callers = random.getstate(), np.random.get_state()  # noqa: NPY002
        self._set(self.state)

    def __exit__(self, *error: object) -> None:
        self.state = random.getstate(), np.random.get_state()  # noqa: NPY002
        self._set(self._callers)

    @staticmethod
    def _set(state: tuple[object, object]) -> None:
        random.setstate(state[0])  # type: ignore[arg-type]
        np.random.set_state(state[1])  # type: ignore[arg-type]  # noqa: NPY002
