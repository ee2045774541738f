"""The last good step of worlds that have failed, found by running them once more.

Whether all is finite is asked now and then only, between many steps, and a failing step can leave its work
half done. But a run has the same bits again, so worlds go back to a time at which all of their state is
known, and from there by bisection to the last step after which they were good: all that have failed at once,
each to its own. That takes no longer than about twice the way from there to the failure did, and what is
found does not depend on when anybody looked, nor on what else is in the batch.

Particles that do not feel each other have no state in common but at the end of an interval of their longest
step (steppers/intervals.py), which is a step here. One in which a particle fails is made once more, and cut
where the last good step of that particle ended: the others go as far, in a last step that is cut short. There
the world is known, and from there it must fail again, or the interval's beginning is what is good.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from tisim.state.status import WorldStatus

if TYPE_CHECKING:
    from collections.abc import Callable

    from tisim.engine.simulation import Simulation

Image = dict[str, np.ndarray]
EVERY = 10.0
"""This wall time (s) passes at least between images of the whole state, from which worlds can go on."""
IMAGES = 0.05
"""At most this part of the time goes into making images: one of a million grains takes seconds."""


class Replay:
    """A replay runs the worlds of a loaded simulation once more, from an image of them or from their start.

    base : the image, of every world between two steps; None for the start, of which none is made, as most
        runs are short and none fails.
    """

    def __init__(self, simulation: Simulation, base: Image | None) -> None:
        self.simulation, self.base, self.saved_at, self.pause = simulation, base, time.perf_counter(), EVERY

    def save_image(self) -> None:
        """Make the image anew, where that is due; every world that runs must be good."""
        began = time.perf_counter()
        if began - self.saved_at > self.pause:
            self.base, self.saved_at = self.whole(), time.perf_counter()
            self.pause = max(EVERY, (self.saved_at - began) / IMAGES)

    def whole(self) -> Image:
        """Return an image of worlds as they are, or as they were, where a step is under way."""
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
        """Bring worlds to where they fail, and the others nowhere; return an image that has their last good
        steps.

        worlds : indices. sound : whether all is well, for each world of an image. A world in which something
        is wrong from the start is left there.
        """
        last, pauses = self.simulation.s.read("steps"), self.simulation.s.read("pause_time")
        # Nobody waits for them on the way.
        self.simulation.s.write("pause_time", np.inf)
        good = self._rewind()
        going = worlds[sound(good)[worlds]]
        # How many steps are good, from the highest binary digit of that number to the lowest.
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
        """Go as far into the step that fails as all was well, where from there it fails again."""
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
        """Return what an image becomes when only these worlds take a number of steps."""
        image["status"][:] = WorldStatus.ENDED
        image["status"][worlds] = WorldStatus.RUNNING
        image["goal"] = image["steps"] + steps
        self.simulation.put(image)
        while self.simulation.is_running():
            self.simulation.advance(steps)
        return self.simulation.s.image()
