"""Rigid clumps that are inserted, come to rest and leave: one scene over a soft floor, compiled once."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Turn
from scipy.stats import kstest

from tests.operators.test_filling import DAMPING, DT, NEVER, Floor, side_by_side, uniforms
from tests.scenes import by_id, compiled, fixed
from tisim import Cloud, Clump, GrainClass, InputError, Particles, Scene
from tisim.analysis import clump_bodies
from tisim.effects import Gravity, RigidClumps
from tisim.geometry import Plane
from tisim.numerics.random_streams import INSERTION
from tisim.operators import AtRest, InsertionByFlux, InsertionByFraction, Outflow, Passage
from tisim.packing import EqualSizes, UniformSizes

G, RHO = 9.81, 1000.0
PEAR = Clump(
    centres=np.array([(0, 0, 0), (1.6, 0, 0), (0.5, 1.3, 0), (0, 0, 0.9)]),
    radii=np.array([1, 0.8, 0.7, 0.5]),
    density=3.0,
)
SIZE = float(np.cbrt(PEAR.body.mass / 3.0 * 3 / (4 * np.pi)))
"""Radius (m) of a sphere of the same volume."""
GRAINS = (
    GrainClass(
        sizes=UniformSizes(by="number", smallest=0.03, largest=0.05), density=RHO, clump=PEAR, share=3.0
    ),
    GrainClass(sizes=EqualSizes(radius=0.04), density=1200.0),
)
NUMBER = 150
LOW, HIGH = np.array([0.0, 0.0, 1.0]), np.array([1.5, 1.5, 2.5])
BED = [(0.0, 0.0, 0.12), (0.5, 0.1, 0.14), (1.0, -0.2, 0.13)]
THERE = [(-4.5, 0.5, 1.5), (-4.8, 0.2, 1.2), (-4.2, 0.8, 1.8)]
SMALL = Clump(centres=0.04 * PEAR.centres, radii=0.04 * PEAR.radii, density=RHO)


def filling(
    begin=NEVER, fill=NEVER, fraction=0.03, interval=0.1, flux=1e5, gravity=G, bed=BED, edge=50.0,
    side=-1.0, velocity=0.0, duration=0.4, floor=DAMPING,
):  # fmt: skip
    """Three clumps on the floor, and more that are inserted above it."""
    more = {"velocity": (velocity, 0.0, 0.0), "angular_velocity": (0.0, 2.0, 1.0)}
    return Scene(
        particles=Particles.of_clumps(SMALL, bed, **more) if bed else Particles.none(),
        effects=(
            RigidClumps(),
            Floor(damping=floor),
            Gravity(acceleration=(0.0, 0.0, -gravity)),
            InsertionByFlux(
                name="pour", by="number", flux=flux, begin=begin, number=NUMBER, grains=GRAINS,
                low=tuple(LOW), high=tuple(HIGH), velocity=(0.0, 0.0, -1.0),
            ),
            InsertionByFraction(
                name="fill", fraction=fraction, interval=interval, begin=fill, number=NUMBER,
                grains=GRAINS[:1], low=(-5.0, 0.0, 1.0), high=(-4.0, 1.0, 2.0),
            ),
            Passage(planes=[Plane(point=(edge, 0, 0), normal=(side, 0, 0))]),
            Outflow(planes=[Plane(point=(edge, 0, 0), normal=(side, 0, 0))]),
            AtRest(time=0.05, energy=1e-4, unbalanced=2e-2),
        ),
        stepper=fixed(DT),
        duration=duration,
        seed=3,
    )  # fmt: skip


SCENES = {
    "pour": filling(begin=0.0, gravity=0.0, bed=()),
    "beside": filling(begin=0.1, gravity=0.0),
    "rest": filling(begin=0.1, fill=0.0, fraction=1e-9, interval=1e3, duration=12.0),
    "fill": filling(fill=0.0, bed=THERE, gravity=0.0, duration=0.15),
    "both": filling(begin=0.0, flux=450.0, gravity=0.0, edge=0.02, side=1.0, velocity=-3.0, floor=1e-3),
    "leaving": filling(gravity=0.0, edge=1.5, velocity=3.0, floor=1e-3),
    "staying": filling(gravity=0.0, velocity=3.0, floor=1e-3),
}


@pytest.fixture(scope="module")
def simulation():
    return compiled(SCENES["pour"], worlds=len(SCENES), capacity=12 + 8 * NUMBER)


@pytest.fixture(scope="module")
def outcome(simulation):
    return side_by_side(simulation, SCENES)


@pytest.fixture(scope="module")
def results(outcome):
    return outcome[0]


@pytest.mark.long
def test_inserted_clumps_follow_the_random_numbers(results):
    """Size, mass and inertia equal a template scaled in NumPy, and every sphere is at its place in the
    body."""
    state = by_id(results["pour"])
    u = np.array([uniforms(3, INSERTION + 3, k) for k in range(NUMBER)])
    number = np.array([one.number() for one in GRAINS])
    which = (u[:, 0] * number.sum() >= number[0]).astype(int)
    radius = np.where(which == 0, 0.03 + 0.02 * u[:, 1], 0.04)
    assert results["pour"].measures["pour_number"] == NUMBER
    assert len(state["mass"]) == np.where(which == 0, 4, 1).sum()
    mass = np.where(which == 0, RHO, 1200.0) * 4 / 3 * np.pi * radius**3
    assert results["pour"].measures["pour_mass"] == pytest.approx(mass.sum(), rel=1e-12)
    first = np.cumsum(np.where(which == 0, 4, 1)) - np.where(which == 0, 4, 1)
    np.testing.assert_array_equal(state["clump"][first[which == 1]], -1)
    np.testing.assert_array_equal(state["clump"][first[which == 0]], first[which == 0])
    bodies, grown = clump_bodies(results["pour"].state), radius[which == 0] / SIZE
    np.testing.assert_allclose(bodies.mass, mass[which == 0], rtol=1e-12)
    scaled = Clump(centres=grown[0] * PEAR.centres, radii=grown[0] * PEAR.radii, density=RHO).body
    np.testing.assert_allclose(bodies.mass[0], scaled.mass, rtol=1e-9)
    np.testing.assert_allclose(bodies.inertia[0], scaled.moments, rtol=1e-7)
    for k, (n, factor) in enumerate(zip(first[which == 0], grown, strict=True)):
        members = slice(n, n + 4)
        arm = Turn.from_quat(np.roll(bodies.orientation[k], -1)).apply(factor * PEAR.body.places)
        np.testing.assert_allclose(state["position"][members], bodies.position[k] + arm, rtol=0, atol=1e-12)
        np.testing.assert_allclose(state["radius"][members], factor * PEAR.radii, rtol=1e-12)
        shares = PEAR.body.masses / PEAR.body.mass
        np.testing.assert_allclose(state["mass"][members], bodies.mass[k] * shares, rtol=1e-12)
    np.testing.assert_allclose(bodies.velocity, np.tile([0, 0, -1.0], (len(grown), 1)), atol=1e-12)


def test_orientations_are_uniform(results):
    """For uniform random rotations the angle t has the distribution (t - sin t) / pi, and the axis is
    uniform."""
    turns = Turn.from_quat(np.roll(clump_bodies(results["pour"].state).orientation, -1, axis=1))
    angle = turns.magnitude()
    assert kstest((angle - np.sin(angle)) / np.pi, "uniform").pvalue > 0.01
    for axis in np.eye(3):
        for component in turns.apply(axis).T:
            assert kstest((component + 1) / 2, "uniform").pvalue > 0.01


def test_inserted_clumps_overlap_no_other_grain(simulation):
    """Checked after each step, before the new clumps have moved: only spheres of the same clump overlap."""
    simulation.load(SCENES["pour"])
    known, waited = 0, 0
    for _ in range(40):
        simulation.run(steps=1)
        now = simulation.state
        order = np.argsort(now["id"])
        r, radius, clump = (now[name][order] for name in ("position", "radius", "clump"))
        outside = np.minimum(r - LOW, HIGH - r).min(axis=1) - radius
        assert (outside[known:] >= -1e-12).all()
        for k in range(known, len(r)):
            others = (clump[:k] != clump[k]) | (clump[:k] < 0)
            gaps = np.linalg.norm(r[:k] - r[k], axis=1) - radius[:k] - radius[k]
            assert (gaps[others] >= -1e-12).all()
        waited += 0 < known == len(r)
        known = len(r)
    assert known > 4 * 20


def test_insertions_do_not_affect_initial_clumps(results):
    """The initial clumps keep rotating freely, and member numbers are unique."""
    state = by_id(results["beside"])
    assert len(state["mass"]) > 12 + 4 * 20
    alone = by_id(results["staying"])
    bodies, others = clump_bodies(state), clump_bodies(alone)
    np.testing.assert_array_equal(bodies.angular_momentum[:3], others.angular_momentum)
    np.testing.assert_allclose(bodies.orientation[:3], others.orientation, rtol=0, atol=1e-9)
    held = state["clump_member"][state["clump"] >= 0]
    assert len(np.unique(held)) == len(held)


def test_a_region_is_filled_up_to_a_fraction_of_clumps(outcome):
    """The fraction counts the volume of each clump, not the sum of its spheres, and includes the initial
    clumps.

    At the next interval nothing is missing.
    """
    result, series = outcome[0]["fill"], outcome[1]["fill"]
    bodies = clump_bodies(result.state)
    volume = bodies.mass / RHO
    np.testing.assert_allclose(result.state["clump_volume"][result.state["clump_volume"] > 0], volume)
    assert volume[:-1].sum() < 0.03 <= volume.sum()
    spheres = (4 / 3 * np.pi * result.state["radius"] ** 3).sum()
    assert spheres > 1.05 * volume.sum()
    assert len(volume) == 3 + series["fill_number"][-1]
    assert series["fill_number"][0] == 0 < series["fill_number"][1] == series["fill_number"][-1] > 50


def test_clumps_inserted_during_an_outflow_remain(outcome):
    """Member numbers then have gaps, and inserted clumps reuse the slots of clumps that have left."""
    (results, series), name = outcome, "both"
    result, poured, gone = results[name], series[name]["pour_number"], series[name]["outflow"]
    leaving = np.flatnonzero(np.diff(gone)) + 1
    assert len(leaving) == 3
    assert (poured[leaving - 1] < poured[leaving]).all()
    assert result.work["outflow"] == 3
    assert result.measures["pour_number"] == NUMBER
    assert result.measures["outflow_mass"] == pytest.approx(3 * SMALL.body.mass, rel=1e-12)


def test_members_are_found_in_reused_slots(simulation):
    """Inserted clumps take slots with the member numbers of other clumps."""
    simulation.load(SCENES["both"])
    simulation.run(until=0.2)
    (before,) = simulation.measures([0])
    for _ in range(20):
        simulation.run(steps=1)
        member = simulation.s.read("clump_member")[0][: simulation.s.read("count")[0]]
        held = np.flatnonzero(member >= 0)
        assert (member[held] != held).any()
        np.testing.assert_array_equal(simulation.s.read("clump_index")[0][member[held]], held)
    assert simulation.measures([0])[0]["pour_number"] >= before["pour_number"] + 3


def test_clumps_can_be_inserted_among_spheres(simulation):
    start = Particles(position=[(0.0, 0.0, 0.04)], velocity=[(0.0, 0.0, 0.0)], radius=0.04, density=RHO)
    simulation.load(SCENES["pour"].model_copy(update={"particles": start}))
    simulation.run(until=0.002)
    (result,) = simulation.results()
    clump = by_id(result)["clump"]
    assert clump[0] == -1
    assert clump.max() > 0


def test_bodies_of_other_inertia_are_another_structure():
    def of(moment):
        shape = Clump(centres=PEAR.centres, radii=PEAR.radii, mass=1.0, inertia=np.diag([moment, 2.0, 2.5]))
        grains = GrainClass(sizes=EqualSizes(radius=0.04), density=RHO, clump=shape)
        return InsertionByFlux(flux=1.0, number=1, grains=[grains], low=tuple(LOW), high=tuple(HIGH))

    assert of(1.0).structure() == of(1.0).structure() != of(1.5).structure()


def test_clumps_at_rest_end_the_run(results):
    """The criteria use the kinetic energy of the bodies and the total force on each."""
    result = results["rest"]
    assert result.status.reason == "grains are at rest, by effects.at_rest"
    bodies, state = clump_bodies(result.state), result.state
    depth = G * (state["mass"] * state["radius"]).sum()
    free, spin = state["clump"] < 0, 0.4 * state["radius"] ** 2 * (state["spin"] ** 2).sum(axis=1)
    of_spheres = 0.5 * state["mass"] * ((state["velocity"] ** 2).sum(axis=1) + spin)
    kinetic = bodies.energy.sum() + of_spheres[free].sum()
    assert result.measures["kinetic_ratio"] == pytest.approx(kinetic / depth, rel=1e-9)
    grains = np.where(state["clump"] >= 0, state["clump"], -1 - np.arange(len(state["mass"])))
    force = [np.linalg.norm(state["force"][grains == k].sum(axis=0)) for k in np.unique(grains)]
    weight = G * state["mass"].sum()
    assert result.measures["unbalanced_ratio"] == pytest.approx(sum(force) / weight, rel=1e-9)
    # The forces on single spheres include the internal constraint forces, so they never balance.
    assert np.linalg.norm(state["force"], axis=1).sum() > 0.1 * weight
    assert result.measures["pour_number"] == NUMBER
    np.testing.assert_array_less(bodies.position[:, 2], 0.12)


def test_a_clump_leaves_as_a_whole(outcome):
    """It leaves when its centre of mass crosses the plane. The remaining clumps match a run without outflow
    to the bit."""
    results, series = outcome
    leaving, staying = results["leaving"], by_id(results["staying"])
    mass = SMALL.body.mass
    where = clump_bodies(staying).position[:, 0]
    gone = where > 1.5
    assert gone.tolist() == [False, True, True]
    assert leaving.work["outflow"] == 2
    assert leaving.measures["outflow_mass"] == pytest.approx(2 * mass, rel=1e-12)
    assert leaving.measures["passed_mass"] == leaving.measures["outflow_mass"]
    assert set(series["leaving"]["particles"]) == {12, 8, 4}
    time = series["leaving"]["time"]
    for number, clump in ((8, 2), (4, 1)):
        first = time[series["leaving"]["particles"] <= number][0]
        assert first == pytest.approx((1.5 - BED[clump][0]) / 3.0, abs=0.021)
    left = by_id(leaving)
    for name, values in left.items():
        np.testing.assert_array_equal(values, staying[name][:4], err_msg=name)


@pytest.mark.parametrize("name", ["beside", "leaving"])
def test_a_restart_does_not_change_the_run(simulation, results, tmp_path, name):
    """This also holds if, after clumps have come or gone, a state field is overwritten with its own
    values."""
    simulation.load(SCENES[name])
    simulation.run(until=0.3)
    simulation.checkpoint(tmp_path / "half")
    simulation.load(SCENES[name])
    simulation.restore(tmp_path / "half")
    simulation.state["clump_velocity"] = simulation.state["clump_velocity"]
    simulation.run()
    (again,) = simulation.results()
    assert again.measures == results[name].measures
    for field, values in results[name].state.items():
        np.testing.assert_array_equal(again.state[field], values, err_msg=field)


@pytest.mark.slow
@pytest.mark.parametrize("schedule", ["particle", "team"])
def test_other_schedules_do_not_change_the_run(results, schedule):
    names = ("both", "beside", "fill")
    simulation = compiled(SCENES["pour"], worlds=3, capacity=12 + 8 * NUMBER, schedule=schedule)
    simulation.load([SCENES[name] for name in names])
    simulation.run()
    for result, name in zip(simulation.results(), names, strict=True):
        assert result.measures == results[name].measures
        for field, values in results[name].state.items():
            np.testing.assert_array_equal(result.state[field], values, err_msg=field)


def test_a_scene_file_holds_classes_of_clumps():
    made = SCENES["pour"]
    assert Scene.from_dict(made.to_dict()).digest() == made.digest()


WRONG = {
    "no room": (
        lambda: InsertionByFlux(flux=1.0, number=1, grains=GRAINS[:1], low=(0, 0, 0), high=(1, 1, 0.1)),
        "insertion_by_flux.high must be at least 0.1",
    ),
    "a cloud": (lambda: Cloud(number=3, grains=GRAINS), "cloud.grains must be spheres; received clumps"),
    "loose spheres": (
        lambda: Scene(particles=Particles.none(), effects=(SCENES["pour"].effects[3],), duration=1.0),
        r"effects.pour must be used together with effects.rigid_clumps",
    ),
}


@pytest.mark.parametrize(("make", "message"), WRONG.values(), ids=WRONG)
def test_impossible_values_are_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()
