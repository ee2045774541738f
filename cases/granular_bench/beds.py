"""Draw-down tests of grains that differ in one property, and of silos with other outlets, as one batch.

Each is run from several random starts. The rate of discharge is compared with Beverloo's law, W = C rho_b
sqrt(g) (D - k d)^(5/2), by a straight line through W^(2/5): its slope gives C and its zero gives k.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.constants import g as STANDARD_GRAVITY

from tisim import Result, run
from tisim.analysis import Mean
from tisim.cases.common.csv_tables import csv_text
from tisim.cases.common.runs import sound
from tisim.cases.granular_bench.measures import discharge, heap, repose
from tisim.cases.granular_bench.scene import DENSITY, DIAMETER, NATURAL, scene
from tisim.engine.batches import Progress
from tisim.plotting.cloud import panel
from tisim.plotting.scenery import scenery, window
from tisim.plotting.style import empty, letters, plain

VALUES = {
    "friction": (0.1, 0.3, 0.5, 0.8),
    "rolling_friction": (0.0, 0.1, 0.2, 0.4),
    "restitution": (0.3, 0.5, 0.8),
    "outlet": (5.0, 6.0, 7.0, 8.0, 9.0),
}
"""Values of the varied properties: those of NATURAL, and the outlet of the silo in diameters of a grain."""
STARTS = 4
"""Number of random starts of each."""
SHOWN = (("rolling_friction", 0.0), ("rolling_friction", 0.2), ("rolling_friction", 0.4))
"""Beds that are drawn as pictures."""
PACKED = 0.6
"""Packing fraction of the grains in the silo, for the bulk density in Beverloo's law."""
COLOURS = ("#4477aa", "#cc6677", "#228833")


@dataclass(frozen=True)
class Bed:
    """The results of a bed, one for each start.

    what : name of the varied property. value : of this property.
    """

    what: str
    value: float
    results: Sequence[Result]

    @property
    def angle(self) -> Mean:
        """Return the angle of repose, degrees; NaN if a start leaves no heap."""
        return Mean.of([repose(result) for result in self.results])

    @property
    def rates(self) -> np.ndarray:
        """Return the discharge rate of each start, kg/s; NaN if an arch has closed the silo."""
        return np.array([discharge(result) for result in self.results])

    @property
    def flowing(self) -> int:
        """Return the number of starts in which no arch closes the silo before its rate is known."""
        return int(np.isfinite(self.rates).sum())

    def mean_rate(self, power: float = 1.0) -> Mean:
        """Return the mean of a power of the discharge rates (kg/s) of the starts that flow.

        It has no interval if only one start flows.
        """
        rates = self.rates[np.isfinite(self.rates)]
        return Mean.of(rates**power) if len(rates) else Mean(np.nan, np.nan)

    @property
    def kept(self) -> Mean:
        """Return the number of grains that stay on the disc."""
        return Mean.of([heap(result).sum() for result in self.results])


def beds(progress: Progress, size: Mapping[str, Any]) -> list[Bed]:
    """Run the beds of VALUES as one batch; identical ones are run once."""
    wanted = [(what, value) for what, values in VALUES.items() for value in values]
    scenes = [
        scene({**NATURAL, what: value}, seed, **size)
        if what in NATURAL
        else scene(seed=seed, **{**size, what: value})
        for what, value in wanted
        for seed in range(STARTS)
    ]
    digests = [one.digest() for one in scenes]
    different = dict(zip(digests, scenes, strict=True))
    found = sound(run(list(different.values()), progress))
    results = dict(zip(different, found, strict=True))
    grouped = np.reshape(digests, (len(wanted), STARTS))
    return [Bed(*one, [results[key] for key in row]) for one, row in zip(wanted, grouped, strict=True)]


def beverloo_constants(found: Sequence[Bed]) -> tuple[Mean, Mean]:
    """Return C and k of Beverloo's law, as means of fits to the first, second, ... start of each outlet.

    Starts in which an arch has closed the silo are left out of a fit; fits with fewer than two flowing
    outlets are left out.
    """
    outlets = np.array([one.value for one in found])
    flows = ((rates, np.isfinite(rates)) for rates in np.array([one.rates for one in found]).T)
    fits = [beverloo_fit(outlets[open_], rates[open_]) for rates, open_ in flows if open_.sum() > 1]
    if not fits:
        return Mean(np.nan, np.nan), Mean(np.nan, np.nan)
    return Mean.of([constant for constant, _ in fits]), Mean.of([empty_part for _, empty_part in fits])


