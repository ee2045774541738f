"""All laws, operators and steppers of the package satisfy their contracts; violations are reported
by name."""

import numpy as np
import pytest

from tests import extremes
from tests.scenes import compiled, fixed, flow, scene
from tests.throwaway import SoftShell
from tisim import InputError, Scene
from tisim.backend.taichi import ti
from tisim.describe.explain import known_effects
from tisim.effects import (
    DipoleDipole,
    EwaldDipoleDipole,
    EwaldFroehlichMoment,
    EwaldInducedMoment,
    EwaldLangevinMoment,
    Force,
    Lorentz,
    PairForce,
    PermanentMoment,
    PrescribedMotion,
    RigidClumps,
    RigidMixture,
    RigidRods,
    RigidSuperquadrics,
    Tether,
    TruncatedDipoleDipole,
    Virial,
    option,
)
from tisim.forces.loads import FORCE
from tisim.operators import Capture, Inlet, JoinGroup, Operator, Outflow, Outlet
from tisim.program.phases import PerParticle
from tisim.sources import MagneticCylinders, MagneticField, MagneticSpheres
from tisim.state.fields import Field
from tisim.steppers import (
    Boris,
    Brownian,
    Collocation,
    DriftLimit,
    ErrorControl,
    FixedStep,
    IterationControl,
    Langevin,
    StageControl,
    Step,
    Stepper,
    Trapezoid,
    Verlet,
)
from tisim.steppers.common import BeginStep
from tisim.steppers.verlet import Advance
from tisim.testing import assert_contracts, assert_fields, assert_lists, assert_pair_forces, assert_reach

SHELL = SoftShell(stiffness=1.0, width=0.3)


class Change(Operator):
    """Moves each particle by its own ``leap``, and lets it grow, in every step."""

    fields = ("radius", Field("leap", "m", 3, "keep"), Field("growth", "m/s", 1, "keep"))

    @ti.func
    def particle(self, s, w, i, t, dt):
        s.position[w, i] += s.leap[w, i]
        s.radius[w, i] += s.growth[w, i] * dt


LAWS = (SHELL, Tether(stiffness=(0.0, 0.0, 0.0)), Change())


def crossing(stepper, effects=LAWS, velocity=0.0, pull=0.0, leap=0.0, growth=0.0, **quantities):
    """Three particles cross a lattice of 27 others and meet one after another: at a velocity (m/s), by a
    spring (N/m) whose rest position is 4 m ahead, or in leaps (m). Alternatively, the others grow (m/s)."""
    lattice = np.stack(np.meshgrid(*[np.arange(3.0)] * 3, indexing="ij"), -1).reshape(-1, 3)
    bullets = np.array([[-1.0, 0.2, 0.1], [-1.3, 1.1, 0.2], [-1.1, 1.9, 1.8]])
    position, ahead, others = np.concatenate([bullets, lattice]), np.zeros((30, 3)), np.arange(30) > 2
    ahead[:3, 0] = 1.0
    if effects[:3] == LAWS:
        effects = (SHELL, Tether(stiffness=(pull,) * 3), *effects[2:])
        quantities |= {"anchor": position + 4.0 * ahead, "leap": leap * ahead, "growth": growth * others}
    return scene(
        position,
        velocity * ahead,
        effects,
        radius=np.where(others, 0.1, 0.15),
        mass=1.0,
        stepper=stepper,
        duration=1.2,
        quantities=quantities,
    )


