"""The last good step of a world that has failed, found by running it once more.

Whether all is finite is asked now and then only, between many steps, and a failing step can leave its work
half done. But a run has the same bits again, so the world goes back to a time at which all of its state is
known, and from there by bisection to the last step after which it was good. That takes no longer than the way
from there to the failure did, and what is found does not depend on when anybody looked.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from tisim.state import ENDED

if TYPE_CHECKING:
    from collections.abc import Callable

    from tisim.simulation import Simulation

Image = dict[str, np.ndarray]
EVERY = 10.0
"""Wall time (s) between images of the whole state, from which a world can go on."""


class Replay:
    """Where the worlds of a loaded simulation can be run once more from: an image of them, or their start.

    base : the image; None for the start, of which none is made, as most runs are short and none fails.
    """

    def __init__(self, simulation: Simulation, base: Image | None) -> None:
        self.simulation, self.base, self.made = simulation, base, time.perf_counter()

    def keep(self) -> None:
        """Make the image anew, where that is due; no world may have failed since it was last made."""
        if time.perf_counter() - self.made > EVERY:
            self.base, self.made = self.simulation.s.image(), time.perf_counter()

    def last_good(self, w: int, sound: Callable[[int], bool]) -> Image:
        """Bring a world to where it fails, and the others nowhere; the image of its last good step.

        sound : whether all is well with a world as it is.
        """
        s, program = self.simulation.s, self.simulation.program
        last = int(s.read("steps")[w])
        self._rewind(w)
        good = s.image()
        # Steps from where it was last found good to where it was first found bad.
        to_bad = last + 1 - int(good["steps"][w])
        while to_bad > 1:
            half = to_bad // 2
            program.advance(half)
            if sound(w):
                good, to_bad = s.image(), to_bad - half
            else:
                to_bad = half
                self.simulation.put(good)
        program.advance(1)
        return good

    def _rewind(self, w: int) -> None:
        if self.base is None:
            self.simulation.begin()
        else:
            self.simulation.put(self.base)
        status = self.simulation.s.read("status")
        status[np.arange(len(status)) != w] = ENDED
        self.simulation.s.write("status", status)
