"""Particles that touch a magnet are captured and stay there under any force; checked against NumPy."""

import numpy as np
import pytest

from tests.scenes import compiled, scene, simulate
from tisim import InputError, Scene
from tisim.effects import Gravity, Impact, MagneticBodyForce, Tether
from tisim.operators import Capture
from tisim.sources import Cylinder, MagneticCylinders, MagneticField, MagneticSpheres, Sphere

DT, STEPS, RADIUS = 0.02, 60, 0.05
"""Flights last 1.2 s at speeds of about 1 m/s, with steps shorter than a radius."""


def bodies(rng, cylinders, spheres):
    """Random magnets without magnetisation."""
    return (
        MagneticCylinders(
            cylinders=[
                Cylinder(
                    centre=rng.normal(size=3),
                    axis=rng.normal(size=3),
                    radius=rng.uniform(0.1, 0.4),
                    length=rng.uniform(0.1, 1),
                )
                for _ in range(cylinders)
            ]
        ),
        MagneticSpheres(
            spheres=[Sphere(centre=rng.normal(size=3), radius=rng.uniform(0.1, 0.4)) for _ in range(spheres)]
        ),
    )


def distance(body, r):
    """Distance from the surface of a body, negative inside; r has shape (n, 3)."""
    d = r - body.centre
    if isinstance(body, Sphere):
        return np.linalg.norm(d, axis=1) - body.radius
    z = d @ np.array(body.direction)
    side = np.linalg.norm(d - z[:, None] * np.array(body.direction), axis=1) - body.radius
    end = np.abs(z) - body.length / 2
    return np.hypot(np.maximum(side, 0), np.maximum(end, 0)) + np.minimum(np.maximum(side, end), 0)


def flying(rng, magnets, n=60, **more):
    """Particles in free flight, none of which touches a magnet at the start."""
    solids = [*magnets[0].cylinders, *magnets[1].spheres]
    position = rng.normal(size=(400, 3)) * 1.5
    position = position[np.all([distance(body, position) > 2 * RADIUS for body in solids], axis=0)][:n]
    effects = (*magnets, Tether(stiffness=(0.0, 0.0, 0.0)), Capture())
    return scene(
        position,
        0.4 * rng.normal(size=position.shape) - position,
        effects,
        radius=RADIUS,
        mass=1.0,
        dt=DT,
        steps=STEPS,
        **more,
    )


def reference(setup):
    """Reference implementation: the magnet that each particle touches first (-1 for none), the time, and the
    final position."""
    solids = [*setup.effects[0].cylinders, *setup.effects[1].spheres]
    r, v = np.array(setup.particles.position), np.array(setup.particles.velocity)
    by, at = np.full(len(r), -1), np.full(len(r), -1.0)
    for step in range(1, STEPS + 1):
        free = by < 0
        r[free] += DT * v[free]
        gaps = np.array([distance(body, r) for body in solids])
        touch = free & (gaps.min(axis=0) <= RADIUS)
        by[touch], at[touch] = gaps.argmin(axis=0)[touch], step * DT
    return by, at, r


@pytest.mark.long
def test_against_the_reference(rng):
    """Captured particles, their magnets and times agree, and they lie on the surface, in worlds with
    different numbers of magnets."""
    worlds = [flying(rng, bodies(rng, *numbers)) for numbers in ((1, 0), (3, 2), (0, 6), (8, 5))]
    results = simulate(worlds, worlds=4, capacity=64)
    caught = 0
    for setup, result in zip(worlds, results, strict=True):
        assert result.status.ok, result.status.reason
        by, at, r = reference(setup)
        np.testing.assert_array_equal(result.state["captured_by"], by)
        np.testing.assert_array_equal(result.state["fixed"], by >= 0)
        np.testing.assert_allclose(result.state["captured_at"], at, rtol=1e-12)
        assert result.work["captures"] == (by >= 0).sum()
        solids = [*setup.effects[0].cylinders, *setup.effects[1].spheres]
        for k, body in enumerate(solids):
            positions = result.state["position"][by == k]
            np.testing.assert_allclose(distance(body, positions), RADIUS, rtol=1e-12)
        assert (result.state["velocity"][by >= 0] == 0).all()
        np.testing.assert_allclose(result.state["position"][by < 0], r[by < 0], atol=1e-12)
        # The particle moves from the end of its step to the surface by the shortest path.
        moved = np.linalg.norm(result.state["position"] - r, axis=1)
        assert (moved <= DT * np.linalg.norm(setup.particles.velocity, axis=1) + 1e-12).all()
        caught += (by >= 0).sum()
    assert caught > 20
    alone = simulate(worlds[1:2], worlds=4, capacity=64)[0]
    for name, values in alone.state.items():
        np.testing.assert_array_equal(values, results[1].state[name])


