"""Specific surface of packings, and their permeability by Kozeny and Carman, and by flow through them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.analysis.packings.packing_fractions import packing_fraction
from tisim.analysis.packings.shape_integrals import surface_areas
from tisim.errors import must
from tisim.sources.flow import kozeny_carman
from tisim.sources.pore_flow.solids import SolidBody, SolidCylinder, SolidSphere
from tisim.sources.pore_flow.stokes_flow import WALL_TOLERANCE, permeability_tensor

KOZENY_CONSTANT = 5.0
"""The constant C of random packings (P. C. Carman, Trans. Inst. Chem. Eng. 15 (1937) 150)."""


def specific_surface(packing: PackedBodies, volume: float | None = None) -> float:
    """Return the surface of all bodies over the volume of the box, or of another container (m^3), 1/m: 6
    phi/D for spheres. Walls do not count."""
    return float(surface_areas(packing).sum() / (packing.box_volume if volume is None else volume))


def permeability(
    packing: PackedBodies, constant: float = KOZENY_CONSTANT, volume: float | None = None
) -> float:
    """Return the permeability of a packing by Kozeny and Carman, m^2.

        k = (1 - phi)^3 nu^2 / (C phi^2)

    phi is the packing fraction, in the box or in a container of ``volume`` (m^3), and nu the volume of the
    bodies over their surface: D/6 for spheres. The law is an average over random packings of like bodies; it
    knows nothing of their order.

    constant : C, which contains the tortuosity and the form of the pores.

    Source: B16 Eq. (7.4), after Kozeny (1927) and Carman (1937).
    """
    must(constant > 0, "constant", "above 0", constant)
    must(len(packing) > 0, "bodies", "at least one", len(packing))
    phi = packing_fraction(packing, volume)
    must(phi < 1, "packing fraction", "below 1", phi)
    size = packing.volumes().sum() / surface_areas(packing).sum()
    return float(kozeny_carman(1 - phi, size, constant))


def solid_bodies(packing: PackedBodies) -> list[SolidBody]:
    """Return the spheres and rods of a packing as bodies that ``stokes_flow`` takes. InputError for bodies of
    other shapes."""
    solids: list[SolidBody] = []
    axes = packing.axes()[:, 2]
    for place, axis, shape, scale in zip(packing.position, axes, packing.shape, packing.scale, strict=True):
        kind = packing.shapes[shape]
        rod = kind.rod()
        must(rod is not None, "shapes", "spheres or spherocylinders", kind.kind())
        assert rod is not None
        half, radius = scale * rod[0], scale * rod[1]
        centre = (float(place[0]), float(place[1]), float(place[2]))
        along = (float(axis[0]), float(axis[1]), float(axis[2]))
        solids.append(
            SolidCylinder(centre, along, radius, 2 * half, round=True)
            if half
            else SolidSphere(centre, radius)
        )
    return solids


def stokes_permeability(
    packing: PackedBodies, cells: Sequence[int], tolerance: float = WALL_TOLERANCE
) -> np.ndarray:
    """Return the permeability of a periodic packing of spheres or rods, K in U = -K/eta grad p, m^2, shape
    (3, 3), from the slow flow of a fluid through it; see ``tisim.sources.stokes_flow``.

    cells : of the grid along x, y and z. The error is of second order in their size; at 5 cells for the
        diameter of a body, it is about 6 % at a packing fraction of 0.3.
    tolerance : velocity at walls over the mean velocity.
    InputError if the packing is not periodic along all axes, for other shapes, or if cells are too large.
    """
    must(all(packing.periodic), "packing", "periodic along all axes", packing.periodic)
    return permeability_tensor(solid_bodies(packing), packing.low, packing.high, cells, tolerance)
