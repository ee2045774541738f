"""The memory of a batch of worlds and its access from Python: fields are placed, read and written.

The particle fields are a core, plus the union of the fields that the effects of the scene need.

Every field has a leading world axis. By default, vectors are stored as separate components (structure of
arrays), which the compiler can vectorise over particles. Scenes that mostly compute listed pairs store all
quantities of a particle together (array of structures).
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from tisim.backend import runtime
from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.backend.transfer import Exchange
from tisim.errors import RunError
from tisim.state.fields import CORE_OF_WORLDS, Field, WorldField, names_of

DTYPES = {"counter": ti.i64, "sum": ti.i64, "integer": ti.i32, "measure": ti.f64, "real": ti.f64}
"""Type of each kind of world field."""


class StateMemory:
    """A state memory is the device memory of ``worlds`` worlds of at most ``capacity`` particles.

    fields : the particle fields. world_fields : the fields of a world.
    shared : whether several threads may work on a world at once, in the compiled kernels.
    records : whether the real quantities of a particle are adjacent in memory.
    domain : the domain of the worlds, as kernels see it.
    before_reading : functions called before particle fields are read, for values that are kept elsewhere.
    columns : names of all world fields. counters : names of those that count events.
    singles, slotted : particle fields that a copy of a particle has; with their numbers of values and
    defaults if they have several.
    defaults, copied : values of the other fields of an inserted particle: a number, or a copy of a field.
    means, sums : particle fields by the rule of merging.
    """

    worlds: int
    capacity: int
    fields: tuple[Field, ...]
    world_fields: tuple[WorldField, ...]
    reported: tuple[Field, ...]
    real: Any
    records: bool
    shared: bool
    domain: Any
    before_reading: list[Callable[[], None]]
    columns: tuple[str, ...]
    counters: tuple[str, ...]
    singles: tuple[Any, ...]
    slotted: tuple[Any, ...]
    defaults: tuple[Any, ...]
    copied: tuple[Any, ...]
    means: tuple[Any, ...]
    sums: tuple[Any, ...]

    def __init__(
        self,
        worlds: int,
        capacity: int,
        fields: tuple[Field, ...],
        world_fields: tuple[WorldField, ...] = CORE_OF_WORLDS,
        records: bool = False,
    ) -> None:
        self.worlds, self.capacity = worlds, capacity
        self.fields, self.world_fields = fields, world_fields
        self.reported = tuple(field for field in fields if not field.scratch)
        self.real, self.records, self.shared = runtime.current().real, records, True
        builder = Builder()
        self._record: list[Any] | None = [] if records else None
        for field in fields:
            setattr(self, field.name, self._place(builder, field))
        if self._record:
            builder.dense(ti.i, worlds).dense(ti.j, capacity).place(*self._record)
        for of_world in world_fields:
            # A vector has an axis index: atomic operations on a component of a vector field are lost.
            column, place = ti.field(DTYPES[of_world.kind]), builder.dense(ti.i, worlds)
            (place.dense(ti.j, 3) if of_world.components == 3 else place).place(column)
            setattr(self, of_world.name, column)
        self._tree = Tree(builder)
        self._exchanges: dict[tuple[str, ...], Exchange] = {}
        self.domain, self.before_reading = None, []
        self.columns, self.counters = tuple(f.name for f in world_fields), names_of(world_fields, "counter")
        carried = [field for field in fields if not (field.slots or field.lookup)]
        self.singles = tuple(getattr(self, field.name) for field in carried)
        self.slotted = tuple(
            (getattr(self, field.name), field.slots, _number(field)) for field in fields if field.slots
        )
        self.defaults = tuple(
            (getattr(self, field.name), _number(field), field.components)
            for field in carried
            if not isinstance(field.default, str)
        )
        self.copied = tuple(
            (getattr(self, field.name), getattr(self, field.default))
            for field in fields
            if isinstance(field.default, str)
        )
        self.means = self._by_merge_rule("mean")
        self.sums = self._by_merge_rule("sum")

    def __getattr__(self, name: str) -> Any:
        what = "the fields or world_fields of an effect that reads it"
        raise AttributeError(f"{name!r} must be declared in {what}")

    def _place(self, builder: Any, field: Field) -> Any:
        dtype = ti.i32 if field.integer else ti.f64 if field.double else self.real
        if field.slots:
            column = ti.field(dtype)
            builder.dense(ti.i, self.worlds).dense(ti.j, self.capacity).dense(ti.k, field.slots).place(column)
            return column
        column = ti.field(dtype) if field.components == 1 else ti.Vector.field(field.components, dtype)
        parts = [column] if field.components == 1 else [column.get_scalar_field(k) for k in range(3)]
        for part in parts:
            if self._record is not None and dtype == self.real:
                self._record.append(part)
            else:
                builder.dense(ti.i, self.worlds).dense(ti.j, self.capacity).place(part)
        return column

    def _by_merge_rule(self, rule: str) -> tuple[Any, ...]:
        return tuple(getattr(self, field.name) for field in self.fields if field.merge == rule)

    def bytes(self) -> dict[str, int]:
        """Return the bytes of each particle field, for all worlds together."""
        real = 8 if self.real == ti.f64 else 4
        return {f.name: f.bytes(real, self.worlds, self.capacity) for f in self.fields}

    def _exchange(self, names: tuple[str, ...]) -> Exchange:
        self.check()
        if names not in self._exchanges:
            self._exchanges[names] = Exchange({name: getattr(self, name) for name in names})
        return self._exchanges[names]

    def snapshot(self, names: Iterable[str]) -> dict[str, np.ndarray]:
        """Return fields as arrays of their full shapes, by name.

        A copy kernel is compiled for each choice of particle fields, and one for all world fields.
        """
        names = tuple(names)
        particles = tuple(name for name in names if name not in self.columns)
        for store in self.before_reading if particles else ():
            store()
        arrays = self._exchange(particles).read() if particles else {}
        if len(particles) < len(names):
            arrays |= self._exchange(self.columns).read()
        return {name: arrays[name] for name in names}

    def read(self, name: str) -> np.ndarray:
        """Return a field as an array of its full shape."""
        return self.snapshot((name,))[name]

    def saved(self) -> tuple[str, ...]:
        """Return the names of all fields that determine how a simulation continues, except pair lists, which
        can be rebuilt."""
        fields = (field.name for field in self.fields)
        return (*fields, *(field.name for field in self.world_fields if field.saved))

    @classmethod
    def reserved(cls) -> tuple[str, ...]:
        """Return the names that no field may have, because a state uses them otherwise."""
        return (*StateMemory.__annotations__, *dir(cls))

    def image(self) -> dict[str, np.ndarray]:
        """Return a copy of the current state of all worlds, by the names of ``saved``."""
        return self.snapshot(self.saved())

    def fill(self, values: Mapping[str, Any]) -> None:
        """Set fields, each from an array of its full shape or to one number."""
        worlds = {name: values[name] for name in self.columns if name in values}
        if worlds:
            exchange = self._exchange(self.columns)
            exchange.write(worlds if len(worlds) == len(self.columns) else {**exchange.read(), **worlds})
        particles = tuple(name for name in values if name not in worlds)
        if particles:
            self._exchange(particles).write(values)

    def write(self, name: str, values: Any) -> None:
        """Set a field from an array of its full shape, or to one number."""
        self.fill({name: values})

    @property
    def alive(self) -> bool:
        """Return whether the memory still exists: it has not been freed, nor lost in a restart of Taichi."""
        return self._tree.alive

    def check(self) -> None:
        """Raise RunError if the memory no longer exists."""
        if self._tree.generation != runtime.generation():
            raise RunError("a Simulation must be used with the settings it was made under; start it anew")
        if not self.alive:
            raise RunError("a Simulation must be used before it is closed; make another")


def _number(field: Field) -> int | float:
    """Return the value of a field of a new particle, for a numeric default."""
    return int(field.default or 0) if field.integer else float(field.default or 0.0)
