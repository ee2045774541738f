"""Runs of clouds in one batch, with several magnetisations and starts, and their agglomeration over time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from tisim import Scene
from tisim.accuracy import Quantity
from tisim.analysis import cluster_shapes, fraction_in_clusters, head_to_tail
from tisim.cases.case import Size
from tisim.cases.coalescence import published
from tisim.cases.coalescence.scene import scale_of, scene
from tisim.cases.common.rubble_pile import Asteroid, Conserved, body, clusters_of, part
from tisim.cases.common.runs import overlap, sound
from tisim.engine.batches import Progress, loaded
from tisim.errors import must
from tisim.scene.initial_state import Arrays

CLOUD_SAMPLES = 25
"""Number of samples of a cloud after the start, at equal intervals."""
SEEDS = 10
"""Number of random starts of each magnetisation."""
T = TypeVar("T")
CLUMP = 11
"""Least number of grains in a clump: more than ten."""


def chain_length(state: Arrays) -> float:
    """Return the mean number of grains along the chain of each grain, without the seed; NaN without moments.

    A chain consists of grains whose moments bind them head to tail.
    """
    radius = state["radius"]
    grains = part(state, radius == radius.min())
    if "moment" not in grains or not grains["moment"].any():
        return float("nan")
    diameter = 2 * float(radius.min())
    shapes = cluster_shapes(grains["position"], head_to_tail(grains["position"], grains["moment"], diameter))
    return float(np.average(shapes.path, weights=shapes.size))


@dataclass(frozen=True)
class Gathering:
    """The progress of agglomeration in a cloud.

    coalesced : fraction of all grains that are in the asteroid.
    some, many : fractions of the other grains in clusters of two or more and of more than ten; NaN without
    other grains.
    chain : mean length of chains, in grains.
    """

    coalesced: float
    some: float
    many: float
    chain: float

    @classmethod
    def of(cls, state: Arrays) -> Gathering:
        """Return the progress of agglomeration in a state."""
        cluster = clusters_of(state)
        inside = body(cluster, state["mass"])
        # A single grain is not an asteroid.
        inside &= inside.sum() > 1
        others = cluster[~inside]
        some, many = (fraction_in_clusters(others, least) for least in (2, CLUMP))
        return cls(float(inside.mean()), some, many, chain_length(state))

    @property
    def bound(self) -> float:
        """Return the fraction of all grains that are in clusters of two or more."""
        return self.coalesced + (0.0 if self.coalesced == 1 else (1 - self.coalesced) * self.some)

    @property
    def clumped(self) -> float:
        """Return the fraction of all grains that are outside the asteroid in clusters of more than ten."""
        return 0.0 if self.coalesced == 1 else (1 - self.coalesced) * self.many


@dataclass(frozen=True)
class CloudRun:
    """The results of a cloud.

    magnetisation : of the grains in L21's cloud, A/m. scale : ratio of the copy's magnetisation to it.
    scene : of the run. times : of the samples, s.
    agglomerations, conserved : progress of agglomeration and conserved quantities at these times.
    end : state of the grains at the end.
    """

    magnetisation: float
    scale: float
    scene: Scene
    times: np.ndarray
    agglomerations: Sequence[Gathering]
    conserved: Sequence[Conserved]
    end: Arrays

    @cached_property
    def asteroid(self) -> Asteroid:
        """Return the asteroid at the end."""
        return Asteroid.of(self.end)

    def at(self, time: float) -> Gathering:
        """Return the progress of agglomeration at the sample closest to a time (s)."""
        return self.agglomerations[int(np.abs(self.times - time).argmin())]

    @property
    def magnetised_part(self) -> float:
        """Return the magnetisation of the asteroid divided by the magnetisation of its grains."""
        return self.asteroid.magnetisation / (self.scale * self.magnetisation)


def sampled(
    scenes: Sequence[Scene],
    times: np.ndarray,
    sample: Callable[[Arrays], T],
    progress: Progress = lambda part: None,
) -> tuple[list[list[T]], list[Arrays]]:
    """Run scenes as one batch; return the samples of each at given times (s), and the states at the end.

    sample : computes a sample from a state. RunError if a run fails.
    """
    seen: list[list[T]] = [[] for _ in scenes]
    with loaded(scenes) as simulation:
        for time in times:
            simulation.run(until=time)
            for one, result in zip(seen, sound(simulation.results()), strict=True):
                one.append(sample(result.state))
            progress(float(time / times[-1]))
        states = [result.state for result in sound(simulation.results())]
    return seen, states


def clouds(
    seeds: int,
    progress: Progress = lambda part: None,
    magnetisations: Sequence[float] = published.MAGNETISATIONS,
    samples: int = CLOUD_SAMPLES,
    **settings: Any,
) -> list[CloudRun]:
    """Return the results of clouds of each magnetisation (A/m), with several starts each.

    settings : of ``scene``. progress : receives the completed fraction, 0..1.
    """
    wanted = [(m, seed) for m in magnetisations for seed in range(seeds)]
    scenes = [scene(magnetisation=m, seed=seed, **settings) for m, seed in wanted]
    times = np.linspace(0.0, scenes[0].duration, samples + 1)
    seen, states = sampled(scenes, times, lambda state: (Gathering.of(state), Conserved.of(state)), progress)
    scale = scale_of(settings.get("number", published.NUMBER))
    return [
        CloudRun(m, scale, one, times, [a for a, _ in of_run], [c for _, c in of_run], state)
        for (m, _), one, of_run, state in zip(wanted, scenes, seen, states, strict=True)
    ]


def of_all_magnetisations(size: str, sizes: Mapping[str, Size]) -> dict[str, Any]:
    """Return the settings of a size that is run with each magnetisation; InputError if it has a fixed one."""
    some = [name for name, one in sizes.items() if "magnetisation" not in one.scene]
    rule = f"one that is run with each magnetisation ({', '.join(some)})"
    must(size in some, "size", rule, size)
    return dict(sizes[size].scene)


def of_magnetisation(runs: Sequence[CloudRun], magnetisation: float) -> list[CloudRun]:
    """Return the clouds of a magnetisation, A/m."""
    return [one for one in runs if one.magnetisation == magnetisation]


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Return the quantities of ``tisim cost``: properties of clusters and asteroid, as paths of grains are
    chaotic."""
    return (
        Quantity("part in clusters", lambda result: Gathering.of(result.state).bound, random=True),
        Quantity("density", lambda result: Asteroid.of(result.state).density, random=True),
        Quantity("largest overlap", lambda result: overlap(result, np.min), random=True),
    )
