"""Checks of packed_filter: what B16 expects of the matrix, and what single fibres predict for it."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.constants import Boltzmann, mu_0

from tisim import Result
from tisim.analysis import Mean
from tisim.cases.case import Check, Claim, Shown
from tisim.cases.common.magnetic_fibre import WATER_TEMPERATURE, WATER_VISCOSITY
from tisim.cases.common.runs import grouped
from tisim.cases.packed_filter.lone_fibre import COMPARED_RESOLUTION, lone_fibres
from tisim.cases.packed_filter.matrix import STEEL_SATURATION
from tisim.cases.packed_filter.measures import (
    SIZE_CLASSES,
    captured_by,
    captured_fraction,
    has_left,
    missing,
    penetration,
    penetration_of_layers,
    released_fraction,
    size_classes,
)
from tisim.cases.packed_filter.scene import (
    MAGNETITE_DENSITY,
    MAGNETITE_SATURATION,
    PackedFilter,
    eluted,
    filter_of,
)

CHECK_STARTS = 6
"""Packings of each setting, each with its own colloids."""
LONE_FIBRES = 64
"""Directions of single fibres."""
WAITS = (10.0, 60.0, 180.0)
"""Waiting times of static separation, s (B16 section 7.4.3)."""
SLOW, FAST = 1e-4, 4e-4
"""Superficial velocities of dynamic separation, of B16's ratio of 4 (section 7.4.2), m/s."""
CASCADE_COLLOIDS = 4000
"""Colloids around each fibre of the cascade, of which few are captured in a stage."""
OTHERS: dict[str, dict[str, Any]] = {
    "in a uniform flow": {"flow": "uniform"},
    "without mutual magnetisation": {"mutual": False},
    "of saturated fibres": {"saturated": True},
    "captured wherever they touch": {"adhering": None},
    "with steps of 0.05 D": {"longest_move": 0.05},
    "with steps of 0.01 D": {"longest_move": 0.01},
    "with 5 cells over D": {"resolution": 5.0},
    "with 12 cells over D": {"resolution": 12.0},
    "with 3 digits of the field": {"digits": 3},
}
"""Settings of the dynamic separation that are compared with the usual ones."""
SMALL_RADII = (2e-9, 1e-9)
"""Magnetic radii of colloids that fibres hardly hold, m."""
CONTACT_DIFFUSION = 0.03
"""Displacement by noise in a step of colloids that may touch, in radii (case ``concentration``)."""
DRAWN_COLLOIDS = 100_000
"""Colloids of a distribution."""
WEIGHT_FRACTION, WATER_DENSITY = 5e-5, 1000.0
"""Fraction of magnetite in B16's suspension by weight (section 7.4.3), and the density of water, kg/m^3."""
COLLOIDS = 400
OWN_COLLOIDS: dict[str, Any] = {"mean_radius": 2.95e-9, "polydispersity": 0.475, "flux": 1.5}
"""Colloids that B16 synthesised, and the field, of the dynamic separation (sections 7.4.1, 7.4.2)."""


Runs = Callable[[PackedFilter], list[Result]]
"""Results of a filter in several packings."""


def check(starts: int = CHECK_STARTS) -> Iterator[Check | Claim | Shown]:
    """Run static and dynamic separation in six packings each."""
    every: list[Result] = []

    def made(filter: PackedFilter) -> list[Result]:
        results = runs(filter, starts)
        every.extend(results)
        return results

    yield from of_colloids(filter_of("small"))
    still = filter_of("small", "static", duration=WAITS[-1], number=COLLOIDS)
    yield from of_static(still, made(still))
    yield from of_elution([made(eluted(wait, "small", number=COLLOIDS)) for wait in WAITS])
    slow = stream(SLOW)
    of_slow = made(slow)
    yield from of_dynamic(slow, of_slow, made(stream(FAST)))
    for speed, name in ((SLOW, "slow"), (FAST, "4 times as fast")):
        yield from passed(f"{name}: colloids of 2.95 nm at 1.5 T", made(stream(speed, **OWN_COLLOIDS)))
    coarse = replace(slow, resolution=COMPARED_RESOLUTION)
    yield from of_fibres(coarse, made(coarse))
    yield from of_others(of_slow, made)
    yield of_magnetisation(slow, starts)
    yield Check("colloids that are neither out, captured nor free", float(missing(every)), 0.0, 0.0)


