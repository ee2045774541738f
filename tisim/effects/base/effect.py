"""The base of all effects: the interface that scenes, kernels and other effects use."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, Self

import numpy as np

from tisim.backend.taichi import ti
from tisim.components.component import Component, option
from tisim.state.bound import Peers
from tisim.state.fields import Field, WorldField

if TYPE_CHECKING:
    from tisim.domains.domain import Domain


LONGEST_PART = 0.35
"""Largest automatic step over the critical step. In rows of grains energy grows at steps from 0.7 of the
critical step on."""


class SceneParts(Protocol):
    """The parts of a scene that effects and steppers check.

    effects : the effects as they are given. acting : the effects completed by the materials and the start.
    duration : of the run (s).
    """

    @property
    def effects(self) -> tuple[Effect, ...]: ...

    @property
    def domain(self) -> Domain: ...

    @property
    def duration(self) -> float: ...

    def acting(self) -> tuple[Effect, ...]: ...


class Effect(Component):
    """An effect is any physical part of a scene: this is the contract of all effects.

    Laws derive from one of its kinds: ``Force``, ``PairForce``, ``PairEvent``, ``DerivedQuantity``,
    ``SelfConsistentQuantity``, ``LongRange``, ``Constraint``, ``Source`` or ``Operator``. Names are unique in
    a scene. A scene can therefore hold several effects of a ``repeatable`` kind: each acts with its own
    parameters, and their counts are summed.

    fields : the particle fields that it reads or writes, by name or as a ``Field``. depends_on_velocity :
    whether it reads or changes velocities or spins. homogeneous : whether it is unchanged if all particles
    are shifted, or if a common velocity is added to all, as in the layers of a sheared box. world_fields :
    the numbers of a world that it counts, measures or keeps, as ``WorldField``. requires_source : quantities;
    a scene must have at least one source of any of them. repeatable : whether a scene can hold several of its
    kind. ends : the event at which it ends a world.

    kinked : whether its force, or the field that it produces, has kinks or jumps, at which steppers of high
    order lose their order. leapfrog : whether only explicit steppers integrate it to second order, because it
    has a history, rotates with its particle, or moves it. guards_steps : whether it stops its world itself if
    a step is too long for it, or whether no step is too long. step_dependent : whether its law contains the
    length of the step, so that no accuracy can be requested. smooth : whether its forces have derivatives of
    all orders along the trajectory; otherwise steppers of high order, and steps that follow the error, gain
    nothing.
    """

    contract: ClassVar[bool] = True
    repeatable: ClassVar[bool] = False

    name: str | None = option(
        "name in scene, files and messages; by default the name of its kind",
        None,
        pattern=r"^[A-Za-z][A-Za-z0-9_]*$",
    )

    fields: ClassVar[tuple[str | Field, ...]] = ()
    depends_on_velocity: ClassVar[bool] = False
    homogeneous: ClassVar[bool] = True
    world_fields: ClassVar[tuple[WorldField, ...]] = ()
    ends: ClassVar[str] = "it ends"
    requires_source: ClassVar[tuple[str, ...]] = ()
    kinked: ClassVar[bool] = False
    leapfrog: ClassVar[bool] = False
    guards_steps: ClassVar[bool] = False
    step_dependent: ClassVar[bool] = False
    smooth: ClassVar[bool] = True

    @classmethod
    def called(cls, data: Mapping[str, Any]) -> str:
        """Return the name in the data of an effect; its kind if none is given."""
        return str(data.get("name") or cls.kind())

    def required_fields(self) -> tuple[str | Field, ...]:
        """Return the particle fields that it needs, given its options; by default all of ``fields``."""
        return self.fields

    def required_effects(self) -> tuple[type[Component], ...]:
        """Return the effects that must be present, given its options; by default ``requires``."""
        return self.requires

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        """Return the critical time step (s) of a leapfrog, 2/omega of the stiffest motion that it causes. The
        default is infinity, for no limit; None stands for an unknown limit.

        start : quantities of the particles by field name, without positions. speed : largest expected
        approach speed (m/s). effects : all of the scene.
        """
        return math.inf

    def part_of_critical_step(self, accuracy: float) -> float:
        """Return the longest step of a leapfrog over the critical step at a relative accuracy; by default the
        relative energy error of an oscillation, (omega dt)^2 / 8, is at most half the accuracy."""
        return min(math.sqrt(accuracy), LONGEST_PART)

    def has_kinks(self) -> bool:
        """Return whether it has or may have kinks or jumps; a user's law that does not set ``kinked`` may
        have."""
        classes = [base for base in type(self).__mro__ if issubclass(base, Effect)]
        own = [vars(base) for base in classes if not base.__module__.startswith("tisim.")]
        told = not own or any("kinked" in names for names in own)
        return self.kinked or not self.smooth or not told

    def gyrates(self, effects: Sequence[Effect]) -> bool:
        """Return whether it rotates velocities, as a magnetic field does with charges, given all effects of
        the scene; Verlet then gains energy at any step."""
        return False

    def reached_speed(self, duration: float, extent: float) -> float:
        """Return the speed (m/s) that it is expected to give to particles in a run of a duration (s) over an
        extent (m, infinite in open space); 0 by default."""
        return 0.0

    def shortest_length(self) -> float:
        """Return the smallest length (m) over which the field that it produces changes; infinity by
        default."""
        return math.inf

    def check(self, scene: SceneParts) -> None:
        """Raise InputError if it cannot act in the domain of a scene or together with the other effects; by
        default it can."""

    def check_start(self, start: Mapping[str, np.ndarray], scene: SceneParts) -> None:
        """Raise InputError if it cannot act on the particles of a start, by field name, in its scene; by
        default it can."""

    def approximations(self, extent: float) -> tuple[Any, ...]:
        """Return other laws for ``tisim cost`` to try in place of this one, which trade accuracy for time,
        the coarsest first, for particles up to ``extent`` (m) apart; by default none."""
        return ()

    def beside(self, other: Effect) -> Self:
        """Return a copy with the settings that it must share with an effect that replaces another; by default
        itself."""
        return self

    def required_world_fields(self) -> tuple[WorldField, ...]:
        """Return the world fields that it needs, given its options; by default ``world_fields``. Effects of
        one kind share them, unless the names contain the name of the effect; ``bind_fields`` finds these."""
        return self.world_fields

    def connect(self, peers: Peers) -> dict[str, Any]:
        """Return attributes to set on its bound object, taken from the bound effects of the scene."""
        return {}

    def bind_fields(self, s: Any) -> dict[str, Any]:
        """Return attributes to set on its bound object, taken from the fields of the state."""
        return {}

    def gives(self, constraint: Effect) -> bool:
        """Return whether it may add particles to a constraint after the start; by default yes for the
        constraints that it requires."""
        return type(constraint) in self.required_effects()

    def at_start(self, masses: np.ndarray) -> Self:
        """Return a copy with values that depend on the masses of the start (kg) filled in; by default
        itself."""
        return self

    def completed_by(self, effects: Sequence[Effect]) -> Self:
        """Return a copy with values that follow from the other effects of its scene filled in; by default
        itself."""
        return self

    def given_at_start(self, start: Mapping[str, np.ndarray], seed: int) -> dict[str, np.ndarray]:
        """Return further fields of the particles of a start, given their quantities (SI) and the seed of the
        scene: arrays by field name, a row for each particle; by default none."""
        return {}

    def measures(self, state: Mapping[str, np.ndarray]) -> dict[str, float]:
        """Return quantities for a Result, by name, computed from the particles; world fields of the
        kind "measure" are reported anyway."""
        return {}

    def measured(self) -> dict[str, str]:
        """Return the unit of each quantity that it adds to a Result, by name: of its world fields of the kind
        "measure" and of the values of ``measures``. A trajectory has a column for each."""
        return {field.name: field.unit for field in self.required_world_fields() if field.kind == "measure"}

    @ti.func
    def end_step(self, s, w):
        """Set its measures of a world at the end of a step, and once before the first step; serially, before
        events and operators. It is called only for effects with world fields of the kind "measure"."""

    def failure_hint(self, effects: Sequence[Effect], domain: Domain) -> str:
        """Return the condition in which it stops a world on purpose by values that are not a number, given
        the effects and the domain of a scene; worded to follow "this happens if". Empty by default."""
        return ""

    @classmethod
    @functools.cache
    def offers(cls, hook: str) -> bool:
        """Return whether it implements a method that its contract leaves empty."""
        return getattr(cls, hook) is not getattr(cls._promise(hook), hook)

    @classmethod
    def _promise(cls, hook: str) -> type:
        return next(base for base in reversed(cls.__mro__) if hasattr(base, hook))
