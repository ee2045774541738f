"""Inlet: particles enter with the flow, each at its own time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, ClassVar, Self

import numpy as np
from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.components.component import Vector
from tisim.components.directed import Directed
from tisim.effects.base import Constraint, Effect, PairEvent, PairForce, SceneParts, SelfConsistentQuantity
from tisim.errors import Words, must
from tisim.numerics import philox
from tisim.numerics.random_streams import INLET
from tisim.operators.base import option, parameter
from tisim.operators.filled_region import FilledRegion
from tisim.operators.outlet import Outlet
from tisim.operators.reflecting_walls import ReflectingWalls
from tisim.operators.touching_magnets import TouchingMagnets
from tisim.sources.base import Source, sources
from tisim.state.bound import Peers
from tisim.state.fields import Field, WorldField

FLOW = "flow_velocity"
ENTRY_FIELDS = (
    Field("enters_at", "s", 1, "keep", double=True),
    Field("entered_at", "s", 1, "keep", default=-1.0, double=True),
    Field("entry_trials", "", 1, "keep", integer=True),
)
PARTICLE_NUMBERS = ("waiting_particles", "captured_particles", "free_particles")
"""Measures: the numbers of particles by state."""


class Inlet(Directed, FilledRegion, TouchingMagnets):
    """Particles wait until they enter with the flow through a thin region, each at its own time.

        P(place) ~ u.n,    P(time) uniform between begin and end

    All particles of the start wait, unless it gives them an ``entered_at`` of 0 or more; a waiting particle
    is ``fixed``, at rest, and takes part in nothing, wherever the start has placed it. Entry times are
    independent: the feed is a Poisson process of as many particles as the start has. At the end of the step
    that contains its time, a particle is placed at random in the region, with a density proportional to the
    velocity u.n of the flow along ``direction``, as in a suspension of uniform concentration, and moves on
    with the velocity of the flow. Places at which it would touch a magnet or a reflecting wall are rejected;
    where nothing flows, nothing enters. If all ``tries`` trials fail, it is tried again in the next step. A
    short time from ``begin`` to ``end`` is a pulse, a long one a step of the concentration.

    Particles that diffuse back through the upstream face of the region are reflected there: the flux into the
    region equals the feed (P. V. Danckwerts, Chem. Eng. Sci. 2 (1953) 1).

    ``work["entered"]`` is the number of particles that have entered, and ``entered_at`` is the time for each
    (s), -1 before. ``measures`` have the numbers of particles at this time: ``waiting_particles``,
    ``captured_particles``, and ``free_particles``, inside and not captured. The numbers entered, released
    and so on balance: entered = exited + captured + free. Particles must not interact; for particles that do,
    use insertions and ``outflow``.
    """

    along: ClassVar[str] = "direction"
    unit: ClassVar[str] = "axis"
    fields: ClassVar = ("radius", "fixed", *ENTRY_FIELDS)
    world_fields: ClassVar = (WorldField("entered", "counter"),)
    requires_source: ClassVar = (FLOW,)
    excludes: ClassVar = (PairForce, PairEvent, Constraint, SelfConsistentQuantity)
    precedes: ClassVar = (Outlet,)
    any_order: ClassVar[bool] = True
    acts_on_fixed: ClassVar[bool] = True

    direction: Vector = parameter("", "direction n of the flow into the region", examples=[(0.0, 0.0, 1.0)])
    begin: float = parameter("s", "time from which on particles enter", 0.0, ge=0)
    end: float = parameter("s", "time until which particles enter", examples=[1.0], ge=0)
    fastest: float | None = parameter(
        "m/s",
        "upper bound of the flow velocity in the region; by default the sum of the bounds of all flows",
        None,
        gt=0,
    )
    tries: int = option("largest number of trial places of a particle in a step", 100, gt=0, le=10_000)

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        rule = f"at least {self.label}.begin, {self.begin:g} s"
        must(self.end >= self.begin, f"{self.label}.end", rule, self.end)
        return self

    def check(self, scene: SceneParts) -> None:
        bound = self._bound(scene.effects)
        rule = "given, because a flow of the scene has no known bound"
        must(bound is not None, f"{self.label}.fastest", rule, Words("nothing"))

    def _bound(self, effects: Sequence[Effect]) -> float | None:
        """Return the upper bound of the flow velocity, m/s; None if unknown."""
        if self.fastest is not None:
            return self.fastest
        flows = [one for one in effects if isinstance(one, Source) and one.quantity == FLOW]
        bounds = [one.strongest() for one in flows]
        return None if None in bounds else sum(filter(None, bounds))

    def completed_by(self, effects: Sequence[Effect]) -> Self:
        return self.model_copy(update={"fastest": self._bound(effects)})

    def given_at_start(self, start: Mapping[str, np.ndarray], seed: int) -> dict[str, np.ndarray]:
        n = len(start["radius"])
        entered = np.asarray(start.get("entered_at", np.full(n, -1.0)), float)
        draw = np.random.Generator(np.random.Philox(key=[seed, INLET]))
        times = self.begin + (self.end - self.begin) * draw.random(n)
        waits = entered < 0
        fixed = np.where(waits, 1, start.get("fixed", np.zeros(n, int)))
        return {
            "velocity": np.where(waits[:, None], 0.0, start["velocity"]),
            "fixed": fixed,
            "entered_at": entered,
            "enters_at": np.where(waits, times, entered),
        }

    def measures(self, state: Mapping[str, np.ndarray]) -> dict[str, float]:
        waiting = state["entered_at"] < 0
        none = np.full(len(waiting), -1)
        captured = (state.get("captured_by", none) >= 0) & ~waiting
        exited = state.get("exited_at", none) >= 0
        free = ~(waiting | captured | exited)
        return dict(
            zip(PARTICLE_NUMBERS, (float(one.sum()) for one in (waiting, captured, free)), strict=True)
        )

    def measured(self) -> dict[str, str]:
        return {**super().measured(), **dict.fromkeys(PARTICLE_NUMBERS, "")}

    @classmethod
    def columns(cls) -> Iterator[tuple[str, int]]:
        yield from super().columns()
        yield "upstream", 1

    def values(self) -> list[float]:
        axis = np.array(self.unit_vector())
        low, high = np.array(self.low), np.array(self.high)
        upstream = float(axis @ (low + high) / 2 - np.abs(axis) @ (high - low) / 2)
        return [*super().values(), upstream]

    def connect(self, peers: Peers) -> dict[str, Any]:
        flows, walls = sources(peers, FLOW), peers.of(ReflectingWalls)
        return {**super().connect(peers), "flows": flows, "walls": walls}

    @ti.func
    def particle(self, s, w, i, t, dt):
        if s.entered_at[w, i] < 0.0:
            if t >= s.enters_at[w, i]:
                self.enter(s, w, i, t)
        elif s.fixed[w, i] == 0:
            r = s.position[w, i]
            depth = self.upstream(w) - r.dot(self.axis(w))
            if depth > 0.0:
                s.position[w, i] = r + 2.0 * depth * self.axis(w)

    @ti.func
    def enter(self, s, w, i, t):
        """Try places for a particle, and place it at the first that is accepted."""
        tried = 0
        while tried < self.tries and s.entered_at[w, i] < 0.0:
            u = self.uniforms(s, w, i)
            spot = ti.cast(ti.Vector([u[0], u[1], u[2]]), s.real)
            place = self.point(w, ti.cast(0.0, s.real), spot)
            velocity = 0.0 * place
            for flow in ti.static(self.flows):
                velocity += flow.value(w, place, t)
            if ti.cast(u[3], s.real) * self.fastest(w) < velocity.dot(self.axis(w)):
                by, _distance, _outward = self.touched(w, place, s.radius[w, i])
                free = by < 0
                for walls in ti.static(self.walls):
                    depth, _normal = walls.deepest(w, place, s.radius[w, i])
                    free = free and depth <= 0.0
                if free:
                    s.position[w, i], s.velocity[w, i] = place, velocity
                    s.fixed[w, i], s.entered_at[w, i] = 0, t
                    ti.atomic_add(s.entered[w], 1)
            tried += 1

    @ti.func
    def uniforms(self, s, w, i):
        """Return four random numbers in 0..1 for the next trial of a particle."""
        trial = s.entry_trials[w, i]
        s.entry_trials[w, i] = trial + 1
        one = philox.uniform(philox.bits(s.seed[w], INLET, s.id[w, i], trial, 0))
        two = philox.uniform(philox.bits(s.seed[w], INLET, s.id[w, i], trial, 1))
        return ti.Vector([one[0], one[1], two[0], two[1]], dt=ti.f64)