def of_colloids(filter: PackedFilter) -> Iterator[Shown]:
    """Energies and encounters of colloids, in closed form."""
    energy = Boltzmann * WATER_TEMPERATURE
    for radius in (filter.mean_radius, *SMALL_RADII):
        name = f"energy m B / kT of a colloid of {1e9 * radius:.3g} nm in {filter.flux:g} T"
        yield Shown(name, float(moment_of(radius) * filter.flux / energy), "held by the fibre if far above 1")
    own = replace(filter, **{name: OWN_COLLOIDS[name] for name in ("mean_radius", "polydispersity")})
    for one in (filter, own):
        part = float((one.radii(DRAWN_COLLOIDS, 0) < SMALL_RADII[0]).mean())
        mean, least = 1e9 * one.mean_radius, 1e9 * SMALL_RADII[0]
        name = f"part of colloids of mean radius {mean:.3g} nm that are below {least:g} nm"
        yield Shown(name, part)
    for times in (1, 2):
        radius = times * filter.mean_radius
        coupling = mu_0 * moment_of(radius) ** 2 / (2 * np.pi * (2 * radius) ** 3) / energy
        name = f"coupling Gamma of two colloids of {1e9 * radius:.3g} nm in contact"
        yield Shown(name, float(coupling), "B16 (6.25); chains if far above 1")
    # The mean of the cubes of lognormal radii.
    volume = 4 / 3 * np.pi * filter.mean_radius**3 * (1 + filter.polydispersity**2) ** 3
    number = WEIGHT_FRACTION * WATER_DENSITY / (MAGNETITE_DENSITY * volume)
    rate = 8 * energy / (3 * WATER_VISCOSITY) * number
    yield Shown(
        "time in which a colloid of B16's suspension meets another, s", 1 / rate, "Smoluchowski (1917)"
    )
    box = filter.box()
    here = filter.number / float(np.prod(np.subtract(box.high, box.low)))
    yield Shown("mean distance of colloids here over B16's", float(np.cbrt(number / here)))
    # The time of a step is proportional to the square of the displacement by diffusion.
    moved = filter.longest_move * filter.matrix.diameter / (CONTACT_DIFFUSION * filter.mean_radius)
    yield Shown(
        "steps of colloids that touch over those here",
        moved**2,
        f"of {CONTACT_DIFFUSION:g} radii each, 6.4.6",
    )


def moment_of(radius: float) -> float:
    """Return the magnetic moment of a colloid of a magnetic radius (m), A m^2."""
    return MAGNETITE_SATURATION * 4 / 3 * np.pi * radius**3


def stream(speed: float, size: str = "small", **settings: Any) -> PackedFilter:
    """Return dynamic separation at a speed (m/s). At ``SLOW`` colloids enter for 40 s, and the field is
    switched off after 200 s; in a faster flow all times are shorter in proportion."""
    scale = SLOW / speed
    times = {"feed": 40.0 * scale, "field_end": 200.0 * scale, "duration": 400.0 * scale}
    return filter_of(size, speed=speed, **{"number": COLLOIDS, **times, **settings})


def runs(filter: PackedFilter, starts: int) -> list[Result]:
    """Return results in other packings with other colloids; RunError if a run fails."""
    (results,) = grouped([filter.with_packing(seed).scene(seed) for seed in range(starts)], starts)
    return results


def of_static(filter: PackedFilter, results: Sequence[Result]) -> Iterator[Claim | Shown]:
    """B16 7.4.3: half of the colloids are captured, the larger ones first."""
    for wait in WAITS:
        fraction = Mean.of([captured_fraction(one, wait) for one in results])
        yield Shown(f"static: captured in {wait:g} s", fraction, "B16: 0.5 to 0.6 in 10 to 180 s")
    size = {wait: np.array([free_radius(one, wait) for one in results]) for wait in (0.0, *WAITS)}
    for wait in WAITS:
        name = f"static: mean radius of the free after {wait:g} s, nm"
        yield Shown(name, Mean.of(size[wait]), "B16: about 3")
    for wait in (0.0, *WAITS):
        width = [free_width(one, wait) for one in results]
        name = f"static: standard deviation of the radius of the free over its mean, after {wait:g} s"
        yield Shown(name, Mean.of(width), "B16: falls")
    yield Claim(
        "static: mean radius of the free after 180 s over the start", Mean.of(size[WAITS[-1]] / size[0.0]),
        most=1.0,
    )  # fmt: skip
    lone, n = lone_fibres(filter, LONE_FIBRES), filter.matrix.density
    for wait in WAITS:
        free = Mean.of([1 - captured_fraction(one, wait) for one in results])
        alone = lone.passed(wait, n)
        yield Shown(f"static: free after {wait:g} s", free, f"single fibres: {alone}")


def of_elution(rinsed: Sequence[Sequence[Result]]) -> Iterator[Claim | Shown]:
    """B16 7.4.3: the water runs out with the field on. rinsed : results by waiting time."""
    during = []
    for wait, results in zip(WAITS, rinsed, strict=True):
        rested, whole = (np.array([captured_fraction(one, at) for one in results]) for at in (wait, np.inf))
        during.append(whole - rested)
        yield Shown(f"elution after {wait:g} s: captured in all", Mean.of(whole), "B16: 0.5 to 0.6")
        yield Shown(f"elution after {wait:g} s: captured during the elution", Mean.of(during[-1]))
        radius = Mean.of([float(magnetic_radii(one, has_left(one)).mean()) for one in results])
        yield Shown(f"elution after {wait:g} s: mean radius of the eluted, nm", radius, "B16: about 3")
    yield Claim(
        f"elution: captured during it after {WAITS[0]:g} s minus after {WAITS[-1]:g} s",
        Mean.of(during[0] - during[-1]), least=0.0,
    )  # fmt: skip


