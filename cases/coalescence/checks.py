"""Checks of coalescing clouds: findings of L21 that a copy with few grains reproduces, and relations that
hold exactly."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from tisim.analysis import Mean
from tisim.cases.case import Check, Claim, Shown
from tisim.cases.coalescence import published
from tisim.cases.coalescence.regime import COMPARED, random_moment, regime
from tisim.cases.coalescence.runs import SEEDS, CloudRun, clouds, of_magnetisation
from tisim.cases.coalescence.scene import DEFAULT, scene
from tisim.cases.common.rubble_pile import critical_spin, mean_density

ROUNDING = 1e-11
"""Largest change of a momentum, relative to the sum of its magnitudes over the grains."""
GAINED = 1e-4
"""Largest rise of kinetic plus gravitational energy, relative to the gravitational energy; contacts release
stored energy."""
LOOSER = 1.0
"""Least difference in density that counts as less dense, kg/m^3; equal densities do not support the claim."""


def check(seeds: int = SEEDS) -> Iterator[Check | Claim | Shown]:
    """Yield the governing numbers of clouds, and the checks of clouds from several starts."""
    yield from regime()
    yield from of_the_cloud()
    runs = clouds(seeds, **DEFAULT)
    yield from of_conservation(runs)
    yield from of_agglomeration(runs)
    yield from of_structure(runs)


def of_the_cloud() -> Iterator[Check]:
    """Yield the critical rotation of L21's cloud from its second moments, and from a ball of its density."""
    for d in published.DIAMETERS:
        start = scene(diameter=d, rotation=published.ROTATIONS[1], magnetisation=0.0).start()
        mass, place = start["mass"][1:], start["position"][1:]
        # The radius of the ball with the second moments of the lattice.
        radius = np.sqrt(5 / 3 * np.average((place**2).sum(axis=1), weights=mass))
        density = mass.sum() / (4 / 3 * np.pi * radius**3)
        turns = critical_spin(density)
        expected = critical_spin(mean_density(d, published.SPACING, published.DENSITY))
        yield Check(f"{1e2 * d:g} cm: critical spin of the cloud, urad/s", 1e6 * turns, 1e6 * expected, 2.0)


def of_conservation(runs: Sequence[CloudRun]) -> Iterator[Check]:
    """Yield the conservation of momenta under gravity, contacts and magnetism, and the loss of energy."""
    momentum = max(_off(one, "momentum") for one in runs)
    yield Check("momentum: largest change over the sum of magnitudes", momentum, 0.0, ROUNDING)
    angular = max(_off(one, "angular") for one in runs)
    yield Check("angular momentum: largest change over the sum of magnitudes", angular, 0.0, ROUNDING)
    gained = max(_gained(one) for one in of_magnetisation(runs, 0.0))
    yield Check("0 A/m: largest gain of energy over gravitational energy", gained, 0.0, GAINED)


def _off(run: CloudRun, name: str) -> float:
    """Return the largest change of a momentum since the start over the initial sum of its magnitudes."""
    values = np.array([getattr(one, name) for one in run.conserved])
    return float(np.linalg.norm(values - values[0], axis=1).max() / getattr(run.conserved[0], f"{name}_sum"))


def _gained(run: CloudRun) -> float:
    """Return the largest rise of energy between samples, divided by the gravitational energy."""
    energy = np.array([one.energy for one in run.conserved])
    return float(np.diff(energy).max(initial=0.0) / abs(run.conserved[-1].gravity))


