"""Scenes of the packed filter: colloids in the pores, the field, the flow, and a whole run."""

from dataclasses import replace

import numpy as np
import pytest

from tisim import Simulation
from tisim.analysis import particle_balance
from tisim.cases.packed_filter.matrix import in_pores, magnetised
from tisim.cases.packed_filter.measures import (
    captured_fraction,
    has_left,
    missing,
    penetration,
    released_fraction,
)
from tisim.cases.packed_filter.scene import MEAN_RADIUS, POLYDISPERSITY, eluted, filter_of, scene_for
from tisim.sources import MagneticCylinders, PoreFlow, sample

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def filter():
    """A filter with coarse fields, so that scenes compile quickly."""
    return filter_of("small", number=60, feed=10.0, field_end=80.0, duration=160.0, resolution=3.0, digits=2)


@pytest.fixture(scope="module")
def looks(filter):
    """Results of a run at eight times; the field ends at the fourth."""
    return eight_looks(filter.scene(3))


def eight_looks(scene):
    """Results of a run at eight equally spaced times, the last at its end."""
    simulation, seen = Simulation(scene), []
    simulation.load(scene)
    for time in np.linspace(0.0, scene.duration, 9)[1:]:
        simulation.run(until=time)
        seen += simulation.results()
    return seen


@pytest.fixture(scope="module")
def result(looks):
    return looks[-1]


def test_colloids_start_in_the_pores(filter):
    fibres, box = filter.magnets(), filter.box()
    place = in_pores(500, fibres, box, 7)
    assert (place >= box.low).all()
    assert (place <= box.high).all()
    for body in fibres:
        away = place - body.centre
        along = away @ body.direction
        across = np.linalg.norm(away - np.outer(along, body.direction), axis=1)
        assert not ((across < body.radius) & (np.abs(along) < body.length / 2)).any()
    # They fill the pores evenly: as many in each half.
    share = (place < (np.add(box.low, box.high) / 2)).mean(axis=0)
    np.testing.assert_allclose(share, 0.5, atol=0.1)


def test_sizes_and_moments_are_those_of_the_ferrofluid():
    scene = filter_of("small", "static", number=20_000).scene(0)
    radius, moment = (
        scene.particles.arrays(scene.domain, 0)[name] for name in ("radius", "saturation_moment")
    )
    assert radius.mean() == pytest.approx(MEAN_RADIUS, rel=0.01)
    assert radius.std() / radius.mean() == pytest.approx(POLYDISPERSITY, rel=0.03)
    np.testing.assert_allclose(moment, 4.46e5 * 4 / 3 * np.pi * radius**3, rtol=1e-12)


@pytest.mark.slow
def test_neighbours_change_the_magnetisation_and_images_have_that_of_their_fibres(filter):
    number = filter.matrix.number
    every = np.array([one.magnetisation for one in filter.magnets()])
    alone = np.array([one.magnetisation for one in replace(filter, mutual=False).magnets()])
    expected = [magnetised(one, filter.field(), False).magnetisation for one in filter.matrix.fibres()]
    np.testing.assert_allclose(alone[:number], expected)
    change = np.linalg.norm(every - alone, axis=1)[:number] / 2.2e6
    assert 0.02 < change.mean() < 0.3
    known = {tuple(one) for one in every[:number]}
    assert {tuple(one) for one in every[number:]} <= known


def test_saturated_fibres_are_stronger_than_soft_ones_across_the_field(filter):
    """At 1 T, below N mu_0 M_s across, soft fibres across the field are not saturated; those along it are."""
    alone = replace(filter, mutual=False)
    cosine, soft = np.array(
        [(abs(one.direction[0]), np.linalg.norm(one.magnetisation)) for one in alone.magnets()]
    ).T
    hard = replace(alone, saturated=True).magnets()
    np.testing.assert_allclose([np.linalg.norm(one.magnetisation) for one in hard], 2.2e6)
    assert (soft[cosine < 0.2] < 0.95 * 2.2e6).all()
    assert (soft[cosine > 0.6] > 0.99 * 2.2e6).all()
    assert min(one.magnetisation[0] for one in hard) > 0
    both = replace(alone, saturated=True, mutual=True).magnets()
    np.testing.assert_allclose([np.linalg.norm(one.magnetisation) for one in both], 2.2e6)
    change = [np.subtract(a.magnetisation, b.magnetisation) for a, b in zip(hard, both, strict=True)]
    assert 0.02 < np.linalg.norm(change, axis=1).mean() / 2.2e6 < 0.3


@pytest.mark.slow
def test_the_flow_has_the_superficial_velocity_and_rests_in_fibres(filter):
    scene = filter.scene(0)
    flow = next(one for one in scene.effects if isinstance(one, PoreFlow))
    # A plane in the clear water, with points at the centres of squares.
    x, y = (flow.low[a] + (np.arange(40) + 0.5) / 40 * (flow.high[a] - flow.low[a]) for a in range(2))
    plane = np.stack([*(one.ravel() for one in np.meshgrid(x, y)), np.full(1600, flow.low[2] + 1e-4)], axis=1)
    velocity, _ = sample(scene.effects, "flow_velocity", plane)
    assert velocity[:, 2].mean() == pytest.approx(filter.speed, rel=1e-3)
    body = filter.matrix.fibres()[0]
    inner, _ = sample(scene.effects, "flow_velocity", [body.centre])
    assert np.linalg.norm(inner) < 1e-3 * filter.speed


