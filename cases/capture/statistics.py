"""Captured fractions in the case capture: sweeps over its settings, with many repeats each.

All runs of a sweep are the worlds of one batch. A run records the capture time of each particle, so the
fraction at any earlier time needs no further run. Start k is the same for all settings, except for the
changes that a setting makes. Fractions of one start are therefore not independent, and settings are compared
and averaged start by start.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from tisim import Result, Scene, run
from tisim.accuracy import Quantity
from tisim.analysis import Mean
from tisim.cases.capture import scene as capture
from tisim.cases.capture.diffusing import FREE, brownian, brownian_fraction, diffuses
from tisim.cases.case import Check, Claim
from tisim.cases.common.magnetic_fibre import SATURATION_MOMENTS
from tisim.cases.common.runs import grouped
from tisim.engine.batches import Progress
from tisim.scene.initial_state import Arrays

ANGLES = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0)
"""The swept angles of the cylinder to the field, degrees (B16 section 6.4.2)."""
ASPECTS = (5 / 3, 10 / 3, 20 / 3, 20.0)
"""The swept ratios of the cylinder's length to its diameter (B16 section 6.4.3)."""
CHECK_REPEATS = 30
"""Number of starts of each setting in the checks, as in B16 section 6.3."""

FREE_NUMBER = 4000
"""Number of particles whose diffusion without a magnet is compared with (6.24)."""
MAGNET = ("capture", "magnetic_cylinders")
"""The effects that a scene without the cylinder does not have; the uniform field exerts no force."""

Settings = Mapping[str, Any]


def results(
    settings: Sequence[Settings], repeats: int, progress: Progress | None = None
) -> list[list[Result]]:
    """Return results of capture for each setting, with the same number of starts each; RunError if one
    fails."""
    scenes = [capture.scene(**setting, seed=seed) for setting in settings for seed in range(repeats)]
    return grouped(scenes, repeats, progress)


def fraction(state: Arrays, time: float = np.inf) -> float:
    """Return the fraction of the particles captured by a time (s)."""
    at = state["captured_at"]
    return float(((at >= 0) & (at <= time)).mean())


def fractions(group: Sequence[Result], time: float = np.inf) -> np.ndarray:
    """Return the captured fraction of each start by a time (s)."""
    return np.array([fraction(result.state, time) for result in group])


def mean(group: Sequence[Result], time: float = np.inf) -> Mean:
    """Return the captured fraction by a time (s), the mean over repeats."""
    return Mean.of(fractions(group, time))


def isotropic(by_angle: np.ndarray) -> np.ndarray:
    """Return the mean over an isotropic distribution of directions for each start.

    by_angle : values at ANGLES, (angles, starts). The weights are sin(alpha).
    """
    weights = np.sin(np.radians(ANGLES))
    weights[[0, -1]] /= 2
    return np.average(by_angle, axis=0, weights=weights)


def even(by_angle: np.ndarray) -> np.ndarray:
    """Return the mean over a uniform distribution of angles for each start, as over the curves of B16 Fig.
    6.7."""
    return by_angle.mean(axis=0)


def of_orientation(repeats: int) -> Iterator[Claim]:
    """Section 6.4.2: transverse captures more than longitudinal; TOP and SIDE behave in opposite ways."""
    sizes, parts = (75, 212), ("top", "side")
    settings = [
        {"nanometres": size, "part": part, "angle": angle, "aspect": 20.0}
        for size in sizes
        for part in ("all", *parts)
        for angle in (0.0, 90.0)
    ]
    groups = iter(results(settings, repeats))
    for size in sizes:
        for part, name in (("all", "both regions"), ("top", "TOP"), ("side", "SIDE")):
            along, across = fractions(next(groups)), fractions(next(groups))
            limits = {"most": 0.0} if part == "top" else {"least": 0.0}
            gain = Mean.of(across - along)
            yield Claim(f"{size} nm, {name}: transverse minus longitudinal", gain, **limits)


