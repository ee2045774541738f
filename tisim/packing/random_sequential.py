"""Random sequential addition: spheres placed one after another at random, where they do not overlap.

Of unlike ones the largest come first, which leave room for the small ones between them.

B. Widom, J. Chem. Phys. 44 (1966) 3888. The start of Z04 section 8 ("initially non-intersecting") and of
Z16 section 9. Equal spheres jam at a volume fraction of 0.3841 in the bulk (G. Zhang and S. Torquato,
Phys. Rev. E 88 (2013) 053312), at less between walls.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np

from tisim.backend import runtime
from tisim.components.ranges import check_resolved
from tisim.errors import InputError, must
from tisim.numerics.random_streams import SEQUENTIAL_ADDITION
from tisim.packing.region import Region
from tisim.packing.saturation import fill
from tisim.packing.tried_places import Packing, everywhere

SATURATION_FRACTION = 0.3841
"""At this volume fraction no further sphere fits, in the bulk."""
_placed_ahead: dict[tuple[bytes, bytes, int], np.ndarray] = {}
"""These are centres of packings that were made side by side with others, while starts are made from them."""


def place(radii: np.ndarray, region: Region, seed: int) -> np.ndarray:
    """Return centres, shape (n, 3) in m, of spheres of these radii (m), shape (n,), none overlapping.

    region : of the centres of the largest. Depends on the arguments alone, not on device or threads. Equal
    spheres go up to saturation. InputError, which says the volume fraction reached, when no further sphere
    fits.
    """
    runtime.current()
    count, largest, smallest = len(radii), float(radii.max()), float(radii.min())
    check_resolved("places of the packing", np.stack([region.low, region.high]), smallest)
    spheres = 4 / 3 * np.pi * radii**3
    fraction, equal = float(spheres.sum()) / region.volume, smallest == largest
    # Refused at once where no choice of places would do: a few spheres can exceed the limit of many.
    most = (SATURATION_FRACTION + count**-0.5) * region.reachable_volume(largest) / region.volume
    rule = f"at most {SATURATION_FRACTION:.3f}, where random sequential addition of many spheres ends"
    must(fraction <= most or not equal, "volume fraction", rule, float(f"{fraction:.4g}"))
    packing = Packing(radii, region, seed)
    ahead = _placed_ahead.get(packing.key()) if _placed_ahead else None
    centres = everywhere([packing])[0] if ahead is None else ahead
    if len(centres) < count and equal:
        generator = np.random.Generator(np.random.Philox(key=[seed, SEQUENTIAL_ADDITION]))
        centres = fill(centres, count, 2 * largest, region, generator)
    order = packing.order
    if len(centres) < count:
        reached = float(spheres[order][: len(centres)].sum()) / region.volume
        raise InputError(
            f"volume fraction must be at most {reached:.4f}, where no further "
            f"sphere fits ({len(centres)} of {count} were placed); received {fraction:.4f}"
        )
    return centres[np.argsort(order, kind="stable")]


@contextmanager
def placed_side_by_side(packings: Sequence[Packing]) -> Iterator[None]:
    """Place the spheres of all packings on all threads at once; within, ``place`` finds them there.

    What no sphere has room for is left to ``place``, which says so.
    """
    new = {packing.key(): packing for packing in packings}
    _placed_ahead.update(zip(new, everywhere(list(new.values())), strict=True) if len(new) > 1 else ())
    try:
        yield
    finally:
        for key in new:
            _placed_ahead.pop(key, None)
