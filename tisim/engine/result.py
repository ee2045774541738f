"""What a run gives back: how each world ended, its state, and the counts of its work."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Self

from tisim.errors import RunError, RunWarning
from tisim.scene.initial_state import Arrays
from tisim.scene.scene import Scene

RUNNING = "running"
"""This is the reason of a world that has not come to its end yet."""
RESULTS = ("state", "measures")
"""To read these of a failed run warns, unless its status has been read before."""


@dataclass(frozen=True)
class Status:
    """A status says how a world ended. ``ok`` when it reached its end; else ``reason`` says when, where and
    what."""

    ok: bool
    reason: str

    @property
    def failed(self) -> bool:
        """Return whether the world has failed; one that still runs has neither failed nor ended."""
        return not self.ok and self.reason != RUNNING


@dataclass(frozen=True)
class Result:
    """A result is what a run has made of one scene.

    Who uses the ``state`` or the ``measures`` of a result of ``tisim.run`` that has failed, or drops it,
    without having read its ``status`` gets a ``RunWarning``. ``check()`` raises instead, and returns the
    result where all is well: ``tisim.run(scene).check().state``.

    state : arrays of the live particles by field name, SI; shape (n,) or (n, 3). After a failure, that
        of the last good step; for particles that do not feel each other and take implicit or Brownian steps
        of their own, of the last good step of the particle that failed. start : the same at the start,
        where ids are numbers from 0 in the order of the arrays.
    time : s, of ``state``. work : counts until then (steps, particle_steps, and what the effects count).
        measures : quantities of the world that its effects keep, at the end. wall_s : wall seconds of
        the batch that this world was part of, per world; set-up, compilation and observers are not
        in it, but what it took to find the last good steps is.
    settings : precision, device and threads that it ran with; ``edited`` among them says what was written to
        ``Simulation.state`` on the way, and then neither the scene nor ``start`` alone describe the run.
    """

    scene: Scene
    state: Arrays
    start: Arrays
    time: float
    work: dict[str, int]
    status: Status
    wall_s: float
    settings: dict[str, str] = field(default_factory=dict)
    measures: dict[str, float] = field(default_factory=dict)

    def check(self) -> Self:
        """Return the result itself; raise RunError, with the reason, where the run has failed."""
        if self.status.failed:
            raise RunError(f"{self.scene.name}: {self.status.reason}")
        return self

    def watched(self) -> Self:
        """Return the result itself, which from now on warns who does not read its status."""
        self.__dict__["_unread"] = True
        return self

    def __repr__(self) -> str:
        # Who prints it sees how it ended.
        n, status = len(self.start.get("mass", ())), self.status.reason
        return f"Result({self.scene.name!r}: {n} particles, {self.time:.6g} s, {status})"

    def __getstate__(self) -> dict[str, Any]:
        # The copy warns in its place.
        own = dict(self.__dict__)
        self.__dict__["_unread"] = False
        return own

    def __getattribute__(self, name: str) -> Any:
        if name == "status":
            object.__getattribute__(self, "__dict__")["_unread"] = False
        elif name in RESULTS:
            object.__getattribute__(self, "_warn")(f"its {name} is that of the last good step")
        return object.__getattribute__(self, name)

    def __del__(self, at_exit: Callable[[], bool] = sys.is_finalizing) -> None:
        # At exit there may be no modules any more.
        if not at_exit():
            self._warn("its result has been dropped")

    def _warn(self, what: str) -> None:
        """Warn, once, where the run has failed and nobody has read its status."""
        own = object.__getattribute__(self, "__dict__")
        if own.get("_unread") and own["status"].failed:
            own["_unread"] = False
            told = "read result.status first, or call result.check(), which raises"
            text = f"the run of {own['scene'].name!r} failed, and {what} ({told}): {own['status'].reason}"
            warnings.warn(text, RunWarning, stacklevel=3)
