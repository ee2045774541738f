"""Steps in which grains outrun a contact: the world stops, and the message states the longest step."""

import re

import numpy as np
import pytest

from tests.effects.contact import grains as granular
from tests.effects.contact import surfaces
from tests.effects.contact.grains import FLOOR, HERTZ_MINDLIN, grains
from tests.scenes import scene, simulate
from tisim import Material
from tisim.effects import PrescribedMotion, Translation
from tisim.geometry import Disc

RADIUS, STEP = 0.45e-3, 3.55756e-7
"""m, s: a step that resolves the springs of grains of this radius, of 10 MPa and 2500 kg/m^3."""
LAW = {"young": 1e7, "poisson": 0.25, "restitution": 0.5, "friction": 0.5}
MASS = 2500 * 4 / 3 * np.pi * RADIUS**3
BOUND = re.compile(r"the step is (\S+) s, and the force is finite up to (\S+) s")


def thrown(height, velocity, **more):
    """A grain above a floor."""
    return grains(
        [[0, 0, height]], [velocity], planes=[FLOOR], radius=RADIUS, mass=MASS, law=LAW, dt=STEP, **more
    )


def fates(scenes):
    """Results of scenes that share the structure of granular grains."""
    return simulate(scenes, worlds=granular.WORLDS, capacity=granular.CAPACITY)


def test_a_grain_that_outruns_a_wall_contact_is_stopped():
    """Without the check the energy grew by a factor of 19, because the force acted with a lever arm of
    hundreds of radii. A grain of equal speed in sufficiently short steps keeps its energy, and fast sliding
    on the floor is allowed."""
    angles = (0.3, 0.8, 1.3)
    fast = [thrown(1e-3, 1e6 * np.array([np.sin(a), 0, -np.cos(a)]), steps=400) for a in angles]
    slow = [thrown(1e-3, np.array([np.sin(a), 0, -np.cos(a)]), steps=4000) for a in angles]
    sliding = thrown(RADIUS * (1 - 1e-4), (1e4, 0.0, 0.0), steps=5)
    results = fates([*fast, *slow, sliding])
    for result in results[:3]:
        assert not result.status.ok
        assert "by effects.walls, at particle 0" in result.status.reason
        step, longest = map(float, BOUND.search(result.status.reason).groups())
        assert step == pytest.approx(STEP, rel=1e-3)
        assert 0 < longest < 1e-2 * STEP
        assert result.state["position"][0, 2] == pytest.approx(1e-3)
    for result in results[3:]:
        assert result.status.ok, result.status.reason


@pytest.mark.parametrize(("part", "goes"), [(1.9, True), (2.1, False)])
def test_largest_approach_to_a_wall_in_a_step(part, goes):
    """A grain may approach by its diameter, for any springs."""
    soft = {**LAW, "young": 1e-3}
    one = grains(
        [[0, 0, RADIUS * (1 + part / 2)]], [(0, 0, -part * RADIUS / STEP)], planes=[FLOOR], radius=RADIUS,
        mass=MASS, law=soft, dt=STEP, steps=1,
    )  # fmt: skip
    (result,) = fates([one])
    assert result.status.ok == goes, result.status.reason


def test_grains_that_pass_each_other_in_a_step_are_detected():
    """Earlier, they passed without an error. Two grains that move side by side at the same speed
    are allowed."""
    place = [[0, 0, 0], [21 * RADIUS, 0, 0]]
    meeting = grains(place, [[5 * RADIUS / STEP, 0, 0], [-5 * RADIUS / STEP, 0, 0]], radius=RADIUS, mass=MASS,
                     law=LAW, dt=STEP, steps=9)  # fmt: skip
    together = grains(place, [[5 * RADIUS / STEP, 0, 0]] * 2, radius=RADIUS, mass=MASS, law=LAW, dt=STEP,
                      steps=9)  # fmt: skip
    passing, beside = fates([meeting, together])
    assert not passing.status.ok
    assert "a step so long that grains may pass through each other: particle " in passing.status.reason
    assert f"it must be below {STEP / 5:.3g} s" in passing.status.reason
    assert beside.status.ok, beside.status.reason