@pytest.mark.slow
def test_no_colloid_is_lost_and_most_are_released(result):
    assert result.status.ok
    assert missing([result]) == 0
    assert result.work["entered"] == 60
    assert result.work["captures"] > 5
    assert 0.1 < penetration(result) < 0.95
    assert 0.3 < released_fraction(result) < 0.9
    # A colloid that is released leaves: after the end of the field nothing is captured again.
    held = result.work["captures"] - result.work["releases"]
    assert captured_fraction(result) == pytest.approx(held / 60)
    assert result.state["captured_at"].max() <= 80.5


@pytest.mark.slow
def test_colloids_balance_at_every_look(looks):
    """Entered are out, captured or free; nothing is released while the field is on."""
    assert [missing([one]) for one in looks] == [0] * len(looks)
    entered, captures, releases = (
        np.array([one.work[name] for one in looks]) for name in ("entered", "captures", "releases")
    )
    assert (np.diff(entered) >= 0).all()
    assert entered[0] == entered[-1] == 60
    held = [particle_balance(one.work, one.state).captured for one in looks]
    np.testing.assert_array_equal(held, captures - releases)
    assert (releases[:3] == 0).all()
    assert releases[-1] > 5
    assert captures[3] > captures[0]


@pytest.mark.slow
def test_the_small_scene_is_dynamic_and_the_static_one_is_periodic():
    dynamic, static = scene_for("small", 0), filter_of("small", "static").scene(0)
    assert {one.kind() for one in dynamic.effects} - {one.kind() for one in static.effects} == {
        "pore_flow", "inlet", "outlet",
    }  # fmt: skip
    assert (dynamic.domain.periodic, static.domain.periodic) == ((True, True, False), (True, True, True))
    count = [
        len(next(e for e in s.effects if isinstance(e, MagneticCylinders)).cylinders)
        for s in (dynamic, static)
    ]
    assert count[0] < count[1]


@pytest.mark.slow
def test_colloids_stay_in_a_tube_with_its_flow():
    """In the resolved flow, which rests at the wall, and in water at rest."""
    coarse = {"number": 60, "tube": 1.5, "resolution": 3.0, "digits": None}
    flowing = filter_of("small", feed=10.0, field_end=80.0, duration=160.0, **coarse)
    scene, radius = flowing.scene(3), flowing.matrix.sides[0] / 2
    (flow,) = (one for one in scene.effects if isinstance(one, PoreFlow))
    rho, turn = (np.arange(40) + 0.5) / 40 * radius, np.arange(20) * np.pi / 10
    plane = np.stack(
        [
            np.outer(rho, np.cos(turn)).ravel(),
            np.outer(rho, np.sin(turn)).ravel(),
            np.full(800, flow.low[2] + 1e-4),
        ],
        axis=1,
    )
    velocity, _ = sample(scene.effects, "flow_velocity", plane)
    mean = (velocity[:, 2].reshape(40, 20).mean(axis=1) * rho).sum() / rho.sum()
    assert mean == pytest.approx(flowing.speed, rel=0.02)
    for one in (flowing, filter_of("small", "static", duration=20.0, **coarse)):
        looks = eight_looks(one.scene(3))
        result = looks[-1]
        assert result.status.ok
        assert [missing([each]) for each in looks] == [0] * len(looks)
        assert result.work["captures"] > 5
        assert np.hypot(*result.state["position"][:, :2].T).max() < radius


@pytest.fixture(scope="module")
def rinsed():
    """An elution in a uniform flow, in which all colloids leave within one transit."""
    return eluted(5.0, "small", number=60, digits=None, flow="uniform")


def test_the_flow_of_an_elution_begins_after_the_wait(rinsed):
    scene = rinsed.scene(3)
    flow = next(one for one in scene.effects if one.kind() == "uniform_flow")
    assert flow.begin == 5.0
    assert scene.duration > 5.0 + 3 * rinsed.matrix.depth / rinsed.pore_speed
    assert "inlet" not in {one.kind() for one in scene.effects}
    assert scene.domain.periodic == (True, True, False)
    low, high = scene.domain.bounds()
    start = scene.particles.arrays(scene.domain, 3)["position"]
    assert (low <= start).all()
    assert (start <= high).all()


@pytest.mark.slow
def test_an_elution_rinses_free_colloids_out(rinsed):
    scene = rinsed.scene(3)
    looks = eight_looks(scene)
    assert [missing([one]) for one in looks] == [0] * len(looks)
    result = looks[-1]
    left, captured = has_left(result), result.state["captured_at"] >= 0
    np.testing.assert_array_equal(left, ~captured)
    assert left.sum() > 5
    # The nearest to the outlet is a whole approach away from it; no colloid leaves without a flow.
    assert result.state["exited_at"][left].min() > 5.0 + 0.9 * rinsed.matrix.length / rinsed.pore_speed
    assert result.state["exited_at"][left].max() < 5.0 + 1.1 * rinsed.transit
    # Water carries colloids against fibres.
    assert (captured & (result.state["captured_at"] > 5.0)).sum() > 5
    assert captured_fraction(result, 5.0) > 0.05
