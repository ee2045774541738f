"""Figures of packings: directions of rods, neighbours and pores, rattlers, bond order and layers at walls."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from tisim.analysis.packings.bond_order import bond_order, voronoi_bonds
from tisim.analysis.packings.contact_numbers import contact_numbers
from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.analysis.packings.packing_fractions import FractionProfile
from tisim.analysis.packings.pores import pore_sizes
from tisim.analysis.packings.surface_correlation import surface_correlation
from tisim.analysis.packings.tortuosity import packing_diffusion
from tisim.analysis.packings.wall_alignment import DirectionHistogram
from tisim.errors import must
from tisim.plotting.style import AXIS_COLOURS, empty, letters, plain

RATTLER_GAPS = np.logspace(-6, -2, 9)
"""Largest gaps (D) of contacts, for the fraction of rattlers."""
CRYSTALS = {
    "fcc": (0.191, 0.575),
    "hcp": (0.097, 0.485),
    "bcc": (0.224, 0.567),
    "icosahedron": (0.0, 0.663),
}
"""Bond order q_4 and q_6 of lattices of spheres and of twelve spheres around one, with Voronoi weights."""
GAP_BINS = 20
"""Number of intervals of the gap in the pair correlation of surfaces."""


def directions(histograms: Mapping[str, DirectionHistogram]) -> Figure:
    """Draw histograms of directions side by side, as B16 Fig. 2.15: the azimuth across, the cosine of the
    polar angle upwards, and the density relative to random directions as a colour, with one scale for all.

    histograms : by title.
    """
    must(len(histograms) > 0, "histograms", "at least one", len(histograms))
    figure = empty(1.2 + 2.6 * len(histograms), 2.9)
    panels = figure.subplots(1, len(histograms), sharey=True, squeeze=False)[0]
    largest = max(float(one.density.max()) for one in histograms.values())
    for axis, (title, one) in zip(panels, histograms.items(), strict=True):
        mesh = axis.pcolormesh(
            np.degrees(one.azimuth), one.cosine, one.density, vmin=0, vmax=largest, cmap="viridis"
        )
        first, last = np.degrees(one.azimuth[[0, -1]])
        axis.set_xticks(np.linspace(first, last, 4 if first == 0 else 5))
        axis.set(xlabel="azimuth (degrees)", title=title)
    panels[0].set_ylabel("cosine of the polar angle")
    figure.colorbar(mesh, ax=panels.tolist(), label="density of directions (1: random)")
    letters(panels)
    return figure


def structure(packings: Mapping[str, PackedBodies], spacing: float = 0.1, reach: float = 1.5) -> Figure:
    """Draw neighbours and pores of packings: the pair correlation of surfaces by gap, the part of the pore
    volume in pores up to a diameter, and the tortuosity factor along each axis by porosity, with Bruggeman's
    law for spheres, eps^(-1/2).

    packings : by title, periodic along all axes. spacing : side of a voxel, and reach : largest gap, both in
        D, the shortest side of the box around the first body. A packing of 200 bodies takes some ten seconds.

    Source: D. A. G. Bruggeman, Ann. Phys. 416 (1935) 636, for the law.
    """
    must(len(packings) > 0, "packings", "at least one", len(packings))
    must(reach > 0, "reach", "above 0", reach)
    for title, one in packings.items():
        must(all(one.periodic), f"packing {title!r}", "periodic along all axes", one.periodic)
    figure = empty(12.6, 3.9)
    near, pores, paths = panels = figure.subplots(1, 3)
    porosity = []
    for (title, one), colour in zip(packings.items(), AXIS_COLOURS * len(packings), strict=False):
        unit = float(one.diameters()[0])
        edges = np.linspace(0.0, reach, GAP_BINS + 1)
        near.stairs(surface_correlation(one, unit * edges), edges, baseline=None, color=colour, lw=1.4)
        sizes = pore_sizes(one, spacing * unit)
        pores.step(
            sizes.diameter / unit, np.cumsum(sizes.share), where="post", color=colour, lw=1.4, label=title
        )
        along = [packing_diffusion(one, spacing * unit, axis) for axis in range(3)]
        porosity += [each.porosity for each in along]
        paths.plot(porosity[-3:], [each.tortuosity for each in along], "o", ms=5, color=colour, alpha=0.7)
    near.axhline(1.0, color="0.6", lw=0.9, ls="--")
    near.set(xlabel="gap between surfaces over D", ylabel="pair correlation of surfaces")
    near.set_xlim(0, reach)
    near.set_ylim(bottom=0)
    pores.set(
        xlabel="pore diameter over D", ylabel="part of the pore volume in pores up to it", ylim=(0, 1.02)
    )
    pores.set_xlim(left=0)
    pores.legend(frameon=False, fontsize=8)
    law = np.linspace(0.97 * min(porosity), 1.03 * max(porosity), 50)
    paths.plot(law, law**-0.5, color="0.6", lw=0.9, ls="--", label=r"$\epsilon^{-1/2}$")
    paths.set(xlabel=r"porosity $\epsilon$", ylabel="tortuosity factor")
    paths.legend(frameon=False, fontsize=8)
    for axis in panels:
        plain(axis)
    letters(panels)
    return figure


def order(
    packings: Mapping[str, PackedBodies], profiles: Mapping[str, FractionProfile] | None = None
) -> Figure:
    """Draw how packings are held and how far they are from order: the fraction of rattlers by the largest gap
    of a contact, the bond order q_4 and q_6 of each body beside crystals, and packing fractions
    by distance from a wall.

    packings : by title, periodic along all axes. profiles : by title, with distances in D.
    """
    must(len(packings) > 0, "packings", "at least one", len(packings))
    for title, one in packings.items():
        must(all(one.periodic), f"packing {title!r}", "periodic along all axes", one.periodic)
    figure = empty(12.6 if profiles else 8.6, 3.9)
    panels = figure.subplots(1, 3 if profiles else 2)
    loose, bonds = panels[:2]
    for (title, one), colour in zip(packings.items(), AXIS_COLOURS * len(packings), strict=False):
        numbers = contact_numbers(one, RATTLER_GAPS)
        loose.semilogx(numbers.cutoff, numbers.rattlers / len(one), "o-", ms=3, color=colour, label=title)
        found = voronoi_bonds(one)
        q4, q6 = (bond_order(len(one), found, degree).local for degree in (4, 6))
        bonds.plot(q4, q6, "o", ms=2.5, mew=0, alpha=0.6, color=colour)
    for name, place in CRYSTALS.items():
        bonds.plot(*place, "k+", ms=9)
        bonds.annotate(name, place, xytext=(5, 4), textcoords="offset points", fontsize=8)
    loose.set(xlabel="largest gap of a contact over D", ylabel="fraction of rattlers")
    loose.set_ylim(bottom=0)
    loose.legend(frameon=False, fontsize=8)
    bonds.set(xlabel="bond order $q_4$ of a body", ylabel="$q_6$")
    for (title, layers), colour in zip((profiles or {}).items(), AXIS_COLOURS * len(packings), strict=False):
        panels[2].stairs(layers.fraction, layers.edges, baseline=None, color=colour, lw=1.4, label=title)
        panels[2].set(xlabel="distance from the wall over D", ylabel="packing fraction", xlim=(0, None))
        panels[2].set_ylim(bottom=0)
        panels[2].legend(frameon=False, fontsize=8)
    for axis in panels:
        plain(axis)
    letters(panels)
    return figure
