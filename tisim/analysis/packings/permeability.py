"""Specific surface of packings, and their permeability by Kozeny and Carman."""

from __future__ import annotations

from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.analysis.packings.packing_fractions import packing_fraction
from tisim.analysis.packings.shape_integrals import surface_areas
from tisim.errors import must
from tisim.sources.flow import kozeny_carman

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
