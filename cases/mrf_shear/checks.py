"""Checks of the sheared cell: balances that hold exactly, and L21's findings on stress and chains.

The governing numbers, in closed form, show that faster shear than L21's is still quasi-static.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from scipy.constants import mu_0

from tisim import Result
from tisim.analysis import Mean
from tisim.cases.case import Check, Claim, Shown
from tisim.cases.common.runs import overlap
from tisim.cases.common.two_spheres import attraction, sphere_mass
from tisim.cases.mrf_shear import published
from tisim.cases.mrf_shear.flow_curve import AS_PUBLISHED, COMPARED, MIXED, VARIATIONS, Curve, cells, paired
from tisim.cases.mrf_shear.measures import magnetisation, magnetised_part, order, raft_force
from tisim.cases.mrf_shear.scene import DENSITY, LARGE_RADIUS, LOWER, RATES, UPPER
from tisim.effects import CARBONYL_IRON

CHECK_STARTS = 3
"""Number of starts of each setting."""
HALF_FIELD = published.FLUX / 2
BALANCE = 0.1
"""Largest relative imbalance of the forces on the two rafts; it arises from the drag and the momentum of free
grains."""

YIELD_BOUNDS = (0.5, 2.0)
"""Bounds of the ratio of simulated and measured yield stress, for a cell of seven diameters between rafts."""
SAID = {
    "no resistance to rolling": "reduced most",
    "no cohesion": "slightly increased",
    "oil at rest": "slightly increased",
    MIXED: "33:67, {:.2f} measured, {:.2f} simulated".format(
        *(one["33:67"] / one["00:100"] for one in (published.MEASURED_YIELD, published.SIMULATED_YIELD))
    ),
}
"""L21's statement on each variant."""
SATURATES = "iron that saturates"
"""A variant that is not in L21."""

DIAMETER = 2 * LARGE_RADIUS
"""Diameter of the large grains, m."""


def check() -> Iterator[Check | Claim | Shown]:
    """Yield each number when it is known."""
    yield from regime()
    rates = [{"rate": rate} for rate in RATES]
    settings = [
        *rates,
        {**COMPARED, "flux": HALF_FIELD},
        *({**COMPARED, **one} for one in VARIATIONS.values()),
    ]
    groups = cells(settings, CHECK_STARTS)
    curve = Curve(np.array([one["rate"] for one in rates]), groups[: len(rates)])
    weak, parts = groups[len(rates)], dict(zip(VARIATIONS, groups[len(rates) + 1 :], strict=True))
    whole = parts[AS_PUBLISHED]
    yield from balances(whole)
    yield from chains(whole)
    yield from as_magnetised(whole)
    yield from flows(curve, whole, weak)
    yield from compared(parts, whole)


def balances(results: Sequence[Result]) -> Iterator[Check]:
    """Yield the balance of the forces on the rafts; drag and inertia of the grains between them are small."""
    forces = np.array([[raft_force(one, group)[0] for group in (LOWER, UPPER)] for one in results])
    off = forces.sum(axis=1) / np.abs(forces).sum(axis=1)
    name = "forces on both rafts along the flow: sum over sum of magnitudes, largest of all starts"
    yield Check(name, float(np.abs(off).max()), 0.0, BALANCE)


def chains(results: Sequence[Result]) -> Iterator[Claim]:
    """Yield that grains form chains along the field, which are several grains thick."""
    orders = [order(one.state, one.scene.domain) for one in results]
    name = "sheared chains: mean of (3 cos^2 - 1)/2 of contacts to the field"
    yield Claim(name, Mean.of([one.alignment for one in orders]), 0.0)
    yield Claim("sheared chains: contacts of a grain", Mean.of([one.contacts for one in orders]), 3.0, 6.0)


def as_magnetised(results: Sequence[Result]) -> Iterator[Shown]:
    """Yield the largest overlap of grains, and their moment relative to a single grain in the field."""
    yield Shown("sheared chains: largest overlap over a radius", Mean.of([overlap(one) for one in results]))
    name = "sheared chains: moment of a grain over moment of a single one"
    yield Shown(name, Mean.of([magnetised_part(one) for one in results]))


