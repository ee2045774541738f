"""Particle fields: the definition of each, and the choice of the fields that a scene needs."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

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


def resolve_fields(needs: Iterable[str | Field]) -> tuple[Field, ...]:
    """Return the core fields and all needed fields, each once, in a fixed order.

    InputError is raised for a field that two parts declare differently.
    """
    fields = {field.name: field for field in CORE}
    for need in needs:
        field = SHARED[need] if isinstance(need, str) else need
        declared = fields.setdefault(field.name, field)
        must(declared == field, f"field {field.name}", f"declared as everywhere, {declared}", field)
    return tuple(fields.values())
