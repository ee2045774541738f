"""Cut-offs of dipole interactions, plain and shifted: forces, torques and mutual moments."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.effects.contact.loads import WORLDS, balanced, close, loads, vector
from tests.effects.magnetic.magnets import MU_0, Quadrupole, dipole_field, flux_density
from tests.scenes import by_id, fixed, scene, simulate
from tisim import Box, InputError
from tisim.effects import (
    DipoleDipole,
    EwaldDipoleDipole,
    EwaldInducedMoment,
    InducedMoment,
    Magnetophoresis,
    MutualInducedMoment,
    PermanentMoment,
    TruncatedDipoleDipole,
)
from tisim.sources import MagneticField

EWALD = {"cutoff": 3.0, "waves": (15, 15, 15)}
NUMBERS = ({"cutoff": 6.0}, {"cutoff": 2.0, "gap": 2.0}, {"cutoff": 3.0, "gap": 1.0})
"""Cut-offs: in mean radii, as a gap between surfaces, and both."""


def parts(law, r, radius):
    """Matrix [i, j] of the factor f of the dipole interaction."""
    distance = np.linalg.norm(r[None] - r[:, None], axis=2)
    x = distance / (law.cutoff * (radius[:, None] + radius) / 2 + law.gap)
    return (x <= 1) * (1 - 4 * x**3 + 3 * x**4 if law.shifted else 1.0)


def energy(law, r, m, radius):
    """Energy of the dipoles, each pair once, J."""
    field = np.einsum("ij,ijab,jb->ia", parts(law, r, radius), dipole_field(r), m)
    return -0.5 * (m * field).sum()


def magnets(rng, law, n=9, size=2.0):
    """Random permanent magnets, some of them beyond each other's cut-off."""
    return scene(
        size * rng.normal(size=(n, 3)),
        np.zeros((n, 3)),
        (PermanentMoment(), law),
        radius=rng.uniform(0.5, 1.0, n),
        mass=1.0,
        quantities={"moment": 1e3 * rng.normal(size=(n, 3))},
    )


def steps(n, h):
    """Displacements of one of n vectors along one axis by h."""
    for i, a in np.ndindex(n, 3):
        change = np.zeros((n, 3))
        change[i, a] = h
        yield i, a, change


