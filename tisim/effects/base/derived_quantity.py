"""Quantities of particles that follow from the rest of the state, and from each other."""

from __future__ import annotations

from typing import ClassVar, Literal

from tisim.backend.taichi import ti
from tisim.components.accuracy_parameter import AccuracyParameter
from tisim.components.component import option, parameter
from tisim.effects.base.effect import Effect
from tisim.effects.base.pairwise import Pairwise
from tisim.state.fields import WorldField

SWEEPS = 100
"""Default of the largest number of sweeps."""


class DerivedQuantity(Effect):
    """A derived quantity of each particle follows from the rest of the state, such as a magnetic moment.

    It is set before each summation of forces; several derived quantities are set in scene order.

    quantity : the name of the field that it sets.
    """

    contract: ClassVar[bool] = True
    quantity: ClassVar[str]

    @ti.func
    def response(self, s, w, i, total, t):
        """Return the value of i, given the sum of the influences of others, which is 0 unless it is
        self-consistent."""
        return total


class SelfConsistentQuantity(DerivedQuantity, Pairwise):
    """A self-consistent quantity of each particle depends on its values at all other particles, such as an
    induced dipole.

        q_i = response(sum_j influence(q_j))

    It is solved by sweeps over all particles at once (Jacobi's method). Each step starts from the values of
    the last step. Sweeps end when no particle changes by more than ``tolerance`` times the largest value, or
    by more than rounding. A world that has not converged after ``sweeps`` sweeps fails with a message, unless
    its values vanish, as after a field is switched off: the last change is then at most ``tolerance`` times
    the largest value before the first sweep.

    With ``sweeps`` = 0 each step makes one sweep. It makes more only if that sweep changes a particle by more
    than ``largest_change`` times the largest value. This happens at the start, when particles are inserted,
    when a field is switched on, and when values diverge. Sweeps then continue to ``tolerance``; after 100
    sweeps the world fails. With ``largest_change`` = 2 each step makes exactly one sweep.

    If the others act by a linear law with real eigenvalues L, plain sweeps with a ``relaxation`` a converge
    if 1 - 2/a < L < 1 for all of them. Anderson mixing needs fewer sweeps, and also converges if some
    eigenvalues are below -1, as in dense lattices. No physical solution exists if an L exceeds 1. Mixed
    sweeps could then converge to a spurious one, so a ``linear`` law stops its world as soon as sweeps reveal
    such an L.

    ``sweep_change`` of a world is the change in the last sweep, over the largest value. With one sweep per
    step, the distance of the values from the solution is about L / (1 - L) times this change.
    ``sweep_factor`` is the factor by which a sweep multiplies the change, from the last three sweeps of a
    step. For plain sweeps that go on it tends to the largest |1 - a + a L|. If a world stops because L
    exceeds 1, it is a lower bound of L.

    linear : whether the response is linear in the influence of the others. The ``weight`` must then make the
    influence of i on j equal to that of j on i.

    Source: D. G. Anderson, J. ACM 12 (1965) 547, with a depth of 1.
    """

    contract: ClassVar[bool] = True
    within_bodies: ClassVar[bool] = True
    world_fields = (
        WorldField("mutual_sweeps", "counter"),
        WorldField("sweep_factor", "measure"),
        WorldField("sweep_change", "measure"),
    )
    linear: ClassVar[bool] = False

    tolerance: float = parameter(
        "", "change in a sweep over the largest value at which sweeps have converged", 1e-8, gt=0
    )
    sweeps: int = option(
        "largest number of sweeps over all particles; 0 for one sweep per step while that suffices",
        SWEEPS,
        ge=0,
    )
    largest_change: float = parameter(
        "",
        "with sweeps = 0, relative change above which a step makes more than one sweep",
        1e-2,
        gt=0,
    )
    relaxation: float = parameter(
        "", "relaxation factor a of a sweep, q = (1 - a) q + a response", 1.0, gt=0, le=1
    )
    acceleration: Literal["anderson", "none"] = option(
        "how a sweep is mixed with the previous one, if a step makes several", "anderson"
    )

    @property
    def accuracy_parameters(self) -> tuple[AccuracyParameter, ...]:  # type: ignore[override]
        return self.sweep_parameters()

    def sweep_parameters(self) -> tuple[AccuracyParameter, ...]:
        """Return the setting that decides whether another sweep is made."""
        return (AccuracyParameter(tolerance=1) if self.sweeps else AccuracyParameter(largest_change=1),)

    def approximations(self, extent: float) -> tuple[Effect, ...]:
        return (self.model_copy(update={"sweeps": 0 if self.sweeps else SWEEPS}),)

    @ti.func
    def weight(self, s, w, i):
        """Return the weight of particle i in the inner product that Anderson mixing uses."""
        return ti.cast(1.0, s.real)

    @ti.func
    def influence(self, s, w, i, j, separation, distance, t):
        """Return the influence of j, with its present value, at i."""
        return 0.0 * separation
