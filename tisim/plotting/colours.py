"""Colours of grains by a quantity, and their legend."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from tisim.engine.assembly import units
from tisim.errors import InputError, abbreviated, did_you_mean
from tisim.plotting.style import TIME, quantity
from tisim.scene.initial_state import Arrays
from tisim.scene.scene import Scene

GRAIN_COLOUR = (0.36, 0.55, 0.73)
"""Colour of grains that no quantity distinguishes: red, green and blue, 0..1."""
MATERIAL_COLOURS = np.array([
    (0.36, 0.55, 0.73), (0.80, 0.40, 0.46), (0.87, 0.80, 0.47), (0.27, 0.67, 0.60), (0.53, 0.13, 0.33),
    (0.60, 0.60, 0.20), (0.67, 0.27, 0.60), (0.53, 0.80, 0.93), (0.07, 0.47, 0.20), (0.70, 0.70, 0.70),
])  # fmt: skip
"""Colours of materials, in their order in the scene, also for colour-blind readers (P. Tol's muted set)."""
# The black end is left out, because cold grains would show neither shading nor edges.
HEAT = ListedColormap(colormaps["inferno"](np.linspace(0.17, 0.97, 256)))
WIDE_RANGE = 20.0
"""A scale is logarithmic if the ratio of its largest to its smallest value exceeds this."""
TAILS = 1.0
"""Percentage of the smallest values, and of the largest, that may be beyond the scale."""
LONG_TAIL = 1.0
"""A tail is beyond the scale if it reaches farther than this, relative to the range of all other values."""
COLOUR_SAMPLES = 400
"""Number of quantiles of a state by which its values enter the scale."""


@dataclass(frozen=True)
class Colouring:
    """Colours of grains by a quantity.

    name : of the quantity. unit : of its values. norm : its scale. names : of materials, if it is the
    material.
    """

    name: str
    unit: str
    norm: Normalize
    names: tuple[str, ...] = ()
    extend: str = "neither"

    @property
    def map(self) -> Colormap:
        """Return the colours of the scale."""
        return HEAT if self.name == "temperature" else TIME

    def of(self, state: Arrays) -> np.ndarray:
        """Return the colour of each grain, red, green and blue, shape (n, 3)."""
        values = values_of(state, self.name)
        if self.names:
            return np.asarray(MATERIAL_COLOURS[values.astype(int) % len(MATERIAL_COLOURS)])
        return np.asarray(self.map(self.norm(values)))[:, :3]

    def legend(self, figure: Figure, beside: Any, place: Axes | None = None) -> None:
        """Draw the legend: beside axes, or in given axes."""
        if self.names:
            style: dict[str, Any] = {"handles": self.patches(), "frameon": False, "title": self.name}
            if place is None:
                figure.legend(loc="outside right center", **style)
            else:
                place.set_axis_off()
                place.legend(loc="center left", bbox_to_anchor=(0.0, 0.5), **style)
            return
        at = {"ax": beside, "shrink": 0.72, "pad": 0.01} if place is None else {"cax": place}
        bar = figure.colorbar(ScalarMappable(self.norm, self.map), extend=self.extend, **at)
        if isinstance(self.norm, LogNorm) or self.unit in ("", "K"):
            bar.set_label(f"{self.name} ({self.unit})" if self.unit else self.name)
        else:
            quantity(bar.ax.yaxis, self.name, self.unit)
        bar.outline.set_visible(False)

    def patches(self) -> list[Patch]:
        """Return one patch for each material, for a legend."""
        colours = MATERIAL_COLOURS[np.arange(len(self.names)) % len(MATERIAL_COLOURS)]
        return [Patch(color=colour, label=name) for colour, name in zip(colours, self.names, strict=True)]


def plain_colours(number: int) -> np.ndarray:
    """Return the colours of grains that no quantity distinguishes, shape (n, 3)."""
    return np.tile(GRAIN_COLOUR, (number, 1))


def values_of(state: Arrays, name: str) -> np.ndarray:
    """Return a quantity of each grain, shape (n,): "speed", a field, a component such as "velocity_x", or the
    magnitude of a vector. Raise InputError if the state has no such quantity."""
    if name == "speed":
        return np.asarray(np.linalg.norm(state["velocity"], axis=1))
    base, _, component = name.rpartition("_")
    if name not in state and component in ("x", "y", "z") and base in state and state[base].ndim == 2:
        return np.asarray(state[base][:, "xyz".index(component)], float)
    values = state.get(name)
    if values is None or (values.ndim > 1 and values.shape[1] != 3):
        fields = (key for key in state if state[key].ndim == 1 or state[key].shape[1] == 3)
        options = sorted({"speed", *fields})
        raise InputError(
            f"colour must be one of {', '.join(options)}; received {abbreviated(name)}"
            f"{did_you_mean(name, options)}"
        )
    return np.linalg.norm(values, axis=1) if values.ndim == 2 else np.asarray(values)


def unit_of(name: str, known: Mapping[str, str]) -> str:
    """Return the unit of a quantity as ``values_of`` names it; empty if it is not known."""
    if name == "speed":
        return "m/s"
    return known.get(name, known.get(name.rpartition("_")[0], ""))


def colouring(scene: Scene, states: Sequence[Arrays], name: str | None = None) -> Colouring | None:
    """Return the colours of grains by a quantity with one scale for all states; None if nothing distinguishes
    them. ``name`` : as for ``chosen``."""
    some = [state for state in states if len(state["radius"])]
    name = chosen(scene, some, name)
    return None if name is None else scaled(scene, name, [sample(values_of(state, name)) for state in some])


def chosen(scene: Scene, states: Sequence[Arrays], name: str | None) -> str | None:
    """Return the name of the quantity that colours grains; None if nothing distinguishes them.

    name : by default the temperature if all states have it, or the material if the scene has several.
    """
    if name is not None or not states:
        return name
    if all("temperature" in state for state in states):
        return "temperature"
    several = len(scene.materials) > 1 and all("material" in state for state in states)
    return "material" if several else None


def scaled(scene: Scene, name: str, values: Sequence[np.ndarray]) -> Colouring:
    """Return the colours by a quantity with a scale for all values."""
    names = tuple(scene.materials) if name == "material" else ()
    norm, extend = scale(np.concatenate([np.empty(0), *values]))
    return Colouring(name, "" if names else unit_of(name, units(scene)), norm, names, extend)


def sample(values: np.ndarray) -> np.ndarray:
    """Return the finite values, or quantiles of them if there are many."""
    values = values[np.isfinite(values)].astype(float)
    return np.quantile(values, np.linspace(0, 1, COLOUR_SAMPLES)) if len(values) > COLOUR_SAMPLES else values


def scale(values: np.ndarray) -> tuple[Normalize, str]:
    """Return the scale of values, logarithmic for a wide range, and at which ends values are beyond it:
    "neither", "min", "max" or "both"."""
    if not len(values):
        return Normalize(0.0, 1.0), "neither"
    ends = float(values.min()), float(values.max())
    low, high = (float(one) for one in np.percentile(values, [TAILS, 100 - TAILS]))
    usual = high - low
    below = 0 < LONG_TAIL * usual < low - ends[0]
    above = 0 < LONG_TAIL * usual < ends[1] - high
    low, high = low if below else ends[0], high if above else ends[1]
    beyond = {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}[
        below, above
    ]
    if low > 0 and high > WIDE_RANGE * low:
        return LogNorm(low, high), beyond
    # A scale finer than a hundredth would exaggerate negligible differences.
    least = max(0.01 * abs(low), 1e-300) / 2
    middle = (low + high) / 2
    return Normalize(min(low, middle - least), max(high, middle + least)), beyond
