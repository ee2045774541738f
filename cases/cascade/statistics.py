"""Capture times of cascades, and checks of B16 section 6.4.5 under the assumptions that affect its
numbers."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from tisim import run
from tisim.analysis import Mean
from tisim.cases.capture.statistics import CHECK_REPEATS
from tisim.cases.cascade.scene import STAGE, Cascade, Orientation
from tisim.cases.case import Claim
from tisim.cases.common.runs import sound
from tisim.engine.batches import Progress

CAPTURED_SHARE = 0.9
"""Share of the particles at which the capture time is measured."""
MAX_STAGES = 1000
"""Largest number of stages of a cascade."""

PUBLISHED_TIMES = {25: (1100.0, 500.0), 125: (12.5, 5.5)}
"""The time to 90 %, s, of random and optimal cascades by radius in nm (B16 section 6.4.5)."""
SHORT, LONG = 0.1, 10.0
"""A shorter and a longer stage than 0.5 s for 125 nm, s (B16 Fig. 6.11b)."""
OFF = 0.15
"""Gap, in radii of the cylinder, at which the optimal cascades of both particle sizes take as long as in B16.
The ratio of the times of 25 nm and 125 nm rises with the gap."""
GAPS = (0.0, OFF)
RANDOM: tuple[Orientation, ...] = ("directions", "angles")
ORIENTATIONS: tuple[Orientation, ...] = ("optimal", *RANDOM)

Means = dict[Cascade, Mean]


def captured_at(
    cascades: Sequence[Cascade],
    repeats: int,
    share: float = CAPTURED_SHARE,
    seed: int = 0,
    progress: Progress | None = None,
    longest: float = np.inf,
) -> list[np.ndarray]:
    """Return the capture time of each particle, s from the start of the cascade.

    The result is one array (repeats, number) for each cascade, with sorted rows. Particles that are still
    free when ``share`` has been captured, at the end of the first stage that ends after ``longest`` (s), or
    after MAX_STAGES, have inf. Each stage of all unfinished cascades and repeats is one batch of worlds.
    RunError if a run fails.
    """
    times = [np.full((repeats, one.number), np.inf) for one in cascades]
    rows = [
        (one, times[k][repeat], np.random.default_rng([seed, k, repeat]))
        for k, one in enumerate(cascades)
        for repeat in range(repeats)
    ]
    for passed in range(MAX_STAGES):
        going = [row for row in rows if np.isfinite(row[1]).mean() < share and row[0].begin(passed) < longest]
        if not going:
            break
        results = sound(
            run([one.scene(int(np.isinf(at).sum()), generator, passed) for one, at, generator in going])
        )
        for (one, at, _), result in zip(going, results, strict=True):
            when = result.state["captured_at"]
            # Particles keep no identity between stages, so capture times fill the row from its start.
            first = int(np.isfinite(at).sum())
            caught = np.sort(when[when >= 0])
            at[first : first + len(caught)] = one.begin(passed) + caught
        if progress:
            progress(min(1.0, float(np.mean([np.isfinite(at).mean() for _, at, _ in rows])) / share))
    return times


def time_to(share: float, times: np.ndarray) -> np.ndarray:
    """Return the time at which a share of the particles was captured in each repeat: shape (repeats,), s; inf
    for never."""
    return np.asarray(times[:, int(np.ceil(share * times.shape[1])) - 1])


def means(cascades: Sequence[Cascade], repeats: int) -> Means:
    """Return the mean time to 90 % (s) of each cascade."""
    times_of = captured_at(cascades, repeats)
    return {
        one: Mean.of(time_to(CAPTURED_SHARE, times)) for one, times in zip(cascades, times_of, strict=True)
    }


def check(repeats: int = CHECK_REPEATS) -> Iterator[Claim]:
    """Yield comparisons of random and optimal cascades and of stage durations, with confidence intervals."""
    bases = [Cascade(n, STAGE[n], "optimal", gap=gap) for gap in GAPS for n in PUBLISHED_TIMES]
    short = [replace(base, aspect=5 / 3) for base in bases[:2]]
    cascades = [replace(one, orientation=how) for one in bases for how in ORIENTATIONS]
    cascades += [replace(one, orientation=how) for one in short for how in ORIENTATIONS]
    stages = [
        Cascade(125, stage, how, gap=gap)
        for gap in GAPS for stage in (SHORT, LONG) for how in ORIENTATIONS[:2]
    ]  # fmt: skip
    mean_times = means([*cascades, *stages], repeats)
    for base in bases:
        yield from of_orientation(mean_times, base)
    for base in short:
        ratio = mean_times[replace(base, orientation="directions")].over(mean_times[base])
        yield Claim(f"{base.nanometres} nm, L/D 5/3, isotropic: random over optimal", ratio, 1.0, 1.5)
    for one in stages:
        yield stage_claim(mean_times, one)


def name_of(one: Cascade) -> str:
    """Return a readable name for the size and layer of a cascade."""
    return f"{one.nanometres} nm, {one.gap:g} R off"


def of_orientation(mean_times: Means, base: Cascade) -> Iterator[Claim]:
    """Random over optimal, L/D 20: the published ratio lies between the ratios of the two kinds of random
    cascades."""
    random, best = PUBLISHED_TIMES[base.nanometres]
    name, ratio = name_of(base), random / best
    bounds = (0.75 * best, 1.25 * best) if base.gap else (0.0, 0.75 * best)
    yield Claim(f"{name}: time to 90 %, s, optimal (B16 {best:g})", mean_times[base], *bounds)
    for how, bounds in zip(RANDOM, ((1.0, 1.25 * ratio), (0.75 * ratio, 2 * ratio)), strict=True):
        ours = mean_times[replace(base, orientation=how)].over(mean_times[base])
        yield Claim(f"{name}: random over optimal, uniform {how} (B16 {ratio:.1f})", ours, *bounds)


def stage_claim(mean_times: Means, one: Cascade) -> Claim:
    """A longer stage captures more slowly; a shorter stage does so only if particles start away from the
    cylinder."""
    ours = mean_times[one].over(mean_times[replace(one, stage=STAGE[125])])
    name = f"{name_of(one)}, {one.orientation}: time to 90 % with stages of {one.stage:g} s over 0.5 s"
    worse = one.stage == LONG or one.gap > 0
    return Claim(name, ours, least=1.0) if worse else Claim(name, ours, most=1.0)
