"""A rubble pile is spun up until it deforms and sheds grains (L21 section 4.3).

It continues the case coalescence, as section 4.3 of L21 continues section 4.2: a cloud of that case, without
rotation and without a seed particle, collapses, and the angular velocity of its pile is increased in steps
(``stages.py``). Grains, laws and the scaling of the copy are therefore as in coalescence. The spin at which
gravity alone no longer holds a pile depends on its density, not on the number of its grains. The contribution
of magnetism depends on stresses, which are as in a scaled copy of L21's pile.

Departures from L21: fewer grains, softer grains, and a denser lattice, from which the cloud collapses sooner
and at a lower speed.
"""

from collections.abc import Mapping
from typing import Any

from tisim import Scene
from tisim.cases.case import Size, size_named
from tisim.cases.coalescence import published
from tisim.cases.coalescence import scene as coalescence

TITLE = "A rubble pile of magnetised grains is spun up until it breaks"

NUMBERS = {published.DIAMETERS[0]: 33_220, published.DIAMETERS[1]: 4_088}
"""Numbers of L21's grains by their diameter (m), with the same total mass; section 4.3.1."""
SETTLED = 7500.0
"""Time at which the pile of the default size is at rest, s: three free-fall times."""
DEFAULT: Mapping[str, Any] = {"number": 80, "spacing": 1.3, "softened": 10.0, "duration": SETTLED}

SEARCH = {"generations": 100, "max_evaluations": 80}
"""Settings of the search."""

SIZES = {
    "default": Size(
        "80 grains of 100 cm, magnetised to 1190 A/m, in a scaled copy of L21's pile", DEFAULT, SEARCH
    ),
    "unmagnetised": Size("the same without magnetisation", {**DEFAULT, "magnetisation": 0.0}),
    "l21": Size("L21's 4088 grains of 100 cm, gravity by a tree", {"tree": True}),
    "l21_50cm": Size("L21's 33,220 grains of 50 cm", {"diameter": published.DIAMETERS[0], "tree": True}),
}


def scene(
    number: int | None = None,
    diameter: float = published.DIAMETERS[1],
    magnetisation: float = published.MAGNETISATIONS[-1],
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
