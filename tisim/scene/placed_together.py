"""The spheres of many scenes are placed in parallel, on all threads, before their initial states are made."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from tisim.errors import InputError
from tisim.packing.random_sequential import placed_side_by_side
from tisim.packing.tried_places import Packing
from tisim.scene.scene import Scene


@contextmanager
def placed_together(scenes: Sequence[Scene]) -> Iterator[None]:
    """Within this context, ``start`` of each scene finds its spheres already placed, at the same places as if
    it placed them alone.

    An invalid packing raises no error here, but when the initial state of its scene is made.
    """
    several = scenes if len(scenes) > 1 else ()
    with placed_side_by_side([packing for scene in several if (packing := _packing(scene))]):
        yield


def _packing(scene: Scene) -> Packing | None:
    try:
        return scene.particles.packing(scene.domain, scene.seed)
    except InputError:
        return None
