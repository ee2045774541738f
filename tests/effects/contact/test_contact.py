"""Contact of overlapping spheres against NumPy references, each law alone with contact and all together."""

import numpy as np
import pytest

from tests.effects.contact.loads import WORLDS, balanced, close, fields_beside_the_core, loads, pairs
from tests.scenes import scene
from tisim.effects import Contact, ContactBond, ContactDissipation, ContactFriction, ContactSoftening, Hertz
from tisim.effects.contact.overlapping_pairs import OverlappingPairs
from tisim.report.contact_network import normal_forces

# Grains overlap deeply at the start here, on purpose.
pytestmark = pytest.mark.filterwarnings("ignore::tisim.errors.StartWarning")

GRAINS, DT = 12, 1e-3


def law(rng, kind):
    """One law for a world; with these stiffnesses some grains stick and some slip, some bond and
    some do not."""
    return {
        Contact: lambda: Contact(stiffness=rng.uniform(50, 100), exponent=2),
        Hertz: lambda: Hertz(young=rng.uniform(10, 30), poisson=rng.uniform(0, 0.5)),
        ContactSoftening: lambda: ContactSoftening(
            sensitivity=rng.uniform(1, 2), reference_temperature=400.0, floor=20.0
        ),
        ContactDissipation: lambda: ContactDissipation(damping=rng.uniform(1, 2)),
        ContactFriction: lambda: ContactFriction(
            stiffness=rng.uniform(500, 1000), static=rng.uniform(0.4, 0.6), dynamic=rng.uniform(0.1, 0.3)
        ),
        ContactBond: lambda: ContactBond(
            stiffness=rng.uniform(10, 20), exponent=3, grip_stiffness=rng.uniform(500, 1000), threshold=0.2
        ),
    }[kind]()


def heap(rng, kinds):
    """Grains of unlike sizes that overlap, move and spin, in a space too small for them."""
    quantities = {"temperature": rng.uniform(100, 1000, GRAINS), "spin": rng.normal(size=(GRAINS, 3)) * 3}
    return scene(
        rng.uniform(0, 1, (GRAINS, 3)),
        rng.normal(size=(GRAINS, 3)),
        tuple(law(rng, kind) for kind in kinds),
        radius=rng.uniform(0.15, 0.35, GRAINS),
        quantities=quantities,
    )


class Reference:
    """All pairs [i, j] of a state at once, as printed in Z16; forces on i by j."""

    def __init__(self, setup, state):
        self.laws = {type(effect): effect for effect in setup.effects}
        self.radius, self.v = state["radius"], state["velocity"]
        self.spin, self.temperature = state.get("spin"), setup.particles.arrays(None, 0)["temperature"]
        self.n, self.d = pairs(state)
        a, b = self.radius[:, None], self.radius
        self.touch = (self.d <= a + b) & ~np.eye(len(b), dtype=bool)
        self.apart = ~self.touch
        self.delta = np.where(self.touch, np.abs(self.d - (a + b)), 0)
        self.strain = self.delta / (a + b)
        self.arm = 0.5 * (self.d - (b**2 - a**2) / self.d)
        self.area = np.where(self.touch, np.pi * np.maximum(a**2 - self.arm**2, 0), 0)

    def sizes(self):
        """Normal contact force, N."""
        total = np.zeros_like(self.d)
        if Hertz in self.laws:
            e, nu = self.laws[Hertz].young, self.laws[Hertz].poisson
            e_star = 1 / ((1 - nu**2) / e + (1 - nu**2) / e)
            r_star = 1 / (1 / self.radius[:, None] + 1 / self.radius)
            total += 4 / 3 * r_star**0.5 * e_star * self.delta**1.5
        if Contact in self.laws:
            contact = self.laws[Contact]
            k = np.full(len(self.v), contact.stiffness)
            if soft := self.laws.get(ContactSoftening):
                cold = np.exp(-soft.sensitivity * (self.temperature / soft.reference_temperature - 1))
                k = np.maximum(contact.stiffness * cold, soft.floor)
                self.softest, self.stiffer = k == soft.floor, k > contact.stiffness
            total += (k[:, None] + k) / 2 * self.strain**contact.exponent * self.area
        return total

    def slip(self):
        """Tangential velocity of the surface of j relative to the surface of i, at the point of contact."""
        lever = self.arm[..., None] * self.n
        surface = self.v[:, None] + np.cross(self.spin[:, None], lever)
        past = surface.transpose(1, 0, 2) - surface
        return past - (past * self.n).sum(axis=2, keepdims=True) * self.n

    def friction(self):
        f, u = self.laws[ContactFriction], self.slip()
        speed = np.linalg.norm(u, axis=2)
        trial, normal = f.stiffness * speed * self.area * DT, self.sizes()
        self.sticks = self.touch & (trial < f.static * normal)
        self.slips = self.touch & (trial >= f.static * normal) & (normal > 0)
        size = np.where(self.sticks, trial, f.dynamic * normal)
        return (size / np.where(speed > 0, speed, 1))[..., None] * u

    def bond(self):
        b = self.laws[ContactBond]
        self.bonded = self.touch & (self.strain >= b.threshold)
        pull = b.stiffness * self.strain**b.exponent * self.area
        grip = b.grip_stiffness * self.area * DT
        return self.bonded[..., None] * (pull[..., None] * self.n + grip[..., None] * self.slip())

    def dissipation(self):
        opening = ((self.v[None] - self.v[:, None]) * self.n).sum(axis=2)
        return (self.laws[ContactDissipation].damping * opening * self.area)[..., None] * self.n

    def loads(self):
        """Force and torque on each grain."""
        terms = {ContactDissipation: self.dissipation, ContactFriction: self.friction, ContactBond: self.bond}
        force = -self.sizes()[..., None] * self.n
        for kind, term in terms.items():
            if kind in self.laws:
                force = force + term()
        torque = np.cross(self.arm[..., None] * self.n, force)
        return force.sum(axis=1), torque.sum(axis=1)


