"""Grains on a table that rotates about its normal, with a liquid: against their reference and
closed forms."""

import numpy as np
import pytest

from tests.effects.contact.grains import WORLDS
from tests.effects.contact.granular_reference import Grains, law_of
from tests.effects.contact.loads import close
from tests.scenes import by_id, compiled, scene
from tisim import Material
from tisim.effects import (
    CapillaryBridge,
    Granular,
    Gravity,
    HertzMaterial,
    MindlinForce,
    RestitutionDamping,
    RollingSDS,
    Rotation,
    TwistingSDS,
    Walls,
)
from tisim.geometry import Disc, Plane

pytestmark = pytest.mark.slow

RADIUS, G = 0.1, 10.0
AWAY = 1e6
LAW = Granular(
    normal=HertzMaterial(),
    damping=RestitutionDamping(),
    tangential=MindlinForce(),
    rolling=RollingSDS(),
    twisting=TwistingSDS(),
)
SURFACE = {
    "young": 1e6,
    "poisson": 0.3,
    "restitution": 0.5,
    "friction": 0.5,
    "rolling_friction": 0.1,
    "rolling_stiffness": 1e4,
    "rolling_damping": 20.0,
    "twisting_friction": 0.01,
    "twisting_stiffness": 20.0,
    "twisting_damping": 0.05,
}
RATE, CENTRE = (0.0, 0.0, 3.0), (0.05, -0.1, 0.0)
LIQUID = {"surface_tension": 0.5, "contact_angle": 0.4, "volume": 1e-6}
RUPTURE = 1.2 * 1e-2
"""m; (1 + theta / 2) V^(1/3)."""
TABLE, COIN = Plane(), Disc(radius=5.0)
NO_TABLE, NO_COIN = Plane(point=(0, 0, -AWAY)), Disc(centre=(0, 0, -AWAY), radius=1.0)


def on_table(position, velocity, spin, rate=RATE, gravity=G, liquid=0.0, table=TABLE, coin=NO_COIN, **more):
    """Grains of 1 kg and 0.1 m, at a plane or a disc; a liquid has a surface tension."""
    acting = (
        LAW,
        CapillaryBridge(**{**LIQUID, "surface_tension": liquid}),
        Walls(planes=[table], discs=[coin], motion=Rotation(rate=rate, centre=CENTRE)),
        Gravity(acceleration=(0.0, 0.0, -gravity)),
    )
    given = {"radius": RADIUS, "mass": 1.0, "dt": 1e-4, "quantities": {"spin": spin}, **more}
    return scene(position, velocity, acting, materials={"grain": Material(**SURFACE)}, **given)


def ended(scenes, until=None):
    simulation = compiled(scenes[0], WORLDS, 8)
    simulation.load(scenes)
    simulation.run(until=until)
    results = simulation.results()
    for result in results:
        assert result.status.ok or result.status.reason == "running", result.status.reason
    return [by_id(result) for result in results]


def bridge(gap, radius, tension):
    """The force (N) of a bridge between a sphere and a plane, a sphere of infinite radius: R = 2 R_i."""
    mean = 2 * radius
    s = np.maximum(gap, 0) * np.sqrt(mean / LIQUID["volume"])
    line = 2 * np.pi * mean * tension * np.cos(LIQUID["contact_angle"])
    return line / (1 + 1.05 * s + 2.5 * s**2)


class WetGrains(Grains):
    """Grains that are also held to a plane by a liquid, after they have touched it."""

    tension, wet = 0.0, False

    def _plane(self, k, point, normal, dt):
        super()._plane(k, point, normal, dt)
        gap = (self.x - point) @ normal - self.radius
        self.wet = (gap <= 0) | (self.wet & (gap <= RUPTURE))
        pull = np.where(self.wet, bridge(gap, self.radius, self.tension), 0.0)
        self.force -= pull[:, None] * normal


def reference(made, rate=RATE, tension=0.0):
    start = made.start()
    columns = (start[name] for name in ("position", "velocity", "spin", "radius", "mass"))
    WetGrains.tension = tension
    acceleration = made.effects[3].acceleration
    return WetGrains(
        law_of(made), *columns, planes=[((0, 0, 0), (0, 0, 1))], acceleration=acceleration,
        turning=(rate, CENTRE),
    )  # fmt: skip


