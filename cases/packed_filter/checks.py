"""Checks of packed_filter: what B16 expects of the matrix, and what single fibres predict for it."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from tisim import Result
from tisim.analysis import Mean
from tisim.cases.case import Check, Claim, Shown
from tisim.cases.common.runs import grouped
from tisim.cases.packed_filter.lone_fibre import lone_fibres
from tisim.cases.packed_filter.measures import (
    SIZE_CLASSES,
    captured_by,
    captured_fraction,
    has_left,
    missing,
    penetration,
    released_fraction,
    size_classes,
)
from tisim.cases.packed_filter.scene import MAGNETITE_SATURATION, PackedFilter, eluted, filter_of

CHECK_STARTS = 6
"""Packings of each setting, each with its own colloids."""
LONE_FIBRES = 64
"""Directions of single fibres."""
WAITS = (10.0, 60.0, 180.0)
"""Waiting times of static separation, s (B16 section 7.4.3)."""
SLOW, FAST = 1e-4, 4e-4
"""Superficial velocities of dynamic separation, of B16's ratio of 4 (section 7.4.2), m/s."""
COLLOIDS = 400
OWN_COLLOIDS: dict[str, Any] = {"mean_radius": 2.95e-9, "polydispersity": 0.475, "flux": 1.5}
"""Colloids that B16 synthesised, and the field, of the dynamic separation (sections 7.4.1, 7.4.2)."""


def check(starts: int = CHECK_STARTS) -> Iterator[Check | Claim | Shown]:
    """Run static and dynamic separation in six packings each."""
    still = filter_of("small", "static", duration=WAITS[-1], number=COLLOIDS)
    rested = runs(still, starts)
    yield from of_static(still, rested)
    rinsed = [runs(eluted(wait, "small", number=COLLOIDS), starts) for wait in WAITS]
    yield from of_elution(rinsed)
    slow, fast = stream(SLOW), stream(FAST)
    of_slow, of_fast = runs(slow, starts), runs(fast, starts)
    yield from of_dynamic(slow, of_slow, of_fast)
    yield from of_fibres(slow, of_slow, starts)
    of_own = [runs(stream(speed, **OWN_COLLOIDS), starts) for speed in (SLOW, FAST)]
    for name, results in zip(("slow", "4 times as fast"), of_own, strict=True):
        passing = Mean.of([penetration(one) for one in results])
        yield Shown(f"dynamic, {name}: passed, colloids of 2.95 nm at 1.5 T", passing)
    every = [*rinsed, of_slow, of_fast, *of_own]
    lost = missing([*rested, *(one for results in every for one in results)])
    yield Check("colloids that are neither out, captured nor free", float(lost), 0.0, 0.0)


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
        radius = Mean.of([mean_magnetic_radius(one, has_left(one)) for one in results])
        yield Shown(f"elution after {wait:g} s: mean radius of the eluted, nm", radius, "B16: about 3")
    yield Claim(
        f"elution: captured during it after {WAITS[0]:g} s minus after {WAITS[-1]:g} s",
        Mean.of(during[0] - during[-1]), least=0.0,
    )  # fmt: skip


def free_radius(result: Result, time: float) -> float:
    """Return the mean magnetic radius of the colloids that are not captured by a time (s), nm."""
    return mean_magnetic_radius(result, ~captured_by(result, time))


def mean_magnetic_radius(result: Result, which: np.ndarray) -> float:
    """Return the mean magnetic radius of some of the colloids, nm."""
    moment = result.state["saturation_moment"][which]
    return float(1e9 * np.cbrt(3 * moment / (4 * np.pi * MAGNETITE_SATURATION)).mean())


def of_dynamic(
    filter: PackedFilter, slow: Sequence[Result], fast: Sequence[Result]
) -> Iterator[Claim | Shown]:
    """B16 7.4.2: a flow four times as slow loses (nearly) no colloids; at most 60 % are released."""
    depth = 1e3 * filter.matrix.depth
    passing = [np.array([penetration(one) for one in some]) for some in (slow, fast)]
    published = ("slow", "B16, in 280 mm: (nearly) none"), ("4 times as fast", "B16, in 280 mm: some")
    for (name, expected), some, results in zip(published, passing, (slow, fast), strict=True):
        yield Shown(f"dynamic, {name}: passed in {depth:.2g} mm", Mean.of(some), expected)
        for kind, size in ((0, "smallest"), (SIZE_CLASSES - 1, "largest")):
            of_size = [penetration(one, size_classes(one.state["radius"]) == kind) for one in results]
            name_of = f"dynamic, {name}: passed in {depth:.2g} mm, {size} sixth"
            yield Shown(name_of, Mean.of(of_size))
    yield Claim("dynamic: passed, fast minus slow", Mean.of(passing[1] - passing[0]), least=0.0)
    freed = Mean.of([released_fraction(one) for one in slow])
    yield Claim("dynamic: released after the field is switched off", freed, 0.4, 0.7)


def of_fibres(filter: PackedFilter, results: Sequence[Result], starts: int) -> Iterator[Claim | Shown]:
    """The matrix beside single fibres, the cascade, a uniform flow, fibres that do not magnetise each
    other, and other steps."""
    passing = np.array([penetration(one) for one in results])
    matrix, lone = filter.matrix, lone_fibres(filter, LONE_FIBRES)
    yield Shown(
        "passed, matrix",
        Mean.of(passing),
        f"single fibres: {lone.passed(np.inf, matrix.density * matrix.depth)}",
    )
    still = lone_fibres(filter_of("small", "static", duration=filter.stage, number=COLLOIDS), LONE_FIBRES)
    stages = matrix.depth * matrix.density ** (1 / 3)
    yield Shown(
        "passed, matrix", Mean.of(passing), f"cascade: {still.passed(np.inf, matrix.density, stages)}"
    )
    others: tuple[tuple[str, dict[str, Any]], ...] = (
        ("in a uniform flow", {"flow": "uniform"}),
        ("without mutual magnetisation", {"mutual": False}),
        ("of saturated fibres", {"saturated": True}),
        ("with steps of 0.05 D", {"longest_move": 0.05}),
        ("with steps of 0.01 D", {"longest_move": 0.01}),
    )
    for name, setting in others:
        other = np.array([penetration(one) for one in runs(stream(SLOW, **setting), starts)])
        yield Shown(f"passed, {name}, minus matrix", Mean.of(other - passing))
