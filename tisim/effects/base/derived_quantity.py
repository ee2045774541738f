"""Quantities of particles that follow from the rest of the state, and from each other."""

from __future__ import annotations

from typing import ClassVar, Literal

from tisim.backend.taichi import ti
from tisim.components.accuracy_parameter import AccuracyParameter
from tisim.components.component import option, parameter
from tisim.effects.base.effect import Effect
from tisim.effects.base.pairwise import Pairwise

SWEEPS = 100
"""There are at most so many sweeps unless it is said how many."""


class DerivedQuantity(Effect):
    """A derived quantity of each particle follows from the rest of the state, such as a magnetic moment.

    It is set before forces are summed, whenever they are; several of them in scene order.

    quantity : the name of the field that it sets.
    """

    contract: ClassVar[bool] = True
    quantity: ClassVar[str]

    @ti.func
    def response(self, s, w, i, total, t):
        """Return the value of i, given the sum of what others do to it: 0 unless it is self-consistent."""
        return total


class SelfConsistentQuantity(DerivedQuantity, Pairwise):
    """A self-consistent quantity of each particle depends on that of all others, such as an induced dipole.

        q_i = response(sum_j influence(q_j))

    It is found by sweeps over all particles at once (the method of Jacobi), each starting from the last
    values, also those of the last step, until no particle changes by more than ``tolerance`` times the
    largest value, or by rounding. A world in which ``sweeps`` do not suffice fails, and says so.

    With ``sweeps`` of 0 a step makes one, and more only where that one changes a particle by more than
    ``largest_change`` times the largest value: at the start, from nothing, where particles are put in or a
    field is switched on, and where values grow without end. It then goes on to ``tolerance``, in at most
    100 sweeps, or the world fails. A ``largest_change`` of 2 has one sweep a step whatever comes of it.

    Where the others act by a linear law, with real eigenvalues L, plain sweeps with a ``relaxation`` of a
    converge if 1 - 2/a < L < 1 for all of them. Mixed by the method of Anderson they are fewer, and converge
    as well where some are below -1, as in dense lattices. There is no solution to find where L exceeds 1:
    what a mixed sweep would then find is none, so a ``linear`` law stops its world as soon as sweeps show
    such an L.

    ``sweep_change`` of a world is the change in the last sweep, over the largest value: where there is one
    sweep a step, it times L / (1 - L) is about how far values are from those that they should have.
    ``sweep_factor`` is what sweeps multiply the change by, from the last three of a step; of plain ones
    without end it tends to the largest |1 - a + a L|. Where a world stops as L exceeds 1 it is a bound of L
    from below.

    linear : whether the response is linear in what the others do. Its ``weight`` then makes what i does to j
    equal to what j does to i.

    Source: D. G. Anderson, J. ACM 12 (1965) 547, with a depth of 1.
    """

    contract: ClassVar[bool] = True
    within_bodies: ClassVar[bool] = True
    counters = ("mutual_sweeps",)
    world_quantities = ("sweep_factor", "sweep_change")
    linear: ClassVar[bool] = False

    tolerance: float = parameter(
        "", "change in a sweep, over the largest value, at which the solution counts as converged", 1e-8, gt=0
    )
    sweeps: int = option(
        "sweeps over all particles at most; 0 for one a step, while that suffices", SWEEPS, ge=0
    )
    largest_change: float = parameter(
        "",
        "beside sweeps = 0, change over the largest value above which a step makes more than one",
        1e-2,
        gt=0,
    )
    relaxation: float = parameter(
        "", "part a of its way that a sweep goes, q = (1 - a) q + a response", 1.0, gt=0, le=1
    )
    acceleration: Literal["anderson", "none"] = option(
        "how sweeps are mixed with the last, where a step makes several", "anderson"
    )

    @property
    def accuracy_parameters(self) -> tuple[AccuracyParameter, ...]:  # type: ignore[override]
        return self.sweep_parameters()

    def sweep_parameters(self) -> tuple[AccuracyParameter, ...]:
        """Return the setting that says when there is another sweep."""
        return (AccuracyParameter(tolerance=1) if self.sweeps else AccuracyParameter(largest_change=1),)

    def approximations(self, extent: float) -> tuple[Effect, ...]:
        return (self.model_copy(update={"sweeps": 0 if self.sweeps else SWEEPS}),)

    @ti.func
    def weight(self, s, w, i):
        """Return the weight of particle i in the inner product by which sweeps are mixed."""
        return ti.cast(1.0, s.real)

    @ti.func
    def influence(self, s, w, i, j, separation, distance, t):
        """Return what j, with its present value, does at i."""
        return 0.0 * separation
