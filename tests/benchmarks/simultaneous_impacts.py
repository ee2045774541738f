"""The outcome of impacts on one grain in the same instant, which are resolved one after another.

python tests/benchmarks/simultaneous_impacts.py

Equal grains close in on one in the middle, which would stay at rest by symmetry. For each arrangement, and
each restitution of the first impact, the table has: the speed of the middle grain and the sum of all
velocities, over the approach speed; the remaining part of the energy, and e^2, which would remain if all
impulses acted at once; and the largest difference to the velocities if each grain arrives 1e-12 s after
another. (Six grains around one touch each other, so several orders are possible.)
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

RINGS = {"two from both sides": 2, "a cross of four": 4, "a ring of six": 6}
RESTITUTION = (1.0, 0.9, 0.5, 0.1)
SPEED, RADIUS, DENSITY, DT = 2.0, 1e-3, 2000.0, 1e-9


def ring(number, restitution, delay=0.0):
    """Grains around one that they just touch; they arrive at intervals of ``delay`` (s), last one first."""
    from tests.scenes import scene
    from tisim.effects import Impact

    angle = 2 * np.pi * np.arange(number) / number
    out = np.stack([np.cos(angle), np.sin(angle), np.zeros(number)], axis=1)
    # The last grain arrives first, as pairs due in the same instant are resolved in that order.
    late = delay * np.arange(number)[::-1, None]
    place = 2 * RADIUS * (1 - 1e-7) * out + SPEED * late * out
    # Z04 (4.14): e = 1 - v / v*. v is half of the approach speed, v* the speed at which two equal grains
    # bond.
    critical = SPEED / 2 / max(1 - restitution, 1e-12)
    hardness = critical**2 * 2 * DENSITY / 3
    return scene(
        np.vstack([[[0, 0, 0]], place]),
        np.vstack([[[0, 0, 0]], -SPEED * out]),
        (Impact(hardness=hardness),),
        radius=RADIUS,
        density=DENSITY,
        dt=DT,
        steps=20_000,
    )


def outcome(scenes):
    """Final velocities over the approach speed, by id. Shape (scenes, grains, 3)."""
    from tests.scenes import by_id, simulate

    results = simulate(scenes, worlds=len(scenes), capacity=8)
    assert all(result.status.ok for result in results)
    return [by_id(result)["velocity"] / SPEED for result in results]


def main() -> None:
    """Print the table."""
    cases = [(name, e) for name in RINGS for e in RESTITUTION]
    delays = (0.0, 1e-12)
    outcomes = outcome([ring(RINGS[name], e, delay) for name, e in cases for delay in delays])
    print("arrangement          e     middle    momentum  energy  e^2     from one by one")
    for k, (name, e) in enumerate(cases):
        tie, near = outcomes[2 * k : 2 * k + 2]
        energy = (tie**2).sum() / RINGS[name]
        momentum = np.linalg.norm(tie.sum(axis=0))
        limit = f"{np.abs(tie - near).max():.1e}" if RINGS[name] < 6 else "-"
        print(
            f"{name:20s} {e:.1f}   {np.linalg.norm(tie[0]):.1e}   {momentum:.1e}   "
            f"{energy:.3f}   {e * e:.3f}      {limit}"
        )


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[2]))
    main()
