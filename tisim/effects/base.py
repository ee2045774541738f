"""The contract of an effect. One effect is one file: its law, its source, its parameters.

Rules
1. An effect is a frozen ``Component``: validated data, its source and equation in the docstring.
2. Every float or Vector parameter may differ per world; in a kernel it is a function, ``self.name(w)``. So
   may a list of parts, in number too: ``self.list.name(w, k)``, k below ``self.list.size(w)``.
   Every other option (bool, int, text) is compiled in, and the same for all worlds of a batch.
3. ``fields`` names the particle fields it reads or writes; a field that nobody needs is not allocated.
   A field that no other effect has ever needed is declared by putting a ``Field`` there. Where the
   effect's options decide, ``required_fields`` returns those of this one.
4. ``counters`` names the integer counters of events it keeps per world: ``ti.atomic_add(s.NAME[w], 1)``;
   ``world_quantities`` names quantities of a world, ``s.NAME[w]``, f64, 0 at the start; a Result gives them
   back.
5. A ``Force`` or ``PairForce`` is a pure function of the trial state; it writes nothing. Forces and torques
   are summed in scene order. What touching pairs remember of each other (``memory``) is handed to them by
   the driver, and changed by ``remember`` only, once a step.
6. Who feels an external field finds it with ``sources`` (see tisim/sources/base.py), and names in
   ``requires_source`` the quantities of which a scene must have at least one source.
7. A ``DerivedQuantity`` of a particle follows from the rest of the state, such as a moment along the field
   where the particle is; the driver sets it before forces are summed. A ``SelfConsistentQuantity`` depends on
   that of all others too, such as an induced dipole.
8. What changes the state between steps is an ``Operator`` (see tisim/operators/base.py).
9. A ``PairEvent`` changes two particles at once. The driver hands it each pair in ``contact`` with
   exclusive access to both, earliest first (see collision_rounds.py); it may remove either.
10. ``connect`` returns what an effect wants to know of the other bound effects; ``requires`` names the
    effects without which it means nothing. The driver never asks what an effect is called.
11. ``at_start`` fills in what an effect takes from the start; ``capacity`` says how many particles may
    ever live at once, given the start.
12. Particles are removed with ``s.remove(w, i)`` and added with ``s.append(w, i)``; ``world`` and ``resolve``
    say with ``s.invalidate_lists(w)`` that they have moved or resized one. Indices move only between steps.
    Nothing may depend on the order of parallel work: no float atomics.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Self

import numpy as np
from pydantic import Field as Option

from tisim.backend.taichi import ti
from tisim.components.accuracy_parameter import AccuracyParameter
from tisim.components.component import Component, parameter
from tisim.worlds.state import Field

__all__ = [
    "DerivedQuantity",
    "Effect",
    "Force",
    "PairEvent",
    "PairForce",
    "SelfConsistentQuantity",
    "parameter",
]


class Effect(Component):
    """Anything physical that a scene can call for.

    name : what it is called in a scene, files and messages; its kind unless given. A scene has each name
    once, so that it can hold two of a kind where ``repeatable`` says that they make sense: each then acts
    with its own parameters, and what both count is added up.
    """

    contract: ClassVar[bool] = True
    repeatable: ClassVar[bool] = False

    name: str | None = Option(None, pattern=r"^[A-Za-z][A-Za-z0-9_]*$")

    fields: ClassVar[tuple[str | Field, ...]] = ()
    counters: ClassVar[tuple[str, ...]] = ()
    world_quantities: ClassVar[tuple[str, ...]] = ()
    requires_source: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def called(cls, data: Mapping[str, Any]) -> str:
        """Its name; its kind unless one is given."""
        return str(data.get("name") or cls.kind())

    def required_fields(self) -> tuple[str | Field, ...]:
        """The particle fields that this one needs, given its options; all of ``fields`` by default."""
        return self.fields

    def at_start(self, masses: np.ndarray) -> Self:
        """With parameters left at None taken from the masses of the start (kg); itself by default."""
        return self

    def capacity(self, masses: np.ndarray) -> int:
        """Particles that may ever live at once, given those of the start (kg); their number by default."""
        return len(masses)

    def approximations(self, extent: float) -> tuple[Effect, ...]:
        """Cheaper laws that ``tisim cost`` tries in its place, the coarsest first, for particles that are up
        to ``extent`` (m) apart; none by default."""
        return ()

    @classmethod
    def offers(cls, hook: str) -> bool:
        """Whether it defines a method that its contract leaves empty."""
        return getattr(cls, hook) is not getattr(cls._promise(hook), hook)

    @classmethod
    def _promise(cls, hook: str) -> type:
        return next(base for base in reversed(cls.__mro__) if hasattr(base, hook))


class Force(Effect):
    """A force on a particle by itself: of its state, its place and the time."""

    contract: ClassVar[bool] = True
    repeatable: ClassVar[bool] = True

    @ti.func
    def force(self, s, w, i, t):
        """Force on particle i of world w at time t. N."""
        return 0.0 * s.velocity[w, i]

    @ti.func
    def torque(self, s, w, i, t):
        """Torque on particle i about its centre. N m."""
        return 0.0 * s.velocity[w, i]

    @ti.func
    def velocity_jacobian(self, s, w, i, t):
        """[a, b] the derivative of component a of ``force`` by component b of the velocity of i. N s/m.

        Of the trial state, like ``force``. Implicit steppers solve with it what is linear in velocity
        exactly; a force of which ``offers("velocity_jacobian")`` is false they take as given.
        """
        return ti.Matrix.zero(s.real, 3, 3)


class Pairwise(Effect):
    """What is summed over pairs.

    A ``short_ranged`` one is zero where the gap between surfaces is wider than ``reach``, and is summed
    over the pair list; any other is summed over all pairs.
    """

    contract: ClassVar[bool] = True
    short_ranged: ClassVar[bool] = False

    @ti.func
    def reach(self, s, w, i):
        """Widest gap (m) at which it acts between i and a particle that is no larger, when short-ranged."""
        return 0.0


class PairForce(Pairwise):
    """A force between two particles, along any direction; ``pair_force(i, j) = -pair_force(j, i)``.

    memory : values that a pair remembers while it touches, for short-ranged forces; a bound effect reads
        them with ``self.past.recall(s, w, i, j)``, a vector, and zero for a pair that has just met.
        One of the two keeps it: ``self.past.sign(s, w, i, j)`` is 1 when that is i, and -1 when it is j.
    """

    contract: ClassVar[bool] = True
    repeatable: ClassVar[bool] = True
    memory: ClassVar[int] = 0
    past: ClassVar[Any] = None

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        """Force on i by j; ``separation`` is r_j - r_i (m), ``distance`` its length. N."""
        return 0.0 * separation

    @ti.func
    def pair_torque(self, s, w, i, j, separation, distance, t):
        """Torque on i, about its centre, by j. N m."""
        return 0.0 * separation

    @ti.func
    def touching(self, s, w, i, j, separation, distance):
        """Whether the pair has something to remember; what it knows is forgotten when it has not."""
        return distance <= s.radius[w, i] + s.radius[w, j]

    @ti.func
    def remember(self, s, w, i, j, separation, distance, past, dt):
        """What the pair knows after a further dt (s), given ``past``; i is the one who keeps it."""
        return past


class DerivedQuantity(Effect):
    """A quantity of each particle, the field ``quantity``, that follows from the rest of the state.

    Set before forces are summed, whenever they are; of several, in scene order.
    """

    contract: ClassVar[bool] = True
    quantity: ClassVar[str]

    @ti.func
    def response(self, s, w, i, total, t):
        """The value of i, given the sum of what the others do to it: zero unless it is self-consistent."""
        return total


class SelfConsistentQuantity(DerivedQuantity, Pairwise):
    """A quantity of each particle that depends on that of the others: q_i = response(sum_j influence(q_j)).

    Settled by sweeps over all particles at once (the method of Jacobi), each starting from the last values,
    also those of the last step, until no particle changes by more than ``tolerance`` times the largest
    value, or by rounding. A world in which ``sweeps`` do not suffice fails, and says so; with ``sweeps`` of 0
    there is one sweep per step and no such test.

    relaxation : the part a of its way that a sweep goes, q = (1 - a) q + a response. Where the others act by
    a linear law, with real eigenvalues L, sweeps converge if 1 - 2/a < L < 1 for all of them. There is no
    solution to find where L exceeds 1; a < 1 helps where one is below -1, as in dense lattices.

    ``sweep_factor`` of a world is what sweeps multiply the change by, from the last three; without end it
    tends to the largest |1 - a + a L|.
    """

    contract: ClassVar[bool] = True
    counters = ("mutual_sweeps",)
    world_quantities = ("sweep_factor",)

    tolerance: float = parameter("", 1e-8, gt=0)
    sweeps: int = Option(100, ge=0)
    relaxation: float = parameter("", 1.0, gt=0, le=1)

    accuracy_parameters = (AccuracyParameter(tolerance=1),)

    def approximations(self, extent: float) -> tuple[Effect, ...]:
        return (self.model_copy(update={"sweeps": 0}),) if self.sweeps else ()

    @ti.func
    def influence(self, s, w, i, j, separation, distance, t):
        """What j, with its present value, does at i."""
        return 0.0 * separation


class PairEvent(Effect):
    """Something sudden between two particles, such as an impact.

    hard : its particles are hard spheres, which may touch but not lie in each other: a world stops in which
        that is true of more pairs than can touch.
    """

    contract: ClassVar[bool] = True
    hard: ClassVar[bool] = False

    @ti.func
    def contact(self, s, w, i, j, separation):
        """How long ago (s) the event between i and j fell due; negative when it has not.

        ``separation`` is r_j - r_i (m). Called for every near pair in every step.
        """
        return -1.0

    @ti.func
    def resolve(self, s, w, i, j, separation):
        """Change i and j; both are exclusively the caller's."""
