"""Runs of valves, with their flow rates over time; comparisons of constrictions, grain sizes and fields."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tisim import Observer, Result, Scene, Simulation
from tisim.analysis import Mean
from tisim.cases.common.magnetorheological_fluid import equal
from tisim.cases.common.runs import sound
from tisim.cases.valve import published
from tisim.cases.valve.measures import duct_of, rate
from tisim.cases.valve.scene import FIELD, FINE_DIAMETER, THROATS, D, scene
from tisim.engine.batches import Progress, loaded
from tisim.sources import MagneticField

Settings = Mapping[str, Any]
"""Settings of a scene that differ from the defaults."""
FLOW_SAMPLES = 100
"""Number of samples of the flow rate in a run."""
LATE = 0.2
"""Fraction at the end of the time without a field, and of the time with it, over which flow rates are
averaged."""
ARRESTED = 0.05
"""Largest remaining fraction of the flow rate at which a flow counts as arrested. For ``Flow.left`` it is
relative to the mean rate before the field. In a search, which has no time without a field, it is relative to
the rate of grains that move with the oil, at the end (``problem.part_left``)."""

FLUXES = (published.FLUX, 0.27)
"""Flux densities in addition to FIELD, T."""


class FlowSeries(Observer):
    """Records the mass flow rate of each world at FLOW_SAMPLES equally spaced times.

    ``rows[w]`` are pairs of time (s) and rate (kg/s) of world w.
    """

    def __init__(self, scenes: Sequence[Scene]) -> None:
        self.lengths = [duct_of(one).length for one in scenes]
        self.intervals = np.array([one.duration / FLOW_SAMPLES for one in scenes])
        self.rows: list[list[tuple[float, float]]] = [[] for _ in scenes]

    def pause(self, simulation: Simulation) -> np.ndarray:
        return np.array([len(rows) for rows in self.rows]) * self.intervals

    def observe(self, simulation: Simulation) -> None:
        for rows, due, length, state in zip(
            self.rows, self.pause(simulation), self.lengths, simulation.states, strict=True
        ):
            if state.time >= due:
                rows.append((state.time, rate(state["mass"], state["velocity"], length)))


@dataclass(frozen=True)
class Flow:
    """The result of a flow, with the mass flow rate (kg/s) at times (s)."""

    result: Result
    times: np.ndarray
    rates: np.ndarray

    @property
    def switched(self) -> float:
        """Return the time at which the field is switched on, s."""
        return next(one for one in self.result.scene.effects if isinstance(one, MagneticField)).begin

    @property
    def open_rate(self) -> float:
        """Return the mass flow rate before the field is switched on, kg/s."""
        return self.mean(0.0, self.switched)

    @property
    def closed_rate(self) -> float:
        """Return the mass flow rate at the end, kg/s."""
        return self.mean(self.switched, float(self.times[-1]))

    @property
    def left(self) -> float:
        """Return the fraction of the flow rate that remains in the field."""
        return self.closed_rate / self.open_rate

    @property
    def arrested(self) -> bool:
        """Return whether the field has arrested the flow."""
        return self.left < ARRESTED

    def mean(self, begin: float, end: float) -> float:
        """Return the mean rate over the last part LATE of the time from ``begin`` to ``end``, s."""
        chosen = (self.times > end - LATE * (end - begin)) & (self.times <= end)
        return float(self.rates[chosen].mean())


def flows(scenes: Sequence[Scene], progress: Progress = lambda part: None) -> list[Flow]:
    """Return the flows of scenes, run as one batch; RunError if one fails."""
    series = FlowSeries(scenes)
    with loaded(scenes) as simulation:
        simulation.run(observers=[series, lambda simulation: progress(simulation.fraction())])
        results = sound(simulation.results())
    return [Flow(result, *np.array(rows).T) for result, rows in zip(results, series.rows, strict=True)]


def left(group: Sequence[Flow]) -> Mean:
    """Return the fraction of the flow rate before the field that remains at the end, a mean over starts."""
    return Mean.of([one.left for one in group])


def left_of(group: Sequence[Flow], without: Sequence[Flow]) -> Mean:
    """Return the ratio of the final flow rates with and without a field, from the same starts: a mean over
    starts.

    It excludes slowing of the flow that is not caused by the field.
    """
    return Mean.of([one.closed_rate / other.closed_rate for one, other in zip(group, without, strict=True)])


@dataclass(frozen=True)
class ValveRuns:
    """The runs of a valve: flows from several starts.

    throat, diameter : of the constriction and of the grains, m. flux : flux density, T.
    """

    throat: float
    diameter: float
    flux: float
    flows: Sequence[Flow]

    @property
    def width(self) -> float:
        """Return the number of grains side by side in the constriction."""
        return self.throat / self.diameter

    @property
    def name(self) -> str:
        """Return a readable name."""
        name = f"{self.width:.3g} grains of {1e6 * self.diameter:.3g} µm"
        return name if self.flux > 0 else f"{name}, no field"


@dataclass(frozen=True)
class Wanted:
    """A valve to run: diameters of the constriction and of the grains, m, flux density, T, and number of
    starts."""

    throat: float
    diameter: float
    flux: float
    starts: int

    def settings(self) -> list[Settings]:
        """Return the settings of its scenes, one for each start."""
        grains = equal(self.diameter / 2, 1.0)
        one = {"throat": self.throat, "grains": grains, "flux": self.flux}
        return [{**one, "seed": seed} for seed in range(self.starts)]


def run_all(wanted: Sequence[Wanted], progress: Progress = lambda part: None) -> list[ValveRuns]:
    """Return the runs of valves, all in one batch."""
    done = flows([scene(**one) for each in wanted for one in each.settings()], progress)
    ends = np.cumsum([each.starts for each in wanted])
    return [
        ValveRuns(each.throat, each.diameter, each.flux, done[end - each.starts : end])
        for each, end in zip(wanted, ends, strict=True)
    ]


def by_throat(starts: int, progress: Progress = lambda part: None) -> list[ValveRuns]:
    """Return the runs of the compared constrictions and grains.

    They are, with the number of starts:
    - coarse grains in the narrow constriction, 2 ``starts``, with a field and without one;
    - coarse grains in the wide constriction, ``starts``;
    - fine grains, with eight times the number, in the narrow constriction, ``starts`` / 2.
    """
    narrow, wide = THROATS
    wanted = [
        Wanted(narrow, D, FIELD, 2 * starts),
        Wanted(wide, D, FIELD, starts),
        Wanted(narrow, FINE_DIAMETER, FIELD, starts // 2),
        Wanted(narrow, D, 0.0, 2 * starts),
    ]
    return run_all(wanted, progress)


def by_field(starts: int, progress: Progress = lambda part: None) -> list[ValveRuns]:
    """Return coarse grains in each constriction, in other fields."""
    return run_all([Wanted(throat, D, flux, starts) for throat in THROATS for flux in FLUXES], progress)
