"""What is compared: constrictions, grain sizes and fields, each from several starts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cases.mrf_shear.scene import equal
from cases.valve.runs import Flow, valves
from cases.valve.scene import FIELD
from cases.valve.sizes import FINE_DIAMETER, THROATS, D
from tisim.engine.batches import Progress

FLUXES = (0.2, 0.25, 0.35)
"""Flux densities beside FIELD, T."""


@dataclass(frozen=True)
class ValveRuns:
    """The runs of a valve are flows from several starts.

    throat, diameter : of the constriction and of the grains, m. flux : flux density, T.
    """

    throat: float
    diameter: float
    flux: float
    flows: Sequence[Flow]

    @property
    def width(self) -> float:
        """Return how many grains are side by side in the constriction."""
        return self.throat / self.diameter

    @property
    def name(self) -> str:
        """Return what it is, for people."""
        return f"{self.width:.3g} grains of {1e6 * self.diameter:.3g} µm"

    @property
    def jammed(self) -> int:
        """Return how many of the flows are arrested."""
        return sum(flow.arrested for flow in self.flows)


Valve = tuple[float, float, float]
"""Diameters of the constriction and of the grains, m, and flux density, T."""


def studies(wanted: Sequence[Valve], starts: int, progress: Progress = lambda part: None) -> list[ValveRuns]:
    """Return valves from so many starts each, run as one batch."""
    settings = [
        {"throat": throat, "grains": equal(diameter / 2, 1.0), "flux": flux}
        for throat, diameter, flux in wanted
    ]
    groups = valves(settings, starts, progress)
    return [ValveRuns(*valve, flows) for valve, flows in zip(wanted, groups, strict=True)]


def by_throat(starts: int, progress: Progress = lambda part: None) -> list[ValveRuns]:
    """Return coarse grains in each constriction, and fine ones in the narrowest."""
    coarse = [(throat, D, FIELD) for throat in THROATS]
    return studies([*coarse, (THROATS[0], FINE_DIAMETER, FIELD)], starts, progress)


def by_field(starts: int, progress: Progress = lambda part: None) -> list[ValveRuns]:
    """Return coarse grains in the narrowest and the widest constriction, in other fields."""
    ends = (THROATS[0], THROATS[-1])
    return studies([(throat, D, flux) for throat in ends for flux in FLUXES], starts, progress)
