"""Random sequential addition: spheres are placed one after another at random positions without overlap.

Spheres of different sizes are placed in order of decreasing size, because small ones fit between large ones.

B. Widom, J. Chem. Phys. 44 (1966) 3888. It gives the start of Z04 section 8 ("initially non-intersecting")
and of Z16 section 9. Equal spheres jam at a volume fraction of 0.3841 in the bulk (G. Zhang and S. Torquato,
Phys. Rev. E 88 (2013) 053312), and earlier between walls.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import numpy as np

from tisim.backend import runtime
from tisim.components.ranges import check_resolved
from tisim.errors import InputError, must
from tisim.packing.region import Region
from tisim.packing.saturation import fill
from tisim.packing.tried_places import Packing, everywhere

SATURATION_FRACTION = 0.3841
"""Saturation volume fraction of equal spheres in the bulk."""
SPHERES_AT_ONCE = 300_000
"""Largest number of spheres placed in one kernel launch, which limits its memory and duration."""
_placed_ahead: ContextVar[Mapping[Any, np.ndarray] | None] = ContextVar("_placed_ahead", default=None)
"""Centres of packings that were placed in parallel beforehand, for the thread that creates the starts."""


def place(radii: np.ndarray, region: Region, seed: int) -> np.ndarray:
    """Return centres, shape (n, 3) in m, of non-overlapping spheres with these radii (m), shape (n,).

    region : region of the centres of the largest spheres.

    The result depends on the arguments only, not on device or threads. Equal spheres can be placed up to
    saturation. InputError, with the volume fraction reached, if no further sphere fits.
    """
    packing = Packing(radii, region, seed)
    refuse(packing)
    ahead = _placed_ahead.get()
    centres = ahead.get(packing.key()) if ahead else None
    if centres is None:
        (centres,) = everywhere([packing])
    count, largest = len(radii), float(radii.max())
    if len(centres) < count and packing.equal:
        centres = fill(centres, count, 2 * largest, region, packing.generator())
    if len(centres) < count:
        reached = packing.fraction(len(centres))
        raise InputError(
            f"volume fraction must be at most {reached:.4f}, where no further sphere fits "
            f"({len(centres)} of {count} were placed); received {packing.fraction(count):.4g}"
        )
    return centres[np.argsort(packing.order, kind="stable")]


def refuse(packing: Packing) -> None:
    """Raise InputError, before any trial, if no arrangement of the spheres is possible. The limit allows for
    small numbers, which can exceed the saturation fraction of many spheres."""
    runtime.current()
    region, count, largest = packing.region, len(packing.radii), float(packing.radii.max())
    smallest = float(packing.radii.min())
    check_resolved("places of the packing", np.stack([region.low, region.high]), smallest)
    most = (SATURATION_FRACTION + count**-0.5) * region.reachable_volume(largest) / region.volume
    rule = f"at most {SATURATION_FRACTION:.3f}, where random sequential addition of many spheres ends"
    fraction = packing.fraction(count)
    must(fraction <= most or not packing.equal, "volume fraction", rule, float(f"{fraction:.4g}"))


@contextmanager
def placed_side_by_side(packings: Sequence[Packing]) -> Iterator[None]:
    """Place the spheres of all packings in parallel; within this context ``place`` uses these results, in
    this thread.

    Impossible packings are left to ``place`` to refuse, and incomplete ones to continue.
    """
    new = {packing.key(): packing for packing in packings if _possible(packing)}
    ahead: dict[Any, np.ndarray] = {}
    for some in _portions(new) if len(new) > 1 else ():
        ahead.update(zip(some, everywhere([new[key] for key in some]), strict=True))
    token = _placed_ahead.set(ahead)
    try:
        yield
    finally:
        _placed_ahead.reset(token)


def _possible(packing: Packing) -> bool:
    try:
        refuse(packing)
    except InputError:
        return False
    return True


def _portions(packings: Mapping[Any, Packing]) -> Iterator[list[Any]]:
    """Yield the keys of packings in groups of at most SPHERES_AT_ONCE spheres, or of one packing."""
    some: list[Any] = []
    spheres = 0
    for key, packing in packings.items():
        if some and spheres + len(packing.radii) > SPHERES_AT_ONCE:
            yield some
            some, spheres = [], 0
        some.append(key)
        spheres += len(packing.radii)
    yield some