def flows(curve: Curve, whole: Sequence[Result], weak: Sequence[Result]) -> Iterator[Claim | Shown]:
    """Yield the yield stress, its share of the total stress, and the growth of the stress with the field."""
    fit, measured = curve.bingham(), published.MEASURED_YIELD["00:100"]
    simulated, spread = published.SIMULATED_YIELD["00:100"], published.SEED_SPREAD
    theirs = f"{1e-3 * measured:g} measured; L21 {1e-3 * simulated:g}, by seed {spread:.1%}"
    yields = Mean(*(1e-3 * one for one in fit.yield_stress))
    yield Shown("Bingham yield stress at 0.6 T, kPa", yields, theirs)
    name = f"Bingham yield stress at 0.6 T over the measured {1e-3 * measured:g} kPa"
    yield Claim(name, Mean(*fit.yield_stress).over(Mean(measured, 0.0)), *YIELD_BOUNDS)
    viscous = Mean(*fit.plastic_viscosity).over(Mean(curve.values[-1] / curve.x[-1], 0.0))
    yield Claim("Bingham fit: viscous part of the stress at the highest rate", viscous, most=0.5)
    yield Claim("stress at 0.6 T over stress at 0.3 T", paired(whole, weak), 2.0, 6.0)


def compared(parts: Mapping[str, Sequence[Result]], whole: Sequence[Result]) -> Iterator[Claim | Shown]:
    """Yield the effect of each part of the model on the stress, with L21's statement on it (section
    2.4.2)."""
    ratio = {name: paired(parts[name], whole) for name in (*SAID, SATURATES)}
    for name, says in SAID.items():
        yield Shown(f"stress, {name}, over stress of the whole model", ratio[name], f"L21: {says}")
    yield Claim(f"stress, {SATURATES}, over stress of the whole model", ratio[SATURATES], most=1.0)


def mason_number(rate: float, flux: float) -> float:
    """Return the Mason number, Mn = 8 eta rate mu_0 / B^2: the ratio of drag in a shear flow to magnetic
    forces.

    Other authors define it with other factors.
    """
    return 8 * published.OIL_VISCOSITY * rate * mu_0 / flux**2


def stokes_time() -> float:
    """Return the time in which oil stops a grain, m / (6 pi eta R) = 2 rho R^2 / (9 eta), s."""
    return 2 * DENSITY * LARGE_RADIUS**2 / (9 * published.OIL_VISCOSITY)


def approach_time(flux: float) -> float:
    """Return the time (s) in which the attraction of two grains in line moves one of them by its radius: (2 R
    m / F)^(1/2).

    The attraction is that at contact.
    """
    force = attraction(DIAMETER, magnetisation(flux))
    return float(np.sqrt(2 * LARGE_RADIUS * sphere_mass(DIAMETER, DENSITY) / force))


def regime() -> Iterator[Shown]:
    """Yield the governing numbers of grains at 0.6 T, with the moments of the external field alone."""
    flux = published.FLUX
    for rate in (RATES[0], RATES[-1]):
        yield Shown(f"Mason number at {rate:g} 1/s", mason_number(rate, flux))
    force = attraction(DIAMETER, magnetisation(flux))
    yield Shown("attraction of two touching grains in line, uN", 1e6 * force)
    yield Shown("time in which it moves a grain by a radius, us", 1e6 * approach_time(flux))
    yield Shown("time in which oil stops a grain, us", 1e6 * stokes_time())
    yield Shown(f"duration of a strain of 1 at {RATES[-1]:g} 1/s, us", 1e6 / RATES[-1])
    saturated = f"iron saturates at {1e-6 * CARBONYL_IRON.saturation:.2f}"
    yield Shown("magnetisation of a single grain, MA/m", 1e-6 * magnetisation(flux), saturated)
