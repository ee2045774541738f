"""A scene that names no stepper reaches its stated accuracy or is refused; none is wrong with status ok.

    python -m pytest -n 0 -m slow -s tests/hard/test_default_stepper.py

prints the errors of 100 random scenes of each family (tests/hard/default_scenes.py), and their work beside
the work of the coarsest settings of any stepper that reach the same accuracy in all scenes of the family.
"""

import copy
import math
import pickle
import zlib

import numpy as np
import pytest

import tisim
from tests.hard.default_scenes import FAMILIES
from tisim import effects as laws
from tisim import operators, sources
from tisim.geometry import Plane
from tisim.steppers import (
    ApproachTime,
    Boris,
    Collocation,
    ErrorControl,
    FixedStep,
    StageControl,
    Trapezoid,
    Verlet,
)
from tisim.steppers.choice import ACCURACY, ALONE, KINKED

pytestmark = pytest.mark.long


def drawn(name, number):
    """Return scenes of a family with the functions that return their errors, and the number of refused
    scenes."""
    scenes, refused = [], 0
    for k in range(number):
        draw = np.random.Generator(np.random.Philox(key=[k, zlib.crc32(name.encode())]))
        try:
            scenes.append(FAMILIES[name](draw))
        except tisim.InputError:
            refused += 1
    return scenes, refused


def errors_of(scenes, results):
    """Return the error of each result; infinity for a failed result."""
    return np.array(
        [error(r) if r.status.ok else math.inf for (_, error), r in zip(scenes, results, strict=True)]
    )


def work_of(results):
    """Return the number of force evaluations, averaged over the runs."""
    return float(np.mean([r.work.get("force_evaluations", 0) or r.work["steps"] for r in results]))


@pytest.mark.slow
@pytest.mark.parametrize("name", FAMILIES)
def test_100_random_scenes_of_each_family(name, capsys):
    scenes, refused = drawn(name, 100)
    results = tisim.run([scene for scene, _ in scenes])
    errors = errors_of(scenes, results)
    right, failed = errors[np.isfinite(errors)], int(np.isinf(errors).sum())
    with capsys.disabled():
        print(
            f"\n{name:25s} refused {refused}, failed {failed}, error median {np.median(right):.1e} "
            f"largest {right.max():.1e}, {work_of(results):.0f} force evaluations"
        )
    assert right.max() <= ACCURACY
    # A scene that cannot be run accurately must be refused or fail with a message; very few scenes here do.
    assert refused + failed <= 3


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(set(FAMILIES) - {"impact"}))
def test_other_accuracies(name):
    scenes, _ = drawn(name, 30)
    # A leapfrog with an error of 1e-6 takes hundreds of times the steps.
    adaptive = isinstance(scenes[0][0].stepper, Collocation)
    for accuracy in (1e-1, 1e-3, 1e-4, 1e-6) if adaptive else (1e-1, 1e-3):
        asked = [(scene.replace({"accuracy": accuracy}), error) for scene, error in scenes]
        assert errors_of(asked, tisim.run([scene for scene, _ in asked])).max() <= accuracy


ERRORS = (ACCURACY, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5)
PARTS = (0.4, 0.28, 0.2, 0.14, 0.1, 0.07, 0.05)
"""Manual settings, one for all scenes of a family: an error bound no coarser than the accuracy, or a step as
a fraction of the critical step."""
NOT_COMPARED = {
    "impact",  # Collisions of hard particles have no other stepper.
    "bonded_pair",  # Its error only requires bounded energy, which the coarsest steps satisfy.
}


def by_hand(scene, error=None, part=None, kind=None):
    """Return a scene with the stepper that an expert who knows its scales would choose."""
    chosen = scene.choice()
    if part is not None:
        gyrates = any(effect.gyrates(scene.effects) for effect in scene.effects)
        dt = min(part * min(chosen.critical.values()), scene.duration)
        stepper = (Boris if gyrates else Verlet)(control=FixedStep(dt=dt))
    else:
        limits = {
            "first": min(1e-6, 1e-4 * scene.duration),
            "longest": 0.1 * scene.duration,
            "shortest": min(1e-12, 1e-10 * scene.duration),
            "stride": getattr(chosen.stepper.control, "stride", 0.0),
        }
        if kind == "trapezoid":
            stepper = Trapezoid(
                control=ErrorControl(error=error, tolerance=1e-2 * error, per="run", **limits)
            )
        else:
            stages = int(kind[-1])
            stepper = Collocation(stages=stages, control=StageControl(error=error, per="run", **limits))
    return tisim.Scene(
        particles=scene.particles,
        materials=scene.materials,
        effects=scene.effects,
        domain=scene.domain,
        duration=scene.duration,
        stepper=stepper,
    )


