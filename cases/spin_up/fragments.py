"""Elongation of the fragments of spun-up piles, beside L21's of 6:1 and 5:1 (sections 4.3.2 and 4.6).

    python -m tisim.cases.spin_up.fragments [--starts 10]

Piles without magnetisation and of 1190 A/m are spun up beyond the last step of L21, until all have broken.
Prints the longest axis over the shortest of each pile's most elongated fragment. It takes one to two minutes.
"""

import argparse
from collections.abc import Sequence

import numpy as np

from tisim.analysis import Mean
from tisim.cases.coalescence import published
from tisim.cases.common.rubble_pile import Asteroid, clusters_of, part
from tisim.cases.spin_up.scene import DEFAULT
from tisim.cases.spin_up.stages import SpinUp, spin_ups
from tisim.scene.initial_state import Arrays

LEAST_GRAINS = 8
"""Least number of grains of a fragment, a tenth of a pile. Two grains in a row would have an axis ratio of
two."""
FURTHER_RATES = tuple(1e-4 * k for k in range(1, 13))
"""Successive angular velocities of the pile, rad/s: three steps more than L21's."""
COMPARED_MAGNETISATIONS = (published.MAGNETISATIONS[0], published.MAGNETISATIONS[-1])
"""The magnetisations of L21's grains, A/m."""


def fragments(state: Arrays, least: int = LEAST_GRAINS) -> list[Asteroid]:
    """Return the clusters of at least this number of grains, with their bounding ellipsoids."""
    cluster = clusters_of(state)
    large = np.flatnonzero(np.bincount(cluster) >= least)
    chosen = (part(state, cluster == one) for one in large)
    return [Asteroid.of(grains) for grains in chosen]


def elongation(run: SpinUp, least: int = LEAST_GRAINS) -> float:
    """Return the longest axis over the shortest of the most elongated fragment after any step that broke the
    pile.

    NaN if none did. least : number of grains of a fragment.
    """
    states = [step.state for step, broken in zip(run.steps, run.broken, strict=True) if broken]
    ratios = [one.elongation for state in states for one in fragments(state, least)]
    return max(ratios, default=float("nan"))


def elongations(runs: Sequence[SpinUp]) -> dict[float, np.ndarray]:
    """Return the elongation of each pile's most elongated fragment, by magnetisation (A/m)."""
    by_magnetisation = {m: [one for one in runs if one.magnetisation == m] for m in COMPARED_MAGNETISATIONS}
    return {m: np.array([elongation(one) for one in group]) for m, group in by_magnetisation.items()}


def main() -> None:
    """Spin piles up and print the elongations of their fragments."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--starts", type=int, default=10)
    options = parser.parse_args()
    runs = spin_ups(options.starts, magnetisations=COMPARED_MAGNETISATIONS, rates=FURTHER_RATES, **DEFAULT)
    found = elongations(runs)
    for m, values in found.items():
        each = ", ".join(f"{value:.1f}" for value in values)
        print(f"{m:g} A/m: {Mean.of(values)} ({each}); L21 {'6:1 and 5:1' if m else 'gives none'}")
    plain, strong = (found[m] for m in COMPARED_MAGNETISATIONS)
    print(f"difference, start by start: {Mean.of(strong - plain)}")


if __name__ == "__main__":
    main()
