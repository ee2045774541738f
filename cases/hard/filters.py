"""Gaps, switched fields and closed pores of filters.

Colloids of 100 nm in water near magnets along x. A captured colloid is held at the surface of a magnet as
long as a field holds it.
"""

import numpy as np
from scipy.constants import Boltzmann

from tisim import InputError, Particles, Scene, run
from tisim.analysis import particle_balance
from tisim.cases.common.runs import sound
from tisim.cases.hard.hard_case import Criterion, hard_case
from tisim.cases.hard.runs import by_id
from tisim.effects import LangevinMoment, Magnetophoresis
from tisim.geometry import Plane
from tisim.operators import Capture, Inlet, Outlet, Release
from tisim.sources import (
    Cylinder,
    MagneticCylinders,
    MagneticField,
    MagneticSpheres,
    PoreFlow,
    Sphere,
    UniformFlow,
    sample,
)
from tisim.steppers import Brownian, DriftLimit

COLLOID_RADIUS, MAGNET_RADIUS = 1e-7, 3e-6
"""Radii of colloids and magnets, m."""
STEP_OF_COLLOIDS, LONGEST_STEPS = 1e-3, 200
"""Longest step (s), and number of steps of this length."""
COLLOID_WATER = {"temperature": 298.0, "viscosity": 1e-3}
AT_ORIGIN = (0.0, 0.0, 0.0)
HELD_BY_FIELD = Capture(release=Release())


def colloids(position, balls, *effects, field=0.0, off=1e30, flow=0.0, longest=STEP_OF_COLLOIDS):
    """Return a scene of colloids near balls that are magnetised along x while a field (T) is on.

    off : end of the field, s. flow : velocity of the water along z, m/s. longest : step, s.
    """
    position = np.asarray(position, float)
    magnetisation = (1e6 if field else 0.0, 0.0, 0.0)
    return Scene(
        particles=Particles(
            position=position,
            velocity=np.zeros_like(position),
            radius=COLLOID_RADIUS,
            density=1000.0,
            quantities={"saturation_moment": 2e-16, "domain_moment": 1e-19},
        ),
        effects=(
            MagneticField(constant=(field, 0.0, 0.0), end=off),
            MagneticSpheres(
                spheres=[
                    {"centre": c, "radius": MAGNET_RADIUS, "magnetisation": magnetisation} for c in balls
                ],
                end=off,
            ),
            UniformFlow(velocity=(0.0, 0.0, flow)),
            LangevinMoment(temperature=COLLOID_WATER["temperature"]),
            Magnetophoresis(),
            *effects,
        ),
        stepper=Brownian(**COLLOID_WATER, control=DriftLimit(longest=longest, shortest=1e-12, drift=1.0)),
        duration=LONGEST_STEPS * STEP_OF_COLLOIDS,
    )


def ended(*scenes):
    """Return the results of scenes, and the number of colloids that are missing in their balances."""
    results = sound(run(list(scenes)))
    lost = sum(abs(particle_balance(one.work, one.state).missing) for one in results)
    return results, lost


def around(distance):
    """Return places (m) at a distance (m) from the origin in random directions."""
    away = np.random.default_rng(1).normal(size=(100, 3))
    return distance * away / np.linalg.norm(away, axis=1, keepdims=True)


