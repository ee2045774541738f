"""Figures of the case mrf_shear: flow curve, stress by field and by part of the model, grains and chains."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tisim import Result, run
from tisim.cases.case import size_named
from tisim.cases.mrf_shear import published
from tisim.cases.mrf_shear.chain_figures import chain_table, reattachment_figure
from tisim.cases.mrf_shear.chains import followed
from tisim.cases.mrf_shear.flow_curve import (
    COMPARED,
    Curve,
    by_field,
    by_part,
    flow_curve,
    magnetised,
    paired,
    table,
    yield_table,
)
from tisim.cases.mrf_shear.measures import order
from tisim.cases.mrf_shear.scene import RATES, SIZES
from tisim.engine.batches import Progress
from tisim.errors import must
from tisim.plotting.cloud import panel
from tisim.plotting.scenery import box_scenery, window
from tisim.plotting.style import empty, letters, plain, si

STARTS = 3
"""Number of starts of each setting."""
DRAWN = {"default": STARTS, "polydisperse": 6}
"""The sizes with figures, and the number of starts of their flow curves; starts of the mixture also differ in
their largest grains."""
KILO = 1e3
"""A kilopascal, Pa."""


def figures(size: str, progress: Progress) -> Mapping[str, Figure | str]:
    """Figures and tables of a size, "default" or "polydisperse", by file name.

    - flow_curve.csv, yield_stress.csv: stress by shear rate, and the yield stress of Bingham's law.
    - chains.png: grains before, in the field, and sheared.
    - reattachment.png, chains.csv: chains that are followed while they are sheared.
    - flow_curve.png, field.csv, of the default size: stress also by field and by part of the model.
    """
    must(size in DRAWN, "size", f"one of {', '.join(DRAWN)}, which are run", size)
    settings = {key: value for key, value in size_named(size, SIZES).scene.items() if key != "rate"}
    curve = flow_curve(DRAWN[size], progress=progress, settings=settings)
    slow = curve.groups[0][0]
    (chained,) = run([magnetised({**settings, "rate": RATES[0]}, slow.scene.seed)])
    sheared, still = followed({**settings, **COMPARED}, STARTS)
    drawn: dict[str, Figure | str] = {
        "flow_curve.csv": table(curve, "shear_rate_per_s"),
        "yield_stress.csv": yield_table(curve),
        "chains.csv": chain_table(sheared, still),
        "chains.png": chain_figure(chained, slow),
        "reattachment.png": reattachment_figure(sheared, still),
    }
    if size == "default":
        fields, parts = by_field(STARTS), by_part(STARTS)
        drawn |= {
            "flow_curve.png": stress_figure(curve, fields, parts),
            "field.csv": table(fields, "flux_density_T"),
        }
    return drawn


def stress_figure(curve: Curve, fields: Curve, parts: Mapping[str, Sequence[Result]]) -> Figure:
    """Draw stress by shear rate with the fitted Bingham fluid, by field, and by part of the model."""
    figure = empty(12.6, 3.9)
    rates, flux, bars = figure.subplots(1, 3, width_ratios=(1.0, 1.0, 1.15))
    fit = curve.bingham()
    style: Any = {"fmt": "o", "ms": 5, "capsize": 3}
    rates.errorbar(curve.x, curve.values / KILO, curve.halves / KILO, **style, label="as run")
    line = np.linspace(0.0, curve.x.max(), 2)
    yields, half = fit.yield_stress.value / KILO, fit.yield_stress.half / KILO
    rates.plot(line, fit.stress(line) / KILO, color="0.2", lw=1.0,
               label=f"Bingham: {yields:.1f} ± {half:.1f} kPa")  # fmt: skip
    beside = published.MEASURED_YIELD["00:100"] / KILO
    rates.axhline(beside, color="#cc6677", lw=1.0, ls="--", label=f"measured yield stress, {beside:g} kPa")
    rates.set(xlabel="shear rate (1/s)", ylabel="shear stress (kPa)", title="flow curve at 0.6 T")
    rates.set_ylim(bottom=0.0)
    flux.errorbar(fields.x, fields.values / KILO, fields.halves / KILO, **style)
    scale = fields.values[-1] / fields.x[-1] ** 2 / KILO
    line = np.linspace(fields.x.min(), fields.x.max(), 100)
    flux.plot(line, scale * line**2, color="0.2", lw=1.0, label=f"as B²; exponent {fields.power()}")
    flux.set(xlabel="flux density (T)", ylabel="shear stress (kPa)", title="by field")
    part_bars(bars, parts)
    for axis in (rates, flux):
        axis.legend(frameon=False, fontsize=8)
    for axis in (rates, flux, bars):
        plain(axis)
    letters((rates, flux, bars))
    return figure


def part_bars(axis: Axes, parts: Mapping[str, Sequence[Result]]) -> None:
    """Draw the ratio of stresses of each variant and the whole model, from the same starts."""
    names = list(parts)
    ratios = [paired(parts[name], parts[names[0]]) for name in names[1:]]
    place = np.arange(len(ratios))[::-1]
    axis.barh(place, [one.value for one in ratios], xerr=[one.half for one in ratios], height=0.6,
              color="#88aacc", ecolor="0.3", capsize=3)  # fmt: skip
    axis.axvline(1.0, color="0.2", lw=1.0)
    axis.set_yticks(place, names[1:])
    axis.set(xlabel="stress over that of the whole model", title="without a part, or with another")


def chain_figure(chained: Result, sheared: Result) -> Figure:
    """Draw a cell at the start, with its chains, and sheared, on one scale.

    Titles give the contacts per grain and their order along the field, (3 cos^2 - 1)/2.
    """
    figure = empty(12.0, 4.6, pad=0.1)
    states = (
        ("at the start", chained.start),
        (f"in the field, {si(chained.time, 's')}", chained.state),
        (f"sheared, {si(sheared.time, 's')}", sheared.state),
    )
    domain = sheared.scene.domain
    box = box_scenery(*domain.bounds())
    part = window([chained.start], [box])
    axes = figure.subplots(1, 3)
    for axis, (heading, state) in zip(axes, states, strict=True):
        known = {name: state[name] for name in ("position", "radius")}
        panel(axis, known, part, box)
        chains = order(state, domain)
        axis.set_title(f"{heading}: contacts {chains.contacts:.1f}, order {chains.alignment:.2f}")
    letters(axes, 9)
    return figure
