"""The contract of an effect. One effect is one file: its law, its source, its parameters.

Rules
1. An effect is a frozen ``Spec``: validated data, its source and equation in the docstring.
2. Every float or Vector parameter may differ per world; in a kernel it is a function, ``self.name(w)``.
   Every other option (bool, int, text) is compiled in, and the same for all worlds of a batch.
3. ``needs`` names the particle fields it reads or writes; a field that nobody needs is not allocated.
   A field that no other effect has ever needed is declared by putting a ``Field`` there.
4. ``counts`` names the integer counters of events it keeps per world: ``ti.atomic_add(s.NAME[w], 1)``.
5. A ``Force`` is a pure function of the trial state; it writes nothing. Forces are summed in scene order.
6. An ``Operator`` changes the state between steps: ``particle`` for each particle on its own (it may write
   only that particle), then ``world`` once per world, serially (it may add particles and remove them).
7. A ``PairEvent`` changes two particles at once. The driver hands it each pair in ``contact`` with
   exclusive access to both, earliest first (see events.py); it may remove either.
8. ``connect`` returns what an effect wants to know of the other bound effects; ``requires`` names the
   effects without which it means nothing. The driver never asks what an effect is called.
9. ``capacity`` says how many particles may ever live at once, given the start.
10. Particles are removed with ``s.remove(w, i)`` and added with ``s.append(w, i)``; indices move only
    between steps. Nothing may depend on the order of parallel work: no float atomics.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from tisim._taichi import ti
from tisim.spec import Spec, parameter
from tisim.state import Field

__all__ = ["Effect", "Force", "Operator", "PairEvent", "PairForce", "parameter"]


class Effect(Spec):
    """Anything physical that a scene can call for."""

    needs: ClassVar[tuple[str | Field, ...]] = ()
    counts: ClassVar[tuple[str, ...]] = ()

    def capacity(self, masses: np.ndarray) -> int:
        """Particles that may ever live at once, given those of the start (kg); their number by default."""
        return len(masses)


class Force(Effect):
    """A force on a particle by itself: of its state, its place and the time."""

    contract: ClassVar[bool] = True

    @ti.func
    def force(self, s, w, i, t):
        """Force on particle i of world w at time t. N."""
        return 0.0 * s.velocity[w, i]


class PairForce(Effect):
    """A force between two particles, along any direction; ``pair_force(i, j) = -pair_force(j, i)``.

    A ``short_ranged`` force is zero where the gap between surfaces is wider than ``reach``, and is summed
    over the pair list; any other is summed over all pairs.
    """

    contract: ClassVar[bool] = True
    short_ranged: ClassVar[bool] = False

    @ti.func
    def reach(self, w):
        """Widest gap (m) at which a short-ranged force acts."""
        return 0.0

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        """Force on i by j; ``separation`` is r_j - r_i (m), ``distance`` its length. N."""
        return 0.0 * separation


class Operator(Effect):
    """A change of state between steps."""

    contract: ClassVar[bool] = True

    @ti.func
    def particle(self, s, w, i, dt):
        """Change particle i alone, after a step of dt seconds."""

    @ti.func
    def world(self, s, w):
        """Change the world as a whole, serially, after pair events; may append and remove."""


class PairEvent(Effect):
    """Something sudden between two particles, such as an impact."""

    contract: ClassVar[bool] = True

    @ti.func
    def contact(self, s, w, i, j, separation):
        """How long ago (s) the event between i and j fell due; negative when it has not.

        ``separation`` is r_j - r_i (m). Called for every near pair in every step.
        """
        return -1.0

    @ti.func
    def resolve(self, s, w, i, j, separation):
        """Change i and j; both are exclusively the caller's."""
