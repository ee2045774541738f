"""What a run gives back: how each world ended, its state, and the counts of its work."""

from __future__ import annotations

from dataclasses import dataclass, field

from tisim.scene.initial_state import Arrays
from tisim.scene.scene import Scene


@dataclass(frozen=True)
class Status:
    """A status says how a world ended. ``ok`` when it reached its end; else ``reason`` says when, where and
    what."""

    ok: bool
    reason: str


@dataclass(frozen=True)
class Result:
    """A result is what a run has made of one scene.

    state : arrays of the live particles by field name, SI; shape (n,) or (n, 3). After a failure, that
        of the last good step; for particles that do not feel each other and take implicit or Brownian steps
        of their own, of the last good step of the particle that failed. start : the same at the start.
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
