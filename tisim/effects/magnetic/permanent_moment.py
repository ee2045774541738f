"""Permanent magnetic moments, which rotate with their particles (L21 section 4.2.1.2)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from scipy.constants import mu_0

from tisim.backend.taichi import ti
from tisim.effects.base import Constraint, Effect, PairForce, parameter
from tisim.effects.magnetic.moment import MOMENT, Moment
from tisim.errors import Words, must
from tisim.numerics.random_streams import MOMENTS
from tisim.numerics.vectors import turned
from tisim.operators.base import Operator
from tisim.sources.base import Source
from tisim.state.bound import Peers


class PermanentMoment(Operator):
    """Each particle is a permanent magnet: its moment is fixed in it and rotates with it.

        dm/dt = w x m,    m(0) = M V e  unless the start gives it,    I dw/dt = T,    I = 2/5 m R^2

    w is the spin. Besides forces, ``dipole_dipole`` exerts the torque m x B of the fields of other particles,
    and ``magnetophoresis`` of the sources. e is a random unit vector for each particle, uniformly distributed
    and determined by the seed of the scene. Inserted particles have the ``moment`` that their class gives
    them.

    Each step rotates the moment about w by |w| dt, which keeps its magnitude. With ``verlet`` this is the
    drift of a leapfrog: second order, symplectic, and exact without torque. In a rigid body the moment
    rotates with the body, in a clump by its quaternion. Other steppers keep moments fixed until the end of a
    step, which makes them first order in dt.

    Source: L21 Eqs (4.6) to (4.9), section 4.2.1.4.
    """

    fields = (MOMENT, "radius", "spin")
    excludes: ClassVar = (Moment,)
    depends_on_velocity = True
    homogeneous = True
    leapfrog: ClassVar[bool] = True

    magnetisation: float = parameter(
        "A/m",
        "magnetisation M, along a random direction for each particle; 0 if the start gives moments",
        0.0,
        ge=0,
    )

    def given_at_start(self, start: Mapping[str, np.ndarray], seed: int) -> dict[str, np.ndarray]:
        if self.magnetisation == 0:
            return {}
        rule = f"left out, as effects.{self.label}.magnetisation gives it"
        must("moment" not in start, "particles.moment", rule, Words("given"))
        draw = np.random.Generator(np.random.Philox(key=[seed, MOMENTS]))
        direction = draw.normal(size=(len(start["radius"]), 3))
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        volume = 4 / 3 * np.pi * start["radius"] ** 3
        return {"moment": self.magnetisation * volume[:, None] * direction}

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        volume = 4 / 3 * np.pi * start["radius"] ** 3
        moment = self.magnetisation * volume
        if "moment" in start:
            moment = np.linalg.norm(start["moment"], axis=1)
        sources = [one for one in effects if isinstance(one, Source)]
        bounds = [one.strongest() for one in sources if one.quantity == "magnetic_flux_density"]
        if None in bounds or not len(moment):
            return None
        # The field of the strongest moment at contact, and of all sources.
        pairs = any(isinstance(one, PairForce) for one in effects)
        near = mu_0 / (4 * np.pi) * 2 * float(moment.max()) / (2 * start["radius"]) ** 3 if pairs else 0.0
        torque = moment * (sum(filter(None, bounds)) + near)
        rate = np.sqrt(torque / (0.4 * start["mass"] * start["radius"] ** 2))
        fastest = float((rate + np.linalg.norm(start.get("spin", np.zeros((1, 3))), axis=1)).max())
        return 2 / fastest if fastest > 0 else math.inf

    def part_of_critical_step(self, accuracy: float) -> float:
        # A moment released against the field passes it at twice the rate: its energy error was up to 0.27
        # (omega dt)^2 of m B (tests/hard/test_default_stepper.py).
        return super().part_of_critical_step(accuracy / 2)

    def connect(self, peers: Peers) -> dict[str, Any]:
        return {"constraints": peers.of(Constraint)}

    @ti.func
    def particle(self, s, w, i, t, dt):
        moment = turned(s.moment[w, i], dt * s.spin[w, i])
        for constraint in ti.static(self.constraints):
            if constraint.holds(s, w, i):
                moment = constraint.carried(s, w, i, s.moment[w, i], t, dt)
        s.moment[w, i] = ti.cast(moment, s.real)
