"""DEAP draws from Python's random module; a search must not share its state with anyone."""

from __future__ import annotations

import random


class OwnRandom:
    """Within ``with``, the random module has this object's state; afterwards the caller's again."""

    def __init__(self, seed: int) -> None:
        self.state = random.Random(seed).getstate()

    def __enter__(self) -> None:
        self._callers = random.getstate()
        random.setstate(self.state)

    def __exit__(self, *error: object) -> None:
        self.state = random.getstate()
        random.setstate(self._callers)
