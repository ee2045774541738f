"""The quantities that particles carry: what each is, and which of them a scene needs."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from tisim.errors import must


@dataclass(frozen=True)
class Field:
    """A field is a quantity that particles carry.

    merge : what becomes of it when two particles become one: "mean" by mass, "sum", "volume" (a radius),
        or "keep" (of the absorbing particle). Splitting does the reverse: a sum is shared equally.
    slots : a particle has so many values, ``s.NAME[w, i, k]``; 0 for one value or vector, ``s.NAME[w, i]``.
        They are its own: a piece that breaks off starts with the default.
    default : what a particle starts with where the start does not say: a number, or the name of a field of
        which it is a copy then, such as "position"; None where the start must say.
    minimum : the least value that a start may give.
    scratch : of use to a stepper only: results do not have it. double : in f64 also in single precision.
    lookup : of memory, not of the particle in a slot: it stays when particles are moved, put in or taken out.
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
        """Return the bytes of the field for an array of particles of this shape; ``real``: those of a real
        number."""
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
"""These are the fields that several effects share by name."""


def resolve_fields(needs: Iterable[str | Field]) -> tuple[Field, ...]:
    """Return the core and everything needed, each once, in a fixed order.

    InputError is raised for a field that two parts declare differently.
    """
    fields = {field.name: field for field in CORE}
    for need in needs:
        field = SHARED[need] if isinstance(need, str) else need
        declared = fields.setdefault(field.name, field)
        must(declared == field, f"field {field.name}", f"declared as everywhere, {declared}", field)
    return tuple(fields.values())
