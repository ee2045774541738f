"""Every granular law head-on at a thousand times the speed of waves in the material."""

import numpy as np
import pytest

from tests.hard.granular_scenes import ELASTIC, LAWS, ends, grains, kinetic, loaded, lossy, stored
from tests.scenes import roundoff
from tisim.cases.common.two_spheres import hertz_duration

pytestmark = pytest.mark.slow

FLOOR = ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))


def fast(law):
    """1e3 times the speed of waves, m/s: in a chain of Hooke's springs 2 R sqrt(k / m), in a solid
    sqrt(E / rho), of grains of 1 m and 1 kg."""
    return 1e3 * np.sqrt(4 * law["stiffness"] if "stiffness" in law else 4 / 3 * np.pi * law["young"])


def long(law, speed):
    """How long an elastic impact at a wall lasts, s."""
    if "stiffness" in law:
        return np.pi / law["stiffness"] ** 0.5
    return float(hertz_duration(speed, 1.0, 1.0, law["young"] / (2 * (1 - law["poisson"] ** 2))))


def head_on(name, law, apart, dt, steps):
    """Two that fly at each other from some distance (m) of their centres."""
    v, place = fast(law), [[-apart / 2, 0, 9], [apart / 2, 0, 9]]
    return grains(name, place, [[v, 0, 0], [-v, 0, 0]], first=law, dt=dt, steps=steps)


@pytest.mark.parametrize("name", LAWS)
def test_grains_that_fly_through_each_other_gain_no_energy(name):
    """Their motion is far more than what contacts can hold, so they go through each other as the law has it:
    elastic ones keep their energy, others lose some. In steps of a third of a radius, which see a contact a
    few times, none gains more than twice what a contact holds at most."""
    made, laws = [], (ELASTIC[name], {**ELASTIC[name], **lossy(name)[0]})
    for law in laws:
        for part in (1 / 500, 0.37):
            made.append(head_on(name, law, 3.001, part / fast(law), round(3 / part)))
    states = ends(made)
    for state, one in zip(states, made, strict=True):
        assert np.isfinite(state["velocity"]).all()
        assert state["position"][0, 0] > 1 > -1 > state["position"][1, 0]
        # That of steps which see a contact a few times is what it holds at most.
        held = stored(name, 2.0, 0.5, ELASTIC[name])
        assert kinetic(state).sum() <= kinetic(one.start()).sum() * (1 + 10 * roundoff()) + 2 * held
    elastic, _, lost, _ = (
        kinetic(state).sum() - kinetic(one.start()).sum() for state, one in zip(states, made, strict=True)
    )
    rounding = 1e3 * roundoff() * kinetic(made[0].start()).sum()
    assert abs(elastic) < 0.02 * stored(name, 2.0, 0.5, ELASTIC[name]) + rounding
    assert lost < -0.1 * stored(name, 2.0, 0.5, laws[1])


@pytest.mark.parametrize("name", LAWS)
def test_a_wall_throws_back_what_is_as_fast(name):
    """After hundreds of radii of overlap, at the speed at which it came, or below it by what is lost. Without
    friction, whose dashpot no such step could follow at a lever of hundreds of radii."""
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
def test_steps_that_cannot_follow_are_named(name):
    """Two that a step of hundreds of radii brings together: the world stops, says who moves so far, and keeps
    what it was."""
    law = ELASTIC[name]
    v, dt = fast(law), 0.03
    made = head_on(name, law, 1.0 + 2 * v * dt, dt, 5)
    simulation = loaded([made])
    simulation.run()
    (result,) = simulation.results()
    assert "a step so long that grains may pass through each other: particle 0" in result.status.reason
    assert kinetic(result.state).sum() <= kinetic(made.start()).sum()
    assert np.isfinite(result.state["position"]).all()
