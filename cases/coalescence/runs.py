"""Clouds that are looked at on their way: as one batch, of several magnetisations and starts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from tisim.cases.case import Size
from tisim.cases.coalescence.measures import Asteroid, Conserved, Gathering
from tisim.cases.coalescence.published import MAGNETISATIONS, NUMBER
from tisim.cases.coalescence.scene import scale_of, scene
from tisim.cases.runs import sound

from tisim import Scene, Simulation
from tisim.engine.batches import Progress
from tisim.errors import must
from tisim.scene.initial_state import Arrays

CLOUD_LOOKS = 25
"""A cloud is looked at so many times after the start, at even intervals."""
SEEDS = 3
"""There are so many random starts of each magnetisation."""
T = TypeVar("T")


@dataclass(frozen=True)
class CloudRun:
    """What became of a cloud: its magnetisation (A/m) in L21's cloud and in this copy's, and at some times
    (s) how far it was agglomerated and what it conserved; the state of its grains at the end."""

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
        """Return how far it was agglomerated when it was looked at next to a time (s)."""
        return self.agglomerations[int(np.abs(self.times - time).argmin())]

    @property
    def magnetised_part(self) -> float:
        """Return the magnetisation of the asteroid over that of its grains."""
        return self.asteroid.magnetisation / (self.scale * self.magnetisation)


def looked_at(
    scenes: Sequence[Scene],
    times: np.ndarray,
    look: Callable[[Arrays], T],
    progress: Progress = lambda part: None,
) -> tuple[list[list[T]], list[Arrays]]:
    """Run scenes as one batch; return what is seen of each at some times (s), and the states at the end.

    RunError where one fails.
    """
    seen: list[list[T]] = [[] for _ in scenes]
    with closing(Simulation(scenes[0], len(scenes))) as simulation:
        simulation.load(scenes)
        for time in times:
            simulation.run(until=time)
            for one, result in zip(seen, sound(simulation.results()), strict=True):
                one.append(look(result.state))
            progress(float(time / times[-1]))
        states = [result.state for result in sound(simulation.results())]
    return seen, states


def clouds(
    seeds: int,
    progress: Progress = lambda part: None,
    magnetisations: Sequence[float] = MAGNETISATIONS,
    looks: int = CLOUD_LOOKS,
    **settings: Any,
) -> list[CloudRun]:
    """Return what becomes of clouds of each magnetisation (A/m), each from some starts.

    settings : those of ``scene``. progress : is told the part that is done, 0..1.
    """
    wanted = [(m, seed) for m in magnetisations for seed in range(seeds)]
    scenes = [scene(magnetisation=m, seed=seed, **settings) for m, seed in wanted]
    times = np.linspace(0.0, scenes[0].duration, looks + 1)
    seen, states = looked_at(
        scenes, times, lambda state: (Gathering.of(state), Conserved.of(state)), progress
    )
    scale = scale_of(settings.get("number", NUMBER))
    return [
        CloudRun(m, scale, one, times, [a for a, _ in looks_], [c for _, c in looks_], state)
        for (m, _), one, looks_, state in zip(wanted, scenes, seen, states, strict=True)
    ]


def of_all_magnetisations(size: str, sizes: Mapping[str, Size]) -> dict[str, Any]:
    """Return the settings of a size that is run with each magnetisation; InputError where it has its own."""
    some = [name for name, one in sizes.items() if "magnetisation" not in one.scene]
    rule = f"one that is run with each magnetisation ({', '.join(some)})"
    must(size in some, "size", rule, size)
    return dict(sizes[size].scene)


def of_magnetisation(runs: Sequence[CloudRun], magnetisation: float) -> list[CloudRun]:
    """Return the clouds of a magnetisation, A/m."""
    return [one for one in runs if one.magnetisation == magnetisation]
