"""Insertion, outflow and the end at rest: one scene of soft grains over a floor, compiled once."""

import numpy as np
import pytest

from tests.judged import check_message
from tests.numerics.test_philox import reference
from tests.scenes import by_id, compiled, fixed, scene
from tisim import GrainClass, InputError, Material, MeasureSeries, Particles, Recording, Scene, Simulation
from tisim.backend.taichi import ti
from tisim.describe.explained_parts import explained
from tisim.effects import Force, Gravity, PairForce, parameter
from tisim.geometry import Plane
from tisim.io import run_folder
from tisim.io.export import export
from tisim.io.reader import frames
from tisim.io.run_folder import RunFolder
from tisim.numerics.random_streams import INSERTION
from tisim.operators import AtRest, InsertionByFlux, InsertionByFraction, Outflow
from tisim.packing import EqualSizes, UniformSizes
from tisim.plotting.cloud import start_and_end
from tisim.plotting.movie import movie
from tisim.plotting.time_series import clouds, history, quantities
from tisim.state.fields import Field

pytestmark = pytest.mark.long

STIFFNESS, DAMPING, DT, G = 2e4, 60.0, 4e-4, 9.81
"""Stiffness (N/m), damping (N s/m), step (s), gravity (m/s^2)."""
NEVER = 1e3
"""A start time (s) after the end of every run."""


class StickingSpring(PairForce):
    """Springs along and across the line of centres; the tangential one keeps the slip of the pair as
    history."""

    fields = ("radius",)
    short_ranged = True
    memory = 3
    depends_on_velocity = True

    @ti.func
    def interaction(self, s, w, i, j, separation, distance, past, dt, t):
        n, v = separation / distance, s.relative_velocity(w, i, j, separation)
        depth, along = s.radius[w, i] + s.radius[w, j] - distance, v.dot(n)
        touching = depth > 0.0
        slid = ti.select(touching, 1.0, 0.0) * (past + dt * (v - along * n))
        normal = ti.select(touching, DAMPING * along - STIFFNESS * depth, 0.0)
        force = normal * n + 0.2 * STIFFNESS * slid
        return force, 0.0 * force, 0.0 * force, slid


class Floor(Force):
    """A spring and damping below z = 0."""

    fields = ("radius",)
    damping: float = parameter("N s/m", "damping", DAMPING, gt=0)

    @ti.func
    def force(self, s, w, i, t):
        depth = s.radius[w, i] - s.position[w, i][2]
        up, v = ti.Vector([0.0, 0.0, 1.0]), s.velocity[w, i]
        return ti.select(depth > 0.0, 1.0, 0.0) * (STIFFNESS * depth * up - self.damping(w) * v)


GRAINS = (
    GrainClass(
        sizes=EqualSizes(radius=0.06), density=1000.0, quantities={"tag": 7, "origin": (1.0, 2.0, 3.0)}
    ),
    GrainClass(
        sizes=UniformSizes(by="volume", smallest=0.03, largest=0.05),
        density=1200.0,
        share=2.0,
        material="ore",
        quantities={"tag": 8, "origin": (0.0, 0.0, 4.0)},
    ),
)
FLUX_NUMBER, FRACTION_NUMBER = 40, 30
LOW, HIGH = np.array([0.0, 0.0, 1.0]), np.array([0.6, 0.6, 1.4])
BED = np.array([[0.3, 0.3, 0.065], [0.3, 0.428, 0.065], [0.411, 0.364, 0.065], [0.34, 0.36, 0.17]])


class Tagged(Force):
    """Exerts no force; its only effect is that grains carry three fields."""

    fields = (
        "material",
        Field("tag", "", 1, "keep", integer=True, default=1),
        Field("origin", "m", 3, default="position"),
    )


