"""Figures of the case spin_up: shape, density and mass of piles against their spin, and pictures of the
piles."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from tisim.cases.coalescence import published
from tisim.cases.coalescence.figures import NO_GRAVITY, SEMI_AXES, close_up, moved
from tisim.cases.coalescence.runs import of_all_magnetisations
from tisim.cases.common.csv_tables import csv_text
from tisim.cases.common.rubble_pile import critical_spin
from tisim.cases.spin_up.scene import SIZES
from tisim.cases.spin_up.stages import DISRUPTION, SEEDS, SpinStep, SpinUp, spin_ups
from tisim.engine.batches import Progress
from tisim.plotting.cloud import directions
from tisim.plotting.scenery import window
from tisim.plotting.style import AXIS_COLOURS, empty, letters, plain
from tisim.rendering.camera import Window

SHOWN = (0.0, 6e-4, 8e-4)
"""Angular velocities after whose steps piles are drawn, rad/s."""
WIDER = 2.6
"""Width of a picture, in units of the width of the pile at rest."""


def figures(size: str, progress: Progress) -> Mapping[str, Figure | str]:
    """spin_up.png: shape, density and mass against spin; piles.png: piles at several spins; spin_up.csv: the
    numbers."""
    runs = spin_ups(SEEDS, progress, **of_all_magnetisations(size, SIZES))
    return {"spin_up.png": against_spin(runs), "piles.png": piles(runs), "spin_up.csv": table(runs)}


def measured(step: SpinStep) -> tuple[float, float, float]:
    """Return the width over the height, the density (kg/m^3), and the fraction of the mass in the pile."""
    asteroid = step.asteroid
    return asteroid.flattening, asteroid.density, step.held


def against_spin(runs: Sequence[SpinUp]) -> Figure:
    """Draw width over height, density (L21 Fig. 4.11) and remaining mass against the imposed angular
    velocity.

    Thin lines are single piles; dotted lines mark the disruption of L21's piles.
    """
    figure = empty(11.6, 3.6)
    axes = figure.subplots(1, 3)
    for m, colour in zip(published.MAGNETISATIONS, AXIS_COLOURS, strict=True):
        group = [one for one in runs if one.magnetisation == m]
        rates = 1e6 * np.array([step.rate for step in group[0].steps])
        values = np.array([[measured(step) for step in one.steps] for one in group])
        for k, axis in enumerate(axes):
            axis.plot(rates, values[..., k].T, color=colour, lw=0.6, alpha=0.5)
            axis.plot(
                rates, values[..., k].mean(axis=0), "o-", ms=3.5, color=colour, lw=2.0, label=f"{m:g} A/m"
            )
            axis.axvline(1e6 * DISRUPTION[m], color=colour, lw=0.9, ls=":")
    density = np.mean([one.steps[0].asteroid.density for one in runs if one.magnetisation == 0])
    axes[2].axvline(
        1e6 * critical_spin(float(density)), color="0.4", lw=0.9, ls="--", label="critical, 0 A/m"
    )
    axes[0].set(ylabel="width over height")
    axes[1].set(ylabel="density (kg/m³)", ylim=(0, None))
    axes[2].set(ylabel="part of the mass in the pile", ylim=(0, 1.05))
    for axis in axes:
        axis.set_xlabel("angular velocity given (µrad/s)")
        plain(axis)
    axes[2].legend(frameon=False, fontsize=8)
    letters(axes)
    return figure


def piles(runs: Sequence[SpinUp]) -> Figure:
    """Draw one pile of each magnetisation at several spins, coloured by cluster (L21 Figs 4.7, 4.8, 4.10)."""
    figure = empty(9.6, 9.6)
    axes = figure.subplots(len(published.MAGNETISATIONS), len(SHOWN))
    for row, m in zip(axes, published.MAGNETISATIONS, strict=True):
        run = next(one for one in runs if one.magnetisation == m)
        pile = run.steps[0].asteroid.grains
        left, bottom, side, _ = window([moved(pile, pile)])
        margin = (WIDER - 1) / 2 * side
        part = Window(left - margin, bottom - margin, WIDER * side, WIDER * side)
        for axis, rate in zip(row, SHOWN, strict=True):
            step = run.at(rate)
            # Centred on all grains: a view around the largest fragment would cut off other fragments.
            close_up(axis, step.state, step.state, part)
            axis.set_title(f"{m:g} A/m, {1e6 * step.rate:.0f} µrad/s")
    directions(axes[0, 0], part, NO_GRAVITY)
    letters(axes.flat)
    return figure


def table(runs: Sequence[SpinUp]) -> str:
    """Return the measures after each step of each pile as CSV."""
    rows: list[list[object]] = [
        [
            "magnetisation_A_per_m", "seed", "spin_given_rad_per_s", *SEMI_AXES,
            "width_over_height", "density_kg_per_m3", "part_of_mass", "angular_momentum_kg_m2_per_s",
        ]
    ]  # fmt: skip
    for one in runs:
        for step in one.steps:
            axes = step.asteroid.ellipsoid.semi_axes
            values = (*axes, *measured(step), step.angular_momentum)
            rows.append(
                [one.magnetisation, one.seed, f"{step.rate:.4g}", *(f"{value:.5g}" for value in values)]
            )
    return csv_text(rows)
