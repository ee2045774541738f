"""Packings have the same bits on one thread and on two."""

import subprocess
import sys

import pytest

HASHES = """
import sys
from hashlib import sha256

from tests.steppers.packing.test_mixtures import BODIES, mixed
from tisim import Simulation
from tisim.backend import runtime
from tisim.effects import HardRods, HardSuperquadrics
from tisim.steppers import EnergyMinimisation, MechanicalContraction, MonteCarloGrowth

STEPPERS = {
    "contraction": MechanicalContraction(volume_step=2.0, attempts=20),
    "minimisation": EnergyMinimisation(),
    "growth": MonteCarloGrowth(),
}
BODIES_OF = {
    "rods": HardRods(rods=BODIES.rods),
    "superquadrics": HardSuperquadrics(superquadrics=BODIES.superquadrics),
}


def digest(state):
    names = ("position", "orientation", "radius")
    return sha256(b"".join(state[one].tobytes() for one in names)).hexdigest()


runtime.init(threads=int(sys.argv[1]))
for name in sys.argv[2:]:
    stepper = STEPPERS[name]
    for kind, bodies in BODIES_OF.items():
        # Growth starts without overlaps.
        made = mixed(120, 0.04 if name == "growth" else 0.2, stepper, bodies=bodies)
        simulation = Simulation(made, 1, schedule="team")
        assert simulation.teams.shared == (simulation.runtime.threads > 1)
        simulation.load([made])
        simulation.run(steps=40)
        print(name, kind, digest(simulation.state), digest(made.start()))
        simulation.close()
"""
"""A world of 120 bodies, the pairs of which two threads share."""


@pytest.mark.slow
@pytest.mark.parametrize("stepper", ["contraction", "minimisation", "growth"])
def test_the_same_bits_on_one_thread_and_two(stepper):
    found = []
    for threads in ("1", "2"):
        command = [sys.executable, "-c", HASHES, threads, stepper]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        found.append([line.split() for line in done.stdout.splitlines()])
    assert found[0] == found[1]
    assert len(found[0]) == 2
    # The bodies have moved or grown.
    assert all(end != start for _, _, end, start in found[0])
