"""Head-on impacts under every granular law at a thousand times the wave speed in the material."""

import numpy as np
import pytest

from tests.hard.granular_scenes import ELASTIC, LAWS, ends, grains, kinetic, loaded, lossy, stored
from tests.scenes import roundoff
from tisim.cases.common.two_spheres import hertz_duration

pytestmark = pytest.mark.slow

FLOOR = ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))


def fast(law):
    """1e3 times the wave speed (m/s) for grains of 1 m and 1 kg.

    The wave speed is 2 R sqrt(k / m) in a chain of Hookean springs and sqrt(E / rho) in a solid.
    """
    return 1e3 * np.sqrt(4 * law["stiffness"] if "stiffness" in law else 4 / 3 * np.pi * law["young"])


def long(law, speed):
    """Duration of an elastic impact at a wall, s."""
    if "stiffness" in law:
        return np.pi / law["stiffness"] ** 0.5
    return float(hertz_duration(speed, 1.0, 1.0, law["young"] / (2 * (1 - law["poisson"] ** 2))))


def head_on(name, law, apart, dt, steps):
    """Two grains fly at each other; their centres start a distance (m) apart."""
    v, place = fast(law), [[-apart / 2, 0, 9], [apart / 2, 0, 9]]
    return grains(name, place, [[v, 0, 0], [-v, 0, 0]], first=law, dt=dt, steps=steps)


@pytest.mark.parametrize("name", LAWS)
def test_grains_that_fly_through_each_other_gain_no_energy(name):
    """The kinetic energy far exceeds the largest contact energy, so the grains pass through each other.

    Elastic grains keep their energy and others lose some. With steps of a third of a radius, which sample a
    contact only a few times, no grain gains more than twice the largest contact energy.
    """
    made, laws = [], (ELASTIC[name], {**ELASTIC[name], **lossy(name)[0]})
    for law in laws:
        for part in (1 / 500, 0.37):
            made.append(head_on(name, law, 3.001, part / fast(law), round(3 / part)))
    states = ends(made)
    for state, one in zip(states, made, strict=True):
        assert np.isfinite(state["velocity"]).all()
        assert state["position"][0, 0] > 1 > -1 > state["position"][1, 0]
        # The error of steps that sample a contact only a few times is at most the largest contact energy.
        held = stored(name, 2.0, 0.5, ELASTIC[name])
        assert kinetic(state).sum() <= kinetic(one.start()).sum() * (1 + 10 * roundoff()) + 2 * held
    elastic, _, lost, _ = (
        kinetic(state).sum() - kinetic(one.start()).sum() for state, one in zip(states, made, strict=True)
    )
    rounding = 1e3 * roundoff() * kinetic(made[0].start()).sum()
    assert abs(elastic) < 0.02 * stored(name, 2.0, 0.5, ELASTIC[name]) + rounding
    assert lost < -0.1 * stored(name, 2.0, 0.5, laws[1])


@pytest.mark.parametrize("name", LAWS)
def test_a_wall_reflects_grains_of_this_speed(name):
    """The grain rebounds after overlaps of hundreds of radii, at its initial speed or, with losses, slower.

    There is no friction: no such step can resolve its dashpot at a lever arm of hundreds of radii.
    """
    made, laws = [], (ELASTIC[name], {**ELASTIC[name], **lossy(name)[0]})
    for law in laws:
        v = fast(law)
        dt = long(law, v) / 4000
        made.append(
            grains(
                name,
                [[0, 0, 1 + 1e-3]],
                [[0, 0, -v]],
                planes=[FLOOR],
                dt=dt,
                steps=16_000,
                first={**law, "friction": 0.0},
            )
        )
    back, less = (state["velocity"][0, 2] for state in ends(made))
    assert back == pytest.approx(fast(laws[0]), rel=2e-3)
    assert 0 < less < 0.99 * fast(laws[1])


@pytest.mark.parametrize("name", LAWS)
def test_too_long_steps_are_named(name):
    """One step of hundreds of radii brings two grains together: the world stops, names the particle that
    moves too far, and keeps its state."""
    law = ELASTIC[name]
    v, dt = fast(law), 0.03
    made = head_on(name, law, 1.0 + 2 * v * dt, dt, 5)
    simulation = loaded([made])
    simulation.run()
    (result,) = simulation.results()
    assert "a step so long that grains may pass through each other: particle 0" in result.status.reason
    assert kinetic(result.state).sum() <= kinetic(made.start()).sum()
    assert np.isfinite(result.state["position"]).all()
