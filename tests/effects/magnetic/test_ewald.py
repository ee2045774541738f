"""Ewald sums of dipoles: forces, torques and moments in periodic boxes, against sums in NumPy and over
images, and against known energies of lattices."""

import math

import numpy as np
import pytest

from tests.effects.contact.loads import close, loads, vector
from tests.effects.magnetic.ewald import EwaldSum, ball_of_images
from tests.effects.magnetic.magnets import MU_0, Quadrupole, flux_density
from tests.scenes import scene, simulate
from tisim import Box, InputError, Open
from tisim.effects import (
    EwaldDipoleDipole,
    EwaldInducedMoment,
    Magnetophoresis,
    PermanentMoment,
    ewald_settings,
)
from tisim.effects.magnetic.ewald_accuracy import force_scale
from tisim.sources import MagneticField

SIDES = np.array([4.0, 5.0, 4.4])
"""m."""
WAVES = (11, 13, 12)


def box(sides=SIDES, periodic=(True, True, True)):
    low = np.array([-1.0, 0.0, 0.5])
    return Box(low=tuple(low), high=tuple(low + sides), periodic=periodic)


def magnets(rng, law, domain, n=16, radius=0.1, **more):
    """Random permanent magnets."""
    low, high = domain.bounds()
    return scene(
        rng.uniform(low, high, (n, 3)),
        np.zeros((n, 3)),
        (PermanentMoment(), law),
        radius=radius,
        mass=1.0,
        quantities={"moment": 1e3 * rng.normal(size=(n, 3))},
        domain=domain,
        **more,
    )


def dipoles(rng, n=16):
    """Positions in a box of SIDES, and moments."""
    low, high = box().bounds()
    return rng.uniform(low, high, (n, 3)), 1e3 * rng.normal(size=(n, 3))


@pytest.mark.long
@pytest.mark.parametrize("periodic", [(True, True, True), (True, True, False)])
def test_sums_are_independent_of_splitting_and_conservative(periodic, rng):
    """In NumPy, by central differences of positions and moments; also for a box that is open along z."""
    (r, m), domain, h = dipoles(rng), box(periodic=periodic), 1e-5

    def law(accuracy, cutoff):
        settings = ewald_settings(domain, len(r), accuracy, cutoff=cutoff)
        factors = (0.1, 0.2, 0.0) if all(periodic) else (0.0,) * 3
        return EwaldDipoleDipole(**settings, demagnetising_factors=factors)

    here, there = (EwaldSum(law(1e-8, cutoff), domain, r, m) for cutoff in (1.6, 1.9))
    close(here.field(), there.field(), 1e-8)
    close(here.force(), there.force(), 1e-8)
    rough = law(1e-3, 1.9)
    exact = EwaldSum(rough, domain, r, m)
    for i, a in ((0, 0), (3, 1), (7, 2)):
        step = h * np.eye(3)[a] * (np.arange(len(r)) == i)[:, None]
        up, down = (EwaldSum(rough, domain, r + sign * step, m).energy() for sign in (1, -1))
        assert (down - up) / (2 * h) == pytest.approx(exact.force()[i, a], rel=1e-6)
        up, down = (EwaldSum(rough, domain, r, m + sign * 1e3 * step).energy() for sign in (1, -1))
        assert (down - up) / (2e3 * h) == pytest.approx(exact.field()[i, a], rel=1e-6)


def test_factors_of_one_third_give_a_ball_of_images(rng):
    """The error of that sum falls as the third power of the ball's radius."""
    r, m = dipoles(rng, 8)
    domain = box((4.0, 4.0, 4.0))
    law = EwaldDipoleDipole(**ewald_settings(domain, 8, 1e-10), demagnetising_factors=(1 / 3,) * 3)
    exact = EwaldSum(law, domain, r, m)
    field, force = ball_of_images(4.0, r, m, 12)
    close(exact.field(), field, 2e-5)
    close(exact.force(), force, 6e-6)