@pytest.mark.slow
def test_fixed_particles_feel_no_force():
    """Gravity and the magnetic force act on the free particle only; initially fixed particles are not counted
    as captured."""
    magnet = MagneticCylinders(cylinders=[Cylinder(radius=0.5, length=1, magnetisation=(0, 0, 1e6))])
    setup = scene(
        [[0.0, 0, 0.56], [3, 0, 0], [0, 0, 2]],
        [[0.0, 0, -2], [0, 0, 0], [0, 0, 0]],
        (magnet, MagneticField(constant=(0, 0, 1)), MagneticBodyForce(gamma=1e-2), Gravity(), Capture()),
        radius=RADIUS,
        mass=1.0,
        dt=0.01,
        steps=20,
        quantities={"fixed": [0, 0, 1]},
    )
    (result,) = simulate([setup], capacity=4)
    end = result.state
    np.testing.assert_allclose(end["position"][0], [0, 0, 0.55], atol=1e-15)
    np.testing.assert_array_equal(end["position"][2], [0, 0, 2])
    assert (end["velocity"][[0, 2]] == 0).all()
    assert end["velocity"][1, 2] == pytest.approx(-9.81 * 0.2, rel=0.01)
    np.testing.assert_array_equal(end["fixed"], [1, 0, 1])
    np.testing.assert_array_equal(end["captured_by"], [0, -1, -1])
    assert result.work["captures"] == 1
    force = compiled(setup, capacity=4).s.read("force")[0]
    assert (force[[0, 2]] == 0).all()
    assert (force[1] != 0).any()


def test_capture_needs_a_magnet_and_is_kept_in_files():
    with pytest.raises(InputError, match=r"effects\.capture must be used together with effects\.magnetic_"):
        scene([[0, 0, 0]], [[0, 0, 0]], (Capture(),))
    setup = scene(
        [[0, 0, 5]], [[0, 0, 0]], (MagneticCylinders(cylinders=[Cylinder(radius=1, length=1)]), Capture())
    )
    assert Scene.from_dict(setup.to_dict()).digest() == setup.digest()


def test_fixed_particles_start_at_rest_and_stay():
    body = MagneticCylinders(cylinders=[Cylinder(radius=1.0, length=2.0)])
    place, speed = [[3.0, 0, 0]], [[1.0, 0, 0]]
    moving = scene(place, speed, (body, Capture()), quantities={"fixed": [1]})
    with pytest.raises(InputError, match=r"particles.velocity must be 0 for fixed particles"):
        simulate([moving], capacity=1)
    with pytest.raises(InputError, match=r"effects.capture must be used without impact; received 'impact'"):
        scene(place, speed, (body, Capture(), Impact(hardness=1.0)))


@pytest.mark.long
def test_fibres_in_cells_capture_as_all_fibres_do():
    """With ``sum_digits`` only the fibres near the cell of a particle are compared with it. Particles fly
    through empty space from one group of fibres to another; the results agree to the bit."""
    rng = np.random.default_rng(4)
    groups = np.repeat([(-2.0, 0.0, 0.0), (2.0, 0.0, 0.0)], 20, axis=0)
    fibres = [
        Cylinder(centre=centre, axis=axis, radius=0.02, length=0.6, magnetisation=(0.0, 0.0, 1e5))
        for centre, axis in zip(
            groups + rng.normal(size=(40, 3)) * 0.4, rng.normal(size=(40, 3)), strict=True
        )
    ]
    start = rng.uniform((-5.0, -0.7, -0.7), (-3.5, 0.7, 0.7), (64, 3))
    results = []
    for digits in (None, 3):
        setup = scene(
            start,
            np.tile([6.0, 0.0, 0.0], (64, 1)),
            (
                MagneticCylinders(cylinders=fibres, sum_digits=digits),
                Tether(stiffness=(0.0, 0.0, 0.0)),
                Capture(),
            ),
            radius=0.01,
            mass=1.0,
            dt=0.003,
            steps=500,
        )
        results += simulate([setup])
    every, near = results
    caught = every.state["captured_by"]
    assert (caught[caught >= 0] < 20).any()
    assert (caught >= 20).any()
    assert (caught < 0).any()
    for name, values in every.state.items():
        np.testing.assert_array_equal(values, near.state[name], err_msg=name)