def filling(
    flux=20.0,
    begin=0.0,
    fraction=0.05,
    fill=NEVER,
    seed=5,
    duration=0.3,
    velocity=0.0,
    floor=DAMPING,
    bed=BED,
):
    region = {"low": tuple(LOW), "high": tuple(HIGH), "grains": GRAINS}
    return scene(
        bed,
        np.tile([velocity, 0.0, 0.0], (len(bed), 1)),
        (
            StickingSpring(),
            Floor(damping=floor),
            Tagged(),
            Gravity(acceleration=(0.0, 0.0, -G)),
            InsertionByFlux(name="pour", flux=flux, begin=begin, number=FLUX_NUMBER, **region),
            InsertionByFraction(
                name="fill",
                fraction=fraction,
                begin=fill,
                interval=0.25,
                number=FRACTION_NUMBER,
                shape="cylinder",
                deviation=(0.5, 0.5, 0.0),
                **region,
            ),
            Outflow(planes=[Plane(point=(2.0, 0, 0), normal=(-1, 0, 0))]),
            AtRest(time=0.05, energy=1e-4, unbalanced=2e-2),
        ),
        radius=0.065,
        density=1000.0,
        materials={"sand": Material(), "ore": Material()},
        stepper=fixed(DT),
        duration=duration,
        seed=seed,
    )


SCENES = {
    "pour": filling(duration=0.5),
    "fill": filling(begin=NEVER, fill=0.1, duration=0.5),
    "rest": filling(flux=300.0, begin=3.5, fill=0.0, duration=16.0),
    "alone": filling(begin=NEVER, velocity=0.05),
    "below": filling(velocity=0.05, flux=100.0),
    "leaving": filling(begin=NEVER, velocity=8.0, floor=1e-3),
    "empty": filling(flux=30.0, fill=0.3, duration=0.9, bed=np.zeros((0, 3))),
    "lonely": filling(flux=30.0, fill=0.3, duration=0.9, bed=np.array([[-5.0, -5.0, 0.065]])),
    "finer": filling(begin=NEVER, velocity=0.05).replace({"stepper.control.dt": DT / 2}),
}


@pytest.fixture(scope="module")
def simulation():
    return compiled(SCENES["pour"], worlds=9, capacity=80)


def side_by_side(simulation, scenes):
    """Results and time series of all scenes run in one batch, both by name."""
    simulation.load(list(scenes.values()))
    series = MeasureSeries(0.02)
    simulation.run(observers=[series])
    return dict(zip(scenes, simulation.results(), strict=True)), dict(zip(scenes, series, strict=True))


@pytest.fixture(scope="module")
def outcome(simulation):
    return side_by_side(simulation, SCENES)


@pytest.fixture(scope="module")
def results(outcome):
    return outcome[0]


def uniforms(seed, stream, k):
    """The six random numbers of grain k."""
    numbers = []
    for draw in range(3):
        a, b, c, d = reference((0, draw << 16, k, stream), (seed, 0))
        numbers += [((x >> 5) * 2**26 + (y >> 6) + 0.5) / 2**53 for x, y in ((a, b), (c, d))]
    return numbers


def drawn(seed, effect, number):
    """Class, radius and velocity deviates of each grain, computed in NumPy."""
    counts = np.array([one.number() for one in GRAINS])
    u = np.array([uniforms(seed, INSERTION + effect, k) for k in range(number)])
    which = (u[:, 0] * counts.sum() >= counts[0]).astype(int)
    radius = np.array([GRAINS[c].sizes.radii(np.array([x]))[0] for c, x in zip(which, u[:, 1], strict=True)])
    return which, radius, 2 * u[:, 2:5] - 1


def test_grains_are_inserted_by_mass_in_random_number_order(results):
    result = results["pour"]
    state, mass = by_id(result), result.measures["pour_mass"]
    which, radius, _ = drawn(5, 4, FLUX_NUMBER)
    new = slice(len(BED), None)
    n = int(result.measures["pour_number"])
    assert len(state["mass"]) == len(BED) + n
    np.testing.assert_allclose(state["radius"][new], radius[:n], rtol=1e-13)
    density = np.array([1000.0, 1200.0])[which[:n]]
    np.testing.assert_allclose(state["mass"][new], density * 4 / 3 * np.pi * radius[:n] ** 3, rtol=1e-13)
    assert mass == pytest.approx(state["mass"][new].sum(), rel=1e-13)
    # The last grain was inserted while the mass before it was below the mass due by the flux.
    assert mass - state["mass"][-1] < 20.0 * 0.5 <= mass + 1e-9
    # Quantities from the class of the grain, and its own quantities.
    np.testing.assert_array_equal(state["tag"][new], 7 + which[:n])
    np.testing.assert_array_equal(state["origin"][new][:, 2], 3 + which[:n])
    np.testing.assert_array_equal(state["material"], [0] * len(BED) + which[:n].tolist())
    assert (state["tag"][: len(BED)] == 1).all()
    assert 0 < which[:n].mean() < 1