def settings(scene):
    """Return the manual settings for scenes like this one, from coarse to fine, by the kind of stepper.

    Solid contacts are compared with leapfrogs alone: two spheres that mostly fly take far fewer adaptive
    steps, but not the spheres of ``test_adaptive_steps_do_not_pay_in_a_crowd``.
    """
    choice, adaptive = scene.choice(), not any(effect.leapfrog for effect in scene.effects)
    adaptive = adaptive and not any(isinstance(one, laws.PairForce) and one.solid for one in scene.effects)
    tried = {}
    if choice.critical:
        tried["leapfrog"] = [{"part": part} for part in PARTS]
    if adaptive:
        for kind in ("trapezoid", "collocation 3", "collocation 4", "collocation 5"):
            tried[kind] = [{"error": error, "kind": kind} for error in ERRORS]
    return tried


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(set(FAMILIES) - NOT_COMPARED))
def test_cost_of_the_choice_and_of_the_best_manual_settings(name, capsys):
    scenes, _ = drawn(name, 100)
    own = work_of(tisim.run([scene for scene, _ in scenes]))
    best, which = math.inf, "none"
    for kind, choices in settings(scenes[0][0]).items():
        for choice in choices:
            results = tisim.run([by_hand(scene, **choice) for scene, _ in scenes])
            if errors_of(scenes, results).max() <= ACCURACY:
                if (work := work_of(results)) < best:
                    best, which = work, f"{kind}, {choice.get('part', choice.get('error'))}"
                break
    with capsys.disabled():
        print(
            f"\n{name:25s} {own:.0f} force evaluations, best by hand {best:.0f} ({which}): {own / best:.2f}"
        )
    assert own <= 1.5 * best


@pytest.mark.slow
def test_adaptive_steps_do_not_pay_in_a_crowd():
    """Of 64 spheres some are always in contact, and all share the step."""
    radius, density, young = 1e-3, 2e3, 1e7
    speed = 0.01 * np.sqrt(young / density)
    places = 2.3 * radius * (0.5 + np.stack(np.meshgrid(*[np.arange(4)] * 3), axis=-1).reshape(-1, 3))
    velocity = speed * np.random.default_rng(1).normal(size=(64, 3))
    crowd = tisim.Scene(
        particles=tisim.Particles(position=places, velocity=velocity, radius=radius, density=density),
        effects=(laws.Hertz(young=young, poisson=0.3),),
        domain=tisim.Box(low=(0, 0, 0), high=(9.2 * radius,) * 3),
        duration=20 * radius / speed,
    )
    own, adaptive = (
        work_of([tisim.run(one)]) for one in (crowd, by_hand(crowd, error=3e-3, kind="collocation 3"))
    )
    assert isinstance(crowd.choice().stepper, Verlet)
    assert own < 0.8 * adaptive


def magnet(**more):
    """Return a scene of a magnet that swings with a period of 2.8 ms."""
    radius, moment = 1e-2, 1e6 * 4 / 3 * np.pi * 1e-6 * np.array([math.sin(0.3), 0, math.cos(0.3)])
    return tisim.Scene(
        particles=tisim.Particles(
            position=[(0, 0, 0)], velocity=[(0, 0, 0)], radius=radius, density=5000.0,
            quantities={"moment": [moment], "spin": [(0, 0, 0)]},
        ),
        effects=(
            laws.PermanentMoment(),
            sources.MagneticField(constant=(0, 0, 1.0)),
            laws.Magnetophoresis(),
        ),
        duration=0.1,
        **more,
    )  # fmt: skip


def tethered(**more):
    """Return a scene of a particle on a spring, with a period of 1 ms."""
    return tisim.Scene(
        particles=tisim.Particles(position=[(0, 0, 0)], velocity=[(0.1, 0, 0)], radius=1e-4, mass=1e-6),
        effects=(laws.Tether(stiffness=(4 * np.pi**2,) * 3),),
        duration=0.1,
        **more,
    )


