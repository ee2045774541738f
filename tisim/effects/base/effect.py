"""What all effects have in common: the names by which a scene, a kernel and other effects know them."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from tisim.backend.taichi import ti
from tisim.components.component import Component, option
from tisim.components.cost_hints import LawHints
from tisim.state.bound import Peers
from tisim.state.fields import Field

if TYPE_CHECKING:
    from tisim.domains.domain import Domain
    from tisim.scene.scene import Scene


LONGEST_PART = 0.35
"""Steps are not chosen longer than this part of the critical one: in rows of grains energy grows in steps of
0.7 of it."""


class Effect(LawHints, Component):
    """An effect is anything physical that a scene can call for: the contract of all of them.

    Laws are made after one of its kinds: ``Force``, ``PairForce``, ``PairEvent``, ``DerivedQuantity``,
    ``SelfConsistentQuantity``, ``LongRange``, ``Constraint``, ``Source`` or ``Operator``. A scene has each
    name once, so that it can hold two of a kind where they make sense: each acts with its own parameters, and
    what both count is added up.

    fields : the particle fields that it reads or writes, by name or as a ``Field``. depends_on_velocity :
    whether it reads or changes velocities or spins. homogeneous : whether it would be the same for particles
    that are all elsewhere, or all faster by one velocity, as those in each layer of a sheared box are.
    counters : names of the integer counters that it keeps of a world. world_quantities : names of the
    quantities that it keeps of a world. totals : names of whole numbers of a world that sum up what all
    particles add in a step, in any order (``ti.atomic_add``), and that no Result has. requires_source : the
    quantities of which a scene must have at least one source. repeatable : whether a scene can hold two of
    its kind. ends : what has come about when it ends a world.

    kinked : whether its force, or the field that it gives, has kinks or jumps on the way, by which steppers
    of high order lose their order. leapfrog : whether only explicit steppers step it to second order, as it
    has a memory, turns with its particle, or moves it. guards_steps : whether it stops its world itself where
    a step is too long for it, or no step is. step_dependent : whether the length of the step is part of its
    law, so that no accuracy can be asked for.
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
    totals: ClassVar[tuple[str, ...]] = ()
    ends: ClassVar[str] = "it ends"
    requires_source: ClassVar[tuple[str, ...]] = ()
    kinked: ClassVar[bool] = False
    leapfrog: ClassVar[bool] = False
    guards_steps: ClassVar[bool] = False
    step_dependent: ClassVar[bool] = False

    @classmethod
    def called(cls, data: Mapping[str, Any]) -> str:
        """Return the name in the data of an effect; its kind unless one is given."""
        return str(data.get("name") or cls.kind())

    def required_fields(self) -> tuple[str | Field, ...]:
        """Return the particle fields that it needs, given its options; by default all of ``fields``."""
        return self.fields

    def required_effects(self) -> tuple[type[Component], ...]:
        """Return the effects without which it means nothing, given its options; by default ``requires``."""
        return self.requires

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        """Return the critical time step (s) of a leapfrog with it, 2/omega of the stiffest motion that it
        causes; infinity where it has none, as by default, and None where it is not known.

        start : quantities of the particles by field name, without their places. speed : up to which (m/s)
        they are expected to meet. effects : all of the scene.
        """
        return math.inf

    def part_of_critical_step(self, accuracy: float) -> float:
        """Return how long a leapfrog's steps may be, over the critical step, to be as accurate (relative): by
        default so that the energy of what swings is off by half of that at most, (omega dt)^2 / 8."""
        return min(math.sqrt(accuracy), LONGEST_PART)

    def has_kinks(self) -> bool:
        """Return whether it has kinks or jumps on the way, or may have: a law of a user that does not say."""
        classes = [base for base in type(self).__mro__ if issubclass(base, Effect)]
        own = [vars(base) for base in classes if not base.__module__.startswith("tisim.")]
        told = not own or any("kinked" in names for names in own)
        return self.kinked or not self.smooth or not told

    def gyrates(self, effects: Sequence[Effect]) -> bool:
        """Return whether it turns velocities, as a magnetic field does those of charges, given all effects of
        the scene: Verlet's steps then gain energy however short they are."""
        return False

    def reached_speed(self, duration: float, extent: float) -> float:
        """Return the speed (m/s) to which it is expected to bring particles in a run of a duration (s), over
        an extent (m, infinite in open space); 0 by default."""
        return 0.0

    def shortest_length(self) -> float:
        """Return the smallest length (m) over which the field that it gives changes; infinity by default."""
        return math.inf

    def suits(self, domain: Domain) -> None:
        """Raise InputError where it cannot act in a domain; by default it can in any."""

    def suits_others(self, effects: Sequence[Effect]) -> None:
        """Raise InputError where it cannot act beside the effects of a scene, as they are set; by default it
        can beside any."""

    def beside(self, other: Effect) -> Self:
        """Return it as it is to be beside an effect that takes the place of another, where both must have the
        same settings; by default itself."""
        return self

    def keeps(self, what: str) -> tuple[str, ...]:
        """Return the names of the ``counters``, ``world_quantities``, ``totals``, ``flags`` (i32) or
        ``clocks`` (f64) that it keeps of a world, given its options; by default those of its class. No Result
        has flags or clocks. Names that begin with its own are of it alone, where there are several of a kind;
        it finds them with ``remembers``."""
        return getattr(self, what, ())

    def connect(self, peers: Peers) -> dict[str, Any]:
        """Return attributes to set on its bound object, chosen among the bound effects of the scene."""
        return {}

    def remembers(self, s: Any) -> dict[str, Any]:
        """Return attributes to set on its bound object, chosen among the fields of the state."""
        return {}

    def gives(self, constraint: Effect) -> bool:
        """Return whether it may give a constraint particles to hold after the start; by default it does to
        those without which it means nothing."""
        return type(constraint) in self.required_effects()

    def newcomers(self) -> Mapping[str, np.ndarray] | None:
        """Return what it gives to particles it adds, beside what all particles have: by the name of the
        field, its values in SI, a row for each class of them; None where it adds none, or only copies."""
        return None

    def largest_newcomers(self) -> Mapping[str, np.ndarray]:
        """Return ``radius`` (m) and ``material``, its index, of the largest two particles of each class that
        it may put in, or of the largest one of each where it puts in one alone, and ``length`` (m), that of
        their clumps; by default of none. A law is asked whether it can hold all pairs of them."""
        return {"radius": np.zeros(0), "material": np.zeros(0, int), "length": np.zeros(0)}

    def suits_start(self, start: Mapping[str, np.ndarray], scene: Scene) -> None:
        """Raise InputError unless it can act on the particles of a start, by field name, in its scene; by
        default it can."""

    def at_start(self, masses: np.ndarray) -> Self:
        """Return it with what it takes from the masses of the start (kg) filled in; by default itself."""
        return self

    def given_at_start(self, start: Mapping[str, np.ndarray], seed: int) -> dict[str, np.ndarray]:
        """Return what it gives the particles of a start besides, given what they have (SI) and the seed of
        the scene: by the name of the field, a row for each; by default nothing."""
        return {}

    def capacity(self, masses: np.ndarray) -> int:
        """Return how many particles may ever live at once, given the masses of those of the start (kg); by
        default there are never more than at the start."""
        return len(masses)

    def measures(self, state: Mapping[str, np.ndarray]) -> dict[str, float]:
        """Return what a Result tells of it, by name, given the particles; ``world_quantities`` are told
        anyway."""
        return {}

    def measured(self) -> dict[str, str]:
        """Return the unit of all that a Result tells of it, by name: of its ``world_quantities``, and of what
        ``measures`` returns. A trajectory has a column for each."""
        return dict.fromkeys(self.keeps("world_quantities"), "")

    @ti.func
    def end_step(self, s, w):
        """Set its quantities of a world at the end of a step, and once before the first; serially, before
        events and operators. It is asked of an effect that keeps quantities of a world."""

    def may_stop(self, effects: Sequence[Effect], domain: Domain) -> str:
        """Return where it stops a world on purpose, by what is not a number, as a message says it after "it
        is so where", among the effects and in the domain of a scene; by default nowhere."""
        return ""

    @classmethod
    @functools.cache
    def offers(cls, hook: str) -> bool:
        """Return whether it defines a method that its contract leaves empty."""
        return getattr(cls, hook) is not getattr(cls._promise(hook), hook)

    @classmethod
    def _promise(cls, hook: str) -> type:
        return next(base for base in reversed(cls.__mro__) if hasattr(base, hook))
