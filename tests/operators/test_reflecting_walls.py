"""Reflecting walls: free flight against a NumPy twin, and diffusion between walls against closed forms."""

import numpy as np
import pytest
from scipy import stats
from scipy.special import j0, jn_zeros

from tests.scenes import by_id, roundoff, scene, simulate
from tests.steppers.brownian.colloids import DIFFUSIVITY, HEAT, RADIUS, SIGMAS, colloids, run
from tisim import InputError, Particles, Scene
from tisim.geometry import CylindricalSurface, Plane, SphericalSurface
from tisim.operators import Inlet, ReflectingWalls
from tisim.sources import UniformFlow
from tisim.steppers import Brownian, DriftLimit

TILT = np.array([0.48, -0.6, 0.64])
HALF = 0.5
"""Half the distance of the planes, and the radius of the tube and of the sphere, m."""
A, DT = 0.01, 0.02
"""Radius of the particles (m) and step (s)."""
PLATES = ReflectingWalls(
    planes=[
        Plane(point=(-HALF, 0, 0), normal=(2.0, 0, 0)),
        Plane(point=(HALF, 0, 0), normal=(-1.0, 0, 0)),
        Plane(point=(0, -HALF, 0), normal=(0, 1.0, 0)),
    ]
)
TUBE = ReflectingWalls(cylinders=[CylindricalSurface(start=(0, 0, 0), end=tuple(TILT), radius=HALF)])
BALL = ReflectingWalls(spheres=[SphericalSurface(centre=(0, 0, 0), radius=HALF)])
WALLS = {"plates": PLATES, "tube": TUBE, "sphere": BALL}


def mirrored(r, v, name):
    """Positions and velocities after the reflections of one step, one particle after the other."""
    for i in range(len(r)):
        for _ in range(64):
            if name == "plates":
                walls = [
                    (A - HALF - r[i, 0], np.array([1.0, 0, 0])),
                    (A - HALF + r[i, 0], np.array([-1.0, 0, 0])),
                    (A - HALF - r[i, 1], np.array([0, 1.0, 0])),
                ]
            else:
                out = r[i] - (r[i] @ TILT * TILT if name == "tube" else 0.0)
                walls = [(np.linalg.norm(out) + A - HALF, -out / np.linalg.norm(out))]
            depth, normal = max(walls, key=lambda one: one[0])
            if depth <= 0:
                break
            r[i] += 2 * depth * normal
            v[i] -= 2 * min(v[i] @ normal, 0.0) * normal
    return r, v


def thrown(rng, walls, steps=100, effects=(), dt=DT, n=16):
    """Particles that fly through a room between walls."""
    start = rng.uniform(-0.25, 0.25, (n, 3))
    return scene(start, rng.normal(size=(n, 3)), (*effects, walls), radius=A, dt=dt, steps=steps)


def test_free_flight_equals_its_numpy_reference(rng):
    """Between planes, in a tube and in a sphere: the speed is kept, and no particle is behind a
    wall."""
    for name, walls in WALLS.items():
        (result,) = simulate([thrown(rng, walls)], capacity=16)
        assert result.status.ok, result.status.reason
        r, v = result.start["position"].astype(float), result.start["velocity"].astype(float)
        speed, bounced = np.linalg.norm(v, axis=1), v.copy()
        for _ in range(100):
            r, v = mirrored(r + DT * v, v, name)
        end = by_id(result)
        # Rounding grows from one reflection at a curved wall to the next.
        np.testing.assert_allclose(end["position"], r, rtol=0, atol=1e6 * roundoff())
        np.testing.assert_allclose(end["velocity"], v, rtol=0, atol=1e6 * roundoff())
        np.testing.assert_allclose(np.linalg.norm(end["velocity"], axis=1), speed, rtol=200 * roundoff())
        assert (np.abs(end["velocity"] - bounced).max(axis=1) > 0.1).mean() > 0.5
        assert WALLS[name].depths(end["position"]).max() <= 20 * roundoff() - A


def test_a_long_way_between_planes_is_folded(rng):
    """A step over several widths ends where single steps end: the way is folded at the planes."""
    start, width = rng.uniform(-0.4, 0.4, 16), 2 * (HALF - A)
    speed = np.linspace(-9, 9, 16)
    position = np.column_stack([start, np.linspace(0, 1, 16), np.zeros(16)])
    velocity = np.column_stack([speed, np.zeros((16, 2))])
    (result,) = simulate([scene(position, velocity, (PLATES,), radius=A, dt=1.0)], capacity=16)
    way = (start + speed + width / 2) % (2 * width)
    expected = np.minimum(way, 2 * width - way) - width / 2
    np.testing.assert_allclose(by_id(result)["position"][:, 0], expected, rtol=0, atol=300 * roundoff())


def test_the_error_of_a_curved_wall_is_of_first_order(rng):
    """Between reflections in a tube the angular momentum about its axis is constant; half the step, half the
    change."""
    changes = []
    for k in (1, 2, 4):
        made = thrown(np.random.default_rng(5), TUBE, steps=200 * k, dt=2e-3 / k)
        (result,) = simulate([made], capacity=16)
        about = [np.cross(one["position"], one["velocity"]) @ TILT for one in (result.start, by_id(result))]
        changes.append(np.abs(about[1] - about[0]).mean())
    assert changes[0] / changes[2] == pytest.approx(4.0, rel=0.4)


