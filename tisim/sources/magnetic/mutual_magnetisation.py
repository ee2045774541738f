"""The magnetisation of cylinders in a uniform field and in the fields of each other.

It computes input for a scene: ``MagneticCylinders(cylinders=magnetise(cylinders, field, ...))``. Each
cylinder, or each piece of it, is magnetised uniformly and responds to the mean field in its volume.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.constants import mu_0

from tisim.components.component import Vector
from tisim.errors import Words, is_whole, must
from tisim.sources.magnetic.cylinder_body import Cylinder
from tisim.sources.magnetic.demagnetising_tensors import demagnetising_tensors
from tisim.sources.magnetic.magnetic_energy import MagneticEnergy

MOST_PIECES = 6000
"""Largest number of pieces; their tensors then take 2.6 GB."""


class Magnetised(tuple[Cylinder, ...]):
    """Magnetised cylinders, a tuple, with the course of the iteration.

    iterations : number of iterations. imbalance : largest field that would still change the magnetisation of
    a piece, relative to the largest field at a piece.
    """

    iterations: int
    imbalance: float


def magnetise(
    cylinders: Sequence[Cylinder],
    field: Vector,
    saturation: float | ArrayLike,
    susceptibility: float | None = None,
    *,
    segments: int = 1,
    permanent: Sequence[int] = (),
    tolerance: float = 1e-6,
    iterations: int = 10_000,
) -> Magnetised:
    """Return the cylinders with the magnetisations (A/m) that they have in a uniform field and in the fields
    of each other.

    field : flux density B_0 (T) without the cylinders. saturation : saturation magnetisation M_s (A/m), one
    for all or one for each cylinder. susceptibility : None for magnets that are always saturated, as in the
    model of Stoner and Wohlfarth; otherwise M = chi H up to saturation, with ``math.inf`` for soft steel.
    ``saturation=math.inf`` makes the law linear. segments : number of equal pieces into which each cylinder
    is cut, so that M varies along it; the result then has ``segments`` cylinders for each. permanent :
    indices of cylinders that keep their own magnetisation. tolerance : largest ``imbalance`` of the result.
    iterations : largest number of iterations.

    The energy of soft cylinders is convex, so their magnetisation is unique; it is found by projected
    gradients with the acceleration of Nesterov and restarts (B. O'Donoghue, E. Candes, Found. Comput. Math.
    15 (2015) 715). Saturated ones turn in order, each to the minimum of its energy in the field of the
    others, starting from their directions in the uniform field alone; the energy decreases in each turn, so
    no damping is needed, and the result is a minimum in which no single piece gains by turning.

    For one cylinder in one piece these are ``stoner_wohlfarth.magnetisation`` and
    ``soft_magnet.magnetisation``. Within a piece M is uniform, which is exact for ellipsoids only. The error
    is small near saturation; docs/magnetism.md has measured errors.

    Source: B16 section 5.6 for the problem.

    InputError is raised for invalid values, or if the tolerance is not met in ``iterations`` iterations.
    """
    must(len(cylinders) > 0, "cylinders", "at least one", len(cylinders))
    must(is_whole(segments, 1), "segments", "a whole number, at least 1", segments)
    must(is_whole(iterations, 1), "iterations", "a whole number, at least 1", iterations)
    must(0 < tolerance < 1, "tolerance", "between 0 and 1", tolerance)
    number = len(cylinders) * segments
    must(number <= MOST_PIECES, "segments", f"such that all pieces are at most {MOST_PIECES}", number)
    applied = np.asarray(field, float)
    must(applied.shape == (3,) and bool(np.isfinite(applied).all()), "field", "three numbers in T", field)
    kept = np.zeros(len(cylinders), bool)
    for k in permanent:
        must(is_whole(k, 0) and k < len(cylinders), "permanent", "indices of cylinders", k)
        kept[k] = True
    linear = susceptibility is not None
    must(susceptibility is None or susceptibility > 0, "susceptibility", "greater than 0", susceptibility)
    limit = np.broadcast_to(np.asarray(saturation, float), len(cylinders))
    allowed = (limit > 0) & (linear | np.isfinite(limit))
    must(bool(allowed.all()), "saturation", "greater than 0" + ("" if linear else " and finite"), saturation)

    pieces = [piece for one in cylinders for piece in cut(one, segments)]
    energy = MagneticEnergy(
        pieces,
        demagnetising_tensors(pieces, segments),
        applied / mu_0,
        np.repeat(limit, segments),
        np.repeat(kept, segments),
    )
    stiffness = None if susceptibility is None else 1 / susceptibility
    if stiffness is None:
        energy.saturate(cylinders)
    turns, imbalance = energy.minimise(stiffness, tolerance, iterations)
    met = imbalance <= tolerance
    must(met, "tolerance", f"met within {iterations} iterations", Words(f"{imbalance:.2g}"))
    result = Magnetised(
        one.model_copy(update={"magnetisation": (float(a), float(b), float(c))})
        for one, (a, b, c) in zip(pieces, energy.magnetisation, strict=True)
    )
    result.iterations, result.imbalance = turns, imbalance
    return result


def cut(cylinder: Cylinder, segments: int) -> list[Cylinder]:
    """Return the equal pieces of a cylinder along its axis, in order."""
    if segments == 1:
        return [cylinder]
    length, up = cylinder.length / segments, np.array(cylinder.direction)
    centres = [np.array(cylinder.centre) + (k - (segments - 1) / 2) * length * up for k in range(segments)]
    return [cylinder.model_copy(update={"centre": tuple(map(float, r)), "length": length}) for r in centres]
