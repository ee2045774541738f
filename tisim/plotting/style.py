"""Style shared by all figures."""

from __future__ import annotations

import re
from collections.abc import Iterable
from string import ascii_lowercase

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import FuncFormatter

TIME = ListedColormap(colormaps["viridis"](np.linspace(0.0, 0.9, 256)))
"""Perceptually uniform colours for time, without the end that is too light on white."""
AXIS_COLOURS = ("#4477aa", "#cc6677", "#228833")
"""Colours of x, y and z, also for colour-blind readers (P. Tol's bright set)."""
PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
"""Prefixes of a unit by power of ten."""
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
WIDE = 30.0
"""An axis is logarithmic if the ratio of its largest to its smallest value exceeds this."""


def empty(width: float, height: float, pad: float | None = None) -> Figure:
    """Return an empty figure of a size in inches. ``pad`` : space above and below its axes, inches."""
    figure = Figure(figsize=(width, height), layout=ConstrainedLayoutEngine(h_pad=pad), facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def plain(axis: Axes) -> None:
    """Keep only the lower and left spines, with a light grid behind the data."""
    axis.spines[["top", "right"]].set_visible(False)
    axis.grid(color="0.92", lw=0.8)
    axis.set_axisbelow(True)


def letters(panels: Iterable[Axes], size: float = 10) -> None:
    """Write (a), (b), ... before the titles of a figure's panels, at their left edges. size : font size,
    points."""
    for letter, axis in zip(ascii_lowercase, panels, strict=False):
        title = f"({letter}) {axis.get_title()}".rstrip()
        axis.set_title("")
        axis.set_title(title, loc="left", fontsize=size)


def legend_beside(axis: Axes) -> None:
    """Put a legend to the right of the panel."""
    axis.legend(frameon=False, fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0))


def legend_above(axis: Axes, columns: int = 3) -> None:
    """Put a legend above the panel, at its right."""
    axis.legend(
        frameon=False, fontsize=8, ncols=columns, loc="lower right", bbox_to_anchor=(1.0, 1.0),
        borderaxespad=0.1,
    )  # fmt: skip


def si(value: float, unit: str) -> str:
    """Return a value with a prefix: 0.01 s is 10 ms."""
    power = _power(value)
    return f"{value / 10.0**power:.3g} {PREFIXES[power]}{unit}"


def quantity(axis: Axis, name: str, unit: str) -> None:
    """Label an axis with a quantity and its unit, with a prefix that suits its limits, "time (ms)"; or with a
    power of ten if there is no prefix, "kinetic energy (10⁻²⁴ J)"."""
    power = _thousands(float(np.abs(axis.get_view_interval()).max()))
    factor = PREFIXES[power] if power in PREFIXES else superscripts(f"10^{power} ")
    axis.set_major_formatter(
        FuncFormatter(lambda value, _: f"{value / 10.0**power:.6g}".replace("-", "\N{MINUS SIGN}"))
    )
    axis.set_label_text(f"{name} ({factor}{unit})")


def superscripts(text: str) -> str:
    """Return units with superscripts: "m^3/s" is "m³/s"."""
    return re.sub(r"\^(-?\d+)", lambda power: power[1].translate(_RAISED), text)


def symbols(text: str) -> str:
    """Return a label with typeset symbols: "b_f" has a subscript, and "Pi" is the Greek letter."""
    greek = re.sub(r"\bPi\b", "\N{GREEK CAPITAL LETTER PI}", superscripts(text))
    return re.sub(r"\b([A-Za-z])_(\w+)\b", r"$\1_{\2}$", greek)


def scale_of(values: np.ndarray) -> str:
    """Return the scale of an axis for values: "log" if they are positive and span a wide range, else
    "linear"."""
    wide = values.size and values.min() > 0 and values.max() > WIDE * values.min()
    return "log" if wide else "linear"


def _power(value: float) -> int:
    """Return the power of ten of the prefix of a value."""
    return int(np.clip(_thousands(value), min(PREFIXES), max(PREFIXES)))


def _thousands(value: float) -> int:
    """Return the power of ten, a multiple of 3, that leaves a value at least 1 and below 1000."""
    return 3 * int(np.floor(np.log10(abs(value) * (1 + 1e-12)) / 3)) if value else 0