def test_inserted_grains_do_not_overlap_others(simulation):
    """Checked after each step, before the grains have moved; the region is so full that some must wait."""
    scenes = [filling(flux=3000.0), filling(begin=NEVER, fill=0.0)]
    simulation.load(scenes)
    known, waited = [len(BED)] * 2, False
    _, _, spread = drawn(5, 5, FRACTION_NUMBER)
    for _ in range(30):
        simulation.run(steps=1)
        for w, now in enumerate(simulation.states):
            order = np.argsort(now["id"])
            r, radius = now["position"][order], now["radius"][order]
            new = slice(known[w], None)
            size = radius[new, None]
            assert ((r[new] >= LOW + size) & (r[new] <= HIGH - size)).all()
            for k in range(known[w], len(r)):
                others = np.linalg.norm(r[:k] - r[k], axis=1) - radius[:k] - radius[k]
                assert others.min() >= 0
            if w == 1 and known[1] == len(BED):
                axis = np.linalg.norm(r[new, :2] - 0.3, axis=1)
                assert (axis <= 0.3 - radius[new]).all()
                sideways = now["velocity"][order][new, :2]
                np.testing.assert_allclose(sideways, 0.5 * spread[: len(axis), :2], rtol=1e-12)
            known[w] = len(r)
        waited |= 0 < known[0] - len(BED) < FLUX_NUMBER
    assert waited
    filled = simulation.results()[1]
    volume = (4 / 3 * np.pi * filled.state["radius"] ** 3)[np.argsort(filled.state["id"])][len(BED) :]
    container = np.pi * 0.3**2 * 0.4
    assert volume[:-1].sum() < 0.05 * container <= volume.sum()


def test_a_region_is_filled_again_when_grains_have_left_it(outcome):
    """Refills occur at 0.1 s and 0.35 s, after most grains have fallen out of the region."""
    result, series = outcome[0]["fill"], outcome[1]["fill"]
    steps = np.flatnonzero(np.diff(series["fill_number"]))
    np.testing.assert_allclose(series["time"][steps + 1], [0.1, 0.36], atol=0.02)
    first, second = np.diff(series["fill_number"])[steps]
    assert 5 < first < FRACTION_NUMBER
    assert first + second == result.measures["fill_number"] <= FRACTION_NUMBER


def test_distant_insertions_do_not_affect_a_bed(results):
    """The bed slides and builds up contact history while grains are inserted far above it.

    The difference is below one sixth of the integration error: after an insertion the forces use the
    velocities at the end of the step.
    """
    alone, below, finer = (by_id(results[name]) for name in ("alone", "below", "finer"))
    assert len(below["mass"]) > len(alone["mass"]) == len(BED)
    # The bed grains started with 0.05 m/s and have moved a few millimetres.
    for name in ("position", "velocity"):
        error = np.abs(alone[name] - finer[name]).max() / 6
        np.testing.assert_allclose(below[name][: len(BED)], alone[name], rtol=0, atol=error)
    slid = alone["sticking_spring_past"]
    assert np.abs(slid).max() > 1e-5
    error = 0.01 * np.abs(slid).max()
    np.testing.assert_allclose(below["sticking_spring_past"][: len(BED)], slid, rtol=0, atol=error)


def test_grains_at_rest_end_the_run(outcome):
    """The run ends only after all grains are inserted; both ratios are recomputed from the state."""
    results, series = outcome
    result, before = results["rest"], series["rest"]["time"] < 3.49
    calm = (series["rest"]["kinetic_ratio"] <= 1e-4) & (series["rest"]["unbalanced_ratio"] <= 2e-2)
    assert calm[before][-20:].all()
    assert series["rest"]["fill_number"][before][-1] > 5
    assert result.status.ok
    assert result.status.reason == "grains are at rest, by effects.at_rest"
    assert 3.5 < result.time < 16.0
    # The interval between checks is a tenth of the given time; each check follows a step.
    assert (result.time + 1e-9) % 5e-3 < DT + 2e-9
    assert result.measures["pour_number"] == FLUX_NUMBER
    m, radius, v, f = (result.state[name] for name in ("mass", "radius", "velocity", "force"))
    kinetic = 0.5 * (m * (v**2).sum(axis=1)).sum() / (G * (m * radius).sum())
    unbalanced = np.linalg.norm(f, axis=1).sum() / (G * m.sum())
    assert result.measures["kinetic_ratio"] == pytest.approx(kinetic, rel=1e-12)
    assert result.measures["unbalanced_ratio"] == pytest.approx(unbalanced, rel=1e-12)
    assert kinetic <= 1e-4
    assert unbalanced <= 2e-2
    assert results["alone"].status.reason == "reached its end"


