"""What the sheared cell must show: balances that hold exactly, and what L21 says of stress and chains."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from cases.case import Check
from cases.mrf_shear import published
from cases.mrf_shear.flow_curve import COMPARED, VARIATIONS, Curve
from cases.mrf_shear.measures import order, raft_force
from cases.mrf_shear.runs import cells, paired
from cases.mrf_shear.scene import LOWER, RATES, UPPER
from cases.statistics import Claim, Mean
from tisim import Result

CHECK_STARTS = 3
"""Each setting is run from so many starts."""
HALF_FIELD = published.FLUX / 2
BALANCE = 0.1
"""Forces on the two rafts balance to this part: free grains are dragged, and gain momentum."""

YIELD_BOUNDS = (0.3, 3.0)
"""A cell of seven diameters between rafts is to have the measured yield stress up to this factor."""
SAID = {
    "no resistance to rolling": ("reduced most", (0.0, 1.2)),
    "no cohesion": ("slightly increased", (0.8, 1.3)),
    "oil at rest": ("slightly increased", (0.7, 1.5)),
    "iron that saturates": ("not tried", (0.2, 1.0)),
    "a third of small grains": ("1.13 measured, 1.28 simulated", (0.7, 2.0)),
}
"""What L21 says of each variant, and bounds of the ratio here."""


def check() -> Iterator[Check | Claim]:
    """Yield each number as it is known."""
    rates = [{"rate": rate} for rate in RATES]
    settings = [
        *rates,
        {**COMPARED, "flux": HALF_FIELD},
        *({**COMPARED, **one} for one in VARIATIONS.values()),
    ]
    groups = cells(settings, CHECK_STARTS)
    curve = Curve(np.array([one["rate"] for one in rates]), groups[: len(rates)])
    weak, parts = groups[len(rates)], dict(zip(VARIATIONS, groups[len(rates) + 1 :], strict=True))
    whole = parts[next(iter(VARIATIONS))]
    yield from balances(whole)
    yield from chains(whole)
    yield from flows(curve, whole, weak)
    yield from compared(parts, whole)


def balances(results: Sequence[Result]) -> Iterator[Check]:
    """Yield that what drags one raft back drags the other as much: drag and inertia of what is between them
    are little beside it."""
    forces = np.array([[raft_force(one.state, group)[0] for group in (LOWER, UPPER)] for one in results])
    off = float(forces.sum() / np.abs(forces).sum())
    yield Check("forces on both rafts along the flow: sum over that of sizes", off, 0.0, BALANCE)


def chains(results: Sequence[Result]) -> Iterator[Claim]:
    """Yield that grains are in chains along the field, which are several grains thick."""
    orders = [order(one.state, one.scene.domain) for one in results]
    name = "sheared chains: mean of (3 cos^2 - 1)/2 of contacts to the field"
    yield Claim(name, Mean.of([one.alignment for one in orders]), 0.0)
    yield Claim("the same: contacts of a grain", Mean.of([one.contacts for one in orders]), 3.0, 6.0)


def flows(curve: Curve, whole: Sequence[Result], weak: Sequence[Result]) -> Iterator[Claim]:
    """Yield the yield stress, that it is most of the stress, and how the stress grows with the field."""
    fit, measured = curve.bingham(), published.MEASURED_YIELD["00:100"]
    name = f"Bingham yield stress at 0.6 T over that measured, {1e-3 * measured:g} kPa"
    yield Claim(name, Mean(*fit.yield_stress).over(Mean(measured, 0.0)), *YIELD_BOUNDS)
    viscous = Mean(*fit.plastic_viscosity).over(Mean(curve.values[-1] / curve.x[-1], 0.0))
    yield Claim("the same: viscous part of the stress at the fastest rate", viscous, most=0.5)
    yield Claim("stress at 0.6 T over that at 0.3 T", paired(whole, weak), 2.0, 6.0)


def compared(parts: Mapping[str, Sequence[Result]], whole: Sequence[Result]) -> Iterator[Claim]:
    """Yield what each part of the model does to the stress, beside what L21 says of it (section 2.4.2)."""
    for name, (says, bounds) in SAID.items():
        yield Claim(
            f"stress, {name}, over that of the whole model; L21: {says}", paired(parts[name], whole), *bounds
        )