def test_a_slab_is_a_layer_without_images_above_and_below(rng):
    """For few dipoles: by a sum over a disc of images. The rest is approximated by a continuous layer of
    dipoles beyond the disc."""
    domain = box((4.0, 4.0, 3.0), periodic=(True, True, False))
    r, m = dipoles(rng, 6)
    r[:, 2] = rng.uniform(0.5, 3.5, 6)
    exact = EwaldSum(EwaldDipoleDipole(**ewald_settings(domain, 6, 1e-10, slab_factor=5.0)), domain, r, m)
    field, most = np.zeros_like(r), 60
    for x, y in np.ndindex(2 * most + 1, 2 * most + 1):
        cell = np.array([x - most, y - most, 0])
        if (cell**2).sum() > most**2:
            continue
        d = r[None] + 4.0 * cell - r[:, None]
        distance = np.linalg.norm(d, axis=2)
        distance[distance == 0] = np.inf
        along = np.einsum("ijk,jk->ij", d, m)
        field += MU_0 / (4 * math.pi) * np.einsum("ij,ijk->ik", 3 * along / distance**5, d)
        field -= MU_0 / (4 * math.pi) * distance**-3.0 @ m
    # Field of the layer beyond radius R, with moment M / area: 1/2 mu_0 M / (2 R) in its plane, -mu_0 M / (2
    # R) across.
    beyond = MU_0 / (4 * 16.0 * 4.0 * most) * np.array([1.0, 1.0, -2.0]) * m.sum(axis=0)
    close(exact.field(), field + beyond, 5e-6)


@pytest.mark.long
@pytest.mark.parametrize(
    "periodic",
    [
        (True, True, True),
        pytest.param((True, True, False), marks=pytest.mark.slow),
        pytest.param((False, True, True), marks=pytest.mark.slow),
    ],
)
def test_forces_and_torques_are_those_in_numpy(periodic, rng):
    """With boxes and settings that differ between worlds."""
    scenes = []
    for k in range(4):
        law = EwaldDipoleDipole(
            cutoff=float(rng.uniform(1.4, 1.65)),
            accuracy=10.0 ** -rng.uniform(2, 3),
            waves=tuple(n if here else 2 * n for n, here in zip(WAVES, periodic, strict=True)),
            demagnetising_factors=(0.2, 0.3, 0.4) if k > 0 and all(periodic) else (0.0, 0.0, 0.0),
            slab_factor=float(rng.uniform(2, 2.2)),
        )
        scenes.append(magnets(rng, law, box(SIDES * rng.uniform(0.9, 1.0, 3), periodic)))
    for one, state in zip(scenes, loads(scenes), strict=True):
        expected = EwaldSum(one.effects[1], one.domain, state["position"], state["moment"])
        close(state["force"], expected.force(), 1e-11)
        close(state["torque"], np.cross(state["moment"], expected.field()), 1e-11)
        assert np.linalg.norm(state["force"].sum(axis=0)) < 1e-12 * np.abs(state["force"]).sum()


@pytest.mark.slow
def test_a_magnet_that_leaves_its_layer_stops_the_world(rng):
    """There the gap to the next layer would become smaller than guaranteed. Along the layer a magnet may move
    on."""
    law = EwaldDipoleDipole(cutoff=1.6, accuracy=1e-2, waves=(*WAVES[:2], 24), slab_factor=2.0)
    domain = box(periodic=(True, True, False))
    scenes = []
    for velocity in ((0, 0, 1.0), (1.0, 0, 0)):
        one = magnets(rng, law, domain, n=2, dt=0.1, steps=60)
        start = {"position": ((0, 1, 1), (1, 3, 3)), "velocity": (velocity, (0, 0, 0)), "mass": (1e9, 1e9)}
        scenes.append(one.model_copy(update={"particles": one.particles.model_copy(update=start)}))
    gone, stayed = simulate(scenes, worlds=2, capacity=16)
    assert "effects.ewald_dipole_dipole" in gone.status.reason
    why = "(this happens if the centre of a particle is beyond the box along its open axis)"
    assert f"particle 0 {why}" in gone.status.reason
    assert 3.8 < gone.time < 4.0
    assert stayed.status.ok, stayed.status.reason


def cubes(n, side):
    """Positions on a simple cubic lattice, and the moments of parallel dipoles along z."""
    return side / n * (np.argwhere(np.ones((n, n, n))) + 0.25), np.tile([0, 0, 1.0], (n**3, 1))


