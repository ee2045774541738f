"""Particles enter with the flow, are captured and released, and leave: nothing is lost, and all is where and
when the closed forms say."""

import subprocess
import sys

import numpy as np
import pytest
from scipy import stats

from tests.scenes import by_id, compiled, simulate
from tests.steppers.brownian.colloids import DIFFUSIVITY, RADIUS, TEMPERATURE, VISCOSITY, Shear
from tests.throwaway import SoftShellOfAll
from tisim import InputError, MeasureSeries, Particles, Scene
from tisim.analysis import particle_balance
from tisim.effects import Gravity
from tisim.engine.checkpoint import restore, save
from tisim.geometry import Plane
from tisim.operators import Capture, Inlet, Outlet, Release
from tisim.sources import MagneticSpheres, UniformFlow
from tisim.steppers import Brownian, DriftLimit

DT, SIDE, LENGTH, THIN = 1e-3, 2e-5, 4e-5, 1e-7
SPEED = 2e-4
"""m/s: particles pass from the inlet to the outlet in 0.2 s."""
FEED = (0.05, 0.25)
"""s, begin and end of the feed."""


def inlet(**more):
    given = {"low": (0.0, 0.0, 0.0), "high": (SIDE, SIDE, THIN), "direction": (0, 0, 1)}
    return Inlet(**{**given, "begin": FEED[0], "end": FEED[1], **more})


def filtered(
    number=200,
    temperature=TEMPERATURE,
    speed=SPEED,
    flow=None,
    entry=None,
    steps=600,
    balls=(),
    capture=(),
    hydrodynamics="none",
    seed=0,
    **quantities,
):
    """Waiting particles, a flow along z past balls, which hold nothing unless there is adhesion, and an
    outlet."""
    return Scene(
        particles=Particles(
            # All at one place: they do not see each other.
            position=np.zeros((number, 3)),
            velocity=np.zeros((number, 3)),
            radius=RADIUS,
            density=1000.0,
            quantities=quantities,
        ),
        effects=(
            flow or UniformFlow(velocity=(0.0, 0.0, speed)),
            MagneticSpheres(spheres=[{"centre": (-1.0, 0, 0), "radius": 1e-6}, *balls]),
            entry or inlet(),
            *(capture or (Capture(release=Release()),)),
            Outlet(planes=[Plane(point=(0, 0, LENGTH), normal=(0, 0, -1))]),
        ),
        stepper=Brownian(
            temperature=temperature,
            viscosity=VISCOSITY,
            hydrodynamics=hydrodynamics,
            control=DriftLimit(longest=DT, shortest=1e-9, drift=1e6),
        ),
        duration=steps * DT,
        seed=seed,
    )


BALLS = [{"centre": (x, y, 1e-5), "radius": 3e-6} for x in (5e-6, 1.5e-5) for y in (5e-6, 1.5e-5)]
STICKING = (Capture(release=Release(adhering=0.3, adhesion_force=1e-15)),)
"""Captures all that touch, and releases none."""


def run(*scenes, capacity=512):
    results = simulate(scenes, worlds=4, capacity=capacity)
    for result in results:
        assert result.status.ok, result.status.reason
        assert particle_balance(result.work, result.state).missing == 0
    return results


@pytest.mark.long
def test_a_plug_enters_and_leaves_on_time():
    """Entry times are uniform between begin and end and are noticed at the end of a step; the passage takes
    (length - z) / u, up to a step."""
    (result,) = run(filtered(500, temperature=0.0))
    state = by_id(result)
    due, entered, left = state["enters_at"], state["entered_at"], state["exited_at"]
    assert stats.kstest(due, "uniform", args=(FEED[0], FEED[1] - FEED[0])).pvalue > 0.01
    np.testing.assert_allclose(entered, np.ceil(due / DT) * DT, rtol=1e-12)
    late = left - entered - LENGTH / SPEED
    assert (late > -THIN / SPEED - 1e-9).all()
    assert (late <= DT + 1e-9).all()
    assert result.work["entered"] == result.work["exited"] == 500
    assert result.measures["waiting_particles"] == result.measures["free_particles"] == 0
    assert (state["fixed"] == 1).all()
    assert (state["velocity"] == 0).all()


