"""Checks of spun-up piles: findings of L21 that piles of few grains reproduce, and relations that hold
exactly."""

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from tisim.analysis import Mean
from tisim.cases.case import Check, Claim, Shown
from tisim.cases.coalescence import published
from tisim.cases.coalescence.regime import impact_depth, magnetic_depth
from tisim.cases.coalescence.scene import scale_of, step
from tisim.cases.common.rubble_pile import Asteroid, Conserved, critical_spin, free_fall, mean_density
from tisim.cases.spin_up.scene import DEFAULT, NUMBERS
from tisim.cases.spin_up.stages import (
    DEFORMATION,
    DEFORMED_SHAPES,
    DISRUPTION,
    POROSITY,
    QUICK,
    RATES,
    SEEDS,
    SpinUp,
    spin_ups,
)

ROUNDING = 1e-11
"""Largest change of a momentum, relative to the sum of its magnitudes over the grains."""
LATER = 0.5e6 * RATES[0]
"""Least difference in spin that counts as breaking later, urad/s: half a step; equality does not support the
claim."""


def check(seeds: int = SEEDS) -> Iterator[Check | Claim | Shown]:
    """Yield the governing numbers of piles, and the checks of piles from several starts."""
    yield from regime()
    runs = spin_ups(seeds, **DEFAULT)
    yield from of_conservation(runs)
    yield from of_spins(runs)
    yield from of_shapes(runs)
    yield from of_densities(runs)


def of_conservation(runs: Sequence[SpinUp]) -> Iterator[Check]:
    """Yield that the momentum of all grains stays 0 when they are spun up."""
    off = max(
        float(np.linalg.norm(c.momentum)) / c.momentum_sum
        for one in runs
        for c in (Conserved.of(step.state) for step in one.steps)
    )
    yield Check("momentum, over the sum of magnitudes", off, 0.0, ROUNDING)


def of_spins(runs: Sequence[SpinUp]) -> Iterator[Claim | Shown]:
    """Yield the spins at which piles deform and break, and their density before."""
    for m in published.MAGNETISATIONS:
        group = [one for one in runs if one.magnetisation == m]
        density = Mean.of([one.steps[0].asteroid.density for one in group])
        yield Shown(f"{m:g} A/m: density at rest, kg/m^3", density)
        critical = Mean.of([1e6 * critical_spin(one.steps[0].asteroid.density) for one in group])
        yield Shown(f"{m:g} A/m: critical spin at this density, urad/s", critical)
        for name, theirs, value in (
            ("deforms", DEFORMATION[m], "deformation"), ("breaks", DISRUPTION[m], "disruption"),
        ):  # fmt: skip
            mean = Mean.of(at_least([getattr(one, value) for one in group]))
            yield Shown(f"{m:g} A/m: spin at which it {name}, urad/s", mean, f"L21: {1e6 * theirs:.0f}")
    plain, strong = (
        at_least([one.disruption for one in runs if one.magnetisation == m])
        for m in (published.MAGNETISATIONS[0], published.MAGNETISATIONS[-1])
    )
    yield Claim(
        "spin at which it breaks, 1190 minus 0 A/m, urad/s (L21: 100)", Mean.of(strong - plain), least=LATER
    )


MEASURES: Mapping[str, Callable[[Asteroid], float]] = {
    "width over height": lambda pile: pile.flattening,
    "longest over shortest axis": lambda pile: pile.elongation,
    "intermediate over shortest axis": lambda pile: float(
        pile.ellipsoid.semi_axes[1] / pile.ellipsoid.semi_axes[2]
    ),
}
"""Measures of the shape of a pile: from second moments across and along the spin, and from the axes of its
bounding ellipsoid."""


def of_shapes(runs: Sequence[SpinUp]) -> Iterator[Shown]:
    """Yield the shapes of piles at the spin at which L21's piles deformed, beside its widths (section 4.3.2).

    Small piles are not round at rest. Each pile is therefore also compared with itself at rest.
    """
    for m, spin in DEFORMATION.items():
        group = [one for one in runs if one.magnetisation == m]
        for name, theirs in DEFORMED_SHAPES[m].items():
            rest = np.array([MEASURES[name](one.steps[0].asteroid) for one in group])
            spun = np.array([MEASURES[name](one.at(spin).asteroid) for one in group])
            when, beside = f"{m:g} A/m, {1e6 * spin:.0f} urad/s: {name}", f"L21: {theirs:.2f}"
            yield Shown(f"{m:g} A/m, at rest: {name}", Mean.of(rest))
            yield Shown(when, Mean.of(spun), beside)
            yield Shown(f"{when}, over its value at rest", Mean.of(spun / rest), beside)


def of_densities(runs: Sequence[SpinUp]) -> Iterator[Shown]:
    """Yield the porosity of piles at rest, and their density by spin relative to rest (L21 Fig. 4.11).

    As in L21, the volume is the convex hull of the pile, or of its largest fragment.
    """
    for m in DEFORMATION:
        group = [one for one in runs if one.magnetisation == m]
        densities = np.array([[step.asteroid.density for step in one.steps] for one in group])
        beside = f"L21: {POROSITY:.3g}" if m == published.MAGNETISATIONS[-1] else ""
        yield Shown(f"{m:g} A/m: porosity at rest", Mean.of(1 - densities[:, 0] / published.DENSITY), beside)
        rates = np.array([one.rate for one in group[0].steps])
        for k in np.flatnonzero(rates > QUICK):
            ratio = Mean.of(densities[:, k] / densities[:, 0])
            yield Shown(f"{m:g} A/m, {1e6 * rates[k]:.0f} urad/s: density over density at rest", ratio)


def at_least(rates: Sequence[float]) -> np.ndarray:
    """Return angular velocities in urad/s; NaN, for no event, counts as one step after the last.

    Means of these values are therefore lower bounds.
    """
    return 1e6 * np.nan_to_num(np.asarray(rates), nan=RATES[-1] + RATES[0])


def regime() -> Iterator[Shown]:
    """Yield the governing numbers of the copy of the default size, in closed form."""
    d, softened = published.DIAMETERS[1], DEFAULT["softened"]
    scale = scale_of(DEFAULT["number"], NUMBERS[d])
    yield Shown("scale of the copy", scale)
    yield Shown("free-fall time, s", free_fall(mean_density(d, DEFAULT["spacing"], published.DENSITY)))
    yield Shown("step, s", step(d, scale, softened))
    yield Shown("overlap of an impact over a radius", impact_depth(d, scale, softened))
    depth = magnetic_depth(d, scale, published.MAGNETISATIONS[-1], softened)
    yield Shown("overlap of two grains in line over a radius, 1190 A/m", depth)
