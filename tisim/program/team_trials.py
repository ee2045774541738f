"""When threads share worlds, and when each takes one alone, as other programs want the cores too."""

FIRST_ALONE = 4
"""So many steps by threads alone tell how long they take."""
TRIAL_COST = 0.1
"""Trying teams again is to cost at most this part of the time."""


class TeamTrials:
    """Teams that have parted, as somebody had no core too often, and were slower for it than threads alone,
    are tried again after some time.

    alone : threads take so many steps more of each world alone; 0 where they are in teams. pace : the time of
    a step of one world, then (s).
    """

    def __init__(self, worlds: int) -> None:
        self.worlds, self.alone, self.pace = worlds, 0, 0.0

    def learn(self, taken: int, most: int, seconds: float, parted: bool) -> None:
        """Hear how long a launch took, of at most so many steps of each world, and how many all of them have
        taken; ``parted``: whether they had more to take."""
        if self.alone:
            self.alone -= min(most, self.alone)
            if taken:
                self.pace = seconds / taken
        elif parted and seconds > taken * self.pace:
            of_all = int(seconds / TRIAL_COST / self.pace) if self.pace else 0
            self.alone = max(FIRST_ALONE, of_all // self.worlds)