WIDTH = 1e-6
"""Width between planes, radius of a tube, and height kT/mg of a sediment, all for the centres, m."""
TIME = 0.25 * WIDTH**2 / DIFFUSIVITY
MANY = 10_000


@pytest.fixture(scope="module")
def diffused():
    """Brownian particles between planes, in a tube, and in a sediment above a plane."""
    sides = [Plane(point=(d * (WIDTH / 2 + RADIUS), 0, 0), normal=(-d, 0, 0)) for d in (-1.0, 1.0)]
    tube = CylindricalSurface(start=(0, 0, 0), end=(0, 0, 1.0), radius=WIDTH + RADIUS)
    floor = Plane(point=(0, -RADIUS, 0), normal=(0, 1, 0))
    height = np.random.default_rng(7).exponential(WIDTH, MANY)
    mass = 4 / 3 * np.pi * RADIUS**3 * 1000.0
    cases = (
        ("planes", ReflectingWalls(planes=sides), 8, [0.3 * WIDTH, 0, 0], 0.0),
        ("tube", ReflectingWalls(cylinders=[tube]), 100, [0.6 * WIDTH, 0, 0], 0.0),
        ("floor", ReflectingWalls(planes=[floor]), 100, height[:, None] * [0, 1, 0], HEAT / (mass * WIDTH)),
    )
    results = {}
    for name, walls, steps, place, fall in cases:
        start = np.broadcast_to(place, (MANY, 3))
        (results[name],) = run([colloids(start, fall=fall, steps=steps, dt=TIME / steps, extra=(walls,))])
    return results


def test_diffusion_between_planes_has_its_exact_distribution_for_long_steps(diffused):
    """Every mode decays as exp(-n^2 pi^2 D t/W^2), although a step spreads particles over a quarter of W."""
    x = diffused["planes"].state["position"][:, 0] / WIDTH + 0.5
    for k in (1, 2, 3):
        decay = np.exp(-((k * np.pi) ** 2) * DIFFUSIVITY * TIME / WIDTH**2)
        expected = decay * np.cos(k * np.pi * 0.8)
        sample = np.cos(k * np.pi * x)
        assert sample.mean() == pytest.approx(expected, abs=SIGMAS * sample.std() / np.sqrt(len(x))), k
    assert x.min() >= -1e-12
    assert x.max() <= 1 + 1e-12


def test_diffusion_in_a_tube_decays_as_its_first_mode(diffused):
    """J_0(z r/R) decays as exp(-z^2 D t/R^2), with z the first zero of J_0'."""
    position = diffused["tube"].state["position"]
    rho = np.hypot(position[:, 0], position[:, 1]) / WIDTH
    (z,) = jn_zeros(1, 1)
    expected = j0(0.6 * z) * np.exp(-(z**2) * DIFFUSIVITY * TIME / WIDTH**2)
    sample = j0(z * rho)
    assert sample.mean() == pytest.approx(expected, abs=SIGMAS * sample.std() / np.sqrt(len(rho)))
    assert rho.max() <= 1 + 1e-12


def test_a_sediment_keeps_its_barometric_distribution(diffused):
    """The density falls as exp(-m g y/kT), and the mean height stays kT/mg."""
    result = diffused["floor"]
    y = result.state["position"][:, 1] / WIDTH
    assert np.abs(y - result.start["position"][:, 1] / WIDTH).mean() > 0.3
    assert y.mean() == pytest.approx(1.0, abs=SIGMAS / np.sqrt(MANY))
    assert np.exp(-y).mean() == pytest.approx(0.5, abs=SIGMAS * np.sqrt(1 / 12 / MANY))
    assert y.min() >= 0


def test_particles_enter_and_diffuse_inside_a_tube_only():
    """In a uniform flow through a square region around the tube; they enter evenly over its section."""
    n, side = 2000, 2e-5
    made = Scene(
        particles=Particles(position=np.zeros((n, 3)), velocity=np.zeros((n, 3)), radius=RADIUS, density=1e3),
        effects=(
            UniformFlow(velocity=(0.0, 0.0, 1e-4)),
            Inlet(low=(-side, -side, 0), high=(side, side, 1e-7), direction=(0, 0, 1), end=0.05),
            ReflectingWalls(cylinders=[CylindricalSurface(end=(0, 0, 1.0), radius=side)]),
        ),
        stepper=Brownian(temperature=298.0, viscosity=1e-3, control=DriftLimit(longest=1e-3)),
        duration=0.06,
    )
    (result,) = run([made])
    assert result.work["entered"] == n
    rho = np.hypot(*result.state["position"][:, :2].T) / (side - RADIUS)
    assert rho.max() <= 1 + 1e-12
    assert stats.kstest(rho**2, "uniform").pvalue > 1e-3


def test_no_walls_and_particles_outside_are_refused():
    with pytest.raises(InputError, match=r"reflecting_walls\.planes must be given, or cylinders or spheres"):
        ReflectingWalls()
    outside = [[0, 0, 0], [2.0, 0, 0]]
    with pytest.raises(InputError, match=r"particles\.position must be inside all walls of reflecting_walls"):
        simulate([scene(outside, np.zeros((2, 3)), (TUBE,), radius=A)])
    held = scene(outside, np.zeros((2, 3)), (TUBE,), radius=A, quantities={"fixed": [0, 1]})
    assert TUBE.check_start(held.start(), held) is None
    with pytest.raises(InputError, match=r"cylinders\.0\.radius must be above the radius of the largest par"):
        simulate([scene([[0, 0, 0]], np.zeros((1, 3)), (TUBE,), radius=HALF)])