WAYS = ({"velocity": 3.0, "pull": 1.0}, {"leap": 0.05}, {"growth": 0.3})
LIMITS = {"first": 0.01, "longest": 0.02}
FLUID = {"temperature": 0.0, "viscosity": 0.3, "control": DriftLimit(longest=0.02, shortest=1e-4, drift=0.5)}
CHARGED = {"effects": (*LAWS, MagneticField(constant=(0.0, 0.0, 0.5)), Lorentz()), "charge": np.ones(30)}
STEPPERS = {
    "verlet": (Verlet(control=FixedStep(dt=0.02)), {}),
    "boris": (Boris(control=FixedStep(dt=0.02)), CHARGED),
    "trapezoid": (Trapezoid(control=ErrorControl(error=1e-3, tolerance=1e-10, **LIMITS)), {}),
    "trapezoid, iterations": (Trapezoid(control=IterationControl(tolerance=1e-10, **LIMITS)), {}),
    "collocation": (Collocation(control=StageControl(error=1e-4, **LIMITS)), {}),
    "langevin": (Langevin(temperature=0.0, viscosity=0.3, control=FixedStep(dt=0.02)), {}),
    "brownian": (Brownian(**FLUID), {}),
    "brownian, coupled": (Brownian(**FLUID, hydrodynamics="rotne-prager"), {}),
    "brownian, fast noise": (Brownian(**FLUID, hydrodynamics="oseen", noise="fast"), {}),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", STEPPERS)
def test_steppers_report_displacements(name):
    """For motion by the stepper itself, and by operators."""
    stepper, more = STEPPERS[name]
    scenes = [crossing(stepper, **way, **more) for way in WAYS]
    simulation = compiled(scenes[0], worlds=2)
    for made in scenes:
        assert_lists(made, simulation)


def test_every_stepper_is_tried():
    tried = {type(stepper) for stepper, _ in STEPPERS.values()}
    own = {kind for kind in Stepper.known().values() if kind.__module__.startswith("tisim.")}
    # Hard bodies have no laws of their own; tests/steppers/packing finds missing pairs.
    assert tried == {kind for kind in own if not extremes.for_packings(kind)}


@pytest.mark.slow
def test_lists_follow_captured_particles():
    sphere = {"centre": (2.5, 1.5, 1.5), "magnetisation": (0.0, 0.0, 1e3), "radius": 0.8}
    effects = (*LAWS, MagneticSpheres(spheres=(sphere,)), Capture())
    assert_lists(crossing(fixed(0.02), effects, **WAYS[0]))


@pytest.mark.slow
def test_lists_follow_merging_and_breaking_grains():
    assert_lists(flow(grains=60, stepper=fixed(4e-6), duration=4e-4))


class Silent(Stepper):
    """Moves particles, and does not report their displacement."""

    control: FixedStep = FixedStep(dt=0.02)

    def fields(self, effects):
        return (FORCE,)

    def step(self, context):
        return Step(
            (
                BeginStep(context),
                Drift(context.s),
                Advance(context),
                *context.update_lists,
                *context.sum_forces,
            )
        )


class Drift(PerParticle):
    @ti.func
    def run(self, w, i):
        s = self.s
        dt = ti.cast(s.dt[w], s.real)
        s.velocity[w, i] += dt / s.mass[w, i] * s.force[w, i]
        s.position[w, i] += dt * s.velocity[w, i]


@pytest.mark.slow
def test_a_stepper_that_reports_no_motion_is_detected():
    with pytest.raises(AssertionError, match=r"^position at the end must be the same with lists as"):
        assert_lists(crossing(Silent(), (SHELL,), velocity=3.0))


def test_steps_must_not_depend_on_listed_pairs():
    with pytest.raises(
        InputError, match="step control must be one that does not depend on pairs; received 'app"
    ):
        assert_lists(crossing(Verlet(), **WAYS[0]))


class TooFar(SoftShell):
    """Acts to twice its stated range."""

    @ti.func
    def reach(self, s, w, i):
        return 0.5 * self.width(w)


class TooFarIfUnequal(PairForce):
    """Acts within three times the larger radius: beyond its range if the other particle is smaller."""

    short_ranged = True

    @ti.func
    def reach(self, s, w, i):
        return s.radius[w, i]

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        near = distance < 3.0 * ti.max(s.radius[w, i], s.radius[w, j])
        return ti.select(near, -1.0, 0.0) * separation


def two(*effects, **quantities):
    """Two particles of 1 m, 3 m apart, for a step."""
    return scene([[0, 0, 0], [3, 0, 0]], [[0, 0, 0]] * 2, effects, radius=1.0, quantities=quantities)


@pytest.mark.long
@pytest.mark.parametrize(
    ("law", "said"),
    [
        (TooFar(stiffness=1.0, width=1.0), "of radii 1 and 1 m, at 1 of that distance"),
        (TooFarIfUnequal(), "on particle 0 by 1, of radii 1 and 0.5 m, at 1 of that distance"),
    ],
)
def test_a_force_beyond_its_range_is_reported(law, said):
    with pytest.raises(AssertionError, match=f"^{law.kind()} must be 0 between particles farther .*{said}"):
        assert_reach(two(law))


def joined(kinds):
    """A scene of several effects, with the effects they need."""
    every = [extremes.scenes()[f"effects.{kind.kind()}"] for kind in kinds]
    effects = {name: values for data in every for name, values in data["effects"].items()}
    carried = {name: values for data in every for name, values in data["particles"]["quantities"].items()}
    for insertion in (name for name in effects if name.startswith("insertion_by_")):
        # An inserted particle has the quantities of the others.
        quantities = {name: values[0] for name, values in carried.items()}
        grains = [{**grain, "quantities": quantities} for grain in effects[insertion]["grains"]]
        effects[insertion] = {**effects[insertion], "grains": grains}
    particles = {**every[0]["particles"], "quantities": carried}
    materials = {name: values for data in every for name, values in data.get("materials", {}).items()}
    domain = next((data["domain"] for data in every if data["domain"]["kind"] != "open"), every[0]["domain"])
    gyrating = {"stepper": extremes.scenes()["effects.lorentz"]["stepper"]} if "lorentz" in effects else {}
    more = {"effects": effects, "particles": particles, "materials": materials, "domain": domain}
    return Scene.from_dict({**every[0], **more, **gyrating})


def is_short_ranged(kind):
    """Whether the effect is short-ranged in its scene of extremes.scenes(); this may depend on its
    options."""
    effects = Scene.from_dict(extremes.scenes()[f"effects.{kind.kind()}"]).effects
    return any(type(effect) is kind and getattr(effect, "short_ranged", False) for effect in effects)


SHORT = [kind for kind in known_effects() if not extremes.for_packings(kind) and is_short_ranged(kind)]


@pytest.mark.slow
def test_every_law_is_zero_beyond_its_range():
    """All short-ranged laws in one scene, except those summed in another way. Only friction and bonds have
    zero force there before particles have moved."""
    most = assert_reach(joined([kind for kind in SHORT if kind not in (*IMAGED, *DIPOLES)]))
    for apart in (IMAGED, DIPOLES):
        most |= assert_reach(joined([kind for kind in SHORT if kind in apart]))
    assert most.keys() == {kind.kind() for kind in SHORT}
    assert {name for name, size in most.items() if size == 0} <= {"contact_friction", "parallel_bond"}


class Tally(SoftShell):
    """Counts the computations of pressed pairs."""

    fields = (Field("pressed", "", 1, "keep"),)

    @ti.func
    def interaction(self, s, w, i, j, separation, distance, past, dt, t):
        force = self.pair_force(s, w, i, j, separation, distance, t)
        if force.norm() > 0.0:
            s.pressed[w, i] += 1.0
        return force, 0.0 * force, 0.0 * force, past


class InverseSquare(PairForce):
    """Attracts by 1/d^2; the version with the inverse distance uses a power of it."""

    power: int = option("power", 3)

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        return separation / distance**3

    @ti.func
    def pair_force_by_inverse(self, s, w, i, j, separation, inverse, t):
        return inverse ** ti.static(self.power) * separation


class NeverZero(InverseSquare):
    """Is not 0 if the inverse distance is 0."""

    @ti.func
    def pair_force_by_inverse(self, s, w, i, j, separation, inverse, t):
        return separation / (1.0 / inverse) ** 3 + ti.select(inverse > 0.0, 0.0, 1.0)


class Damped(PairForce):
    """Damps the difference of two velocities, which is wrong for images that move."""

    depends_on_velocity = True

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        return s.velocity[w, j] - s.velocity[w, i]


@pytest.mark.long
@pytest.mark.parametrize(
    ("law", "said"),
    [
        (Damped(), "damped must take the velocity of particle 1 relative to 0 from s.relative_velocity"),
        (
            Tally(stiffness=1.0, width=1.0),
            "tally must write nothing between two .* received a changed pressed",
        ),
        (
            InverseSquare(power=2),
            r"must be pair_force, 0.44\d+ N on particle 0 by 1 .*; received 0.6",
        ),
        (NeverZero(), "must be 0 if the inverse is 0; received 1 N on particle 0 by 1 along axis 0"),
    ],
)
def test_invalid_pair_forces_are_reported(law, said):
    """The assertion of all contracts reports it too, before it runs anything."""
    with pytest.raises(AssertionError, match=said):
        assert_contracts(two(law))


PAIR_FORCES = [kind for kind in known_effects() if issubclass(kind, PairForce)]


@pytest.mark.long
def test_a_valid_pair_force_passes():
    assert_pair_forces(two(InverseSquare()))


@pytest.mark.slow
def test_pair_forces_write_nothing_and_are_the_same_by_the_inverse():
    assert {kind.kind() for kind in PAIR_FORCES if kind.offers_inverse()}
    assert_pair_forces(joined(PAIR_FORCES))


class ChargeOfOthers(Force):
    """Reads the charge, which it does not declare."""

    @ti.func
    def force(self, s, w, i, t):
        return s.charge[w, i] * s.velocity[w, i]


def test_a_field_that_only_others_declare_is_reported():
    effects = (MagneticField(), Lorentz(), ChargeOfOthers())
    with pytest.raises(
        AssertionError, match=r"^charge_of_others.fields must name 'charge', which it reads or writes"
    ):
        assert_fields(two(*effects, charge=[1.0, 1.0]))


# Capture, constraints and the virial exclude impacts. Faces at which particles enter and leave exclude pairs.
# Cylinders have no force law, and their series takes long to compile. Outflow weighs particles before it
# removes them. Permanent moments exclude soft ones. Tree gravity has no images, which Ewald sums need. Rigid
# shapes exclude laws for spheres. Dipole forces go only with mutual moments of the same cut-off.
RODS, BRICKS, MIXED = [RigidRods], [RigidSuperquadrics], [RigidMixture]
FACES = [Inlet, Outlet]
HOLDING = [PrescribedMotion, RigidClumps, JoinGroup]
IMAGED = [EwaldDipoleDipole, EwaldFroehlichMoment, EwaldInducedMoment, EwaldLangevinMoment]
DIPOLES = [DipoleDipole, TruncatedDipoleDipole]
APART = (
    Capture,
    MagneticCylinders,
    Outflow,
    PermanentMoment,
    Virial,
    *RODS,
    *BRICKS,
    *MIXED,
    *FACES,
    *HOLDING,
    *IMAGED,
    *DIPOLES,
)
TOGETHER = [
    *(kind for kind in known_effects() if kind not in APART and not extremes.for_packings(kind)),
    Outflow,
]


@pytest.mark.long
@pytest.mark.parametrize(
    "kinds",
    [
        [Capture, Virial],
        FACES,
        HOLDING,
        RODS,
        BRICKS,
        MIXED,
        [PermanentMoment],
        *(pytest.param(kinds, marks=pytest.mark.slow) for kinds in (TOGETHER, DIPOLES, IMAGED)),
    ],
    ids=[
        "capture",
        "inlet and outlet",
        "constraints",
        "rods",
        "superquadrics",
        "mixture",
        "permanent moments",
        "all that go together",
        "dipoles",
        "Ewald sums",
    ],
)
def test_effects_declare_the_fields_that_they_read(kinds):
    assert_fields(joined(kinds))
