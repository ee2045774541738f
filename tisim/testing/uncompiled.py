"""The memory of a scene, of which nothing is compiled but what a check asks for."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from tisim.backend.memory import collected
from tisim.effects.base import Effect
from tisim.engine.allocation import Allocation, allocate
from tisim.scene.scene import Scene
from tisim.worlds.bound import Bound


@contextmanager
def allocated(scene: Scene) -> Iterator[Allocation]:
    """The memory of one world, and the bound parts of its scene, for a while."""
    with collected() as trees:
        made = allocate(scene, 1, scene.capacity())
        try:
            yield made
        finally:
            for tree in trees:
                tree.destroy()


def offered(effect: Bound[Effect], *names: str) -> tuple[Callable[..., Any], ...]:
    """The methods of these names that an effect defines, where its contract leaves them empty."""
    data = effect.data
    return tuple(getattr(effect, name) for name in names if hasattr(data, name) and data.offers(name))
