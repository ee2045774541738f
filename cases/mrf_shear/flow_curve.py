"""Runs of cells: the flow curve, the stress by field and by part of the model, and fits to them.

They are drawn with the measured and simulated yield stresses of L21. L21's curves are only available as
figures.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np

from tisim import Result, Scene
from tisim.analysis import BinghamFit, Estimate, Mean, fit_bingham
from tisim.cases.common.csv_tables import csv_text
from tisim.cases.common.runs import grouped
from tisim.cases.mrf_shear.measures import flux, shear_rate, shear_stress
from tisim.cases.mrf_shear.scene import MAGNETISING_TIME, RATES, mixture, scene
from tisim.effects import CARBONYL_IRON
from tisim.engine.batches import Progress

Settings = Mapping[str, Any]
"""Settings of ``scene`` that differ from the defaults."""
COMPARED = {"rate": RATES[-1]}
"""Variants and fields are compared at the highest shear rate, which takes the shortest time to run."""
FLUXES = (0.1, 0.2, 0.3, 0.45, 0.6)
"""Flux densities of the sweep, T."""
AS_PUBLISHED, MIXED = "as L21 has it", "a third of small grains"
"""Names of the model with which variants are compared, and of the mixture; its small grains are a third by
volume."""
VARIATIONS: dict[str, Settings] = {
    AS_PUBLISHED: {},
    "no resistance to rolling": {"rolling": 0.0},
    "no cohesion": {"cohesion": 0.0},
    "oil at rest": {"still": True},
    MIXED: {"grains": mixture(1 / 3)},
    "iron that saturates": {"saturation": CARBONYL_IRON.saturation},
}
"""The variants that L21 compares (section 2.4.2), a mixture, and grains that saturate, which L21 does not
have."""


@dataclass(frozen=True)
class Curve:
    """A curve: the results of settings, each from several starts, and the varied quantity.

    x : values of the varied quantity. groups : results of each setting.
    """

    x: np.ndarray
    groups: Sequence[Sequence[Result]]

    @property
    def of_starts(self) -> np.ndarray:
        """Return the shear stress of each setting and start, Pa."""
        return np.array([[shear_stress(one) for one in group] for group in self.groups])

    @property
    def stresses(self) -> list[Mean]:
        """Return the mean shear stress of each setting, Pa."""
        return [Mean.of(starts) for starts in self.of_starts]

    @property
    def values(self) -> np.ndarray:
        """Return the mean shear stress of each setting without its interval, Pa."""
        return np.array([one.value for one in self.stresses])

    @property
    def halves(self) -> np.ndarray:
        """Return half the width of the interval of each mean, Pa."""
        return np.array([one.half for one in self.stresses])

    def bingham(self) -> BinghamFit:
        """Return the mean over starts of the Bingham fluid fitted to the curve of each start.

        All settings have the same starts, so their errors are correlated. A fit to the means would treat
        these errors as independent and give a wrong uncertainty.
        """
        viscosity = Mean.of([one.plastic_viscosity.value for one in self._fits])
        yields = Mean.of(self.yield_stresses())
        return BinghamFit(*(Estimate(one.value, one.half) for one in (yields, viscosity)))

    def yield_stresses(self) -> np.ndarray:
        """Return the yield stress of the Bingham fluid fitted to the curve of each start, Pa."""
        return np.array([one.yield_stress.value for one in self._fits])

    @cached_property
    def _fits(self) -> list[BinghamFit]:
        return [fit_bingham(self.x, start) for start in self.of_starts.T]

    def power(self) -> Mean:
        """Return the mean over starts of the exponent of the power law fitted to the curve of each start."""
        x = np.log(self.x)
        return Mean.of([np.polyfit(x, np.log(start), 1)[0] for start in self.of_starts.T])


def flow_curve(
    starts: int,
    rates: Sequence[float] = RATES,
    progress: Progress | None = None,
    settings: Settings = MappingProxyType({}),
) -> Curve:
    """Return the stress by shear rate, with one world for each rate and start in one batch; settings : the
    others."""
    groups = cells([{**settings, "rate": rate} for rate in rates], starts, progress)
    return Curve(np.array([shear_rate(group[0]) for group in groups]), groups)


def by_field(starts: int, fluxes: Sequence[float] = FLUXES, progress: Progress | None = None) -> Curve:
    """Return the stress by flux density."""
    groups = cells([{**COMPARED, "flux": one} for one in fluxes], starts, progress)
    return Curve(np.array([flux(group[0]) for group in groups]), groups)


def by_part(
    starts: int, parts: Sequence[str] = tuple(VARIATIONS), progress: Progress | None = None
) -> dict[str, list[Result]]:
    """Return the results of each variant of the model, by its name."""
    return dict(
        zip(parts, cells([{**COMPARED, **VARIATIONS[one]} for one in parts], starts, progress), strict=True)
    )


def table(curve: Curve, heading: str) -> str:
    """Return a curve as CSV: varied quantity, stress, half of its interval, and the stress of each start."""
    rows: list[list[object]] = [[heading, "shear_stress_Pa", "half_interval_Pa", "of_each_start_Pa"]]
    for x, mean, starts in zip(curve.x, curve.stresses, curve.of_starts, strict=True):
        each = " ".join(f"{one:.5g}" for one in starts)
        rows.append([f"{x:.6g}", f"{mean.value:.5g}", f"{mean.half:.3g}", each])
    return csv_text(rows)


def yield_table(curve: Curve) -> str:
    """Return the yield stress of the Bingham fluid fitted to a flow curve as CSV: its mean, half of its
    interval, and the yield stress of each start."""
    each = curve.yield_stresses()
    mean = Mean.of(each)
    row = [f"{mean.value:.5g}", f"{mean.half:.3g}", " ".join(f"{one:.5g}" for one in each)]
    return csv_text([["yield_stress_Pa", "half_interval_Pa", "of_each_start_Pa"], row])


def cells(settings: Sequence[Settings], starts: int, progress: Progress | None = None) -> list[list[Result]]:
    """Return the results of cells for each setting, from a number of starts each; RunError if a run fails."""
    return grouped([scene(**one, seed=seed) for one in settings for seed in range(starts)], starts, progress)


def magnetised(settings: Settings, seed: int) -> Scene:
    """Return a cell that ends at the time at which its rafts are frozen."""
    until = settings.get("magnetising", MAGNETISING_TIME)
    return scene(**settings, seed=seed).model_copy(update={"duration": until})


def paired(one: Sequence[Result], other: Sequence[Result]) -> Mean:
    """Return the ratio of the shear stresses of two settings, a mean over their common starts."""
    ratio = [shear_stress(a) / shear_stress(b) for a, b in zip(one, other, strict=True)]
    return Mean.of(np.array(ratio))