@hard_case(
    "A field draws colloids into gaps that are narrower than they are, of 1.9 to 0.5 radii, and between "
    "magnets that touch and that overlap.",
    Criterion("least part of the colloids that is captured", least=0.9),
    Criterion("overlap of a colloid with a magnet, in radii", 1e-9),
    Criterion("captured colloids farther than 0.001 radii from every magnet", 0, 0),
    Criterion("captures without a field", 0, 0),
    Criterion("displacement without a field, over its bound by diffusion", 1),
    Criterion("colloids missing", 0, 0),
)
def gap_narrower_than_a_colloid():
    """They start from where they touch both magnets to 5 radii farther out. Without a field nothing holds
    them."""
    numbers = []
    for gap in (1.9, 1.5, 0.5, 0.0, -0.1):
        apart = MAGNET_RADIUS + gap * COLLOID_RADIUS / 2
        balls = np.array([(-apart, 0.0, 0.0), (apart, 0.0, 0.0)])
        start = np.zeros((60, 3))
        start[:, 1] = (
            np.sqrt((MAGNET_RADIUS + COLLOID_RADIUS) ** 2 - apart**2)
            + np.linspace(0.0, 5.0, 60) * COLLOID_RADIUS
        )
        (caught, free), lost = ended(
            colloids(start, balls.tolist(), HELD_BY_FIELD, field=0.5),
            colloids(start, balls.tolist(), HELD_BY_FIELD),
        )
        held = caught.state["captured_by"] >= 0
        clear = [
            (np.linalg.norm(one.state["position"][:, None] - balls, axis=2).min(axis=1) - MAGNET_RADIUS)
            / COLLOID_RADIUS
            - 1
            for one in (caught, free)
        ]
        diffusivity = (
            Boltzmann
            * COLLOID_WATER["temperature"]
            / (6 * np.pi * COLLOID_WATER["viscosity"] * COLLOID_RADIUS)
        )
        bound = 2 * COLLOID_RADIUS + 4 * np.sqrt(6 * diffusivity * free.time)
        moved = np.linalg.norm(by_id(free.state)["position"] - start, axis=1).max()
        numbers.append((
            -held.mean(), -min(one.min() for one in clear), np.count_nonzero(clear[0][held] > 1e-3),
            free.work["captures"], moved / bound, lost,
        ))  # fmt: skip
    most = np.max(numbers, axis=0)
    return -most[0], *most[1:]


@hard_case(
    "The field ends within a step, also within the first one, in which colloids are captured in shorter "
    "steps of their own.",
    Criterion("least number of captures", least=20),
    Criterion("captured colloids that are not released", 0, 0),
    Criterion("time of releases from the end of the step, relative error", 1e-12),
    Criterion("colloids missing", 0, 0),
)
def field_switched_within_a_step():
    """In steps of 1 ms and of an eighth of it."""
    start, off, blink = (
        around(MAGNET_RADIUS + 2 * COLLOID_RADIUS),
        100.37 * STEP_OF_COLLOIDS,
        0.4 * STEP_OF_COLLOIDS,
    )
    settings = ((off, STEP_OF_COLLOIDS), (off, STEP_OF_COLLOIDS / 8), (blink, STEP_OF_COLLOIDS))
    results, lost = ended(
        *(
            colloids(start, [AT_ORIGIN], HELD_BY_FIELD, field=0.5, off=end, longest=step)
            for end, step in settings
        )
    )
    captures, kept, late = [], [], []
    for result, (end, step) in zip(results, settings, strict=True):
        released = result.state["released_at"]
        captures.append(result.work["captures"])
        kept.append(result.work["captures"] - result.work["releases"])
        late.append(np.abs(released[released >= 0] / (np.ceil(end / step) * step) - 1).max())
    return min(captures), max(kept, key=abs), max(late), lost


@hard_case(
    "Colloids start in contact with a magnet: all are captured in the first step, half of them adhere, and "
    "the others are released together.",
    Criterion("colloids that are not captured once", 0, 0),
    Criterion("releases, less the colloids that do not adhere", 0, 0),
    Criterion("part that adheres, from 0.5, in standard deviations", 4, -4),
    Criterion("colloids missing", 0, 0),
)
def all_captured_at_once():
    """Those at the poles, which a field along x attracts."""
    start = around(MAGNET_RADIUS + 0.9 * COLLOID_RADIUS)
    start = np.concatenate([start, -start])
    start = start[np.abs(start[:, 0]) > 0.85 * MAGNET_RADIUS]
    settings = {"field": 0.5, "off": 50.5 * STEP_OF_COLLOIDS, "longest": STEP_OF_COLLOIDS / 50}
    (one,), lost = ended(colloids(start, [AT_ORIGIN], Capture(release=Release(adhering=0.5)), **settings))
    state, n = one.state, len(start)
    once = state["capture_count"] == 1
    adhere = np.count_nonzero(state["adheres"])
    return (
        n - np.count_nonzero(once),
        one.work["releases"] - (n - adhere),
        (adhere - n / 2) / np.sqrt(n / 4),
        lost,
    )


