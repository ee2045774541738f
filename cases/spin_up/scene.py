"""A rubble pile is spun up until it deforms and sheds grains (L21 section 4.3).

A cloud without rotation and without a seed particle falls together; then its angular velocity is stepped up
(``stages.py``). The spin at which gravity alone no longer holds a pile goes by its density, not by the number
of its grains; what magnetism adds goes by stresses, which are those of a copy of L21's pile
(``cases/coalescence/scaling.py``).

Departures from L21: fewer grains, softer ones, and a closer lattice, from which they fall together sooner and
more slowly.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tisim.cases.case import Size, size_named
from tisim.cases.coalescence import scene as coalescence
from tisim.cases.coalescence.published import DIAMETERS, MAGNETISATIONS

from tisim import Scene

TITLE = "A rubble pile of magnetised grains is spun up until it breaks"

NUMBERS = {DIAMETERS[0]: 33_220, DIAMETERS[1]: 4_088}
"""L21's grains by their diameter (m), of equal mass in all; section 4.3.1."""
SETTLED = 7500.0
"""When the pile of the default size is at rest, s: three times of free fall."""
DEFAULT: Mapping[str, Any] = {"number": 80, "spacing": 1.3, "softened": 10.0, "duration": SETTLED}

SIZES = {
    "default": Size("80 grains of 100 cm, magnetised to 1190 A/m, as in a copy of L21's pile", DEFAULT),
    "unmagnetised": Size("the same without magnetisation", {**DEFAULT, "magnetisation": 0.0}),
    "l21": Size("L21's 4088 grains of 100 cm, gravity by a tree", {"tree": True}),
    "l21_50cm": Size("L21's 33,220 grains of 50 cm", {"diameter": DIAMETERS[0], "tree": True}),
}


def scene(
    number: int | None = None,
    diameter: float = DIAMETERS[1],
    magnetisation: float = MAGNETISATIONS[-1],
    duration: float = 15_000.0,
    **settings: Any,
) -> Scene:
    """Return a cloud without rotation that falls together.

    number : of grains; L21's of that diameter unless given. diameter : m. magnetisation : that of L21's pile,
    A/m. duration : s. settings : others of the scene of coalescence.
    """
    whole = NUMBERS[diameter]
    return coalescence.scene(
        number=number or whole, of=whole, diameter=diameter, magnetisation=magnetisation, duration=duration,
        rotation=0.0, seed_diameter=0.0, name="spin_up", **settings,
    )  # fmt: skip


def scene_for(size: str, seed: int) -> Scene:
    """Return the cloud of a size, which becomes the pile that is spun up."""
    return scene(seed=seed, **size_named(size, SIZES).scene)