def of_aspect(repeats: int) -> Iterator[Claim]:
    """Section 6.4.3: averaged over angles, shorter cylinders capture slightly more.

    The cause is the lateral surface, which is larger in long cylinders and inactive in cylinders along the
    field. Averaged over directions, and across the field, shorter cylinders capture less. In section 6.4.4,
    "relatively small" means L/D < 6.
    """
    settings = [
        {"nanometres": 125, "angle": angle, "aspect": aspect} for aspect in ASPECTS for angle in ANGLES
    ]
    by_setting = np.array([fractions(group) for group in results(settings, repeats)])
    shortest, short, medium, long = by_setting.reshape(len(ASPECTS), len(ANGLES), repeats)
    gain = shortest - long
    yield Claim("125 nm, L/D 5/3 minus 20, longitudinal", Mean.of(gain[0]), least=0.0)
    yield Claim("125 nm, L/D 5/3 minus 20, transverse", Mean.of(gain[-1]), most=0.0)
    yield Claim("125 nm, L/D 5/3 minus 20, uniform mean over angles", Mean.of(even(gain)), least=0.0)
    yield Claim("125 nm, L/D 5/3 minus 20, isotropic mean", Mean.of(isotropic(gain)), most=0.0)
    yield Claim("125 nm, L/D 10/3 minus 20, uniform mean over angles", Mean.of(even(short - long)), least=0.0)
    yield Claim(
        "125 nm, L/D 20/3 minus 20, uniform mean over angles", Mean.of(even(medium - long)), most=0.02
    )


def of_size(repeats: int) -> Iterator[Claim]:
    """Sections 6.4.2 and 6.4.4: particles of 50 nm and more are captured within 50 s, particles of 25 nm are
    not."""
    sizes = tuple(SATURATION_MOMENTS)
    settings = [{"nanometres": size, "angle": 90.0, "aspect": 5 / 3} for size in sizes]
    by_size = dict(zip(sizes, results(settings, repeats), strict=True))
    for size in sizes[1:]:
        yield Claim(f"{size} nm captured within 50 s, transverse, L/D 5/3", mean(by_size[size]), least=0.7)
    yield Claim("25 nm captured within 50 s, transverse, L/D 5/3", mean(by_size[25]), most=0.5)
    late = Mean.of([fraction(r.state) - fraction(r.state, 25.0) for r in by_size[25]])
    yield Claim("25 nm: fraction captured in the second half of the time", late, least=0.05)


def of_diffusion(repeats: int) -> Iterator[Check | Claim]:
    """Section 6.4.4: Brownian particles by region, angle and size; (6.24) without a magnet."""
    free = run(capture.scene(number=FREE_NUMBER).without(*MAGNET))
    name = "without a magnet: fraction that fulfils (6.24)"
    yield Check(
        name, float(diffuses(free.check()).mean()), FREE, 4 * np.sqrt(FREE * (1 - FREE) / FREE_NUMBER)
    )
    sizes = (25, 75, 212)
    settings = [{"nanometres": n, "angle": a, "aspect": 20.0} for n in sizes for a in ANGLES]
    groups = results(settings, repeats)
    for k, n in enumerate(sizes):
        rows = groups[k * len(ANGLES) : (k + 1) * len(ANGLES)]
        side = [np.array([brownian(one, "side").mean() for one in rows[at]]) for at in (0, -1)]
        yield Claim(
            f"{n} nm, SIDE: Brownian, longitudinal minus transverse", Mean.of(side[0] - side[1]), least=0.0
        )
        top = [brownian_fraction(row, "top") for row in rows]
        if n == 25:
            yield Claim("25 nm, TOP: Brownian, longitudinal", top[0], least=0.1)
            yield Claim("25 nm, SIDE: Brownian, transverse", Mean.of(side[1]), most=0.1)
        else:
            largest = max(top, key=lambda mean: mean.value)
            yield Claim(f"{n} nm, TOP: Brownian, largest of all angles", largest, most=0.01)
        by_angle = np.array([[brownian(one).mean() for one in row] for row in rows])
        limits = {"least": 0.1} if n == 25 else {"most": 0.1}
        yield Claim(f"{n} nm: Brownian, mean over angles (B16: below 0.1)", Mean.of(even(by_angle)), **limits)


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Return the quantity of ``tisim cost``: the captured fraction, as paths of particles are random."""
    return (Quantity("captured fraction", lambda result: fraction(result.state), random=True),)