COMBINATIONS = {
    "contact": (Contact,),
    "softening": (Contact, ContactSoftening),
    "dissipation": (Contact, ContactDissipation),
    "friction": (Contact, ContactFriction),
    "bond": (Contact, ContactBond),
    "all": (Contact, ContactSoftening, ContactDissipation, ContactFriction, ContactBond),
    "hertz": (Hertz,),
    "hertz with friction": (ContactFriction, Hertz),
}


@pytest.mark.long
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name == "all" else pytest.mark.slow) for name in COMBINATIONS]
)
def test_contact_equals_its_numpy_reference(name, rng):
    """Random heaps, all worlds of one batch; forces and torques; momentum and angular momentum."""
    kinds = COMBINATIONS[name]
    scenes = [heap(rng, kinds) for _ in range(WORLDS)]
    counts = dict.fromkeys(("touch", "apart", "slips", "sticks", "bonded", "softest", "stiffer"), 0)
    for one, state in zip(scenes, loads(scenes, dt=DT), strict=True):
        reference = Reference(one, state)
        force, torque = reference.loads()
        close(state["force"], force)
        turning = ContactFriction in kinds or ContactBond in kinds
        assert ("torque" in state) == turning
        if turning:
            close(state["torque"], torque)
            assert np.abs(torque).max() > 1e-3 * np.abs(force).max()
        balanced(state)
        counts = {key: count + np.sum(getattr(reference, key, 0)) for key, count in counts.items()}
    # The states cover many examples of every branch of the laws.
    assert min(counts["touch"], counts["apart"]) > 100
    if ContactSoftening in kinds:
        assert min(counts["softest"], counts["stiffer"]) > 8
    if ContactFriction in kinds:
        assert min(counts["slips"], counts["sticks"]) > 40
    if ContactBond in kinds:
        assert 40 < counts["bonded"] < counts["touch"] - 40


@pytest.mark.parametrize("kinds", [(Contact, ContactSoftening), (Hertz,)])
def test_normal_forces_in_numpy_equal_the_reference(kinds, rng):
    setup = heap(rng, kinds)
    state = setup.start()
    reference = Reference(setup, state)
    i, j = np.nonzero(np.triu(reference.touch))
    force = normal_forces(OverlappingPairs(state, i, j, reference.delta[i, j], setup.acting()))
    assert len(force) > 10
    np.testing.assert_allclose(force, reference.sizes()[i, j], rtol=1e-9)