def test_lattices_have_their_known_energies():
    """Parallel dipoles on a simple cubic lattice have the field mu_0 M/3. In its ground state rows along z
    alternate up and down, with -2.676 mu_0 m^2 / (4 pi a^3) per dipole (J. M. Luttinger, L. Tisza, Phys. Rev.
    70 (1946) 954)."""
    r, m = cubes(4, 4.0)
    domain = Box(low=(0, 0, 0), high=(4.0, 4.0, 4.0))
    law = EwaldDipoleDipole(**ewald_settings(domain, 64, 1e-11, cutoff=1.95))
    close(EwaldSum(law, domain, r, m).field(), MU_0 / 3 * m, 1e-11)
    rows = np.argwhere(np.ones((4, 4, 4)))
    turned = m * (-1.0) ** rows[:, :2].sum(axis=1)[:, None]
    energy = EwaldSum(law, domain, r, turned).energy() / 64 * 4 * math.pi / MU_0
    assert energy == pytest.approx(-2.676, abs=1e-3)


@pytest.mark.parametrize(
    "accuracy", [1e-6, *(pytest.param(error, marks=pytest.mark.long) for error in (1e-2, 1e-4))]
)
def test_the_error_of_forces_is_as_requested(accuracy, rng):
    """Random moments of one magnitude; the estimate of the error is accurate to about 15 %."""
    domain, n = box((6.0, 6.0, 6.0)), 200
    low, high = domain.bounds()
    r, m = rng.uniform(low, high, (n, 3)), rng.normal(size=(n, 3))
    m /= np.linalg.norm(m, axis=1)[:, None]
    exact = EwaldSum(EwaldDipoleDipole(**ewald_settings(domain, n, 1e-8, cutoff=2.8)), domain, r, m)
    for cutoff in (2.0, 2.8):
        law = EwaldDipoleDipole(**ewald_settings(domain, n, accuracy, cutoff=cutoff))
        error = EwaldSum(law, domain, r, m).force() - exact.force()
        size = math.sqrt((error**2).sum() / n) / force_scale(m, 216.0, cutoff)
        assert 0.6 * accuracy < size < 1.15 * accuracy


def induced(place, radius, domain, field=(0, 0, 0.3), scale=(0, 0, 0), **options):
    """Soft spheres in a periodic box."""
    settings = {"cutoff": 1.6, "waves": WAVES, "accuracy": 1e-3, **options}
    chi, cutting = settings.pop("susceptibility", 5.0), dict(settings)
    effects = (
        Quadrupole(constant=(0, 0, 0), scale=scale),
        MagneticField(constant=field),
        EwaldInducedMoment(susceptibility=chi, tolerance=1e-14, **settings),
        Magnetophoresis(),
        EwaldDipoleDipole(**cutting),
    )
    return scene(place, 0 * place, effects, radius=radius, mass=1.0, domain=domain)


def solved(one, r, radius):
    """Induced moments by one linear solve, and the energy -1/2 sum m.B of the applied field."""
    law, n = one.effects[2], len(r)
    gain = 4 * math.pi / MU_0 * law.susceptibility / (3 + law.susceptibility) * radius**3
    units = np.eye(3 * n).reshape(3 * n, n, 3)
    sums = EwaldSum(law, one.domain, r, units[0])
    influence = []
    for unit in units:
        sums.m, sums.along = unit, sums.k @ unit.T
        influence.append(sums.field().ravel())
    matrix = np.eye(3 * n) - np.repeat(gain, 3)[:, None] * np.array(influence).T
    b = flux_density(one.effects, r)
    m = np.linalg.solve(matrix, (gain[:, None] * b).ravel()).reshape(n, 3)
    return m, -0.5 * (m * b).sum()