@pytest.mark.slow
@pytest.mark.parametrize("sheet", ["disc", "triangles"])
def test_a_grain_that_passes_a_sheet_is_detected(sheet):
    """Behind a disc or a triangle nothing acts on a grain later. The check finds a grain that passes it in
    one step, and one that is pressed through it, which the sheet would push out on the other side."""
    above = (0.0, 0.0, 0.35) if sheet == "disc" else (0.1, 0.2, surfaces.SHEET + 0.35)
    shapes = {"discs": (Disc(radius=5.0),)} if sheet == "disc" else {}
    dt = 1e-4
    made = [
        surfaces.beside(above, (0, 0, -part * surfaces.RADIUS / dt), shapes, dt=dt, steps=steps)
        for part, steps in ((5.0, 2), (0.3, 30), (0.02, 300))
    ]
    *stopped, bounced = simulate(made, worlds=surfaces.WORLDS, capacity=surfaces.CAPACITY)
    for result in stopped:
        assert not result.status.ok
        assert "by effects.walls, at particle 0" in result.status.reason
        assert result.state["position"][0, 2] > above[2] - 0.35
    assert bounced.status.ok, bounced.status.reason
    assert bounced.state["velocity"][0, 2] == pytest.approx(0.02 * surfaces.RADIUS / dt, rel=1e-2)


def test_the_stated_longest_step_is_of_the_stiffest_spring():
    """The sliding mode is the stiffest, with the lever arm to the middle of the overlap."""
    depth = 0.2
    stiffness = 2 * LAW["young"] / (1 - LAW["poisson"] ** 2) * np.sqrt(RADIUS * depth * RADIUS)
    # Because the wall has the same material, E* = E / 2 (1 - nu^2).
    stiffness *= 0.5
    shear = 4 * (1 - LAW["poisson"]) / (2 * (2 - LAW["poisson"])) * stiffness
    slides = 1 + 2.5 * (1 - depth / 2) ** 2
    limit = 2 * np.sqrt(MASS / max(stiffness, slides * shear))
    one = grains(
        [[0, 0, (1 - depth) * RADIUS]], [(0, 0, 0)], planes=[FLOOR], radius=RADIUS, mass=MASS,
        law={**LAW, "restitution": 1.0}, dt=3 * limit, steps=5,
    )  # fmt: skip
    (result,) = fates([one])
    assert not result.status.ok
    assert float(BOUND.search(result.status.reason).group(2)) == pytest.approx(limit, rel=5e-3)


@pytest.mark.long
def test_held_bodies_have_no_longest_step():
    """Their contact moves nothing, and its force depends on the overlap alone, for any step."""
    speed, gap, duration = 1e-4, 2e-6, 0.05
    scenes = [
        scene(
            [[0, 0, 0], [2e-3 + gap, 0, 0]], [[0, 0, 0]] * 2,
            (
                HERTZ_MINDLIN,
                PrescribedMotion(name="rest", group=1),
                PrescribedMotion(name="press", group=2, motion=Translation(velocity=(-speed, 0, 0))),
            ),
            quantities={"group": [1.0, 2.0], "spin": np.zeros((2, 3))}, density=1000.0, dt=dt,
            duration=duration, materials={"m": Material(**{**LAW, "young": 1e8, "restitution": 1.0})},
        )
        for dt in (2e-4, 1e-5)
    ]  # fmt: skip
    modulus = 1e8 / (2 * (1 - LAW["poisson"] ** 2))
    expected = 4 / 3 * modulus * np.sqrt(0.5e-3) * (speed * duration - gap) ** 1.5
    for result in simulate(scenes, worlds=2, capacity=2):
        assert result.status.ok, result.status.reason
        assert result.measures["press_force_x"] == pytest.approx(expected, rel=1e-6)