@pytest.mark.long
def test_places_follow_the_flow():
    """In a flow u_x ~ y the density of entries is ~ y, so that y^2 is uniform; z is uniform."""
    entry = inlet(low=(0.0, 0.0, 0.0), high=(THIN, SIDE, SIDE), direction=(2.0, 0, 0), fastest=10.0 * SIDE)
    (result,) = run(filtered(400, 0.0, flow=Shear(rate=10.0), entry=entry))
    place = by_id(result)["position"]
    assert stats.kstest((place[:, 1] / SIDE) ** 2, "uniform").pvalue > 0.01
    assert stats.kstest(place[:, 2] / SIDE, "uniform").pvalue > 0.01
    assert stats.kstest(place[:, 1] / SIDE, "uniform").pvalue < 1e-9
    # A bound that is higher than necessary costs trials and changes no statistic.
    entry = entry.model_copy(update={"fastest": 80.0 * SIDE})
    (loose,) = run(filtered(400, 0.0, flow=Shear(rate=10.0), entry=entry))
    other = by_id(loose)
    assert other["entry_trials"].mean() == pytest.approx(16.0, rel=0.25)
    assert stats.kstest((other["position"][:, 1] / SIDE) ** 2, "uniform").pvalue > 0.01


def test_the_bound_of_the_flow_must_be_known():
    with pytest.raises(InputError, match=r"inlet\.fastest must be given, because a flow of the scene"):
        filtered(flow=Shear(rate=10.0))


@pytest.mark.long
def test_worlds_of_a_batch_have_bounds_of_their_own():
    """The second flow is a hundredth as fast; with the bound of the first it would take as many trials."""
    for result in run(filtered(50), filtered(50, speed=SPEED / 100)):
        assert (by_id(result)["entry_trials"] <= 3).all()


@pytest.mark.long
def test_places_touch_no_magnet():
    balls = [{"centre": (x, SIDE / 2, 0.0), "radius": 4e-6} for x in (5e-6, 1.5e-5)]
    (result,) = run(filtered(400, temperature=0.0, balls=balls, steps=251))
    state = by_id(result)
    # Nothing moves across the flow; those behind a ball's widest part have not touched it since.
    across = np.min([np.hypot(*(state["position"][:, :2] - ball["centre"][:2]).T) for ball in balls], axis=0)
    assert across.min() >= np.sqrt((4e-6 + RADIUS) ** 2 - THIN**2)
    trials = 1 / (1 - 2 * np.pi * (4e-6 + RADIUS) ** 2 / SIDE**2)
    assert state["entry_trials"].mean() == pytest.approx(trials, rel=0.1)


@pytest.mark.long
def test_diffusion_back_through_the_inlet_is_reflected():
    """Without flow, particles at the upstream face spread as |normal|; they were inside at the start."""
    entry = inlet(fastest=1.0, begin=1.0, end=2.0)
    (result,) = run(filtered(400, flow=UniformFlow(velocity=(0, 0, 0)), entry=entry, entered_at=0.0))
    z = by_id(result)["position"][:, 2]
    assert stats.kstest(z, stats.halfnorm(scale=np.sqrt(2 * DIFFUSIVITY * result.time)).cdf).pvalue > 0.01
    balance = particle_balance(result.work, result.state)
    assert (balance.given, balance.entered, balance.free) == (400, 0, 400)


@pytest.mark.long
def test_particles_diffuse_from_their_first_step_on():
    """They enter within a point, at most 8 steps before the end."""
    entry = inlet(high=(1e-12,) * 3, begin=48.1 * DT, end=53.0 * DT)
    (result,) = run(filtered(500, entry=entry, steps=56))
    state = by_id(result)
    width = np.sqrt(2 * DIFFUSIVITY * (result.time - state["entered_at"]))
    assert stats.kstest((state["position"][:, :2] / width[:, None]).ravel(), "norm").pvalue > 0.01


@pytest.mark.long
def test_no_particle_ever_enters():
    """Nothing flows in, the flow goes the other way, or the feed begins after the run."""
    still, backward, later = run(
        filtered(20, speed=0.0, entry=inlet(fastest=1.0)),
        filtered(20, speed=-SPEED),
        filtered(20, entry=inlet(begin=5.0, end=6.0)),
    )
    for result in (still, backward, later):
        balance = particle_balance(result.work, result.state)
        assert (balance.entered, balance.waiting, balance.captures) == (0, 20, 0)
        np.testing.assert_array_equal(result.state["position"], result.start["position"])


@pytest.mark.long
def test_a_pulse_enters_in_one_step_and_is_captured_at_once():
    """Everything that enters stands before a wall of adhesive balls, and touches it in its first step."""
    wall = [{"centre": (SIDE / 2, SIDE / 2, 1.01), "radius": 1.0}]
    entry = inlet(begin=0.1, end=0.1)
    scene = filtered(100, 0.0, speed=0.05, balls=wall, entry=entry, capture=STICKING, steps=200)
    # Between the face and the ball there are 0.01 m.
    scene = scene.replace({"effects.uniform_flow.velocity": [0.0, 0.0, 50.0]})
    (result,) = run(scene)
    state = by_id(result)
    np.testing.assert_allclose(state["entered_at"], 0.1, rtol=1e-12)
    np.testing.assert_allclose(state["captured_at"], 0.1 + DT, rtol=1e-12)
    assert (state["captured_by"] == 1).all()
    assert result.work["captures"] == 100
    assert result.work["exited"] == 0