def test_the_outflow_is_counted(outcome):
    result, series = outcome[0]["leaving"], outcome[1]["leaving"]
    assert result.status.ok
    mass = result.start["mass"]
    assert result.work["outflow"] == len(BED)
    assert len(result.state["mass"]) == 0
    assert result.measures["outflow_mass"] == pytest.approx(mass.sum(), rel=1e-13)
    np.testing.assert_allclose(series["outflow_mass"], mass[0] * series["outflow"], rtol=1e-13)
    assert (series["outflow"] + series["particles"] == len(BED)).all()
    assert (np.diff(series["outflow"]) >= 0).all()


def test_an_empty_start_is_filled_like_one_with_a_distant_grain(results):
    """They agree to the last bit, filled first by flux and then also by fraction."""
    empty, lonely = (by_id(results[name]) for name in ("empty", "lonely"))
    assert len(results["empty"].start["mass"]) == 0
    poured, filled = (results["empty"].measures[f"{name}_number"] for name in ("pour", "fill"))
    assert len(empty["mass"]) == poured + filled > filled > 0
    assert np.abs(empty["sticking_spring_past"]).max() > 0
    for field, values in empty.items():
        expected = lonely[field][1:]
        if field in ("id", "sticking_spring_partners"):
            expected = expected - (expected >= 0)
        np.testing.assert_array_equal(values, expected, err_msg=field)


def test_a_start_without_particles_is_recorded_drawn_and_exported(simulation, results, tmp_path):
    """The first frame has no particles, and the scene is read back from its file."""
    made = SCENES["empty"]
    simulation.load(made)
    with Recording(tmp_path / "t.h5", frames=5).observer(simulation) as recorder:
        simulation.run(observers=[recorder])
    run_folder.write(simulation.results()[0], RunFolder(tmp_path))
    assert Scene.from_toml(tmp_path / "scene.toml").digest() == made.digest()
    with frames(tmp_path / "t.h5") as sequence:
        numbers = [len(frame.arrays["mass"]) for frame in sequence]
        assert numbers[0] == 0 < numbers[1] < numbers[-1] == len(results["empty"].state["mass"])
        series = history(sequence)
        assert np.isnan(series.drift[0]).all()
        assert series.number.tolist() == numbers
        assert (series.shift[1] == 0).all()
        assert (series.shift[-1] != 0).all()
        assert series.kinetic_energy[0] == 0 < series.kinetic_energy[-1]
        start, _ = clouds(sequence).axes
        assert start.get_title("left") == "(a) start, t = 0 s: 0 grains"
        quantities(sequence).draw_without_rendering()
        movie(sequence, tmp_path / "t.gif")
    text = export(tmp_path / "t.h5", "xyz", tmp_path).read_text().splitlines()
    assert text[0] == "0"
    assert text[2] == str(numbers[1])
    export(tmp_path / "t.h5", "vtk", tmp_path)
    assert b'NumberOfPoints="0"' in (tmp_path / "t_00000.vtu").read_bytes()


def test_a_world_that_is_empty_at_both_ends_has_a_picture():
    nothing = {"position": np.zeros((0, 3)), "radius": np.zeros(0)}
    figure = start_and_end((nothing, nothing), (0.0, 1.0), SCENES["empty"])
    assert len(figure.axes) == 2


@pytest.mark.parametrize("name", ["pour", "rest", "empty"])
def test_alone_or_restarted_the_run_is_the_same(simulation, results, tmp_path, name):
    simulation.load(SCENES[name])
    simulation.run(until=0.21)
    simulation.checkpoint(tmp_path / "half")
    simulation.load(SCENES[name])
    simulation.restore(tmp_path / "half")
    simulation.run()
    (again,) = simulation.results()
    assert again.status == results[name].status
    assert again.measures == results[name].measures
    for field, values in results[name].state.items():
        np.testing.assert_array_equal(again.state[field], values, err_msg=field)


