"""The contract of an effect. Each effect is one file with its law, its source and its parameters.

Each kind of effect derives from a class in this folder. ``effect.py`` holds the common base. ``force.py``,
``pair_force.py``, ``pair_event.py``, ``constraint.py`` and ``derived_quantity.py`` define the methods that a
law of each kind implements. ``pairwise.py`` is the base of sums over pairs, ``long_range.py`` of sums over
all particles by other methods.

A scene holds plain data; kernels hold bound objects (tisim/state/bound.py). All effects follow these rules:

1. An effect is a frozen ``Component``: validated data, with its source and equation in the docstring.
2. Every float or Vector parameter may differ between worlds: in a kernel it is a function, ``self.name(w)``.
   The same holds for a list of parts, whose length may differ too: ``self.list.name(w, k)`` with k below
   ``self.list.size(w)``. All other options (bool, int, text) are compiled in and are the same for all worlds
   of a batch.
3. ``fields`` lists the particle fields that the effect reads or writes. Fields that no effect of a scene
   needs are not allocated. A new field is declared by putting a ``Field`` in ``fields``; effects that share a
   field declare it identically. If the fields depend on the options, ``required_fields`` returns them.
   ``depends_on_velocity`` says whether the effect reads or changes velocities or spins, which steppers
   without inertia do not have. ``homogeneous`` says whether it can be used in a sheared box; for forces on
   single particles, sources and operators the default is no.
4. ``world_fields`` lists the numbers of a world, ``s.NAME[w]``, which are 0 at the start. A Result contains
   those of the kinds "counter", as in ``ti.atomic_add(s.NAME[w], 1)``, and "measure". Several effects of one
   kind write to the same fields, which therefore hold their sums. Sums over particles within a step are whole
   numbers (kind "sum"), so that they do not depend on the order of summation. If the fields depend on the
   options, ``required_world_fields`` returns them; the names of the stepper are not allowed. ``bind_fields``
   gives the bound object the fields whose names contain the name of the effect. ``end_step`` sets measures
   from the forces of the step. ``measures`` computes further quantities from the particles of a Result, and
   ``measured`` gives the names and units of all of them.
5. A ``Force`` or ``PairForce`` is a pure function of the trial state and writes nothing. Forces and torques
   are summed in scene order. The velocity of j relative to i is ``s.relative_velocity(w, i, j, separation)``:
   it includes the velocity of a moving periodic image, which the difference of both velocities does not.
   ``interaction`` receives the contact history of a pair (``memory`` values) and returns the updated history
   with the force. The history that a particle keeps of a force, such as a wall force, is updated in ``load``
   if ``commit`` is set; there ``load`` may also add to world fields of the kind "sum". A short-ranged law
   acts between particles of one rigid body only if it sets ``within_bodies``. A law with a cut-off far beyond
   contact sets ``truncated`` and is summed separately from contact laws. A law that stops a world on purpose,
   by a force that is not a number, describes the condition in ``failure_hint``.
6. An effect that responds to an external field finds it with ``sources`` (see tisim/sources/base.py).
   ``requires_source`` lists quantities; a scene must have at least one source of any of them.
7. A ``DerivedQuantity`` of a particle follows from the rest of the state, such as a moment along the local
   field; it is set before forces are summed. A ``SelfConsistentQuantity``, such as an induced dipole, also
   depends on the values of all other particles. A ``LongRange`` effect sums over all particles by other means
   than pairs, such as a tree of cells or waves. Its phases run before forces are summed, or in each sweep of
   a ``SelfConsistentQuantity``; its ``force`` or ``response`` reads the result from ``self.sum``.
   ``Shaped`` effects give particles shapes and orientations: ``HardBodies`` exert no forces, and packing
   steppers remove their overlaps, and those with the walls of a ``Confinement``; ``RigidShapes`` move under
   contact laws.
8. An ``Operator`` changes the state between steps, and an ``AddsParticles`` also adds particles (see
   tisim/operators/base.py).
9. A ``PairEvent`` changes two particles at once. It receives each pair in ``contact`` with exclusive access
   to both, earliest first (see tisim/collisions/collision_rounds.py), and may remove either particle.
10. A ``Constraint`` moves the particles that it holds, in place of the stepper, regardless of the forces.
11. ``connect`` returns references to other bound effects, such as ``peers.of(Heating)``. ``requires`` lists
    effects that must be present, ``excludes`` those that must be absent, and ``precedes`` those that must
    come later in the scene. ``check`` rejects a domain, or settings of other effects, that do not fit;
    ``check_start`` rejects initial states. ``beside`` adopts the settings of another effect when an
    approximate effect is tried. No code depends on the name of an effect.
12. ``at_start`` fills in values that depend on the start.
13. The following serve scenes that name no stepper (see tisim/steppers/choice.py): ``critical_step`` gives
    the longest stable step of a leapfrog, and ``part_of_critical_step`` the part of it for an accuracy;
    ``kinked`` says that forces have kinks or jumps; ``leapfrog`` says that only explicit steppers keep their
    order with it; ``gyrates`` says that it rotates velocities; ``incompatible_controls`` lists step controls
    that it cannot have; ``reached_speed`` estimates the speed that it gives to particles.
14. Particles are removed with ``s.remove(w, i)`` and added with ``s.append(w, i)``. After ``world`` or
    ``resolve`` has moved or resized a particle it must call ``s.invalidate_lists(w)``. Indices change only
    between steps. Results must not depend on the order of parallel work: no float atomics.

Rules of Taichi for a method with ``ti.func``:
- It has one return, at the end, never within an ``if`` or a loop. A variable keeps the type of its first
  value.
- In ``pair_force`` and the functions that it calls, use ``ti.select`` in place of ``if``: loops over all
  pairs are vectorised only without branches. Both values are computed, so both must be safe to evaluate.
- Positions, forces and parameters are ``s.real``, f32 or f64. Times are always f64; cast values computed from
  them, ``ti.cast(elementary.sin(omega * t), s.real)``.
- Take ``exp``, ``log``, ``pow``, ``sin`` and ``cos`` of one number from ``tisim.numerics.elementary``: a law
  with ``ti.exp`` and the like does not run on Vulkan.
- Test values that are known at compile time with ``ti.static``: ``if ti.static(self.option)``, ``for source
  in ti.static(self.applied)``. A loop over particles or lists is a plain ``range``.
"""

from tisim.components.component import Vector, option, parameter
from tisim.effects.base.constraint import Constraint
from tisim.effects.base.derived_quantity import DerivedQuantity, SelfConsistentQuantity
from tisim.effects.base.effect import Effect, SceneParts
from tisim.effects.base.force import Force
from tisim.effects.base.hard_bodies import HardBodies
from tisim.effects.base.long_range import LongRange, LongRangeSum
from tisim.effects.base.pair_event import PairEvent
from tisim.effects.base.pair_force import PairForce, keeps_apart, kinks
from tisim.effects.base.pairwise import Pairwise
from tisim.effects.base.shaped import Shaped
from tisim.state.fields import Field, WorldField

__all__ = [
    "Constraint",
    "DerivedQuantity",
    "Effect",
    "Field",
    "Force",
    "HardBodies",
    "LongRange",
    "LongRangeSum",
    "PairEvent",
    "PairForce",
    "Pairwise",
    "SceneParts",
    "SelfConsistentQuantity",
    "Shaped",
    "Vector",
    "WorldField",
    "keeps_apart",
    "kinks",
    "option",
    "parameter",
]
