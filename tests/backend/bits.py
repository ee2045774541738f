"""Hashes of the results of scenes of every kind under the backend of this process.

    TISIM_BACKEND=quadrants python -m tests.backend.bits FILE [--schedule particle] [NAME ...]

The scenes come from ``tests/extremes.py``: one for each effect, source and operator, and for each stepper
with each of its controls; here with 27 times the number of particles. FILE is JSON: for each scene, a SHA-256
hash of each final array, and the status, time, work and measures of the run.
"""

from __future__ import annotations

import argparse
import copy
import hashlib
import json
import sys
from pathlib import Path

import numpy as np

from tests import extremes
from tisim import Scene, Simulation
from tisim.backend import memory

APART, SIDE = 0.025, 3
"""Distance from each copy of the particles to the next, m; and copies along each side of a cube. These fit
the box of scenes that need images."""
NOT_COPIED = ("effects.rigid_clumps", "effects.reflecting_walls")
"""Scenes whose particles have no copies: all would belong to one clump, or be outside of the walls."""


def scene_of(name: str) -> Scene:
    """A scene of ``extremes.scenes()`` with copies of its particles, at slightly different velocities."""
    data = copy.deepcopy(extremes.scenes()[name])
    if name in NOT_COPIED:
        return Scene.from_dict(data)
    draw = np.random.Generator(np.random.Philox(3))
    cells = np.stack(np.meshgrid(*[np.arange(SIDE) - SIDE // 2] * 3, indexing="ij"), -1).reshape(-1, 3)
    few = data["particles"]
    number = len(few["position"])
    for table in (few, few["quantities"]):
        for key, values in table.items():
            if isinstance(values, list) and len(values) == number:
                table[key] = values * len(cells)
    few["position"] = (np.array(few["position"]) + APART * np.repeat(cells, number, axis=0)).tolist()
    few["velocity"] = (np.array(few["velocity"]) * draw.uniform(0.9, 1.1, (number * len(cells), 1))).tolist()
    return Scene.from_dict(data)


def bits(scene: Scene, schedule: str) -> dict[str, str]:
    """Run a scene; return hashes of its arrays, and its status."""
    simulation = Simulation(scene, schedule=schedule)
    simulation.load(scene)
    simulation.run()
    (result,) = simulation.results()
    simulation.close()
    ended = json.dumps(
        [result.status.ok, result.status.reason, result.time, result.work, result.measures], sort_keys=True
    )
    arrays = {
        name: hashlib.sha256(np.ascontiguousarray(values).tobytes()).hexdigest()
        for name, values in result.state.items()
    }
    return {"ended": ended, **arrays}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("file", type=Path)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--schedule", default="world")
    arguments = parser.parse_args()
    found = {}
    for name in arguments.names or extremes.scenes():
        found[name] = bits(scene_of(name), arguments.schedule)
        print(name, found[name]["ended"][:60], file=sys.stderr, flush=True)
        if memory.needs_restart():
            memory.reclaim()
            memory.renew()
    arguments.file.write_text(json.dumps(found))


if __name__ == "__main__":
    main()