@pytest.mark.slow
@pytest.mark.parametrize("schedule", ["particle", "team"])
def test_other_schedules_do_not_change_the_run(results, schedule):
    names = ("rest", "leaving", "empty")
    simulation = compiled(SCENES["pour"], worlds=3, capacity=80, schedule=schedule)
    simulation.load([SCENES[name] for name in names])
    simulation.run()
    for result, name in zip(simulation.results(), names, strict=True):
        assert result.measures == results[name].measures
        for field, values in results[name].state.items():
            np.testing.assert_array_equal(result.state[field], values, err_msg=field)


def test_the_capacity_includes_all_insertions():
    assert SCENES["pour"].capacity() == len(BED) + FLUX_NUMBER + FRACTION_NUMBER


ONE = (GrainClass(sizes=EqualSizes(radius=0.1), density=1.0),)


def poured(*quantities):
    """An insertion of classes of equal grains with the given quantities."""
    grains = [GrainClass(sizes=EqualSizes(radius=0.1), density=1.0, quantities=one) for one in quantities]
    return InsertionByFlux(name="pour", flux=1.0, number=1, grains=grains, low=(0, 0, 0), high=(1, 1, 1))


def started(*quantities):
    """A scene with this insertion, checked before anything is compiled."""
    effects = (Tagged(), poured(*quantities))
    made = scene([[0.0, 0.0, 0.0]], [[0.0, 0.0, 0.0]], effects, materials={"sand": Material()})
    return Simulation(made)


WRONG = {
    "no room": (
        lambda: InsertionByFlux(flux=1.0, number=1, grains=ONE, low=(0, 0, 0), high=(1, 1, 0.1)),
        r"insertion_by_flux.high must be at least 0\.2 m from low along each axis",
    ),
    "not round": (
        lambda: InsertionByFlux(
            flux=1.0, number=1, grains=ONE, low=(0, 0, 0), high=(1, 2, 1), shape="cylinder"
        ),
        "insertion_by_flux.high must be equally far from low along the axes in which a cylinder is round",
    ),
    "nothing": (
        lambda: InsertionByFlux(flux=1.0, number=1, grains=(), low=(0, 0, 0), high=(1, 1, 1)),
        "insertion_by_flux.grains must",
    ),
    "unknown material": (
        lambda: Scene.from_dict({**SCENES["pour"].to_dict(), "materials": {"sand": {}}}),
        r"^grains.1.material must be one of the materials of the scene \(sand\); received 'ore'",
    ),
    "nothing ever": (
        lambda: Scene(particles=Particles.none(), effects=(Gravity(),), duration=1.0),
        "particles must be at least one, or inserted by an effect such as insertion_by_flux; received none",
    ),
    "rest without weight": (
        lambda: Scene(
            particles=Particles(position=[[0, 0, 0]], velocity=[[0, 0, 0]], radius=1.0, mass=1.0),
            effects=(AtRest(time=1.0),),
            duration=1.0,
        ),
        "effects.at_rest must be used together with effects.gravity",
    ),
    "a number beside a vector": (
        lambda: poured({"origin": 1.0}, {"origin": (1.0, 2.0, 3.0)}),
        r"grains.1.quantities.origin must be of as many components as in the other classes, 1; received \(1",
    ),
    "a vector for a number": (
        lambda: started({"temperature": (1.0, 2.0, 3.0)}),
        r"effects.pour.grains.0.quantities.temperature must be of shape \(1,\); received \(1, 3\)",
    ),
    "a number for a vector": (
        lambda: started({"origin": 1.0}),
        r"effects.pour.grains.0.quantities.origin must be of shape \(1, 3\); received \(1,\)",
    ),
    "colder than nothing": (
        lambda: started({"temperature": 300.0}, {"temperature": -5.0}),
        "effects.pour.grains.1.quantities.temperature must be at least 0 K; received -5",
    ),
    "a part of a whole": (
        lambda: started({"tag": 1.5}),
        "effects.pour.grains.0.quantities.tag must be whole numbers; received 1.5",
    ),
}


@pytest.mark.parametrize(("make", "message"), WRONG.values(), ids=WRONG)
def test_wrong_insertions_are_refused(make, message):
    with pytest.raises(InputError, match=message) as error_info:
        make()
    check_message(str(error_info.value))


@pytest.mark.parametrize(("by", "unit"), [("mass", "kg/s"), ("number", "1/s")])
def test_a_flux_is_explained_in_its_own_unit(by, unit):
    rows = explained(poured({}).model_copy(update={"by": by})).parameters
    assert next(row for row in rows if row[0] == "flux")[1:3] == ("1", unit)
