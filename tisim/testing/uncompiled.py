"""A scene gets its memory on the device, and nothing of it is compiled but what an assertion needs."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from tisim.backend.memory import collected
from tisim.effects.base import Effect
from tisim.engine.allocation import Allocation
from tisim.scene.scene import Scene
from tisim.worlds.bound import Bound


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


def offered(effect: Bound[Effect], *names: str) -> tuple[Callable[..., Any], ...]:
    """Return those methods of these names that an effect defines, and its contract leaves empty."""
    data = effect.data
    return tuple(getattr(effect, name) for name in names if hasattr(data, name) and data.offers(name))