@pytest.fixture(scope="module")
def thrown():
    """Grains that slide, spin and hop on the table, and some that almost rotate with it; wet and dry."""
    rng = np.random.default_rng(8)
    radius = RADIUS * np.linspace(0.8, 1.0, 6)
    height = radius * rng.uniform(0.995, 1.02, 6)
    place = np.column_stack([np.arange(6) - 2.5, rng.uniform(-0.3, 0.3, 6), height])
    velocity, spin = rng.normal(size=(6, 3)) * [0.5, 0.5, 0.3], 4 * rng.normal(size=(6, 3))
    velocity[3:] = 0.03 * velocity[3:] + np.cross(RATE, place[3:] - CENTRE)
    spin[3:] = 0.03 * spin[3:] + RATE
    more = {"steps": 1000, "radius": radius}
    return [on_table(place, velocity, spin, liquid=tension, **more) for tension in (0.0, 5.0)]


def test_a_turning_table_with_liquid_equals_the_reference(thrown):
    """Slip, rolling and twisting depend on the spin relative to the table."""
    states = ended(thrown)
    for made, state, tension in zip(thrown, states, (0.0, 5.0), strict=True):
        grains = reference(made, tension=tension)
        grains.run(1000, 1e-4)
        assert grains.sliding > 50 < grains.sticking
        for name, values in (("position", grains.x), ("velocity", grains.v), ("spin", grains.w)):
            close(state[name], values, 1e-10)
    wet, dry = states[1]["position"][:, 2], states[0]["position"][:, 2]
    assert np.abs(wet - dry).max() > 1e-4


def test_a_disc_acts_as_the_table(thrown):
    """Its contacts are found and stored in another way."""
    discs = [
        made.model_copy(
            update={
                "effects": tuple(
                    one.model_copy(update={"planes": (NO_TABLE,), "discs": (COIN,)}) if isinstance(one, Walls)
                    else one
                    for one in made.effects
                )
            }
        )
        for made in thrown
    ]  # fmt: skip
    for at_disc, at_table in zip(ended(discs), ended(thrown), strict=True):
        for name in ("position", "velocity", "spin"):
            close(at_disc[name], at_table[name], 1e-9)


def test_a_grain_on_the_axis_is_spun_up_by_the_table():
    """By twisting resistance alone. A grain whose centre moves with the table has no rolling resistance."""
    sunk = (3 * G / (4 * SURFACE["young"] / (2 * (1 - 0.09)) * RADIUS**0.5)) ** (2 / 3)
    place = np.array([[*CENTRE[:2], RADIUS - sunk]])
    still, along = (on_table(place, [[0, 0, 0]], [spin], steps=10_000) for spin in ((0.0, 0.0, 0.0), RATE))
    turned, stays = ended([still, along])
    np.testing.assert_allclose(turned["spin"][0], RATE, rtol=0, atol=0.05)
    np.testing.assert_allclose(stays["spin"][0], RATE, rtol=0, atol=1e-9)
    np.testing.assert_allclose(turned["position"][0], place[0], rtol=0, atol=1e-9)


def test_a_bridge_holds_a_grain_to_a_wall_until_it_ruptures():
    """A heavy grain separates slowly from a plane and from a disc: 4 pi R gamma cos(theta) at contact, and
    Willett's force at each gap; no force before they have touched."""
    heavy, v, walls = {"mass": 1e9, "gravity": 0.0, "dt": 1e-3, "duration": 2.0, "liquid": 0.5}, 0.01, []
    for shapes in ({}, {"table": NO_TABLE, "coin": COIN}):
        for start in (-1e-9, 0.3 * RUPTURE):
            walls.append(on_table([[0, 0, RADIUS + start]], [[0, 0, v]], [RATE], **shapes, **heavy))
    assert bridge(0, RADIUS, 0.5) == pytest.approx(4 * np.pi * RADIUS * 0.5 * np.cos(0.4))
    for part in (0.05, 0.5, 0.98, 1.02):
        states = ended(walls, until=part * RUPTURE / v)
        for wet, dry in (states[:2], states[2:]):
            gap = wet["position"][0, 2] - RADIUS
            expected = bridge(gap, RADIUS, 0.5) if gap <= RUPTURE else 0.0
            np.testing.assert_allclose(wet["force"][0], [0, 0, -expected], rtol=1e-9, atol=1e-12)
            np.testing.assert_array_equal(dry["force"], 0)
