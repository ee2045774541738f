"""Particle fields and world fields: the definition of each, and the choice of those that a scene needs."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

from tisim.errors import must


@dataclass(frozen=True)
class Field:
    """A field is a quantity that every particle has.

    merge : rule when two particles merge: "mean" by mass, "sum", "volume" (a radius), or "keep" (of the
    absorbing particle). Splitting reverses the rule: a sum is shared equally.
    slots : number of values per particle, ``s.NAME[w, i, k]``; 0 for one value or vector, ``s.NAME[w, i]``.
    They are not inherited: a fragment starts with the default.
    default : value if the initial state gives none: a number, or the name of a field to copy, such as
    "position"; None if the initial state must give it.
    minimum : least value allowed in an initial state.
    scratch : whether it is internal to a stepper and left out of results. double : whether it is f64 also in
    single precision.
    lookup : whether it belongs to the memory slot and not to its particle: it stays when particles are moved,
    inserted or removed.
    recorded : whether frames of a trajectory have it; None for all fields that are neither ``scratch`` nor in
    ``slots``, which are mostly contact histories.
    """

    name: str
    unit: str
    components: Literal[1, 3] = 1
    merge: Literal["mean", "sum", "volume", "keep"] = "mean"
    integer: bool = False
    slots: int = 0
    default: float | str | None = 0.0
    minimum: float | None = None
    scratch: bool = False
    double: bool = False
    lookup: bool = False
    recorded: bool | None = None

    def __post_init__(self) -> None:
        if self.slots and (self.merge != "keep" or self.components != 1):
            raise TypeError(f"field {self.name} with slots must have one component and be merged as 'keep'")
        if self.integer and self.merge != "keep":
            raise TypeError(f"field {self.name} of integers must be merged as 'keep'")

    def shape(self, *particles: int) -> tuple[int, ...]:
        """Return the shape of an array that holds the field for an array of particles of this shape."""
        return (*particles, *((3,) if self.components == 3 else ()), *((self.slots,) if self.slots else ()))

    def bytes(self, real: int, *particles: int) -> int:
        """Return the bytes of the field for an array of particles of this shape.

        real : bytes of a real number.
        """
        return math.prod(self.shape(*particles)) * (4 if self.integer else 8 if self.double else real)


CORE = (
    Field("position", "m", 3, "keep", default=None),
    Field("velocity", "m/s", 3, default=None),
    Field("mass", "kg", 1, "sum", default=None),
    Field("radius", "m", 1, "volume", default=None),
    Field("id", "", 1, "keep", integer=True),
)
SHARED = {
    field.name: field
    for field in (
        *CORE,
        Field("temperature", "K", default=None, minimum=0.0),
        Field("spin", "rad/s", 3),
        Field("charge", "C", 1, "sum", default=None),
        Field("fixed", "", 1, "keep", integer=True, minimum=0.0),
        Field("group", "", 1, "keep", integer=True, minimum=0.0),
        Field("material", "", 1, "keep", integer=True, minimum=0.0),
    )
}
"""Fields that several effects share by name."""


WorldFieldKind = Literal["counter", "measure", "real", "integer", "sum"]


@dataclass(frozen=True)
class WorldField:
    """A world field is a number that every world has, ``s.NAME[w]``; it is 0 at the start.

    kind : "counter" (i64), a number of events, which is in the ``work`` of a Result; "measure" (f64), in its
    ``measures``; or internal: "real" (f64), "integer" (i32), or "sum" (i64), to which particles add whole
    numbers within a step, in any order, by ``ti.atomic_add``.
    components : 3 for a vector of the kind "real", of which kernels read and write ``s.NAME[w, k]``.
    saved : whether the continuation of a run depends on it, so that checkpoints contain it.
    """

    name: str
    kind: WorldFieldKind
    unit: str = ""
    components: Literal[1, 3] = 1
    saved: bool = True

    def __post_init__(self) -> None:
        kinds = get_args(WorldFieldKind)
        must(self.kind in kinds, f"kind of world field {self.name}", f"one of {', '.join(kinds)}", self.kind)
        number = self.components == 1 or (self.components == 3 and self.kind == "real")
        rule = "1, or 3 for the kind real"
        must(number, f"components of world field {self.name}", rule, self.components)


CORE_OF_WORLDS = (
    WorldField("time", "real", "s"),
    WorldField("time_carry", "real", "s"),
    WorldField("end", "real", "s"),
    WorldField("dt", "real", "s"),
    WorldField("approach_time", "real", "s"),
    WorldField("fastest", "real", "m/s"),
    WorldField("volume", "real", "m^3"),
    WorldField("failure_time", "real", "s"),
    WorldField("reached", "real", "s"),
    WorldField("cut", "real", "s"),
    WorldField("count", "integer"),
    WorldField("status", "integer"),
    WorldField("failed", "integer"),
    WorldField("failing_particle", "integer"),
    WorldField("failing_effect", "integer"),
    WorldField("ending_effect", "integer"),
    WorldField("changed", "integer"),
    WorldField("events", "integer"),
    WorldField("next_id", "integer"),
    WorldField("underway", "integer"),
    WorldField("steps", "counter"),
    WorldField("particle_steps", "counter"),
    # Velocity of the common frame, and the largest displacement in it since the last pair list.
    WorldField("frame", "real", "m/s", components=3),
    WorldField("displacement", "real", "m", components=3, saved=False),
    WorldField("seed", "sum"),
    # The skin of the scene, or 0 to choose it automatically; and the first step if it is known.
    WorldField("skin", "real", "m", saved=False),
    WorldField("step_ahead", "real", "s", saved=False),
    # Largest number of particles of the scene; the capacity of the memory may be larger.
    WorldField("most", "integer", saved=False),
    # A world waits at the first end of a step at or after ``pause_time``, at ``goal`` steps, and until the
    # next launches at ``step_limit`` steps. ``place`` is the next launch that it takes.
    WorldField("pause_time", "real", "s", saved=False),
    WorldField("goal", "sum"),
    WorldField("step_limit", "sum", saved=False),
    WorldField("place", "integer", saved=False),
    WorldField("evaluation_stage", "integer", saved=False),
    # With more particles than this a world searches pairs in cells.
    WorldField("listed_above", "integer", saved=False),
)
"""World fields of every scene."""


def names_of(fields: Iterable[WorldField], kind: str) -> tuple[str, ...]:
    """Return the names of the world fields of a kind."""
    return tuple(field.name for field in fields if field.kind == kind)


def resolve_world_fields(
    effects: Iterable[WorldField], stepper: Iterable[WorldField], taken: Sequence[str]
) -> tuple[WorldField, ...]:
    """Return the world fields of a scene: the core, those of its effects and those of its stepper, each once.

    Effects may share a field. InputError is raised for a name that is declared in two ways, that the stepper
    uses too, or that is ``taken``.
    """
    fields = (*CORE_OF_WORLDS, *dict.fromkeys(effects), *dict.fromkeys(stepper))
    check_names([field.name for field in fields], taken)
    return fields


def check_names(names: Sequence[str], taken: Sequence[str]) -> None:
    """Raise InputError unless the names of fields are Python names, all different and none ``taken``."""
    for k, name in enumerate(names):
        free = name.isidentifier() and name not in taken and name not in names[:k]
        must(free, "name of a field", "a Python name that nothing else in the state has", name)


def resolve_fields(needs: Iterable[str | Field], taken: Sequence[str] = ()) -> tuple[Field, ...]:
    """Return the core fields and all needed fields, each once, in a fixed order.

    InputError is raised for a field that two parts declare differently, or whose name is ``taken``.
    """
    fields = {field.name: field for field in CORE}
    for need in needs:
        field = SHARED[need] if isinstance(need, str) else need
        declared = fields.setdefault(field.name, field)
        must(declared == field, f"field {field.name}", f"declared as everywhere, {declared}", field)
    check_names([*fields], taken)
    return tuple(fields.values())
