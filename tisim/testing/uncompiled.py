"""Allocation of a scene on the device without compiling its program, for assertions."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from tisim.backend.memory import collected
from tisim.effects.base import Effect
from tisim.engine.allocation import Allocation, parts
from tisim.engine.loading import check_start, laid_out, world_columns
from tisim.scene.initial_state import Arrays
from tisim.scene.scene import Scene
from tisim.state.bound import Bound


@contextmanager
def allocated(scene: Scene) -> Iterator[Allocation]:
    """Yield the fields of one world and the bound parts of its scene; free the memory at the end."""
    with collected() as trees:
        made = Allocation(scene, 1, scene.capacity())
        try:
            yield made
        finally:
            for tree in trees:
                tree.destroy()


@contextmanager
def started(scene: Scene) -> Iterator[tuple[Allocation, Arrays]]:
    """Yield the fields of one world at its start, with the parameters of the scene, and this start."""
    start = scene.start()
    with allocated(scene) as made:
        s = made.s
        check_start(s.fields, scene, start)
        made.table.write([parts(scene)])
        s.fill({f.name: laid_out(f, [start], 1, s.capacity) for f in s.fields})
        s.fill(world_columns([scene], [start], 1))
        yield made, start


def offered(effect: Bound[Effect], *names: str) -> tuple[Callable[..., Any], ...]:
    """Return the methods with these names that an effect defines and that are empty in its contract."""
    data = effect.data
    return tuple(getattr(effect, name) for name in names if hasattr(data, name) and data.offers(name))
