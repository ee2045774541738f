"""The last good step of failed worlds is found by running them again.

Whether all quantities are finite is checked only now and then, many steps apart, and a failing step can leave
its work half done. Runs are bitwise reproducible, so failed worlds return to a time at which their full state
is known. Bisection from there finds the last step after which each world was good, for all failed worlds at
once. This takes at most about twice as long as the original run from that time to the failure. The result
depends neither on when the checks were made nor on the other worlds of the batch.

Particles without mutual interaction share a common time only at the ends of the intervals of their longest
step (steppers/intervals.py), and such an interval counts as a step here. An interval in which a particle
fails is repeated and cut at the end of the last good step of that particle; the last steps of the other
particles are shortened to end there. The state at the cut is used if the world fails again from it; otherwise
the beginning of the interval is the last good state.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from tisim.state.status import WorldStatus

if TYPE_CHECKING:
    from collections.abc import Callable

    from tisim.engine.worlds import Worlds

Image = dict[str, np.ndarray]
EVERY = 10.0
"""Least wall time (s) between images of the full state, from which worlds can be replayed."""
IMAGES = 0.05
"""At most this fraction of the time is spent on images; one image of a million grains takes seconds."""


class Replay:
    """A replay runs the worlds of a loaded simulation again, from an image or from their initial state.

    base : image of every world between two steps; None for the initial state. No image is made of the initial
    state, as most runs are short and do not fail.
    """

    def __init__(self, simulation: Worlds, base: Image | None) -> None:
        self.simulation, self.base, self.saved_at, self.pause = simulation, base, time.perf_counter(), EVERY

    def save_image(self) -> None:
        """Make a new image if it is due; every running world must be good."""
        began = time.perf_counter()
        if began - self.saved_at > self.pause:
            self.base, self.saved_at = self.whole(), time.perf_counter()
            self.pause = max(EVERY, (self.saved_at - began) / IMAGES)

    def whole(self) -> Image:
        """Return an image of all worlds; a world within a step appears as it was before that step."""
        image = self.simulation.s.image()
        waiting = image["underway"] > 0
        if waiting.any():
            before = self.base
            if before is None:
                try:
                    before = self._rewind()
                finally:
                    self.simulation.put(image)
            for name, values in image.items():
                values[waiting] = before[name][waiting]
        return image

    def last_good(self, worlds: np.ndarray, sound: Callable[[Image], np.ndarray]) -> Image:
        """Advance failed worlds to their failure, leave the others in place, and return an image of the last
        good steps.

        worlds : indices. sound : returns for each world of an image whether it is good. A world with a fault
        in its initial state is left there.
        """
        last, pauses = self.simulation.s.read("steps"), self.simulation.s.read("pause_time")
        # There are no pauses during a replay.
        self.simulation.s.write("pause_time", np.inf)
        good = self._rewind()
        going = worlds[sound(good)[worlds]]
        # Find the number of good steps, from its highest binary digit to the lowest.
        jump = 1 << int((last - good["steps"])[going].max(initial=0)).bit_length()
        while jump > 1:
            jump //= 2
            able = going[good["steps"][going] + jump <= last[going]]
            now = self._image_after(good, able, jump)
            fine = able[sound(now)[able]]
            for name, values in good.items():
                values[fine] = now[name][fine]
        self._cut_step(good, going, sound)
        self._image_after(good, going, 1)
        self.simulation.s.write("pause_time", pauses)
        return good

    def _cut_step(self, good: Image, going: np.ndarray, sound: Callable[[Image], np.ndarray]) -> None:
        """Advance into the failing step up to the cut, if the world fails again from there."""
        cut = self._image_after(good, going, 1)["cut"]
        part = going[cut[going] > 0]
        if len(part) == 0:
            return
        good["cut"][part] = cut[part]
        end = self._image_after(good, part, 1)
        good["cut"][part] = 0.0
        next_end = self._image_after(end, part, 1)
        fine = part[sound(end)[part] & ~sound(next_end)[part]]
        for name, values in good.items():
            values[fine] = end[name][fine]

    def _rewind(self) -> Image:
        if self.base is None:
            self.simulation.begin()
        else:
            self.simulation.put(self.base)
        return self.simulation.s.image()

    def _image_after(self, image: Image, worlds: np.ndarray, steps: int) -> Image:
        """Return the image after a number of steps of these worlds only."""
        image["status"][:] = WorldStatus.ENDED
        image["status"][worlds] = WorldStatus.RUNNING
        image["goal"] = image["steps"] + steps
        self.simulation.put(image)
        while self.simulation.is_running():
            self.simulation.advance(steps)
        return self.simulation.s.image()