def beside_a_wall(distance, stiffness, away, dt, duration, **more):
    """Return a scene of a grain on a spring, in front of a wall that moves.

    distance : of the centre from the wall (m). stiffness : of the spring (N/m). away : velocity of the wall
    (m/s). dt, duration : s.
    """
    return tisim.Scene(
        particles=tisim.Particles(
            position=[(distance, 0, 0)], velocity=[more.pop("velocity")], radius=1e-3, **more
        ),
        materials={"grain": tisim.Material(stiffness=1e3, restitution=0.3)},
        effects=(
            laws.Granular(normal=laws.Hooke(), damping=laws.RestitutionDamping()),
            laws.Walls(planes=[Plane(normal=(1, 0, 0))], motion=laws.Translation(velocity=(away, 0, 0))),
            laws.Tether(stiffness=(stiffness,) * 3),
        ),
        stepper=Verlet(control=FixedStep(dt=dt)),
        duration=duration,
    )


class TestTheGuard:
    """A fixed step beyond the critical step stops the world, under every law."""

    @pytest.mark.parametrize(("factor", "ok"), [(0.44, True), (0.48, False)])
    def test_a_spring_is_accepted_up_to_nearly_half_of_the_critical_step(self, factor, ok):
        critical = 2 / (2 * np.pi * 1e3)
        result = tisim.run(tethered(stepper=Verlet(control=FixedStep(dt=factor * critical))))
        assert result.status.ok == ok, result.status.reason
        if not ok:
            assert "critical time step" in result.status.reason
            assert "effects.tether" in result.status.reason
            told = float(result.status.reason.split("critical one at most ")[1].split(" s")[0])
            assert told == pytest.approx(critical, rel=0.05)

    def test_a_rotating_magnet_in_long_steps_stops_the_world(self):
        result = tisim.run(magnet(stepper=Verlet(control=ApproachTime())))
        assert not result.status.ok
        assert "critical time step" in result.status.reason

    @pytest.mark.parametrize("part", [0.3, 0.5, 1.0, 3.0])
    def test_two_orbiting_bodies_in_long_steps_stop_the_world(self, part):
        d, period = 0.01, 1e-3
        total = 4 * np.pi**2 * d**3 / (6.6743e-11 * period**2)
        v = math.sqrt(6.6743e-11 * total / d)
        scene = tisim.Scene(
            particles=tisim.Particles(
                position=[(-d / 2, 0, 0), (d / 2, 0, 0)], velocity=[(0, -v / 2, 0), (0, v / 2, 0)],
                radius=1e-4, mass=total / 2,
            ),
            effects=(laws.SelfGravity(),),
            stepper=Verlet(control=FixedStep(dt=part * period)),
            duration=0.02,
        )  # fmt: skip
        assert "critical time step" in tisim.run(scene).status.reason

    @pytest.mark.parametrize("angle", [0.9, 1.2, 1.6, 2.0, 2.4, 2.8, 3.5, 5.0, 10.0])
    @pytest.mark.parametrize("softening", [None, 1e-3])
    @pytest.mark.parametrize("beside", [(), (laws.Gravity(),)], ids=["alone", "gravity"])
    def test_a_close_encounter_in_long_steps_stops_the_world(self, angle, softening, beside):
        """Two bodies at rest 1 cm apart, attracted to each other.

        angle : omega dt at the start. Without the guard the energy is wrong by a factor of 1 to 1e48.
        """
        d, omega = 0.01, 1e3
        gravity = laws.SoftenedSelfGravity(softening_length=softening) if softening else laws.SelfGravity()
        scene = tisim.Scene(
            particles=tisim.Particles(
                position=[(-d / 2, 0, 0), (d / 2, 0, 0)], velocity=[(0, 0, 0), (0, 0, 0)],
                radius=1e-6, mass=0.5 * omega**2 * d**3 / 6.6743e-11,
            ),
            effects=(gravity, *beside),
            stepper=Verlet(control=FixedStep(dt=angle / omega)),
            duration=0.03,
        )  # fmt: skip
        assert "critical time step" in tisim.run(scene).status.reason

    @pytest.mark.parametrize(("factor", "ok"), [(0.7, True), (1.02, False)])
    def test_an_instability_beside_contacts_stops_the_world(self, factor, ok):
        """Contact laws guard their own steps, but not the steps of a spring beside them."""
        dt = factor * 2 / (2 * np.pi * 1e3)
        result = tisim.run(beside_a_wall(0.1, 4 * np.pi**2, -0.1, dt, 0.1, mass=1e-6, velocity=(0.1, 0, 0)))
        assert result.status.ok == ok, result.status.reason
        assert ok or "effects.tether" in result.status.reason

    def test_a_wall_pulled_away_does_not_stop_the_world(self):
        """The dashpot of the wall pulls at a grain in the first step only, which is not an instability."""
        result = tisim.run(beside_a_wall(1e-3 - 1e-6, 1e-3, -50.0, 1e-5, 1e-3, mass=1e-5, velocity=(0, 0, 0)))
        assert result.check().state["velocity"][0, 0] < -1e-2

    def test_verlet_is_refused_beside_a_magnetic_force(self):
        with pytest.raises(tisim.InputError, match=r"stepper must be one that turns velocities"):
            tisim.Scene(
                particles=tisim.Particles(
                    position=[(0, 0, 0)], velocity=[(1, 0, 0)], radius=1e-4, mass=1e-9,
                    quantities={"charge": [1e-6]},
                ),
                effects=(laws.Lorentz(), sources.MagneticField(constant=(0, 0, 1.0))),
                stepper=Verlet(control=FixedStep(dt=1e-6)),
                duration=0.1,
            )  # fmt: skip