def free_radius(result: Result, time: float) -> float:
    """Return the mean magnetic radius of the colloids that are not captured by a time (s), nm."""
    return float(magnetic_radii(result, ~captured_by(result, time)).mean())


def free_width(result: Result, time: float) -> float:
    """Return the standard deviation of the magnetic radii of the colloids that are not captured by a time
    (s), over their mean."""
    radii = magnetic_radii(result, ~captured_by(result, time))
    return float(radii.std() / radii.mean())


def magnetic_radii(result: Result, which: np.ndarray) -> np.ndarray:
    """Return the magnetic radii of some of the colloids, nm."""
    moment = result.state["saturation_moment"][which]
    return np.asarray(1e9 * np.cbrt(3 * moment / (4 * np.pi * MAGNETITE_SATURATION)))


def of_dynamic(
    filter: PackedFilter, slow: Sequence[Result], fast: Sequence[Result]
) -> Iterator[Claim | Shown]:
    """B16 7.4.2: a flow four times as slow loses (nearly) no colloids; at most 60 % are released."""
    depth = 1e3 * filter.matrix.depth
    yield from passed(f"slow, {depth:.2g} mm", slow, "B16, in 280 mm: (nearly) none")
    yield from passed(f"4 times as fast, {depth:.2g} mm", fast, "B16, in 280 mm: some")
    passing = [np.array([penetration(one) for one in some]) for some in (slow, fast)]
    yield Claim("dynamic: passed, fast minus slow", Mean.of(passing[1] - passing[0]), least=0.0)
    freed = Mean.of([released_fraction(one) for one in slow])
    yield Claim("dynamic: released after the field is switched off", freed, 0.4, 0.7)


def passed(name: str, results: Sequence[Result], published: str = "") -> Iterator[Claim | Shown]:
    """Show the fraction of the colloids that pass, of all, the smallest and the largest, and the sizes of
    those that pass."""
    yield Shown(f"dynamic, {name}: passed", Mean.of([penetration(one) for one in results]), published)
    of_size = {}
    for kind, size in ((0, "smallest"), (SIZE_CLASSES - 1, "largest")):
        some = [penetration(one, size_classes(one.state["radius"]) == kind) for one in results]
        of_size[size] = np.array(some)
        yield Shown(f"dynamic, {name}: passed, {size} sixth", Mean.of(some))
    more = Mean.of(of_size["smallest"] - of_size["largest"])
    yield Claim(f"dynamic, {name}: passed, smallest minus largest sixth", more, least=0.0)
    radius = [float(magnetic_radii(one, one.state["capture_count"] == 0).mean()) for one in results]
    yield Shown(f"dynamic, {name}: mean radius of the passed, nm", Mean.of(radius))


def of_fibres(filter: PackedFilter, results: Sequence[Result]) -> Iterator[Shown]:
    """The matrix beside single fibres, in flows of the same resolution, and beside the cascade."""
    passing = Mean.of([penetration(one) for one in results])
    matrix, lone = filter.matrix, lone_fibres(filter, LONE_FIBRES)
    alone = lone.passed(np.inf, matrix.density * matrix.depth)
    name = f"passed, matrix with {COMPARED_RESOLUTION:g} cells over D"
    yield Shown(name, passing, f"single fibres: {alone}")
    still = filter_of("small", "static", duration=filter.stage, number=CASCADE_COLLOIDS)
    stages = matrix.depth * matrix.density ** (1 / 3)
    cascade = lone_fibres(still, LONE_FIBRES).passed(np.inf, matrix.density, stages)
    yield Shown(name, passing, f"cascade: {cascade}")


def of_others(results: Sequence[Result], made: Runs) -> Iterator[Shown]:
    """The matrix beside other models of it, and beside two layers of it."""
    passing = np.array([penetration(one) for one in results])
    for name, setting in OTHERS.items():
        other = np.array([penetration(one) for one in made(stream(SLOW, **setting))])
        yield Shown(f"passed, {name}, minus matrix", Mean.of(other - passing))
    for layers in (2, 4):
        extrapolated = np.array([penetration_of_layers(one, layers) for one in results])
        twice = np.array([penetration(one) for one in made(stream(SLOW, layers=layers))])
        yield Shown(f"passed, {layers} layers", Mean.of(twice), f"from one: {Mean.of(extrapolated)}")
        yield Shown(f"passed, {layers} layers, minus extrapolated from one", Mean.of(twice - extrapolated))


def of_magnetisation(filter: PackedFilter, starts: int) -> Shown:
    """The change of the magnetisation of fibres by their neighbours (B16 5.6), over saturation."""
    change = []
    for seed in range(starts):
        packed = filter.with_packing(seed)
        both, alone = (
            np.array([one.magnetisation for one in made.magnets()[: filter.matrix.number]])
            for made in (packed, replace(packed, mutual=False))
        )
        change.append(float(np.linalg.norm(both - alone, axis=1).mean()) / STEEL_SATURATION)
    name = "mean change of the magnetisation of a fibre by the others, over saturation"
    return Shown(name, Mean.of(change))
