"""A rubble pile is spun up until it deforms and sheds grains (L21 section 4.3).

A cloud without rotation and without a seed particle collapses; then its angular velocity is increased in
steps (``stages.py``). The spin at which gravity alone no longer holds a pile depends on its density, not on
the number of its grains. The contribution of magnetism depends on stresses, which are as in a scaled
copy of L21's pile (``cases/coalescence/scaling.py``).

Departures from L21: fewer grains, softer grains, and a closer lattice, from which the collapse is earlier and
slower.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tisim import Scene
from tisim.cases.case import Size, size_named
from tisim.cases.coalescence import scene as coalescence
from tisim.cases.coalescence.published import DIAMETERS, MAGNETISATIONS

TITLE = "A rubble pile of magnetised grains is spun up until it breaks"

NUMBERS = {DIAMETERS[0]: 33_220, DIAMETERS[1]: 4_088}
"""Numbers of L21's grains by their diameter (m), with the same total mass; section 4.3.1."""
SETTLED = 7500.0
"""Time at which the pile of the default size is at rest, s: three free-fall times."""
DEFAULT: Mapping[str, Any] = {"number": 80, "spacing": 1.3, "softened": 10.0, "duration": SETTLED}

SIZES = {
    "default": Size("80 grains of 100 cm, magnetised to 1190 A/m, in a scaled copy of L21's pile", DEFAULT),
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
    """Return a cloud without rotation that collapses.

    number : of grains; by default L21's number for that diameter. diameter : m.
    magnetisation : of the grains in L21's pile, A/m. duration : s.
    settings : others of the scene of coalescence.
    """
    whole = NUMBERS[diameter]
    return coalescence.scene(
        number=number or whole, of=whole, diameter=diameter, magnetisation=magnetisation, duration=duration,
        rotation=0.0, seed_diameter=0.0, name="spin_up", **settings,
    )  # fmt: skip


def scene_for(size: str, seed: int) -> Scene:
    """Return the cloud of a size; it collapses to the pile that is spun up."""
    return scene(seed=seed, **size_named(size, SIZES).scene)