@pytest.mark.slow
def test_mutual_moments_follow_clausius_and_mossotti(rng):
    """At random positions, with forces that are gradients of the energy -1/2 sum m.B_0 to the accuracy of the
    sum; and on lattices, within the sample and with its poles."""
    low, high = box().bounds()
    scenes = []
    for _ in range(2):
        place = [rng.uniform(low, high)]
        while len(place) < 12:
            new = rng.uniform(low, high)
            d = np.array(place) - new
            if np.linalg.norm(d - SIDES * np.round(d / SIDES), axis=1).min() > 0.9:
                place.append(new)
        factors = tuple(rng.uniform(0, 0.3, 3))
        options = {"scale": (0.1, 0.1, 0.2), "field": vector(rng, 0.3), "demagnetising_factors": factors}
        scenes.append(induced(np.array(place), rng.uniform(0.3, 0.4, 12), box(), **options))
    lattice, radius = np.argwhere(np.ones((2, 2, 2))) * 2.4 + 0.5, 0.7
    cube = Box(low=(0, 0, 0), high=(4.8, 4.8, 4.8))
    for factors in ((0, 0, 0), (0.3, 0.3, 0.4)):
        scenes.append(induced(lattice, radius, cube, susceptibility=20.0, demagnetising_factors=factors))
    states = loads(scenes)
    for one, state in zip(scenes[:2], states, strict=False):
        r, radii, h = state["position"], state["radius"], 1e-5
        close(state["moment"], solved(one, r, radii)[0], 1e-11)
        expected = EwaldSum(one.effects[4], one.domain, r, state["moment"]).force()
        slopes = [s * state["moment"][:, k] for k, s in ((1, 0.1), (0, 0.1), (2, 0.0))]
        expected += np.stack(slopes, axis=1)
        expected[:, 2] += 0.4 * r[:, 2] * state["moment"][:, 2]
        close(state["force"], expected, 1e-10)
        for i, a in ((0, 0), (5, 1), (9, 2)):
            step = h * np.eye(3)[a] * (np.arange(len(r)) == i)[:, None]
            up, down = (solved(one, r + sign * step, radii)[1] for sign in (1, -1))
            size = np.linalg.norm(state["force"], axis=1).mean()
            assert (down - up) / (2 * h) == pytest.approx(state["force"][i, a], abs=1e-5 * size)
    gain = 4 * math.pi / MU_0 * 20 / 23 * radius**3
    for one, state in zip(scenes[2:], states[2:], strict=True):
        part = gain * MU_0 / 2.4**3 * (1 / 3 - one.effects[2].demagnetising_factors[2])
        close(state["moment"], np.tile([0, 0, gain * 0.3 / (1 - part)], (8, 1)), 3e-4)


def test_settings_minimise_cost_and_suit_the_box():
    """The cut-off scales as N^(-1/6) in one box, and the number of wave vectors along an axis as
    its inverse."""
    domain = box((60.0, 60.0, 60.0))
    few, many = (ewald_settings(domain, n, 1e-4) for n in (8000, 512000))
    assert few["cutoff"] / many["cutoff"] == pytest.approx(2.0)
    assert max(many["waves"]) == pytest.approx(2 * max(few["waves"]), abs=2)
    for settings in (few, many, ewald_settings(box((6.0, 9.0, 3.0), (True, False, True)), 50)):
        EwaldDipoleDipole(**settings)
    assert ewald_settings(box(), 10)["cutoff"] == pytest.approx(0.4 * 4.0)
    with pytest.raises(InputError, match=r"^open must be a periodic box with images"):
        ewald_settings(Open(), 10)


FINE = {"cutoff": 1.6, "waves": WAVES}
WRONG = {
    "box must be periodic along two or three axes, with "
    "effects.ewald_dipole_dipole; received (True, False, False)": (FINE, {"periodic": (True, False, False)}),
    "effects.ewald_dipole_dipole.waves must be at least (11, 14, 13) in this box; received (11, 13, 12)": (
        {**FINE, "accuracy": 1e-4},
        {},
    ),
    "ewald_dipole_dipole.screening must be from 0.625 to 7.5 with this cutoff; received 8.0": (
        {**FINE, "screening": 8.0},
        {},
    ),
    "ewald_dipole_dipole.demagnetising_factors must be from 0 on, and at most 1 together; received "
    "(0.5, 0.5, 0.5)": ({**FINE, "demagnetising_factors": (0.5, 0.5, 0.5)}, {}),
    "effects.ewald_dipole_dipole.demagnetising_factors must be 0 in a box with an open axis, along which it "
    "is 1; received (0.0, 0.0, 0.1)": (
        {"cutoff": 1.6, "waves": (11, 13, 40), "demagnetising_factors": (0, 0, 0.1)},
        {"periodic": (True, True, False)},
    ),
    "ewald_dipole_dipole.waves must be at least 0 each; received (-1, 3, 3)": (
        {**FINE, "waves": (-1, 3, 3)},
        {},
    ),
}


@pytest.mark.parametrize("message", WRONG)
def test_invalid_values_are_refused(message, rng):
    options, shape = WRONG[message]
    with pytest.raises(InputError) as fault:
        magnets(rng, EwaldDipoleDipole(**options), box(**shape))
    assert str(fault.value) == message
