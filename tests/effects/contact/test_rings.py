"""A ball that blocks a round outlet of a mesh rests there, for any number of facets."""

import numpy as np
import pytest

from tests.effects.contact.grains import HERTZ_MINDLIN
from tests.scenes import scene, simulate
from tisim import Material, geometry
from tisim.effects import Gravity, Walls

pytestmark = pytest.mark.long

RADIUS, YOUNG, POISSON, GRAVITY = 5e-3, 1e7, 0.25, 9.80665
MASS = 2500 * 4 / 3 * np.pi * RADIUS**3
E_STAR = YOUNG / (2 * (1 - POISSON**2))


def outlet(number, radius, slope):
    """A funnel of plane facets, each of two triangles; the radius of the outlet and its height in radii."""
    angle = 2 * np.pi * np.arange(number) / number
    ring = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    top = (radius + 1.5) * ring + [0, 0, slope]
    k = np.arange(number)
    after = (k + 1) % number
    faces = np.stack([k, after, number + k, after, number + after, number + k], 1).reshape(-1, 3)
    return geometry.TriangulatedSurface(vertices=RADIUS * np.concatenate([radius * ring, top]), faces=faces)


def lodged(number, radius=0.8, slope=1.2, friction=0.0, aside=(2e-7, 3e-7), sunk=0.0, steps=12_000, **more):
    """A ball released in the outlet, slightly off its axis."""
    rim = radius * np.cos(np.pi / number)
    height = np.sqrt(1 - rim**2) * RADIUS
    law = {"young": YOUNG, "poisson": POISSON, "restitution": 0.3, "friction": friction}
    acting = (HERTZ_MINDLIN, Walls(surface=outlet(number, radius, slope)), Gravity())
    given = {"radius": RADIUS, "mass": MASS, "dt": 1e-5, "materials": {"glass": Material(**law)}, **more}
    place = (*aside, height + RADIUS * (2e-3 if not sunk else -sunk))
    return scene([place], [(0.0, 0.0, 0.0)], acting, steps=steps, **given)


def run(made):
    """Return the result of a scene. Scenes with the same ring run in one compiled simulation."""
    return simulate([made], capacity=1)[0]


QUICK = [(7, 0.5)]
RINGS = [
    (6, 0.0), (7, 0.0), (8, 0.0), (8, 0.5), (16, 0.0), (16, 0.5), (32, 0.0),
    (32, 0.5), (64, 0.0), (64, 0.5),
]  # fmt: skip


@pytest.mark.parametrize(
    ("number", "friction"), [*QUICK, *(pytest.param(*ring, marks=pytest.mark.slow) for ring in RINGS)]
)
def test_a_ball_rests_in_a_ring_of_any_number_of_facets(number, friction):
    """The wall carries its weight, the lateral force is zero, and it comes to rest. Earlier, a world with
    more than six contacts was stopped."""
    result = run(lodged(number, friction=friction))
    assert result.status.ok, result.status.reason
    force = np.array([result.measures[f"walls_force_{axis}"] for axis in "xyz"])
    np.testing.assert_allclose(force / (MASS * GRAVITY), [0, 0, -1], atol=1e-6)
    assert np.linalg.norm(result.state["velocity"]) < 1e-9
    assert np.linalg.norm(result.state["position"][0, :2]) < 1e-3 * RADIUS
    if not friction:
        assert np.linalg.norm(result.state["position"][0, :2]) < 1e-9 * RADIUS


@pytest.mark.parametrize(
    "number", [7, *(pytest.param(number, marks=pytest.mark.slow) for number in (6, 8, 12))]
)
def test_separate_contacts_act_independently(number):
    """The force is the sum of Hertz's forces, even if the contacts exceed the capacity for contact
    history."""
    sunk, aside = 1e-4, np.array([2e-7, -1e-7])
    result = run(lodged(number, sunk=sunk, aside=tuple(aside), steps=1, dt=1e-12))
    place = np.array([*aside, (np.sqrt(1 - (0.8 * np.cos(np.pi / number)) ** 2) - sunk) * RADIUS])
    middle = 2 * np.pi * (np.arange(number) + 0.5) / number
    rim = 0.8 * np.cos(np.pi / number) * RADIUS
    edge = np.column_stack([rim * np.cos(middle), rim * np.sin(middle), 0 * middle])
    along = np.column_stack([-np.sin(middle), np.cos(middle), 0 * middle])
    nearest = edge + ((place - edge) * along).sum(axis=1)[:, None] * along
    out = place - nearest
    distance = np.linalg.norm(out, axis=1)
    force = 4 / 3 * E_STAR * np.sqrt(RADIUS) * (RADIUS - distance) ** 1.5
    expected = (force[:, None] * out / distance[:, None]).sum(axis=0)
    found = -np.array([result.measures[f"walls_force_{axis}"] for axis in "xyz"])
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6 * np.linalg.norm(expected))


@pytest.mark.slow
def test_a_ring_of_more_facets_is_not_stiffer():
    """Above some number of facets the force does not grow with their number."""
    scenes = [lodged(number, sunk=1e-4, aside=(0.0, 0.0), steps=1, dt=1e-12) for number in (16, 32, 64, 128)]
    forces = [run(made).measures["walls_force_z"] for made in scenes]
    assert max(forces) / min(forces) == pytest.approx(1, abs=0.2)


@pytest.mark.slow
def test_a_ball_in_a_ring_is_the_same_alone_and_among_others():
    scenes = [lodged(16, friction=0.3, aside=(k * 1e-6, 2e-7), steps=300) for k in range(4)]
    together = simulate(scenes, worlds=4, capacity=2)
    for made, among in zip(scenes, together, strict=True):
        alone = run(made)
        for name in ("position", "velocity", "spin"):
            assert alone.state[name].tobytes() == among.state[name].tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("radius", [0.45, 0.3, 0.8])
def test_a_ball_in_the_middle_has_no_lateral_force(radius):
    """Nor strongly off its position near the middle: with 64 facets, the choice of contacts would be
    arbitrary."""
    given = {"radius": radius, "slope": 0.05, "sunk": 1e-4, "steps": 1, "dt": 1e-12}
    for x in (0.0, 1e-12, -1e-12):
        result = run(lodged(64, aside=(x, 0.0), **given))
        force = np.array([result.measures[f"walls_force_{axis}"] for axis in "xyz"])
        assert np.linalg.norm(force[:2]) < 1e-5 * abs(force[2])