class TestTheChoice:
    def test_a_changed_scene_gets_a_new_choice(self):
        assert tethered().replace({"duration": 1.0}).stepper.control.longest == pytest.approx(0.1)

    def test_a_scene_keeps_its_accuracy_and_not_its_stepper_in_a_file(self):
        scene = tethered(accuracy=1e-5)
        text = scene.to_toml()
        assert "[stepper" not in text
        assert tisim.Scene.from_dict(scene.to_dict()).stepper == scene.stepper

    def test_accuracy_is_refused_beside_a_stepper(self):
        with pytest.raises(tisim.InputError, match=r"scene.accuracy must be left out"):
            tethered(accuracy=1e-3, stepper=Verlet(control=FixedStep(dt=1e-6)))

    def test_more_accuracy_is_less_error(self):
        exact = 0.1 / (2e3 * np.pi) * math.sin(2e3 * np.pi * 0.1)
        errors = []
        for accuracy in (1e-1, 1e-4, 1e-8):
            result = tisim.run(tethered(accuracy=accuracy))
            errors.append(abs(result.state["position"][0, 0] - exact) / (0.1 / (2e3 * np.pi)))
            assert errors[-1] <= accuracy
        assert errors[0] > errors[-1]

    def test_effects_that_depend_on_the_step_are_refused(self):
        with pytest.raises(tisim.InputError, match=r"scene.stepper must be given, because the step length"):
            tisim.Scene(
                particles=tisim.Particles(position=[(0, 0, 0)], velocity=[(0, 0, 0)], radius=1e-3, mass=1e-6),
                effects=(
                    laws.Hertz(young=1e6, poisson=0.3),
                    laws.ContactFriction(stiffness=1, static=0.5, dynamic=0.4),
                ),
                duration=1.0,
            )

    def test_a_stream_of_grains_meets_a_wall_at_its_own_speed(self):
        def step(speed):
            return tisim.Scene(
                particles=tisim.Particles(
                    position=[(0, 0, 1), (1, 0, 1)],
                    velocity=[(0, 0, -speed)] * 2,
                    radius=1e-3,
                    density=2000.0,
                ),
                materials={"a": tisim.Material(young=1e7, poisson=0.3)},
                effects=(laws.Granular(), laws.Walls(planes=[Plane()])),
                duration=1.0,
            ).stepper.control.dt

        # The duration of a Hertzian impact scales as v^-1/5.
        assert step(10.0) == pytest.approx(step(0.1) * 100**-0.2, rel=0.02)

    def test_the_shortest_step_accounts_for_a_blast(self):
        cloud = {"number": 50, "radius": 1e-3, "density": 2000.0}
        steps = [
            tisim.Scene(
                particles=tisim.Cloud(**cloud, pulse=tisim.Blast(energy=energy)),
                effects=(laws.Impact(hardness=1e6),),
                domain=tisim.Box(low=(0, 0, 0), high=(1, 1, 1)),
                duration=1.0,
            ).stepper.control.shortest
            for energy in (1.0, 100.0)
        ]
        assert steps[0] == pytest.approx(10 * steps[1], rel=0.02)

    def test_a_falling_clump_is_stepped(self):
        clump = tisim.Clump(centres=[(0, 0, 0), (1e-3, 0, 0)], radii=[1e-3] * 2, density=2000.0)
        scene = tisim.Scene(
            particles=tisim.Particles.of_clumps(clump, position=[(0, 0, 0)]),
            effects=(laws.RigidClumps(), laws.Gravity(acceleration=(0, 0, -10.0))),
            duration=1.0,
        )
        fallen = tisim.run(scene).check().state["position"][:, 2]
        assert fallen == pytest.approx([-5.0, -5.0], rel=1e-9)

    def test_a_missing_charge_is_reported(self):
        scene = tisim.Scene(
            particles=tisim.Particles(position=[(0, 0, 0)], velocity=[(1, 0, 0)], radius=1e-3, mass=1e-6),
            effects=(laws.Lorentz(), sources.MagneticField(constant=(0, 0, 1.0))),
            duration=1.0,
        )
        with pytest.raises(tisim.InputError, match="charge"):
            tisim.run(scene)

    def test_inserted_particles_are_refused(self):
        insertion = operators.InsertionByFlux(
            number=10, flux=1.0, low=(0.0,) * 3, high=(0.1,) * 3,
            grains=[tisim.GrainClass(sizes=tisim.packing.EqualSizes(radius=1e-3), density=2000.0)],
        )  # fmt: skip
        with pytest.raises(
            tisim.InputError, match=r"scene.stepper must be given, because .* inserts particles later"
        ):
            tisim.Scene(
                particles=tisim.Particles.none(),
                materials={"a": tisim.Material(young=1e7, poisson=0.3)},
                effects=(laws.Granular(), insertion),
                duration=1.0,
            )

    def test_a_user_law_counts_as_smooth_if_declared_so(self):
        class SaysNothing(laws.Tether):
            pass

        class SaysSmooth(laws.Tether):
            kinked = False

        base = tethered()
        steppers = [
            tisim.Scene(particles=base.particles, effects=(law(stiffness=(1, 1, 1)),), duration=1.0).stepper
            for law in (laws.Tether, SaysSmooth, SaysNothing)
        ]
        assert [stepper.control.error for stepper in steppers] == [
            ACCURACY / safety for safety in (ALONE, ALONE, KINKED)
        ]

    def test_a_law_without_a_critical_step_is_refused_beside_grains(self):
        class WithoutCriticalStep(laws.Tether):
            def critical_step(self, start, speed, effects):
                return None

        with pytest.raises(
            tisim.InputError, match=r"no critical time step is known for effects.without_critical_step"
        ):
            tisim.Scene(
                particles=tisim.Particles(position=[(0, 0, 0)], velocity=[(0, 0, 0)], radius=1e-3, mass=1e-6),
                materials={"a": tisim.Material(young=1e6, poisson=0.3)},
                effects=(laws.Granular(), WithoutCriticalStep(stiffness=(1, 1, 1))),
                duration=1.0,
            )