def of_agglomeration(runs: Sequence[CloudRun]) -> Iterator[Claim | Shown]:
    """Yield the rate of agglomeration, which increases with magnetisation (L21 section 4.2.2.1)."""
    for m in published.MAGNETISATIONS:
        group, theirs = of_magnetisation(runs, m), published.BOUND[m]
        for name, least, part in (("two or more", "some", theirs.some), ("over ten", "many", theirs.many)):
            mean = Mean.of([getattr(one.at(COMPARED), least) for one in group])
            beside = f"L21, 50 cm: {part:.3g}"
            yield Shown(f"{m:g} A/m: fraction of outside grains in clusters of {name}", mean, beside)
        # In a small cloud, clumps have joined the asteroid by that time.
        most = Mean.of([max(one.clumped for one in run.agglomerations) for run in group])
        yield Shown(f"{m:g} A/m: largest fraction of all grains in outside clusters of over ten", most)
    # A difference of at least one grain is required; equality does not support the claim.
    grain = 1 / len(runs[0].end["mass"])
    yield _difference(
        "fraction of all grains in clusters, 1190 minus 0 A/m",
        runs,
        lambda one: one.at(COMPARED).bound,
        least=grain,
    )
    yield _difference(
        "fraction of outside grains in clusters, 1190 minus 0 A/m",
        runs,
        lambda one: one.at(COMPARED).some,
        least=grain,
    )
    weak = _difference(
        "fraction of all grains in clusters, 119 minus 0 A/m",
        runs,
        lambda one: one.at(COMPARED).bound,
        of=119.0,
    )
    yield Shown(weak.name, weak.mean)
    for m in published.MAGNETISATIONS[1:]:
        group = of_magnetisation(runs, m)
        for when, chains in (
            (f"at {COMPARED:.0f} s", [one.at(COMPARED).chain for one in group]),
            ("at the end", [one.agglomerations[-1].chain for one in group]),
        ):
            yield Shown(f"{m:g} A/m: chain length in grains, {when}", Mean.of(chains))


def of_structure(runs: Sequence[CloudRun]) -> Iterator[Claim | Shown]:
    """Yield the density, elongation and bulk magnetisation of asteroids at the end.

    The bulk magnetisation is compared with the magnetisation of the grains (L21 sections 4.2.2.2, 4.2.2.3,
    4.6).
    """
    for m in published.MAGNETISATIONS:
        asteroids = [one.asteroid for one in of_magnetisation(runs, m)]
        yield Shown(f"{m:g} A/m: density, kg/m^3", Mean.of([one.density for one in asteroids]))
        axes = published.AXES[published.DIAMETERS[1], published.ROTATIONS[1], m]
        beside = f"L21: {axes[0] / axes[2]:.2f}"
        name = f"{m:g} A/m: longest axis over shortest"
        yield Shown(name, Mean.of([one.elongation for one in asteroids]), beside)
    yield _difference(
        "density, 1190 minus 0 A/m, kg/m^3", runs, lambda one: one.asteroid.density, most=-LOOSER
    )
    grains = (runs[0].end["radius"] / runs[0].end["radius"].min()) ** 3
    number, seed = int((grains == 1).sum()), float(grains[grains > 1].sum())
    random = random_moment(number, seed) / (number + seed)
    for m in published.MAGNETISATIONS[1:]:
        group, theirs = of_magnetisation(runs, m), published.BULK[m]
        name = f"{m:g} A/m: moment over the sum of the grains' moments"
        beside = f"random directions: {random:.2g}; L21, 50 cm: {theirs.aligned:.2g}"
        yield Shown(name, Mean.of([one.asteroid.aligned for one in group]), beside)
        name, beside = f"{m:g} A/m: bulk magnetisation, A/m", f"L21, 50 cm: {theirs.magnetisation:.2g}"
        yield Shown(name, Mean.of([m * one.magnetised_part for one in group]), beside)
    strong = of_magnetisation(runs, published.MAGNETISATIONS[-1])
    bulk = [published.MAGNETISATIONS[-1] * one.magnetised_part for one in strong]
    yield Claim(
        "1190 A/m: bulk magnetisation, A/m (L21: below Gaspra's)", Mean.of(bulk), most=published.GASPRA
    )


def _difference(
    name: str,
    runs: Sequence[CloudRun],
    value: Callable[[CloudRun], float],
    of: float = published.MAGNETISATIONS[-1],
    **bounds: float,
) -> Claim:
    """Return the claim on the difference between magnetised and unmagnetised clouds from the same starts."""
    pairs = zip(of_magnetisation(runs, of), of_magnetisation(runs, 0.0), strict=True)
    return Claim(name, Mean.of([value(a) - value(b) for a, b in pairs]), **bounds)