def beverloo_fit(outlets: np.ndarray, rates: np.ndarray) -> tuple[float, float]:
    """Return C and k of Beverloo's law for outlets (in diameters) and rates (kg/s), by least squares."""
    slope, offset = np.polyfit(outlets * DIAMETER, rates**0.4, 1)
    constant = slope**2.5 / (PACKED * DENSITY * np.sqrt(STANDARD_GRAVITY))
    return float(constant), float(-offset / slope / DIAMETER)


def bed_figure(found: Sequence[Bed]) -> Figure:
    """Draw three heaps, the dependence of angle and rate on the properties, and Beverloo's law."""
    figure = empty(11.6, 7.2)
    (first, second, angles), (third, rates, law) = figure.subplots(2, 3)
    chosen = [next(one for one in found if (one.what, one.value) == key) for key in SHOWN]
    firsts = [one.results[0] for one in chosen]
    states = [one.state for one in firsts]
    silos = [scenery(one.scene, states, one.time, one.measures) for one in firsts]
    part = window(states, silos)
    for axis, one, state, silo in zip((first, second, third), chosen, states, silos, strict=True):
        panel(axis, state, part, silo)
        angle = "no heap" if np.isnan(one.angle.value) else f"{one.angle.value:.0f} degrees"
        axis.set_title(f"{one.what.replace('_', ' ')} {one.value:g}: {angle}")
    for k, what in enumerate(NATURAL):
        group = [one for one in found if one.what == what]
        values = [one.value for one in group]
        for axis, numbers in (
            (angles, [one.angle for one in group]),
            (rates, [one.mean_rate() for one in group]),
        ):
            bars(axis, values, numbers, fmt="os^"[k] + "-", color=COLOURS[k], label=what.replace("_", " "))
            axis.set_xlabel("coefficient, the others as usual")
            axis.legend(frameon=False, fontsize=8)
    angles.set(ylabel="angle of repose (degrees)", title="angle of repose")
    rates.set(ylabel="discharge rate (kg/s)", title="discharge rate")
    beverloo(law, [one for one in found if one.what == "outlet"])
    for axis in (angles, rates, law):
        plain(axis)
    letters((first, second, angles, third, rates, law))
    return figure


def bars(axis: Axes, values: Sequence[float], means: Sequence[Mean], **style: Any) -> None:
    """Draw means and their 95 % intervals against the varied property."""
    numbers, halves = [one.value for one in means], [one.half for one in means]
    axis.errorbar(values, numbers, halves, ms=5, capsize=2, elinewidth=0.8, **style)


def beverloo(axis: Axes, found: Sequence[Bed]) -> None:
    """Draw the rate to the power 2/5 against the outlet, and the line of Beverloo's law."""
    constant, empty_part = beverloo_constants(found)
    outlets = [one.value for one in found]
    line = np.linspace(empty_part.value, max(outlets), 50)
    bulk = PACKED * DENSITY
    free = np.maximum((line - empty_part.value) * DIAMETER, 0.0)
    rate = constant.value * bulk * np.sqrt(STANDARD_GRAVITY) * free**2.5
    label = f"Beverloo, C = {constant}, k = {empty_part}"
    axis.plot(line, rate**0.4, color="0.2", lw=1.0, label=label)
    powers = [one.mean_rate(0.4) for one in found]
    bars(axis, outlets, powers, fmt="o", mfc="none", color=COLOURS[0], label="as run, of starts that flow")
    axis.set(xlabel="outlet (diameters of a grain)", ylabel=r"rate$^{2/5}$ ((kg/s)$^{2/5}$)",
             title="Beverloo's law")  # fmt: skip
    axis.legend(frameon=False, fontsize=8)


def table(found: Sequence[Bed]) -> str:
    """Return the results of all beds as CSV.

    Columns are the varied property, the angle of repose, the discharge rate of the starts that flow and the
    number of grains in the heap, each with half of its 95 % interval, and the number of starts that flow.
    """
    measured = ("angle_of_repose_degrees", "discharge_rate_kg_s", "grains_of_the_heap")
    headings = [name for one in measured for name in (one, f"{one}_95")]
    rows: list[list[object]] = [["varied", "value", *headings, "starts_that_flow"]]
    for one in found:
        means = (one.angle, one.mean_rate(), one.kept)
        numbers = [x for mean in means for x in (mean.value, mean.half)]
        rows.append([one.what, one.value, *numbers, one.flowing])
    return csv_text(rows)