@pytest.mark.long
@pytest.mark.parametrize("shifted", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_forces_and_torques_are_minus_the_gradient_of_the_energy(rng, shifted):
    """By central differences of positions and of rotations; for a plain cut-off, within it and beyond it.
    Forces and torques sum to zero."""
    scenes = [magnets(rng, TruncatedDipoleDipole(**NUMBERS[k % 3], shifted=shifted)) for k in range(WORLDS)]
    for one, state in zip(scenes, loads(scenes), strict=True):
        law, h = one.effects[1], 1e-5
        r, m, radius, n = state["position"], state["moment"], state["radius"], len(state["radius"])
        force, torque = np.zeros((n, 3)), np.zeros((n, 3))
        for i, a, step in steps(n, h):
            up, down = (energy(law, r + sign * step, m, radius) for sign in (1, -1))
            force[i, a] = (down - up) / (2 * h)
            up, down = (
                energy(law, r, Rotation.from_rotvec(sign * step).apply(m), radius) for sign in (1, -1)
            )
            torque[i, a] = (down - up) / (2 * h)
        part = parts(law, r, radius)[~np.eye(n, dtype=bool)]
        assert (part == 0).any()
        assert (part > 0).any()
        close(state["force"], force, 1e-7)
        close(state["torque"], torque, 1e-7)
        balanced(state)


def parting(law, dt):
    """Two magnets that fly apart, through the cut-off and beyond."""
    return scene(
        [[0, 0, 0], [2.5, 0, 0.1]],
        [[-1.0, 0, 0], [1.0, 0.2, 0]],
        (PermanentMoment(), law),
        radius=1.0,
        mass=1.0,
        quantities={"moment": [[2e3, 1e3, 0], [1.8e3, -1e3, 5e2]], "spin": [[0.1, 0.2, -0.3]] * 2},
        stepper=fixed(dt),
        duration=1.0,
    )


def total_energy(law, state):
    motion = 0.5 * (state["velocity"] ** 2).sum() + 0.2 * (state["spin"] ** 2).sum()
    return motion + energy(law, state["position"], state["moment"], state["radius"])


def at_the_cutoff(law, state):
    """The energy of the dipoles when the pair, which now moves freely, was just within the cut-off; J."""
    apart, speed = (state[name][1] - state[name][0] for name in ("position", "velocity"))
    roots = np.roots([speed @ speed, -2 * apart @ speed, apart @ apart - law.cutoff**2])
    ago = roots.min() * (1 + 1e-9)
    m = Rotation.from_rotvec(-ago * state["spin"]).apply(state["moment"])
    return energy(law, state["position"] - ago * state["velocity"], m, state["radius"])


@pytest.mark.slow
@pytest.mark.parametrize("shifted", [True, False])
def test_energy_is_conserved_through_a_shifted_cutoff_and_jumps_at_a_plain_one(shifted):
    """With a shifted cut-off energy is conserved to the order of Verlet; a plain one removes the pair energy
    at the cut-off."""
    law, gains = TruncatedDipoleDipole(cutoff=3.6, shifted=shifted), []
    for dt in (1e-3, 5e-4):
        (result,) = simulate([parting(law, dt)], capacity=4)
        start, end = result.start, by_id(result)
        assert np.linalg.norm(end["position"][1] - end["position"][0]) > 3.6
        gains.append(total_energy(law, end) - total_energy(law, start))
    if shifted:
        assert abs(gains[0]) < 1e-6
        assert gains[0] / gains[1] == pytest.approx(4.0, rel=0.3)
    else:
        left = at_the_cutoff(law, end)
        assert abs(left) > 1e-3
        # The agreement is limited by the step length: the force ends with the step after the crossing.
        assert gains[1] == pytest.approx(-left, rel=5e-3)


def induced(rng, law, dipoles, n=8, size=3.0, scale=0.3):
    """Random soft spheres, none within another, in a non-uniform field."""
    place = [size * rng.normal(size=3)]
    while len(place) < n:
        new = size * rng.normal(size=3)
        if min(np.linalg.norm(np.array(place) - new, axis=1)) > 2.2:
            place.append(new)
    effects = (
        Quadrupole(constant=(0, 0, 0), scale=(scale, scale, 2 * scale)),
        MagneticField(constant=vector(rng)),
        law,
        Magnetophoresis(),
        dipoles,
    )
    radius = rng.uniform(0.8, 1.1, n)
    return scene(place, np.zeros((n, 3)), effects, radius=radius, mass=1.0)


def solved(one, r, radius):
    """Induced moments by one linear solve, and the energy -1/2 sum m.B of the applied field."""
    law, n = one.effects[2], len(r)
    gain = 4 * np.pi / MU_0 * law.susceptibility / (3 + law.susceptibility) * radius**3
    influence = parts(law, r, radius)[..., None, None] * dipole_field(r)
    matrix = np.eye(3 * n) - np.repeat(gain, 3)[:, None] * influence.transpose(0, 2, 1, 3).reshape(3 * n, -1)
    b = flux_density(one.effects, r)
    m = np.linalg.solve(matrix, (gain[:, None] * b).ravel()).reshape(n, 3)
    return m, -0.5 * (m * b).sum()


@pytest.mark.long
@pytest.mark.parametrize("shifted", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_mutual_moments_with_a_cutoff_equal_a_linear_solve(rng, shifted):
    """If the forces have the same cut-off, they are the gradient of the energy -1/2 sum m.B_0."""
    scenes = []
    for k in range(WORLDS):
        cut = {**NUMBERS[k % 3], "shifted": shifted}
        law = MutualInducedMoment(susceptibility=float(rng.uniform(1, 50)), tolerance=1e-14, **cut)
        scenes.append(induced(rng, law, TruncatedDipoleDipole(**cut)))
    for one, state in zip(scenes, loads(scenes), strict=True):
        r, radius, h = state["position"], state["radius"], 1e-5
        close(state["moment"], solved(one, r, radius)[0], 1e-11)
        expected = np.zeros_like(r)
        for i, a, step in steps(len(r), h):
            energies = [solved(one, r + sign * step, radius)[1] for sign in (1, -1)]
            expected[i, a] = (energies[1] - energies[0]) / (2 * h)
        close(state["force"], expected, 1e-7)


@pytest.mark.slow
def test_mutual_moments_of_many_are_found_with_the_pair_list(rng):
    """Iron grains of unlike sizes on a lattice, 8 um between surfaces (L21): several chunks of pairs."""
    radius = rng.uniform(1.5e-6, 3.5e-6, 512)
    place = 8e-6 * np.argwhere(np.ones((8, 8, 8))) + rng.uniform(0, 0.8e-6, (512, 3))
    law = MutualInducedMoment(susceptibility=1e3, cutoff=2.0, gap=8e-6, tolerance=1e-13)
    effects = (
        Quadrupole(constant=(0, 0, 0), scale=(0, 0, 0)),
        MagneticField(constant=(0, 0, 0.6)),
        law,
        Magnetophoresis(),
        TruncatedDipoleDipole(cutoff=2.0, gap=8e-6),
    )
    setup = scene(place, 0 * place, effects, radius=radius, density=7.86e3)
    (state,) = loads([setup], capacity=512)
    order = np.argsort(state["id"])
    state = {name: values[order] for name, values in state.items()}
    close(state["moment"], solved(setup, state["position"], state["radius"])[0], 1e-10)


def test_without_a_cutoff_all_pairs_count():
    assert not MutualInducedMoment(susceptibility=1.0).short_ranged
    assert MutualInducedMoment(susceptibility=1.0, cutoff=2.5).short_ranged
    law = MutualInducedMoment(susceptibility=1.0, cutoff=6.0)
    assert law.structure() != MutualInducedMoment(susceptibility=1.0).structure()
    assert law.structure() == MutualInducedMoment(susceptibility=3.0, cutoff=2.0, gap=1.0).structure()
    assert law.approximations(1.0)[0] == InducedMoment(susceptibility=1.0)


DISAGREE = {
    "effects.mutual_induced_moment.cutoff must be that of the forces, 6.0 in "
    "effects.truncated_dipole_dipole; received 2.1": (
        MutualInducedMoment(susceptibility=1.0, cutoff=2.1),
        TruncatedDipoleDipole(cutoff=6.0),
    ),
    "effects.mutual_induced_moment.cutoff must be that of the forces, 0 in effects.dipole_dipole; received "
    "2.1": (MutualInducedMoment(susceptibility=1.0, cutoff=2.1), DipoleDipole()),
    "effects.mutual_induced_moment.shifted must be that of the forces, True in "
    "effects.truncated_dipole_dipole; received False": (
        MutualInducedMoment(susceptibility=1.0, cutoff=6.0),
        TruncatedDipoleDipole(cutoff=6.0, shifted=True),
    ),
    "effects.mutual_induced_moment must be used with forces by the same sum; received "
    "'ewald_dipole_dipole'": (
        MutualInducedMoment(susceptibility=1.0),
        EwaldDipoleDipole(**EWALD),
    ),
    "effects.ewald_induced_moment.accuracy must be that of the forces, 0.0001 in "
    "effects.ewald_dipole_dipole; received 0.01": (
        EwaldInducedMoment(susceptibility=1.0, accuracy=1e-2, **EWALD),
        EwaldDipoleDipole(**EWALD),
    ),
    "effects.ewald_induced_moment.demagnetising_factors must be that of the forces, (0.0, 0.0, 1.0) in "
    "effects.ewald_dipole_dipole; received (0.0, 0.0, 0.0)": (
        EwaldInducedMoment(susceptibility=1.0, **EWALD),
        EwaldDipoleDipole(demagnetising_factors=(0, 0, 1), **EWALD),
    ),
}


@pytest.mark.parametrize("message", DISAGREE)
def test_moments_and_forces_must_use_the_same_sum(message):
    """In either order. Other forces, and moments that are not mutual, may have different settings."""
    box = Box(low=(0, 0, 0), high=(8.0,) * 3)
    for laws in (DISAGREE[message], DISAGREE[message][::-1]):
        with pytest.raises(InputError) as fault:
            scene([[0, 0, 0]], [[0, 0, 0]], (MagneticField(constant=(0, 0, 1)), *laws), domain=box)
        assert str(fault.value) == message
    apart = InducedMoment(susceptibility=1.0), TruncatedDipoleDipole(cutoff=6.0)
    scene([[0, 0, 0]], [[0, 0, 0]], (MagneticField(constant=(0, 0, 1)), *apart), domain=box)


WRONG = {
    "mutual_induced_moment.cutoff must be greater than 2, or 2 beside a gap, or 0 without a gap for all "
    "pairs; received 1.0": {"cutoff": 1.0},
    "mutual_induced_moment.cutoff must be greater than 2, or 2 beside a gap, or 0 without a gap for all "
    "pairs; received 0.0": {"gap": 1e-6},
    "mutual_induced_moment.shifted must be false without a cutoff; received True": {"shifted": True},
    "mutual_induced_moment.gap must be at least 0.0; received -1": {"cutoff": 3.0, "gap": -1},
}


@pytest.mark.parametrize("message", WRONG)
def test_invalid_values_are_refused(message):
    with pytest.raises(InputError) as fault:
        MutualInducedMoment(susceptibility=1.0, **WRONG[message])
    assert str(fault.value) == message
