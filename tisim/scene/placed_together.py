"""The spheres of many scenes are placed side by side, on all threads, before their starts are made."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from tisim.errors import InputError
from tisim.packing.random_sequential import placed_side_by_side
from tisim.packing.tried_places import Packing
from tisim.scene.scene import Scene


@contextmanager
def placed_together(scenes: Sequence[Scene]) -> Iterator[None]:
    """Within, ``start`` of each of these scenes finds its spheres placed, where it would place them alone.

    A scene whose packing cannot be asked for raises nothing here: its start does, when it is made.
    """
    several = scenes if len(scenes) > 1 else ()
    with placed_side_by_side([packing for scene in several if (packing := _packing(scene))]):
        yield


def _packing(scene: Scene) -> Packing | None:
    try:
        return scene.particles.packing(scene.domain, scene.seed)
    except InputError:
        return None
