"""The cost in memory and time of effects that a scene does not use, with and without them in the package.

    python tests/benchmarks/absent_effects.py [--scene impacts] [--repeats 5]

A scene - "impacts": impact and agglomeration alone; "vibration": charged particles in a binder - runs in
fresh processes, in turn in a package whose other effects cannot be imported and in the whole package. Printed
are the bytes of its fields and the time of its kernels in both, and, for comparison, the bytes of "impacts"
with all effects.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]

IMPACTS = """
from tisim import Box, Cloud, Scene
from tisim.effects import Impact
from tisim.effects import Agglomeration
effects = [Impact(hardness=1e6), Agglomeration()]
if full:
    from tisim.cases.agglomeration import scene as agglomeration
    effects = agglomeration.scene({**agglomeration.BEST, "hardness": 1e6}, 0).effects
scenes = [
    Scene(
        particles=Cloud(number=1000, radius=7e-4, density=5e3, deviation=(60.0, 60.0, 60.0)), effects=effects,
        domain=Box(low=(-0.01,) * 3, high=(0.01,) * 3, images=False), duration=2e-3, seed=seed,
    )
    for seed in range(8)
]
"""
VIBRATION = """
from tisim.cases.vibration.scene import RATIOS, scene
scenes = [scene(ratio, duration=1e-4) for ratio in RATIOS]
"""
IMPACT = "effects.impact."
SCENES = {
    "impacts": (
        IMPACTS,
        (IMPACT + "softening", IMPACT + "reaction", "operators.cooling", "operators.fragmentation"),
    ),
    "vibration": (
        VIBRATION,
        (*("effects.contact", "effects.impact", "operators.cooling", "operators.fragmentation"),),
    ),
}
"""For each scene, its source and the modules removed from the package. "vibration" runs without all laws of
contact, impact, friction, heat and reaction, and without agglomeration, cooling and fragmentation."""

WORKER = """
import json, sys, time
sys.path.insert(0, {root!r})
absent, full = {absent!r}, {full!r}
for name in absent:
    sys.modules[name] = None  # importing it is an ImportError
import tisim
from tisim.backend import runtime
runtime.init(threads=1)
if not absent:
    from tisim import effects, operators
    from tisim.components import serialization
    serialization.load(effects)
    serialization.load(operators)
{scenes}
simulation = tisim.Simulation(scenes[0], worlds=8, capacity=1000)
simulation.load(scenes)
simulation.run(steps=1)
times = []
for _ in range(3):
    simulation.load(scenes)
    began = time.process_time()
    simulation.program.advance(10**6)
    times.append(time.process_time() - began)
print(json.dumps({{"bytes": simulation.s.bytes(), "seconds": min(times)}}))
"""


def measure(scene: str, absent: bool, full: bool = False) -> dict:
    """Bytes by field and CPU seconds of all steps, from a fresh process."""
    scenes, others = SCENES[scene]
    names = [f"tisim.{name}" for name in others] if absent else []
    source = WORKER.format(root=str(ROOT), absent=names, full=full, scenes=scenes)
    completed = subprocess.run([sys.executable, "-c", source], capture_output=True, text=True, check=True)
    return json.loads(completed.stdout.splitlines()[-1])


def main() -> None:
    """Measure in turn and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--scene", choices=SCENES, default="impacts")
    parser.add_argument("--repeats", type=int, default=5)
    args = parser.parse_args()
    scene, repeats = args.scene, args.repeats
    pairs = [(measure(scene, absent=False), measure(scene, absent=True)) for _ in range(repeats)]
    whole, bare = pairs[0]
    ratios = [a["seconds"] / b["seconds"] for a, b in pairs]
    print(f"fields of the scene, bytes: {bare['bytes']}")
    print(f"the same in the whole package: {whole['bytes'] == bare['bytes']}")
    print(
        f"time in the whole package over time without the other effects: "
        f"median {statistics.median(ratios):.3f} of {repeats} ({min(ratios):.3f}..{max(ratios):.3f})"
    )
    if scene == "impacts":
        full = measure(scene, absent=False, full=True)
        ratio = sum(full["bytes"].values()) / sum(bare["bytes"].values())
        print(f"with all effects: {ratio:.2f} times the bytes")


if __name__ == "__main__":
    main()
