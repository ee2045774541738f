"""The contract of an effect. One effect is one file: its law, its source, its parameters.

What a scene holds is plain data; what kernels hold is a bound object (tisim/worlds/bound.py).
1. An effect is a frozen ``Component``: validated data, its source and equation in the docstring.
2. Every float or Vector parameter may differ per world: in a kernel it is a function, ``self.name(w)``. So
   may a list of parts, in number too: ``self.list.name(w, k)``, k below ``self.list.size(w)``. Every other
   option (bool, int, text) is compiled in, and the same for all worlds of a batch.
3. ``fields`` names the particle fields it reads or writes; a field that nobody needs is not allocated. One
   that no other effect has ever needed is declared by putting a ``Field`` there; effects that share one
   declare it alike. Where the options decide, ``required_fields`` returns those of this one.
   ``depends_on_velocity`` says whether it reads or changes velocities or spins, which steppers without
   inertia do not have; ``homogeneous`` whether it goes with a sheared box, which forces on single particles,
   sources and operators do only where they say so.
4. ``counters`` names the integer counters of events it keeps per world: ``ti.atomic_add(s.NAME[w], 1)``;
   ``world_quantities`` names quantities of a world, ``s.NAME[w]``, f64, 0 at the start; a Result gives them
   back. Of several effects of one kind they are summed, as all write the same.
5. A ``Force`` or ``PairForce`` is a pure function of the trial state; it writes nothing. Forces and torques
   are summed in scene order. The velocity of j relative to i is ``s.relative_velocity(w, i, j, separation)``:
   that of an image that moves past the box is not the difference of the two. What near pairs remember of
   each other (``memory``) is handed to ``interaction``, which returns it brought up to date, together with
   the force; what a particle remembers of a force, such as that of walls, is brought up to date in ``load``,
   where that is told to.
6. Who feels an external field finds it with ``sources`` (see tisim/sources/base.py), and names in
   ``requires_source`` the quantities of which a scene must have at least one source.
7. A ``DerivedQuantity`` of a particle follows from the rest of the state, such as a moment along the field
   where the particle is; it is set before forces are summed. A ``SelfConsistentQuantity`` depends on that of
   all others too, such as an induced dipole.
8. What changes the state between steps is an ``Operator`` (see tisim/operators/base.py).
9. A ``PairEvent`` changes two particles at once. It is handed each pair in ``contact`` with exclusive access
   to both, earliest first (see tisim/interactions/collision_rounds.py); it may remove either.
10. ``connect`` returns what an effect wants to know of the other bound effects, ``peers.of(Heating)``;
    ``requires`` names the effects without which it means nothing. Nobody asks what an effect is called.
11. ``at_start`` fills in what an effect takes from the start; ``capacity`` says how many particles may ever
    live at once, given the start.
12. Particles are removed with ``s.remove(w, i)`` and added with ``s.append(w, i)``; ``world`` and ``resolve``
    say with ``s.invalidate_lists(w)`` that they have moved or resized one. Indices move only between steps.
    Nothing may depend on the order of parallel work: no float atomics.

What Taichi asks of a method with ``ti.func``:
- One return, at the end: none within an ``if`` or a loop. A variable has the type of its first value.
- In ``pair_force`` and what it calls, over all pairs, ``ti.select`` in place of ``if`` keeps the loop without
  a branch, so that it is vectorised; both values are computed, so neither may be harmful.
- Positions, forces and parameters are ``s.real``, f32 or f64. Times are f64 always: cast what is made of
  them, ``ti.cast(elementary.sin(omega * t), s.real)``.
- ``exp``, ``log``, ``pow``, ``sin`` and ``cos`` are those of ``tisim.numerics.elementary``, of one number: a
  law with ``ti.exp`` and the like does not run on Vulkan.
- What is known when it is compiled is asked with ``ti.static``: ``if ti.static(self.option)``, ``for source
  in ti.static(self.applied)``. A loop over particles or lists is a plain ``range``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

import numpy as np

from tisim.backend.taichi import is_device_function, ti
from tisim.components.accuracy_parameter import AccuracyParameter
from tisim.components.component import Component, Vector, option, parameter
from tisim.components.cost_hints import LawHints
from tisim.worlds.bound import Peers
from tisim.worlds.fields import Field

__all__ = [
    "DerivedQuantity",
    "Effect",
    "Field",
    "Force",
    "PairEvent",
    "PairForce",
    "SelfConsistentQuantity",
    "Vector",
    "option",
    "parameter",
]


class Effect(LawHints, Component):
    """An effect is anything physical that a scene can call for: the contract of all of them.

    Laws are made after one of its kinds: ``Force``, ``PairForce``, ``PairEvent``, ``DerivedQuantity``,
    ``SelfConsistentQuantity``, ``Source`` or ``Operator``. A scene has each name once, so that it can hold
    two of a kind where they make sense: each acts with its own parameters, and what both count is added up.

    fields : the particle fields that it reads or writes, by name or as a ``Field``. depends_on_velocity :
    whether it reads or changes velocities or spins. homogeneous : whether it would be the same for particles
    that are all elsewhere, or all faster by one velocity, as those in each layer of a sheared box are.
    counters : names of the integer counters that it keeps of a world. world_quantities : names of the
    quantities that it keeps of a world. requires_source : the quantities of which a scene must have at least
    one source. repeatable : whether a scene can hold two of its kind.
    """

    contract: ClassVar[bool] = True
    repeatable: ClassVar[bool] = False

    name: str | None = option(
        "name in the scene, files and messages; its kind unless given",
        None,
        pattern=r"^[A-Za-z][A-Za-z0-9_]*$",
    )

    fields: ClassVar[tuple[str | Field, ...]] = ()
    depends_on_velocity: ClassVar[bool] = False
    homogeneous: ClassVar[bool] = True
    counters: ClassVar[tuple[str, ...]] = ()
    world_quantities: ClassVar[tuple[str, ...]] = ()
    requires_source: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def called(cls, data: Mapping[str, Any]) -> str:
        """Return the name in the data of an effect; its kind unless one is given."""
        return str(data.get("name") or cls.kind())

    def required_fields(self) -> tuple[str | Field, ...]:
        """Return the particle fields that it needs, given its options; by default all of ``fields``."""
        return self.fields

    def connect(self, peers: Peers) -> dict[str, Any]:
        """Return attributes to set on its bound object, chosen among the bound effects of the scene."""
        return {}

    def at_start(self, masses: np.ndarray) -> Self:
        """Return it with what it takes from the masses of the start (kg) filled in; by default itself."""
        return self

    def capacity(self, masses: np.ndarray) -> int:
        """Return how many particles may ever live at once, given the masses of those of the start (kg); by
        default there are never more than at the start."""
        return len(masses)

    @classmethod
    def offers(cls, hook: str) -> bool:
        """Return whether it defines a method that its contract leaves empty."""
        return getattr(cls, hook) is not getattr(cls._promise(hook), hook)

    @classmethod
    def _promise(cls, hook: str) -> type:
        return next(base for base in reversed(cls.__mro__) if hasattr(base, hook))


class Force(Effect):
    """A force acts on each particle by itself, and depends on its state, its place and the time."""

    contract: ClassVar[bool] = True
    repeatable: ClassVar[bool] = True
    homogeneous: ClassVar[bool] = False

    @ti.func
    def force(self, s, w, i, t):
        """Return the force on particle i of world w at time t (s), in N."""
        return 0.0 * s.velocity[w, i]

    @ti.func
    def torque(self, s, w, i, t):
        """Return the torque on particle i about its centre, in N m."""
        return 0.0 * s.velocity[w, i]

    @ti.func
    def load(self, s, w, i, t, dt, commit):
        """Return force (N) and torque (N m) on particle i together; ``dt`` (s) have gone by since what i
        remembers, in the fields of ``memory_fields``, was brought up to date; it now is, if ``commit``."""
        return self.force(s, w, i, t), self.torque(s, w, i, t)

    def memory_fields(self, effects: Sequence[Effect]) -> tuple[Field, ...]:
        """Return the fields in which particles remember what it has done to them, given all effects of the
        scene; by default none. A bound force finds them with ``remembers``."""
        return ()

    def remembers(self, s: Any) -> dict[str, Any]:
        """Return attributes to set on its bound object, chosen among the fields of the state."""
        return {}

    @ti.func
    def velocity_jacobian(self, s, w, i, t):
        """Return the derivatives of ``force``: [a, b] that of component a by component b of the velocity of
        i, in N s/m.

        Like ``force`` it is of the trial state. Implicit steppers solve with it what is linear in velocity
        exactly; a force that does not define it they take as given.
        """
        return ti.Matrix.zero(s.real, 3, 3)


class Pairwise(Effect):
    """This is the contract of what is summed over pairs.

    short_ranged : whether it is zero where the gap between surfaces is wider than ``reach``; it is then
    summed over the pair list, otherwise over all pairs.
    """

    contract: ClassVar[bool] = True
    short_ranged: ClassVar[bool] = False

    @ti.func
    def reach(self, s, w, i):
        """Return the widest gap (m) between surfaces at which it acts between i and a particle no larger.

        Of a pair it is the reach of the larger particle that counts, whatever the smaller one would return.
        ``assert_reach`` of tisim/testing tells whether it is long enough.
        """
        return 0.0


class PairForce(Pairwise):
    """A pair force acts between two particles, along any direction, and equals its reaction.

        pair_force(i, j) = -pair_force(j, i)

    Most laws define ``pair_force``, and ``pair_torque`` where they turn particles. A short-ranged law whose
    force, torques and memory belong together, such as that of a contact, defines ``interaction`` instead.

    memory : values that a pair remembers while it is within ``reach``, zero for a pair that has just met.
    """

    contract: ClassVar[bool] = True
    repeatable: ClassVar[bool] = True
    memory: ClassVar[int] = 0

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        """Return the force on i by j, in N; ``separation`` is r_j - r_i (m), ``distance`` its length.

        Two particles in one place have a distance of 0. A law that has a limit there must return it; one that
        divides by the distance gives what is not finite, and the world stops and names the law.
        """
        return 0.0 * separation

    @ti.func
    def pair_force_by_inverse(self, s, w, i, j, separation, inverse, t):
        """Return ``pair_force`` given 1/distance (1/m); 0 where that is 0.

        A law that needs no more of the distance may define it as well: sums over all pairs in fast arithmetic
        then make roots and divisions ahead. A subclass that changes the law, ``pair_force`` or what that
        calls, defines it anew, or is summed without it.
        """
        return 0.0 * separation

    @classmethod
    def offers_inverse(cls) -> bool:
        """Return whether ``pair_force_by_inverse`` is the law of this class: no class derived from the one
        that defines it has changed a device function."""
        classes = cls.__mro__
        definer = next(base for base in classes if "pair_force_by_inverse" in vars(base))
        later = classes[: classes.index(definer)]
        changed = (n for base in later for n, own in vars(base).items() if is_device_function(own))
        return cls.offers("pair_force_by_inverse") and not any(hasattr(definer, name) for name in changed)

    @ti.func
    def pair_torque(self, s, w, i, j, separation, distance, t):
        """Return the torque on i by j, about the centre of i, in N m."""
        return 0.0 * separation

    @ti.func
    def interaction(self, s, w, i, j, separation, distance, past, dt, t):
        """Return the force on i by j (N), the torques on i and on j about their centres (N m), and what the
        pair remembers from now on, given what it did, ``past``, and that ``dt`` (s) have gone by since.

        It is asked of listed pairs within ``reach``: i is the one of lower id, and what is remembered is as i
        sees it. ``past`` is a vector of ``memory`` values, or of one 0 where there are none, which is
        returned as it came. It writes nothing: several pairs are computed at once, and some twice. Choices
        (``ti.select``) are faster in it than branches.
        """
        force = self.pair_force(s, w, i, j, separation, distance, t)
        turn = self.pair_torque(s, w, i, j, separation, distance, t)
        back = self.pair_torque(s, w, j, i, -separation, distance, t)
        return force, turn, back, past


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
    largest value, or by rounding. A world in which ``sweeps`` do not suffice fails, and says so; with
    ``sweeps`` of 0 there is one sweep per step and no such test.

    Where the others act by a linear law, with real eigenvalues L, sweeps with a ``relaxation`` of a converge
    if 1 - 2/a < L < 1 for all of them. There is no solution to find where L exceeds 1; a < 1 helps where one
    is below -1, as in dense lattices.

    ``sweep_factor`` of a world is what sweeps multiply the change by, from the last three; without end it
    tends to the largest |1 - a + a L|.
    """

    contract: ClassVar[bool] = True
    counters = ("mutual_sweeps",)
    world_quantities = ("sweep_factor",)

    tolerance: float = parameter(
        "", "change in a sweep, over the largest value, at which the solution counts as converged", 1e-8, gt=0
    )
    sweeps: int = option("sweeps over all particles at most; 0 for one a step without a test", 100, ge=0)
    relaxation: float = parameter(
        "", "part a of its way that a sweep goes, q = (1 - a) q + a response", 1.0, gt=0, le=1
    )

    accuracy_parameters = (AccuracyParameter(tolerance=1),)

    def approximations(self, extent: float) -> tuple[Effect, ...]:
        return (self.model_copy(update={"sweeps": 0}),) if self.sweeps else ()

    @ti.func
    def influence(self, s, w, i, j, separation, distance, t):
        """Return what j, with its present value, does at i."""
        return 0.0 * separation


class PairEvent(Effect):
    """A pair event is something sudden between two particles, such as an impact.

    hard : whether its particles are hard spheres, which may touch but not lie in each other: a world stops in
        which that is true of more pairs than can touch.
    """

    contract: ClassVar[bool] = True
    hard: ClassVar[bool] = False

    @ti.func
    def contact(self, s, w, i, j, separation):
        """Return how long ago (s) the event between i and j fell due; something negative when it has not.

        ``separation`` is r_j - r_i (m). It is called for every near pair in every step.
        """
        return -1.0

    @ti.func
    def resolve(self, s, w, i, j, separation):
        """Change i and j, which no other event changes at the same time."""
