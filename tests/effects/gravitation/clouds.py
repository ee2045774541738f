"""Clouds of particles that attract each other, the forces on them, and sums over all pairs in NumPy."""

import numpy as np
from scipy.constants import G

from tests.scenes import compiled, scene
from tisim.effects import TreeGravity

THETAS = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8])
CAPACITY = 1200


def ball(rng, n):
    """Positions in a uniform ball of radius 1 m."""
    direction = rng.normal(size=(n, 3))
    return direction / np.linalg.norm(direction, axis=1)[:, None] * rng.uniform(0, 1, n)[:, None] ** (1 / 3)


def loads_of(scenes):
    """The forces at the start of up to eight scenes."""
    simulation = compiled(scenes[0], worlds=len(THETAS), capacity=CAPACITY)
    simulation.load(scenes)
    simulation.first.advance(1)
    assert (simulation.s.read("failed") == 0).all()
    force, count = simulation.s.read("force"), simulation.s.read("count")
    return [force[w, : count[w]] for w in range(len(scenes))]


def pair_forces(setup, softening=0.0):
    """F_i = G sum_j m_i m_j d_ij / (d^2 + eps^2)^(3/2)."""
    start = setup.start()
    place, mass = start["position"], start["mass"]
    total = np.zeros_like(place)
    for i, r in enumerate(place):
        apart = place - r
        square = (apart**2).sum(axis=1) + softening**2
        square[i] = 1.0
        total[i] = G * mass[i] * ((mass * square**-1.5)[:, None] * apart).sum(axis=0)
    return total


def relative_error(loads, exact):
    """Root mean square error and largest error, each over the root mean square of the exact force."""
    size = np.sqrt((exact**2).sum(axis=1).mean())
    errors = np.array([np.linalg.norm(load - exact, axis=1) for load in loads]) / size
    return np.sqrt((errors**2).mean(axis=1)), errors.max(axis=1)


def forces():
    """Forces in one ball, as a list."""
    rng = np.random.Generator(np.random.Philox(7))
    place = ball(rng, 700)
    setup = scene(place, 0 * place, (TreeGravity(opening_angle=0.6),), mass=rng.uniform(1, 2, 700))
    return loads_of([setup])[0].tolist()