@hard_case(
    "A magnet closes the inlet; or the water flows at 1e-60 m/s, slower than any number that can be drawn.",
    Criterion("colloids that have entered", 0, 0),
    Criterion("colloids that no longer wait", 0, 0),
    Criterion("places tried for each colloid", least=10_000),
)
def closed_inlet():
    """An inlet of 2 by 2 by 0.1 um."""
    inlet = Inlet(
        low=(-1e-6, -1e-6, 0.0), high=(1e-6, 1e-6, 1e-7), direction=(0, 0, 1), end=0.01, fastest=1e-3
    )
    outlet = Outlet(planes=[Plane(point=(0, 0, 1e-4), normal=(0, 0, -1))])
    start = np.zeros((50, 3))
    results, _ = ended(
        colloids(start, [AT_ORIGIN], inlet, Capture(), outlet, flow=1e-3),
        colloids(start, [(1.0, 0.0, 0.0)], inlet, Capture(), outlet, flow=1e-60),
    )
    balances = [particle_balance(one.work, one.state) for one in results]
    return (
        max(one.entered for one in balances),
        max(50 - one.waiting for one in balances),
        min(one.state["entry_trials"].min() for one in results),
    )


@hard_case(
    "A sphere fills its periodic cell so far that the pores are closed corners; a slightly smaller one "
    "leaves narrow channels.",
    Criterion("words missing from the refusal", 0, 0),
    Criterion("permeability of the narrow channels over the area of a cell", 1e-3, 1e-5),
)
def matrix_that_lets_nothing_through():
    """Radii of 0.72 and 0.62 of the side; spheres touch their images from 0.5 on, and close at 0.7071."""

    def flow(radius):
        return PoreFlow(
            low=(0.0, 0.0, 0.0), high=(1e-3, 1e-3, 1e-3), speed=1e-4, viscosity=1e-3, cells=(24, 24, 24),
            spheres=(Sphere(centre=(5e-4, 5e-4, 5e-4), radius=radius * 1e-3),),
        )  # fmt: skip

    try:
        flow(0.72).solve()
        refusal = ""
    except InputError as fault:
        refusal = str(fault)
    missing = sum(word not in refusal for word in ("pores", "open along the pressure gradient"))
    return missing, flow(0.62).solve().permeability / 1e-6


@hard_case(
    "Forty magnetised fibres in all degrees of touching and overlapping; their field by cells, to 3 digits, "
    "at points on surfaces and within a billionth of a radius of them.",
    Criterion("field, error over its typical magnitude", 1e-3),
    Criterion("places of which the field is not finite", 0, 0),
)
def fibres_that_touch_and_overlap():
    """In a cube of 8 mm; each fibre is 0.4 mm thick and 4 mm long."""
    rng, side = np.random.default_rng(4), 8e-3
    fibres = tuple(
        Cylinder(
            centre=tuple(rng.uniform(-side / 2, side / 2, 3)), axis=tuple(rng.normal(size=3)),
            magnetisation=tuple(1e6 * rng.normal(size=3)), radius=2e-4, length=4e-3,
        )
        for _ in range(40)
    )  # fmt: skip
    chosen = rng.integers(0, len(fibres), 600)
    axis = np.array([one.direction for one in fibres])[chosen]
    across = np.cross(axis, rng.normal(size=(600, 3)))
    across /= np.linalg.norm(across, axis=1)[:, None]
    beside = 2e-4 * (1 + rng.choice([-1e-9, 0.0, 1e-9, 1e-3], (600, 1)))
    centre = np.array([one.centre for one in fibres])[chosen]
    places = centre + rng.uniform(-2e-3, 2e-3, (600, 1)) * axis + beside * across
    direct = MagneticCylinders(cylinders=fibres)
    expected, _ = sample([direct], direct.quantity, places)
    found, _ = sample([MagneticCylinders(cylinders=fibres, sum_digits=3)], direct.quantity, places)
    typical = np.median(np.linalg.norm(expected, axis=1))
    return (
        np.linalg.norm(found - expected, axis=1).max() / typical,
        np.count_nonzero(~np.isfinite(found).all(axis=1)),
    )
