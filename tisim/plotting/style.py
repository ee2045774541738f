"""What all figures have in common."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine


def empty(width: float, height: float, pad: float | None = None) -> Figure:
    """An empty figure, inches; ``pad``: room above and below its axes, inches."""
    figure = Figure(figsize=(width, height), layout=ConstrainedLayoutEngine(h_pad=pad), facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def plain(axis: Axes) -> None:
    """Axes below and on the left only, a light grid behind what is drawn."""
    axis.spines[["top", "right"]].set_visible(False)
    axis.grid(color="0.92", lw=0.8)
    axis.set_axisbelow(True)