def rubbing(contact, **friction):
    """Contact with friction alone: softening, dissipation and bonds, which the test of all laws has compiled,
    have no effect."""
    return (
        Contact(stiffness=contact),
        ContactSoftening(sensitivity=0.0, reference_temperature=400.0, floor=0.0),
        ContactDissipation(damping=0.0),
        ContactFriction(**friction),
        ContactBond(stiffness=10.0, exponent=3, grip_stiffness=500.0, threshold=0.999),
    )


def pair(effects, gap, radius, velocity=(0, 0), spin=None):
    """Two grains on the x axis, the second at a distance of ``gap``, moving along y."""
    quantities = {} if spin is None else {"spin": spin}
    if any(isinstance(effect, ContactSoftening) for effect in effects):
        quantities["temperature"] = 300.0
    return scene(
        [[0, 0, 0], [gap, 0, 0]],
        [[0, velocity[0], 0], [0, velocity[1], 0]],
        effects,
        radius=radius,
        quantities=quantities,
    )


@pytest.mark.slow
def test_a_grain_inside_another_is_not_pushed():
    """If the surfaces do not intersect, there is no contact area and no NaN."""
    scenes = [pair((Contact(stiffness=1e3),), gap, [1.0, 0.3]) for gap in (0.5, 0.7, 0.71, 1.3, 1.31)]
    inside, edge, meeting, touching, apart = (state["force"][1, 0] for state in loads(scenes))
    assert inside == apart == 0
    assert meeting > 0
    assert abs(edge) + abs(touching) < 1e-12


@pytest.mark.long
def test_light_contact_keeps_its_digits():
    """At an overlap of 1e-9 radii, to all digits of the overlap itself."""
    gap = 2.0 - 1e-9
    law = rubbing(1.0, stiffness=10.0, static=1e3, dynamic=1.0)
    (state,) = loads([pair(law, gap, 1.0)])
    delta = 2.0 - gap
    expected = (delta / 2) ** 2 * np.pi * delta * (4 - delta) / 4
    np.testing.assert_allclose(state["force"][1, 0], expected, rtol=1e-14)


@pytest.mark.slow
def test_friction_of_grains_that_roll_on_each_other():
    """There is no friction if the spins make the surfaces move together; opposite spins double the slip."""
    friction = (Contact(stiffness=1e3), ContactFriction(stiffness=10.0, static=1e3, dynamic=0.0))
    arm = 0.9
    scenes = [
        pair(friction, 2 * arm, 1.0, (1.0, -1.0), [[0, 0, sign / arm], [0, 0, sign / arm]])
        for sign in (-1.0, 0.0, 1.0)
    ]
    rolling, sliding, worse = (state["force"][0, 1] for state in loads(scenes, dt=DT))
    assert abs(rolling) < 1e-14
    assert sliding < 0
    assert worse == pytest.approx(2 * sliding)


@pytest.mark.long
def test_grains_that_just_touch_at_rest_rub_with_no_force():
    """Without pressure and speed there is no direction of friction, and no NaN; nor without any friction."""
    smooth = rubbing(1e3, stiffness=10.0, static=0.0, dynamic=0.0)
    rough = rubbing(1e3, stiffness=10.0, static=1e3, dynamic=1.0)
    scenes = [pair(rough, 2.0, 1.0), pair(smooth, 1.8, 1.0), pair(rough, 2.0, 1.0, (1, -1))]
    for state in loads(scenes, dt=DT):
        np.testing.assert_array_equal(state["force"][:, 1:], 0)
        np.testing.assert_array_equal(state["torque"], 0)


@pytest.mark.long
def test_stick_vanishes_with_the_time_step():
    """The docstring's statement on the paper's regularisation."""
    friction = rubbing(1e3, stiffness=10.0, static=1e3, dynamic=0.0)
    scenes = [pair(friction, 1.8, 1.0, (1.0, -1.0))]
    at = [loads(scenes, dt)[0]["force"][0, 1] for dt in (1e-3, 1e-6, 0.0)]
    assert at[1] == pytest.approx(at[0] / 1e3)
    assert at[2] == 0


def test_an_absent_law_leaves_no_field():
    turning = {"torque", "spin"}
    draw = np.random.default_rng(1)
    extra = {
        "contact": set(),
        "softening": {"temperature"},
        "dissipation": set(),
        "friction": turning,
        "bond": turning,
        "hertz": set(),
    }
    for name, more in extra.items():
        assert fields_beside_the_core(heap(draw, COMBINATIONS[name])) == {"force"} | more
