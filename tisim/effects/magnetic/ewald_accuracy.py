"""Cut-offs in space and in wave vectors that an Ewald sum of dipoles needs for a given accuracy.

Errors are root mean square errors of forces on particles at random positions, over

    F_ref = 3 mu_0 m^2 / (4 pi r_c^4) sqrt(n r_c^3)

This is the force between dipoles at the cut-off r_c, for n particles per unit volume and m^2 the mean of
their squared moments. With x = alpha r_c and s = k_max / (2 alpha) they are

    in space:         Q exp(-x^2) / (3 x^2),    Q^2 = 13/6 C^2 + 2/15 D^2 - 13/15 C D
                      C = 4 x^4 + 6 x^2 + 3,    D = 8 x^6 + 20 x^4 + 30 x^2 + 15
    in wave vectors:  8/3 sqrt(2/15) x^(5/2) s^(3/2) exp(-s^2)

and therefore functions of x and s alone.

Source: Z. Wang, C. Holm, J. Chem. Phys. 115 (2001) 6351.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.constants import mu_0
from scipy.optimize import brentq

from tisim.domains.domain import Domain
from tisim.errors import must

PAIR_COST = 10.0
"""Time for the force of a pair, over the time for one term of a wave vector and a particle."""
WIDEST = 0.4
"""Largest automatic cut-off, over the shortest side along which there are images."""
WIDEST_DECAY = 12.0
"""Largest value of x and s: exp(-144) is less than any accuracy."""


def space_error(x: float) -> float:
    """Return the error due to the omitted pairs, over F_ref."""
    c = 4 * x**4 + 6 * x**2 + 3
    d = 8 * x**6 + 20 * x**4 + 30 * x**2 + 15
    return math.sqrt(13 / 6 * c * c + 2 / 15 * d * d - 13 / 15 * c * d) * math.exp(-x * x) / (3 * x * x)


def wave_error(x: float, s: float) -> float:
    """Return the error due to the omitted wave vectors, over F_ref."""
    return 8 / 3 * math.sqrt(2 / 15) * x**2.5 * s**1.5 * math.exp(-s * s)


@lru_cache
def screening_for(accuracy: float) -> float:
    """Return the x at which omitted pairs cause half of the squared error."""
    least = math.sqrt(1.5)
    part = min(accuracy / math.sqrt(2), space_error(least))
    return float(brentq(lambda x: math.log(space_error(x) / part), least, WIDEST_DECAY, xtol=1e-14))


@lru_cache
def waves_for(accuracy: float, x: float) -> float:
    """Return the s at which omitted wave vectors cause half of the squared error."""
    least = math.sqrt(0.75)
    part = min(accuracy / math.sqrt(2), wave_error(x, least))
    return float(brentq(lambda s: math.log(wave_error(x, s) / part), least, WIDEST_DECAY, xtol=1e-14))


def periods(domain: Domain, slab_factor: float) -> np.ndarray:
    """Return the periods (m) of the images: the sides, along an open axis multiplied by the slab factor."""
    return np.diag(domain.edges(0.0)) * np.where(domain.imaged(), 1.0, slab_factor)


def most_waves(domain: Domain, slab_factor: float, wave_cutoff: float) -> tuple[int, int, int]:
    """Return the number of wave vectors along each axis up to a cut-off (1/m)."""
    x, y, z = (int(wave_cutoff * side / (2 * math.pi)) for side in periods(domain, slab_factor))
    return x, y, z


def force_scale(moment: np.ndarray, volume: float, cutoff: float) -> float:
    """Return F_ref (N) of moments (A m^2), shape (n, 3), in a volume (m^3), with a cut-off (m)."""
    n = len(moment)
    square = float((moment**2).sum()) / n
    return 3 * mu_0 * square / (4 * math.pi * cutoff**4) * math.sqrt(n * cutoff**3 / volume)


def ewald_settings(
    domain: Domain,
    particles: int,
    accuracy: float = 1e-4,
    cutoff: float | None = None,
    slab_factor: float = 3.0,
) -> dict[str, Any]:
    """Return settings of Ewald sums in a box, for ``EwaldDipoleDipole(**settings)`` and for moments.

    particles : their number. accuracy : error of the forces, over the force of dipoles at the cut-off.
    cutoff : cut-off of pairs, m; by default chosen so that pairs and wave vectors take the same time.
    slab_factor : the period along an open axis, over the side of the box.

    The ``waves`` hold for this box; worlds of a batch share them, so use the values of the largest box.
    """
    must(any(domain.imaged()), domain.label, "a periodic box with images", domain.kind())
    must(particles > 0, "particles", "above 0", particles)
    x = screening_for(accuracy)
    s, sides = waves_for(accuracy, x), periods(domain, slab_factor)
    if cutoff is None:
        # The time of pairs grows as r_c^3, of wave vectors as its inverse: the sum is least if both are
        # equal.
        equal = float(np.prod(sides)) ** 2 * 2 * (x * s) ** 3 / (math.pi**3 * PAIR_COST * particles)
        cutoff = min(equal ** (1 / 6), WIDEST * float(sides[list(domain.imaged())].min()))
    waves = most_waves(domain, slab_factor, 2 * x * s / cutoff)
    return {"cutoff": cutoff, "accuracy": accuracy, "waves": waves, "slab_factor": slab_factor}