def full(seed=0, **more):
    """Entries, captures, releases and exits, with noise."""
    return filtered(150, balls=BALLS, capture=STICKING, steps=500, seed=seed, **more)


@pytest.mark.long
def test_numbers_balance_at_every_look():
    setup = full()
    simulation = compiled(setup, 4, 512)
    simulation.load([setup])
    series = MeasureSeries(7.3 * DT)
    simulation.run(observers=[series])
    (result,) = simulation.results()
    look = series[0]
    inside = look["captured_particles"] + look["free_particles"]
    np.testing.assert_array_equal(look["entered"] - look["exited"], inside)
    np.testing.assert_array_equal(look["captured_particles"], look["captures"] - look["releases"])
    np.testing.assert_array_equal(look["waiting_particles"] + look["entered"], 150)
    balance = particle_balance(result.work, result.state)
    assert balance.exited > 30
    assert balance.captured > 10


def same(one, other):
    assert one.work == other.work
    assert one.measures == other.measures
    for name, values in one.state.items():
        np.testing.assert_array_equal(values, other.state[name], err_msg=name)


@pytest.mark.long
def test_same_bits_alone_in_a_batch_in_portions_and_after_a_checkpoint(tmp_path):
    scenes = [full(seed) for seed in range(4)]
    usual = run(*scenes)
    assert len({result.work["exited"] for result in usual}) > 1
    same(run(scenes[1])[0], usual[1])
    simulation = compiled(scenes[0], 4, 512)
    simulation.load(scenes)
    for portion in (3, 111, 8):
        simulation.run(steps=portion)
    save(simulation, tmp_path / "c.h5")
    simulation.run(steps=40)
    simulation.load(scenes)
    restore(simulation, tmp_path / "c.h5")
    simulation.run()
    same(simulation.results()[1], usual[1])


ELSEWHERE = """
import sys
import numpy as np
from tests.operators import test_inlet
from tisim.backend import runtime
runtime.init(threads=1)
np.savez(sys.argv[1], **test_inlet.run(test_inlet.full(2))[0].state)
"""


@pytest.mark.slow
def test_same_bits_with_one_thread_and_two(tmp_path):
    file = tmp_path / "state.npz"
    command = [sys.executable, "-W", "error::RuntimeWarning", "-c", ELSEWHERE, str(file)]
    completed = subprocess.run(command, capture_output=True, text=True, timeout=3600, check=False)
    assert completed.returncode == 0, completed.stderr
    there = np.load(file)
    for name, values in run(full(2))[0].state.items():
        np.testing.assert_array_equal(values, there[name], err_msg=name)


@pytest.mark.slow
def test_with_hydrodynamic_interaction():
    """Waiting particles take no part in it: one that is inside falls as if alone, along -x."""
    entry = inlet(begin=0.01, end=0.4)
    (result,) = run(filtered(12, entry=entry, hydrodynamics="rotne-prager", steps=200))
    assert 2 < result.work["entered"] < 12
    fall = (Gravity(acceleration=(-1e3, 0.0, 0.0)), *STICKING)
    inside = np.where(np.arange(12) == 3, 0.0, -1.0)
    late = inlet(begin=5.0, end=5.0)
    scene = filtered(
        12, 0.0, entry=late, capture=fall, hydrodynamics="rotne-prager", steps=50, entered_at=inside
    )
    (result,) = run(scene)
    speed = 1e3 * 1000.0 * 4 / 3 * np.pi * RADIUS**3 / (6 * np.pi * VISCOSITY * RADIUS)
    path = np.zeros((12, 3))
    path[3] = np.array([-speed, 0.0, SPEED]) * result.time
    np.testing.assert_allclose(by_id(result)["position"], path, rtol=1e-12, atol=1e-20)


def test_particles_that_interact_are_refused():
    scene = filtered(5).to_dict()
    scene["effects"]["soft_shell_of_all"] = {"stiffness": 1.0, "width": 1e-9}
    assert SoftShellOfAll.kind() == "soft_shell_of_all"
    with pytest.raises(InputError, match=r"effects\.inlet must be used without soft_shell_of_all"):
        Scene.from_dict(scene)


def test_an_inlet_is_kept_in_files_and_validated():
    setup = filtered(5)
    assert Scene.from_dict(setup.to_dict()).digest() == setup.digest()
    with pytest.raises(InputError, match=r"inlet\.end must be at least inlet\.begin, 2 s; received 1"):
        inlet(begin=2.0, end=1.0)
    with pytest.raises(InputError, match=r"inlet\.direction must be a direction"):
        inlet(direction=(0, 0, 0))
