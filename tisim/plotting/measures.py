"""Figures of results of ``tisim.analysis``: flow curves, radial distributions, chains and profiles."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tisim.analysis.flow_curves import BinghamFit, BiviscousFit, Estimate, HerschelBulkleyFit
from tisim.plotting.style import AXIS_COLOURS, empty, letters, plain, quantity, scale_of, superscripts


def flow_curve(
    rate: np.ndarray,
    stress: np.ndarray,
    fits: tuple[BinghamFit | BiviscousFit | HerschelBulkleyFit, ...] = (),
    error: np.ndarray | None = None,
) -> Figure:
    """Draw shear stresses (Pa) against shear rates (1/s), and fitted laws with 95 % confidence intervals.

    error : half-lengths of the error bars, Pa.
    """
    figure = empty(5.6, 3.8)
    axis = figure.subplots()
    axis.errorbar(rate, stress, error, fmt="o", ms=5, color="0.2", capsize=2, zorder=3)
    axis.set_xscale(scale_of(np.asarray(rate)))
    line = np.linspace(0 if axis.get_xscale() == "linear" else np.min(rate), np.max(rate), 400)
    for fit, colour in zip(fits, AXIS_COLOURS, strict=False):
        axis.plot(line, fit.stress(line), color=colour, label=_law(fit))
    axis.set_ylim(bottom=min(0.0, float(np.min(stress))))
    axis.set_xlabel("shear rate (1/s)")
    quantity(axis.yaxis, "shear stress", "Pa")
    if fits:
        axis.legend(frameon=False, fontsize=8)
    plain(axis)
    return figure


def _law(fit: BinghamFit | BiviscousFit | HerschelBulkleyFit) -> str:
    """Return the law with its numbers, for a legend."""

    def known(estimate: Estimate) -> str:
        return f"({estimate.value:.4g} ± {estimate.half:.1g})"

    if isinstance(fit, BinghamFit | BiviscousFit):
        bingham = (
            f"{known(fit.yield_stress)} Pa + {known(fit.plastic_viscosity)} Pa s \N{MULTIPLICATION SIGN} rate"
        )
        if isinstance(fit, BinghamFit):
            return bingham
        return f"{bingham},\nat most {known(fit.rest_viscosity)} Pa s \N{MULTIPLICATION SIGN} rate"
    power = f"Pa sⁿ \N{MULTIPLICATION SIGN} rateⁿ\nn = {fit.exponent.value:.3g} ± {fit.exponent.half:.1g}"
    return f"{known(fit.yield_stress)} Pa + {known(fit.consistency)} {power}"


def neighbours(edges: np.ndarray, distribution: np.ndarray, diameter: float | None = None) -> Figure:
    """Draw a radial distribution function over distances between edges (m), in units of the ``diameter`` (m)
    of particles if it is given."""
    figure = empty(5.6, 3.4)
    axis = figure.subplots()
    axis.axhline(1.0, color="0.6", lw=0.9, ls="--")
    axis.stairs(
        distribution, np.asarray(edges) / (diameter or 1.0), baseline=None, color=AXIS_COLOURS[0], lw=1.4
    )
    axis.set_xlim(edges[0] / (diameter or 1.0), edges[-1] / (diameter or 1.0))
    axis.set_ylim(bottom=0)
    axis.set_ylabel("radial distribution g")
    if diameter:
        axis.set_xlabel("distance of centres over the diameter")
    else:
        quantity(axis.xaxis, "distance of centres", "m")
    plain(axis)
    return figure


def chain_lengths(cluster: np.ndarray) -> Figure:
    """Draw the fraction of particles in clusters of each size, and of at least this size, given the cluster
    of each particle."""
    sizes = np.bincount(np.bincount(cluster))
    number = np.arange(1, len(sizes))
    share = number * sizes[1:] / len(cluster)
    figure = empty(5.6, 3.4)
    axis = figure.subplots()
    axis.bar(number, share, width=0.8, color=AXIS_COLOURS[0], label="in clusters of this size")
    least = share[::-1].cumsum()[::-1]
    axis.step(number, least, where="mid", color=AXIS_COLOURS[1], label="of this size or larger")
    axis.set(xlabel="particles of a cluster", ylabel="fraction of particles", ylim=(0, 1.05))
    axis.xaxis.set_major_locator(MaxNLocator(8, integer=True))
    axis.legend(frameon=False, fontsize=8)
    plain(axis)
    return figure


def profiles(
    edges: np.ndarray, columns: Mapping[tuple[str, str], np.ndarray], name: str = "height"
) -> Figure:
    """Draw profiles over layers between edges (m), with a panel for each quantity, (name, unit) -> values.
    name : label of the vertical axis."""
    figure = empty(1.2 + 2.7 * len(columns), 3.8)
    panels = figure.subplots(1, len(columns), sharey=True, squeeze=False)[0]
    middle = (np.asarray(edges)[1:] + np.asarray(edges)[:-1]) / 2
    for axis, ((what, unit), values) in zip(panels, columns.items(), strict=True):
        axis.plot(values, middle, "o-", ms=4, lw=1.0, color=AXIS_COLOURS[0])
        # A prefix before a power of a unit would be ambiguous.
        if unit and "^" not in unit:
            quantity(axis.xaxis, what, unit)
        else:
            axis.set_xlabel(f"{what} ({superscripts(unit)})" if unit else what)
            axis.ticklabel_format(axis="x", scilimits=(-2, 3), useMathText=True)
        axis.xaxis.set_major_locator(MaxNLocator(4))
        plain(axis)
    panels[0].set_ylim(edges[0], edges[-1])
    quantity(panels[0].yaxis, name, "m")
    letters(panels)
    return figure
