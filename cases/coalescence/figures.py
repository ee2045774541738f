"""Figures of the case coalescence: agglomeration over time, final asteroids side by side, and forces by grain
size."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tisim.analysis import voronoi_by_shell
from tisim.cases.coalescence import published, regime
from tisim.cases.coalescence.runs import SEEDS, CloudRun, clouds, of_all_magnetisations, of_magnetisation
from tisim.cases.coalescence.scene import SIZES
from tisim.cases.common.csv_tables import csv_text
from tisim.cases.common.rubble_pile import clusters_of
from tisim.cases.common.two_spheres import attraction
from tisim.engine.batches import Progress
from tisim.plotting.cloud import directions, panel
from tisim.plotting.clusters import cluster_colours
from tisim.plotting.scenery import window
from tisim.plotting.style import AXIS_COLOURS, empty, letters, plain
from tisim.rendering.camera import Window
from tisim.scene.initial_state import Arrays

SHELLS = 2
"""Number of shells of equal volume over which Voronoi volumes are averaged. With few grains, the outer ones
of more shells have no cells within the asteroid."""
SEMI_AXES = ("semi_major_axis_m", "semi_intermediate_axis_m", "semi_minor_axis_m")
"""Column headings of the semi-axes of the bounding ellipsoid."""
NO_GRAVITY = np.zeros(3)
"""Clouds have no uniform gravity."""


def figures(size: str, progress: Progress) -> Mapping[str, Figure | str]:
    """coalescence.png: fraction of grains in clusters over time; asteroids.png: the final grains, coloured by
    cluster; forces.png: forces on a grain by size; coalescence.csv: the measures of each cloud."""
    runs = clouds(SEEDS, progress, **of_all_magnetisations(size, SIZES))
    return {
        "coalescence.png": growth(runs),
        "asteroids.png": asteroids([of_magnetisation(runs, m)[0] for m in published.MAGNETISATIONS]),
        "forces.png": forces(),
        "coalescence.csv": table(runs),
    }


def growth(runs: Sequence[CloudRun]) -> Figure:
    """Draw the fractions of grains in clusters and in the asteroid over time, and the final Voronoi volumes.

    Clusters have two or more grains (L21 Fig. 4.1). Voronoi volumes are drawn by shell (Fig. 4.6), for shells
    that have cells within the asteroid. Thin lines and dots are single clouds, thick ones and diamonds means.
    """
    figure = empty(11.6, 3.6)
    left, middle, right = figure.subplots(1, 3)
    beside = np.linspace(-0.2, 0.2, len(published.MAGNETISATIONS))
    for m, colour, shift in zip(published.MAGNETISATIONS, AXIS_COLOURS, beside, strict=True):
        group = of_magnetisation(runs, m)
        for axis, name in ((left, "bound"), (middle, "coalesced")):
            values = np.array([[getattr(a, name) for a in one.agglomerations] for one in group])
            axis.plot(group[0].times, values.T, color=colour, lw=0.6, alpha=0.5)
            axis.plot(group[0].times, values.mean(axis=0), color=colour, lw=2.0, label=f"{m:g} A/m")
        volumes = np.array([shells(one) for one in group])
        known = np.isfinite(volumes)
        at, mean = np.arange(1, SHELLS + 1) + shift, np.where(known, volumes, 0).sum(axis=0)
        right.plot(at, volumes.T, "o", color=colour, ms=3, alpha=0.5)
        right.plot(at, mean / np.where(known.any(axis=0), known.sum(axis=0), np.nan), "D", color=colour)
    left.set(xlabel="time (s)", ylabel="part of the grains", ylim=(0, 1.02), title="in clusters")
    middle.set(xlabel="time (s)", ylim=(0, 1.02), title="in the asteroid")
    right.set(xlabel="shell, from the centre", ylabel="Voronoi volume over a grain's")
    shown = sorted(
        {int(np.rint(x)) for line in right.lines for x in line.get_xdata()[np.isfinite(line.get_ydata())]}
    )
    right.set(xticks=shown, xlim=(shown[0] - 0.5, shown[-1] + 0.5), title="space of a grain")
    left.legend(frameon=False, fontsize=8, title="as in L21's cloud")
    for axis in (left, middle, right):
        plain(axis)
    letters((left, middle, right))
    return figure


def shells(run: CloudRun) -> np.ndarray:
    """Return the mean Voronoi volume in shells of the final asteroid, divided by the volume of a grain."""
    asteroid = run.asteroid
    volume = voronoi_by_shell(asteroid.grains["position"], asteroid.ellipsoid, SHELLS).volume
    return np.asarray(volume / (4 / 3 * np.pi * float(asteroid.grains["radius"].min()) ** 3))


def asteroids(runs: Sequence[CloudRun]) -> Figure:
    """Draw the final grains of clouds side by side, near the asteroid, coloured by cluster (L21 Figs 4.2,
    4.4)."""
    figure = empty(11.6, 4.2)
    axes = figure.subplots(1, len(runs))
    grains = [one.asteroid.grains for one in runs]
    centred = [moved(one, one) for one in grains]
    part = window(centred)
    for axis, one, pile in zip(axes, runs, grains, strict=True):
        close_up(axis, one.end, pile, part)
        directions(axis, part, NO_GRAVITY)
        axis.set_title(f"{one.magnetisation:g} A/m: {len(pile['mass'])} of {len(one.end['mass'])} grains")
    letters(axes)
    return figure


def close_up(axis: Axes, state: Arrays, grains: Arrays, part: Window) -> None:
    """Draw the grains of a state within a window, coloured by cluster.

    The window is relative to the centre of mass of ``grains``.
    """
    panel(axis, moved(state, grains), part, colour=cluster_colours(clusters_of(state)))


def moved(state: Arrays, grains: Arrays) -> Arrays:
    """Return a state shifted so that the centre of mass of some grains is the origin."""
    centre = np.average(grains["position"], axis=0, weights=grains["mass"])
    return {**state, "position": state["position"] - centre}


def forces() -> Figure:
    """Draw the forces on a grain by its diameter (L21 Fig. 4.15), and the gravity in which magnetism and
    weight are equal (Fig. 4.16)."""
    figure = empty(11.6, 4.2)
    left, right = figure.subplots(1, 2)
    line = np.geomspace(1e-4, 1e2, 60)
    for m, colour in zip(published.MAGNETISATIONS[1:], AXIS_COLOURS[1:], strict=True):
        left.plot(line, [attraction(d, m) for d in line], color=colour, label=f"dipoles, {m:g} A/m")
    density, energy = published.DENSITY, published.SURFACE_ENERGY
    laws = (
        ("weight at 5e-6 m/s²", "-", lambda d: regime.surface_weight(d, density, regime.ACCELERATION)),
        ("self-gravity", ":", lambda d: regime.mutual_gravity(d, density)),
        ("cohesion, S = 0.1", "--", lambda d: regime.surface_cohesion(d, 0.1)),
        ("cohesion, DMT", "-", lambda d: regime.dmt_cohesion(d, energy)),
    )
    for k, (name, style, force) in enumerate(laws):
        colour = AXIS_COLOURS[0] if k < 2 else "0.4"
        left.plot(line, [force(d) for d in line], style, color=colour, label=name)
    for d in published.DIAMETERS:
        left.axvline(d, color="0.8", lw=0.8, zorder=0)
    left.set(ylabel="force (N)", ylim=(1e-12, 1e6), title="L21's grains")
    for (field, m), colour in zip(
        regime.MAGNETISED_BY.items(),
        colormaps["viridis"](np.linspace(0.9, 0.1, len(regime.MAGNETISED_BY))),
        strict=True,
    ):
        equal = [regime.balanced_gravity(d, m, regime.IRON_DENSITY) for d in line]
        right.plot(line, equal, color=colour, label=f"{1e6 * field:g} µT, {m:g} A/m")
    right.set(ylabel="gravity (m/s²)", ylim=(1e-8, 1e2), title="iron: magnetism dominates below a line")
    for axis in (left, right):
        axis.set(xscale="log", yscale="log", xlabel="diameter of the grains (m)", xlim=(1e-4, 1e2))
        axis.legend(frameon=False, fontsize=8)
        plain(axis)
    letters((left, right))
    return figure


def table(runs: Sequence[CloudRun]) -> str:
    """Return the measures of each cloud at the end as CSV."""
    rows: list[list[object]] = [
        [
            "magnetisation_A_per_m", "seed", "part_in_asteroid", "part_in_clusters", "grains",
            *SEMI_AXES, "density_kg_per_m3", "bulk_over_grain_magnetisation", "chain_length_grains",
        ]
    ]  # fmt: skip
    for one in runs:
        asteroid, last = one.asteroid, one.agglomerations[-1]
        bulk = one.magnetised_part if one.magnetisation else float("nan")
        values = (last.coalesced, last.bound, asteroid.number, *asteroid.ellipsoid.semi_axes)
        more = (asteroid.density, bulk, last.chain)
        numbers = [f"{value:.4g}" for value in (*values, *more)]
        rows.append([one.magnetisation, one.scene.seed, *numbers])
    return csv_text(rows)
