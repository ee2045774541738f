"""Comparisons of constrictions, grain sizes and fields, each from several starts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tisim.cases.mrf_shear.grains import equal
from tisim.cases.valve import published
from tisim.cases.valve.runs import Flow, Settings, flows
from tisim.cases.valve.scene import FIELD, scene
from tisim.cases.valve.sizes import FINE_DIAMETER, THROATS, D
from tisim.engine.batches import Progress

FLUXES = (published.FLUX, 0.27)
"""Flux densities in addition to FIELD, T."""


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
