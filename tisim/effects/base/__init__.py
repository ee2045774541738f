"""The contract of an effect. One effect is one file: its law, its source, its parameters.

Each kind of effect is made after a class of a file beside this one: ``effect.py`` is what all of them have,
``force.py``, ``pair_force.py``, ``pair_event.py``, ``constraint.py`` and ``derived_quantity.py`` say which
methods a law of that kind defines, ``pairwise.py`` what is summed over pairs, and ``long_range.py`` what is
summed over all others in another way. These are the rules for all of them:

What a scene holds is plain data; what kernels hold is a bound object (tisim/state/bound.py).

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
   back. Of several effects of one kind they are summed, as all write the same. What is summed over particles
   in a step, in any order, is a whole number, of ``totals``. What it keeps for itself alone are ``flags``,
   i32, and ``clocks``, f64. Where the options decide, ``keeps`` returns the names; none may be one of the
   stepper's. ``end_step`` sets quantities of a world by what the forces of a step come to; ``measures`` makes
   more of the particles of a Result, and ``measured`` names all of both, with units.
5. A ``Force`` or ``PairForce`` is a pure function of the trial state; it writes nothing. Forces and torques
   are summed in scene order. The velocity of j relative to i is ``s.relative_velocity(w, i, j, separation)``:
   that of an image that moves past the box is not the difference of the two. What near pairs remember of
   each other (``memory``) is handed to ``interaction``, which returns it brought up to date, together with
   the force; what a particle remembers of a force, such as that of walls, is brought up to date in ``load``,
   where that is told to, and there it may add to ``totals``. Between the particles of one rigid body a
   short-ranged law acts only where it says so, ``within_bodies``; one that ends at a cut-off far beyond
   contact, ``truncated``, is summed apart from laws of contact. A law that stops a world on purpose, by a
   force that is not a number, says where in ``may_stop``.
6. Who feels an external field finds it with ``sources`` (see tisim/sources/base.py), and names in
   ``requires_source`` the quantities of which a scene must have at least one source.
7. A ``DerivedQuantity`` of a particle follows from the rest of the state, such as a moment along the field
   where the particle is; it is set before forces are summed. A ``SelfConsistentQuantity`` depends on that of
   all others too, such as an induced dipole.
   A sum over all others that is not made pair by pair, such as by a tree of cells or by waves, is brought by
   a ``LongRange`` effect as phases of its own, which are taken before forces are summed, or in each sweep for
   a ``SelfConsistentQuantity``; its ``force`` or ``response`` reads what they have come to, ``self.sum``.
8. What changes the state between steps is an ``Operator`` (see tisim/operators/base.py).
9. A ``PairEvent`` changes two particles at once. It is handed each pair in ``contact`` with exclusive access
   to both, earliest first (see tisim/collisions/collision_rounds.py); it may remove either.
10. A ``Constraint`` moves the particles that it holds, in place of the stepper, whatever the forces on them.
11. ``connect`` returns what an effect wants to know of the other bound effects, ``peers.of(Heating)``;
    ``requires`` names the effects without which it means nothing, ``excludes`` those that it does not go
    with, ``precedes`` those that must come after it; ``suits_others`` refuses others by their settings, and
    ``beside`` takes these over from one that it is tried with. Nobody asks what an effect is called.
12. ``at_start`` fills in what an effect takes from the start; ``capacity`` says how many particles may ever
    live at once, given the start.
13. For scenes that name no stepper, ``critical_step`` tells the longest step of a leapfrog, ``kinked`` that
    forces have kinks or jumps on the way, ``leapfrog`` that only explicit steppers keep their order with it,
    and ``reached_speed`` how fast it makes particles (see tisim/steppers/choice.py).
14. Particles are removed with ``s.remove(w, i)`` and added with ``s.append(w, i)``; ``world`` and ``resolve``
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

from tisim.components.component import Vector, option, parameter
from tisim.effects.base.constraint import Constraint
from tisim.effects.base.derived_quantity import DerivedQuantity, SelfConsistentQuantity
from tisim.effects.base.effect import Effect
from tisim.effects.base.force import Force
from tisim.effects.base.long_range import LongRange, LongRangeSum
from tisim.effects.base.pair_event import PairEvent
from tisim.effects.base.pair_force import PairForce, keeps_apart, kinks
from tisim.effects.base.pairwise import Pairwise
from tisim.state.fields import Field

__all__ = [
    "Constraint",
    "DerivedQuantity",
    "Effect",
    "Field",
    "Force",
    "LongRange",
    "LongRangeSum",
    "PairEvent",
    "PairForce",
    "Pairwise",
    "SelfConsistentQuantity",
    "Vector",
    "keeps_apart",
    "kinks",
    "option",
    "parameter",
]
