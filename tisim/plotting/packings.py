"""Figures of packings: the directions of rods."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from tisim.analysis.packings.wall_alignment import DirectionHistogram
from tisim.errors import must
from tisim.plotting.style import empty, letters


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
