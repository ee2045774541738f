"""Grains that hit a fixed grain, or are cemented to it: it acts like a wall, even if it is light."""

import numpy as np
import pytest

from tests.scenes import compiled, scene
from tisim import Material
from tisim.effects import Force, Granular, Hooke, ParallelBond, RestitutionDamping

R, X = 0.01, np.array([1.0, 0.0, 0.0])
STIFFNESS, MASS = 1e4, 1e-2
"""Contact stiffness, N/m; mass of a moving grain, kg."""
GAP = 0.5 * R
"""m, gap between cemented surfaces."""
RATIO, YOUNG = 0.2, 1e6
"""Damping ratio; Pa."""


class MayBeFixed(Force):
    """No force; declares that some particles may be fixed."""

    fields = ("fixed",)


def against_one_that_is_fixed(gap, velocity, spin, dt, steps):
    """A grain beside a fixed one of half its mass, with a gap of ``gap`` (m) between their surfaces."""
    effects = (
        Granular(normal=Hooke(), damping=RestitutionDamping()),
        ParallelBond(young=YOUNG, gap=GAP, damping_ratio=RATIO, tensile_strength=1e9, shear_strength=1e9),
        MayBeFixed(),
    )
    place = [[0, 0, 0], (2 * R + gap) * X]
    quantities = {"spin": [[0, 0, 0], spin], "fixed": [1, 0]}
    return scene(place, [[0, 0, 0], velocity], effects, radius=R, mass=[MASS / 2, MASS], dt=dt, steps=steps,
                 quantities=quantities,
                 materials={"grain": Material(stiffness=STIFFNESS, restitution=0.5)})  # fmt: skip


@pytest.mark.slow
def test_fixed_grains_act_like_walls():
    """An impact has the given restitution, and a stretched and twisted bond the given damping ratio."""
    step = np.pi * np.sqrt(MASS / STIFFNESS) / 400
    area, second = np.pi * R**2, np.pi * R**4 / 4
    stretched, twisted = YOUNG / (2 * R) * area, YOUNG / (2 * R) / 2.5 * 2 * second
    swing = np.sqrt(stretched / MASS), np.sqrt(twisted / (0.4 * MASS * R**2))
    short, steps, v, w = 1e-3 / max(swing), 3000, 1e-3, 1e-2
    made = [
        against_one_that_is_fixed(1.01 * GAP, -X, 0 * X, step, 5000),
        against_one_that_is_fixed(0.9 * GAP, v * X, w * X, short, steps),
    ]
    simulation = compiled(made[0], 2, 2)
    simulation.load(made)
    simulation.run()
    hit, bonded = simulation.results()
    for result in (hit, bonded):
        assert result.status.ok, result.status.reason
        held = result.state["id"] == 0
        np.testing.assert_array_equal(result.state["velocity"][held], 0)
    assert hit.state["velocity"][1, 0] == pytest.approx(0.5, abs=3e-3)
    for name, start, omega in (("velocity", v, swing[0]), ("spin", w, swing[1])):
        t, damped = short * steps, omega * np.sqrt(1 - RATIO**2)
        motion = np.cos(damped * t) - RATIO * omega / damped * np.sin(damped * t)
        found = bonded.state[name][1, 0] / start
        assert found == pytest.approx(np.exp(-RATIO * omega * t) * motion, abs=3e-3), name