class TestFailedResults:
    """Use of a failed run without a check of its status gives a warning."""

    failing = staticmethod(lambda: tisim.run(tethered(stepper=Verlet(control=FixedStep(dt=1e-3)))))

    def test_reading_the_state_warns_once(self):
        result = self.failing()
        with pytest.warns(tisim.RunWarning, match=r"failed, and its state is that of the last good step"):
            assert len(result.state["mass"]) == 1
        assert len(result.state["mass"]) == 1

    def test_reading_the_status_first_does_not(self):
        result = self.failing()
        assert not result.status.ok
        assert len(result.state["mass"]) == 1

    def test_check_raises(self):
        with pytest.raises(tisim.RunError, match="critical time step"):
            self.failing().check()
        assert tisim.run(tethered()).check().state["mass"][0] == 1e-6

    def test_a_result_that_is_dropped_warns(self):
        result = self.failing()
        with pytest.warns(tisim.RunWarning, match="dropped"):
            del result

    def test_the_printed_result_shows_the_failure(self):
        result = self.failing()
        assert repr(result).startswith("Result('scene': 1 particles, ")
        assert "critical time step" in repr(result)
        assert len(result.state["mass"]) == 1

    @pytest.mark.parametrize("copied", [copy.copy, lambda result: pickle.loads(pickle.dumps(result))])
    def test_a_copy_warns_in_the_place_of_its_original(self, copied):
        result = self.failing()
        same = copied(result)
        del result
        with pytest.warns(tisim.RunWarning, match="its state is that of"):
            assert len(same.state["mass"]) == 1

    def test_a_world_that_still_runs_has_not_failed(self):
        simulation = tisim.Simulation(tethered())
        simulation.load(tethered())
        simulation.run(steps=1)
        (result,) = simulation.results()
        assert result.check() is result
        simulation.close()
