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
from tisim.state.fields import Field
from tisim.state.status import (
    WORLD_COUNTERS,
    WORLD_INTEGERS,
    WORLD_QUANTITIES,
    WORLD_SETTINGS,
    WORLD_VECTORS,
    check_names,
)


class StateMemory:
    """A state memory is the device memory of ``worlds`` worlds of at most ``capacity`` particles.

    shared : whether several threads may work on a world at once, in the compiled kernels.
    records : whether the real quantities of a particle are adjacent in memory.
    domain : the domain of the worlds, as kernels see it.
    before_reading : functions called before particle fields are read, for values that are kept elsewhere.
    """

    def __init__(
        self,
        worlds: int,
        capacity: int,
        fields: tuple[Field, ...],
        counters: tuple[str, ...],
        world_quantities: tuple[str, ...] = (),
        flags: tuple[str, ...] = (),
        records: bool = False,
        totals: tuple[str, ...] = (),
    ) -> None:
        # Checked before allocation: fields that are left half made would break every later kernel.
        names = (*(field.name for field in fields), *counters, *world_quantities, *flags, *totals)
        check_names(type(self), names)
        self.worlds, self.capacity = worlds, capacity
        self.fields, self.counters = fields, (*WORLD_COUNTERS, *counters)
        self.world_quantities, self.flags, self.totals = world_quantities, flags, totals
        self.reported = tuple(field for field in fields if not field.scratch)
        self.real, self.records, self.shared = runtime.current().real, records, True
        builder = Builder()
        self._record: list[Any] | None = [] if records else None
        for field in fields:
            setattr(self, field.name, self._place(builder, field))
        if self._record:
            builder.dense(ti.i, worlds).dense(ti.j, capacity).place(*self._record)
        quantities, integers = (*WORLD_QUANTITIES, *world_quantities), (*WORLD_INTEGERS, *flags)
        whole = (*self.counters, *totals)
        for names, dtype in ((quantities, ti.f64), (integers, ti.i32), (whole, ti.i64)):
            for name in names:
                column = ti.field(dtype)
                builder.dense(ti.i, worlds).place(column)
                setattr(self, name, column)
        self.seed = ti.field(ti.i64)
        builder.dense(ti.i, worlds).place(self.seed)
        # The skin of the scene, m, or 0 to choose it automatically; and the first step, s, if it is known.
        self.skin, self.step_ahead = ti.field(ti.f64), ti.field(ti.f64)
        builder.dense(ti.i, worlds).place(self.skin, self.step_ahead)
        # Largest number of particles of the scene; the capacity may be larger.
        self.most = ti.field(ti.i32)
        builder.dense(ti.i, worlds).place(self.most)
        # Not part of the state of a run. A world waits at the first end of a step at or after ``pause_time``
        # (s), at ``goal`` steps, and until the next launches at ``step_limit`` steps. ``place`` is the next
        # launch that it takes, and ``occasion`` the reason for it. With more particles than ``listed_above``
        # a world searches pairs in cells.
        self.pause_time, self.place = ti.field(ti.f64), ti.field(ti.i32)
        self.goal, self.step_limit = ti.field(ti.i64), ti.field(ti.i64)
        self.listed_above, self.occasion = ti.field(ti.i32), ti.field(ti.i32)
        waits = (self.pause_time, self.place, self.occasion, self.goal, self.step_limit, self.listed_above)
        for column in waits:
            builder.dense(ti.i, worlds).place(column)
        for name in WORLD_VECTORS:
            # Scalars with an axis index: atomic operations on a component of a vector field are lost.
            column = ti.field(ti.f64)
            builder.dense(ti.i, worlds).dense(ti.j, 3).place(column)
            setattr(self, name, column)
        self._tree = Tree(builder)
        self._exchanges: dict[tuple[str, ...], Exchange] = {}
        self.domain: Any = None
        self.before_reading: list[Callable[[], None]] = []
        self.columns = (*quantities, *integers, *WORLD_VECTORS, *whole, *WORLD_SETTINGS)
        carried = [field for field in fields if not (field.slots or field.lookup)]
        self.singles = tuple(getattr(self, field.name) for field in carried)
        self.slotted = tuple(
            (getattr(self, field.name), field.slots, _number(field)) for field in fields if field.slots
        )
        # Values of the other fields of an inserted particle: a number, or a copy of another field.
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
        what = "the fields, counters or world_quantities of an effect that reads it"
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

        A copy kernel is compiled for each choice of particle fields, and one for all world quantities.
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
        worlds = (*WORLD_QUANTITIES, *WORLD_INTEGERS, *self.counters, *self.world_quantities, *self.flags)
        return (*fields, *worlds, *self.totals, "frame", "seed", "goal")

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
