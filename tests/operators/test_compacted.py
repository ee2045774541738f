"""A servo wall compacts a bed to a target pressure, or until the solids fill a target fraction of a
region."""

import numpy as np
import pytest

from tests.scenes import compiled, fixed, scene, simulate
from tisim import Box, Cloud, InputError, Material, MeasureSeries, Scene
from tisim.analysis import solid_fraction
from tisim.effects import Granular, MindlinForce, RestitutionDamping, Servo, Walls
from tisim.geometry import Plane
from tisim.operators import Compacted
from tisim.packing import RandomInBox

SIDE, HEIGHT, PRESSURE, GRAINS, RADIUS = 0.05, 0.18, 5000.0, 400, 4e-3
"""Side (m), height (m), pressure (Pa), number of grains, radius (m)."""
LOW, HIGH = (0.0, 0.0, 0.01), (SIDE, SIDE, 0.04)
"""Corners of the observed region, m."""
INTERVAL = 5e-3
"""Interval of the checks, s."""


def bed(fraction):
    """Loose grains between a floor and a descending lid, in a box that is periodic in the other
    directions."""
    return Scene(
        particles=Cloud(
            number=GRAINS,
            radius=RADIUS,
            density=2500.0,
            placement=RandomInBox(low=(0, 0, 0), high=(SIDE, SIDE, HEIGHT)),
        ),
        materials={"glass": Material(young=1e7, poisson=0.25, restitution=0.3, friction=0.2)},
        effects=(
            Granular(damping=RestitutionDamping(), tangential=MindlinForce()),
            Walls(name="floor", planes=[Plane()]),
            Walls(
                name="lid",
                planes=[Plane(point=(0, 0, HEIGHT), normal=(0, 0, -1))],
                motion=Servo(force=PRESSURE * SIDE**2, direction=(0, 0, -1), limit=0.1),
            ),
            Compacted(fraction=fraction, low=LOW, high=HIGH, interval=INTERVAL),
        ),
        domain=Box(low=(0, 0, -1), high=(SIDE, SIDE, 1), periodic=(True, True, False)),
        stepper=fixed(2e-5),
        duration=1.6,
        seed=3,
    )


def filled(state):
    """Solid fraction of the region, from grains whose centres are inside it."""
    inside = ((state["position"] >= LOW) & (state["position"] <= HIGH)).all(axis=1)
    return 4 / 3 * np.pi * (state["radius"][inside] ** 3).sum() / np.prod(np.subtract(HIGH, LOW))


@pytest.mark.slow
def test_compaction_to_a_pressure_or_a_solid_fraction():
    """The pressure on lid and floor is right to one hundredth; the volume fraction equals NumPy at the first
    check that reaches the target."""
    scenes = [bed(fraction) for fraction in (0.99, 0.5)]
    simulation = compiled(scenes[0], 2, GRAINS)
    simulation.load(scenes)
    series = MeasureSeries(INTERVAL)
    simulation.run(observers=[series])
    pressed, dense = simulation.results()
    assert pressed.status.ok
    assert pressed.time == pytest.approx(1.6)
    for name, sign in (("lid", 1), ("floor", -1)):
        assert pressed.measures[f"{name}_force_z"] / SIDE**2 == pytest.approx(sign * PRESSURE, rel=0.01)
    (fraction,) = solid_fraction(
        pressed.state["position"], pressed.state["radius"], [LOW[2], HIGH[2]], SIDE**2
    )
    assert 0.55 < fraction < 0.65
    assert dense.status.ok
    assert dense.status.reason == "grains fill the region, by effects.compacted"
    assert dense.time < 0.9 * pressed.time
    assert filled(dense.state) >= 0.5
    assert dense.measures["filled_fraction"] == pytest.approx(filled(dense.state), rel=1e-12)
    on_the_way = series[1]["filled_fraction"]
    assert (on_the_way[:-1] < 0.5).all()
    assert on_the_way[1] == pytest.approx(filled(dense.start), abs=0.05)


def test_a_region_is_checked_once_in_each_interval():
    """In each world one grain enters the region at a different time; the world ends at the next check."""
    dt, interval, side, speed = 1e-4, 1e-3, 2.0, 1.0
    arrivals = np.random.Generator(np.random.Philox(1)).uniform(0.0, 0.5, 64)
    look = Compacted(fraction=0.1, low=(0, 0, 0), high=(side,) * 3, interval=interval)
    scenes = [
        scene([[-speed * at, 1, 1]], [[speed, 0, 0]], (look,), radius=0.8, dt=dt, duration=1.0)
        for at in arrivals
    ]
    results = simulate(scenes, worlds=len(scenes), capacity=4)
    ends = np.array([result.time for result in results])
    assert all(result.status.reason.startswith("grains fill the region") for result in results)
    # Rounding may shift the first step of an interval by one.
    assert np.isin(np.round(ends / dt) % 10, (0, 1)).all()
    assert ((ends >= arrivals) & (ends <= arrivals + interval + dt)).all()
    filled_part = 4 / 3 * np.pi * 0.8**3 / side**3
    assert results[0].measures["filled_fraction"] == pytest.approx(filled_part, rel=1e-6)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"fraction": 1.0}, "fraction must be less than 1"),
        ({"high": (SIDE, SIDE, 0.0)}, "high must be above low"),
        ({"interval": 0.0}, "interval must be greater than 0"),
    ],
)
def test_invalid_settings_are_refused(given, message):
    with pytest.raises(InputError, match=message):
        Compacted(**{"fraction": 0.5, "low": LOW, "high": HIGH, "interval": INTERVAL, **given})
