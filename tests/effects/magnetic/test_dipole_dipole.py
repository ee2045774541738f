"""Forces between dipoles against NumPy references, the gradient of their energy, and closed forms for induced
ones."""

import numpy as np
import pytest

from tests.effects.contact.loads import WORLDS, balanced, close, fields_beside_the_core, loads, vector
from tests.effects.magnetic.magnets import K_B, MU_0, Quadrupole, dipole_field, flux_density
from tests.scenes import scene
from tisim import Box, InputError
from tisim.effects import (
    DipoleDipole,
    InducedMoment,
    LangevinMoment,
    Magnetophoresis,
    MutualInducedMoment,
    MutualLangevinMoment,
    TruncatedDipoleDipole,
)
from tisim.sources import MagneticField

SIDE = 3.0


def magnets(rng, law, n=12, spread=SIDE, sizes=(0.05, 0.2)):
    """Moments in random directions, in a periodic box."""
    return scene(
        rng.uniform(0, spread, (n, 3)),
        np.zeros((n, 3)),
        (law,),
        radius=rng.uniform(*sizes, n),
        mass=1.0,
        domain=Box(low=(0, 0, 0), high=(SIDE,) * 3),
        quantities={"moment": 1e3 * rng.normal(size=(n, 3))},
    )


def separations(r):
    d = r[None] - r[:, None]
    d -= SIDE * np.round(d / SIDE)
    distance = np.linalg.norm(d, axis=2) + np.eye(len(r))
    return d / distance[..., None], distance


def pair_forces(state):
    """[i, j] the force of j on i: L21 (4.6), with its sign."""
    n, d = separations(state["position"])
    m = state["moment"]
    i, j = np.einsum("ic,ijc->ij", m, n), np.einsum("jc,ijc->ij", m, n)
    total = i[..., None] * m[None] + j[..., None] * m[:, None] + ((m @ m.T) - 5 * i * j)[..., None] * n
    return -3 * MU_0 / (4 * np.pi) * ((1 - np.eye(len(m))) / d**4)[..., None] * total


def energy(r, m):
    """B16 (6.21), each pair once. J."""
    field = np.einsum("ijab,jb->ia", dipole_field(r, SIDE), m)
    return -0.5 * (m * field).sum()


def test_forces_equal_the_reference_and_sum_to_zero(rng):
    """Nearest images in a periodic box."""
    scenes = [magnets(rng, DipoleDipole()) for _ in range(WORLDS)]
    states = loads(scenes)
    for state in states:
        forces = pair_forces(state)
        close(state["force"], forces.sum(axis=1))
        np.testing.assert_allclose(
            state["force"].sum(axis=0), 0, atol=1e-14 * np.linalg.norm(forces, axis=2).sum()
        )


def test_the_force_is_the_gradient_of_the_energy(rng):
    """Central difference of B16 (6.21) with moments held fixed."""
    (state,) = loads([magnets(rng, DipoleDipole(), n=5)])
    r, m, h, expected = state["position"], state["moment"], 1e-5, np.zeros((5, 3))
    for i, a in np.ndindex(5, 3):
        step = np.zeros((5, 3))
        step[i, a] = h
        expected[i, a] = -(energy(r + step, m) - energy(r - step, m)) / (2 * h)
    close(state["force"], expected, 1e-8)


def test_torques_on_moments_balance_torques_of_forces(rng):
    """sum r x F + sum m x B = 0, with all particles in less than half of the box, so that no image acts."""
    (state,) = loads([magnets(rng, DipoleDipole(), spread=0.49 * SIDE)])
    r, m = state["position"], state["moment"]
    turning = np.cross(m, np.einsum("ijab,jb->ia", dipole_field(r), m))
    assert np.abs(turning.sum(axis=0)).max() > 0
    balanced({**state, "torque": turning})


@pytest.mark.slow
def test_near_pairs_only(rng):
    """Up to a number of radii; also over the pair list, with unlike sizes."""
    few = [magnets(rng, TruncatedDipoleDipole(cutoff=float(rng.uniform(4, 7)))) for _ in range(WORLDS - 1)]
    scenes = [*few, magnets(rng, TruncatedDipoleDipole(cutoff=4.0), n=400, sizes=(0.02, 0.1))]
    for one, state in zip(scenes, loads(scenes, capacity=400), strict=True):
        forces, radius = pair_forces(state), state["radius"]
        near = 2 * separations(state["position"])[1] <= one.effects[0].cutoff * (radius[:, None] + radius)
        close(state["force"], (near[..., None] * forces).sum(axis=1))
        assert np.abs(state["force"] - forces.sum(axis=1)).max() > 1e-6 * np.abs(state["force"]).max()


@pytest.mark.long
def test_a_box_in_which_a_law_reaches_beyond_half_a_side_is_refused(rng):
    """Otherwise the second image of a particle would act too."""
    wide, narrow = (magnets(rng, TruncatedDipoleDipole(cutoff=c), sizes=(0.2, 0.2)) for c in (7.4, 7.6))
    loads([wide], capacity=400)
    told = "box must be at least 3.04 m wide where .* the range over which truncated_dipole_dipole acts"
    with pytest.raises(InputError, match=told):
        loads([narrow], capacity=400)


def test_head_to_tail_attracts_and_side_by_side_repels():
    """F = 6 mu_0 m^2 / (4 pi d^4) in attraction, half of it in repulsion; B16 6.2.4."""
    unit = 3 * MU_0 / (4 * np.pi) * 4.0 / 0.5**4
    for moment, expected in (((2, 0, 0), 2 * unit), ((0, 2, 0), -unit)):
        setup = scene(
            [[1, 1, 1], [1.5, 1, 1]],
            np.zeros((2, 3)),
            (DipoleDipole(),),
            mass=1.0,
            domain=Box(low=(0, 0, 0), high=(SIDE,) * 3),
            quantities={"moment": [moment, moment]},
        )
        force = loads([setup])[0]["force"]
        np.testing.assert_allclose(force, [[expected, 0, 0], [-expected, 0, 0]], rtol=1e-12)


def induced(place, b, law=None, radius=1.0, domain=None, **more):
    """Spheres in a uniform or a non-uniform field, with all forces."""
    field = Quadrupole(constant=(0, 0, 0), scale=more.pop("scale", (0, 0, 0)))
    effects = (
        field,
        MagneticField(constant=tuple(b)),
        law or MutualInducedMoment(susceptibility=1e12, tolerance=1e-14),
        Magnetophoresis(),
        DipoleDipole(),
    )
    return scene(place, np.zeros((len(place), 3)), effects, radius=radius, mass=1.0, **more)


def solved(one, r, radius):
    """Induced moments by one linear solve, and the energy -1/2 sum m.B of the applied field."""
    chi = one.effects[2].susceptibility
    gain = 4 * np.pi / MU_0 * chi / (3 + chi) * radius**3
    b, n = flux_density(one.effects, r), len(r)
    matrix = np.eye(3 * n) - np.repeat(gain, 3)[:, None] * dipole_field(r).transpose(0, 2, 1, 3).reshape(
        3 * n, 3 * n
    )
    m = np.linalg.solve(matrix, (gain[:, None] * b).ravel()).reshape(n, 3)
    return m, -0.5 * (m * b).sum()


@pytest.mark.long
def test_two_touching_spheres():
    """For mu_r -> infinity the attraction in line is 16/9 of the attraction of fixed moments, the repulsion
    side by side is 64/81 of it (L21 section 4.2). In general the moments are 1/(1 - 2a) and 1/(1 + a) times
    those of isolated spheres."""
    pair = np.array([[0, 0, 0], [0, 0, 2.0]])
    alone = 4 * np.pi / MU_0
    unit = 3 * MU_0 / (4 * np.pi) * alone**2 / 2**4
    along, across = loads([induced(pair, b) for b in ((0, 0, 1), (1, 0, 0))])
    np.testing.assert_allclose(along["moment"], [[0, 0, 4 / 3 * alone]] * 2, rtol=1e-11)
    np.testing.assert_allclose(across["moment"], [[8 / 9 * alone, 0, 0]] * 2, rtol=1e-11)
    np.testing.assert_allclose(along["force"][:, 2], [16 / 9 * 2 * unit, -16 / 9 * 2 * unit], rtol=1e-11)
    np.testing.assert_allclose(across["force"][:, 2], [-64 / 81 * unit, 64 / 81 * unit], rtol=1e-11)
    laws = [
        MutualInducedMoment(susceptibility=chi, tolerance=1e-14, relaxation=relaxation)
        for chi, relaxation in ((0.5, 1.0), (-0.9, 1.0), (20.0, 0.7))
    ]
    scenes = [induced(3.0 * pair, b, law, radius=2.5) for law in laws for b in ((0, 0, 1), (1, 0, 0))]
    for one, state in zip(scenes, loads(scenes), strict=True):
        law, b = one.effects[2], np.array(one.effects[1].constant)
        a = law.susceptibility / (3 + law.susceptibility) * 2.5**3 / 6**3
        factor = 1 / (1 - 2 * a) if b[2] else 1 / (1 + a)
        expected = 4 * np.pi / MU_0 * a * 6**3 * factor * b
        np.testing.assert_allclose(state["moment"], [expected, expected], rtol=1e-11, atol=1e-14)


@pytest.mark.long
def test_induced_moments_and_forces_follow_from_their_energy(rng):
    """A bent chain of three, and clouds of five; in a non-uniform field, with all its forces.

    The energy of linear spheres is -1/2 sum m.B_0. Its gradient is the whole force: the force of the field on
    the moments plus the forces of the moments on each other. Neither of the two is a gradient of it alone.
    """
    chain = np.array([[0, 0, 0], [1.9, 0.7, 0], [3.5, 1.9, 0.3]])
    places = [chain, *(3 * np.mgrid[:5, :1, :1].reshape(3, -1).T + rng.normal(size=(5, 3)) for _ in range(3))]
    scenes = []
    for place in places:
        law = MutualInducedMoment(susceptibility=float(rng.uniform(1, 100)), tolerance=1e-14)
        radius = rng.uniform(0.8, 1.0, len(place))
        scenes.append(induced(place, vector(rng), law, radius=radius, scale=(0.4, 0.4, 0.7)))
    for one, state in zip(scenes, loads(scenes), strict=True):
        r, radius, h = state["position"], state["radius"], 1e-5
        m, _ = solved(one, r, radius)
        close(state["moment"], m, 1e-11)
        expected = np.zeros_like(r)
        for i, a in np.ndindex(*r.shape):
            step = np.zeros_like(r)
            step[i, a] = h
            expected[i, a] = -(solved(one, r + step, radius)[1] - solved(one, r - step, radius)[1]) / (2 * h)
        close(state["force"], expected, 1e-7)


@pytest.mark.long
def test_langevin_moments_in_each_others_field(rng):
    """Each moment follows from the local field, which includes the field of the other moments. In weak fields
    this differs clearly from the field of the sources alone."""
    unit = K_B * 300.0
    scenes = []
    for strength in (0.1, 1.0, 30.0):
        law = MutualLangevinMoment(temperature=300.0, tolerance=1e-14)
        place = 2.2 * np.mgrid[:3, :2, :1].reshape(3, -1).T + 0.1 * rng.normal(size=(6, 3))
        quantities = {"saturation_moment": 5e7 * rng.uniform(0.5, 1, 6), "domain_moment": unit}
        scenes.append(induced(place, strength * np.array([0.6, 0.0, 0.8]), law, quantities=quantities))
    ratios = []
    for one, state in zip(scenes, loads(scenes), strict=True):
        m = state["moment"]
        own = flux_density(one.effects, state["position"])
        b = own + np.einsum("ijab,jb->ia", dipole_field(state["position"]), m)
        x = np.linalg.norm(b, axis=1)
        expected = (state["saturation_moment"] * (1 / np.tanh(x) - 1 / x) / x)[:, None] * b
        close(m, expected, 1e-11)
        ratios.append(np.abs(b - own).max() / np.abs(own).max())
    assert ratios[0] > 0.3 > 0.05 > ratios[2] > 0


def test_mutual_laws_offer_approximations_to_a_cost_study():
    """The coarsest approximation first: each moment in the field of the sources alone; then one sweep a step;
    and cut-offs."""
    law = MutualLangevinMoment(temperature=300.0, sweeps=50)
    alone, once = law.approximations(1.0)
    assert alone == LangevinMoment(temperature=300.0)
    assert once == law.model_copy(update={"sweeps": 0})
    chi = MutualInducedMoment(susceptibility=2.0).approximations(1.0)
    assert [type(a) for a in chi] == [InducedMoment, MutualInducedMoment]
    cuts = DipoleDipole().approximations(1.0)
    assert [type(cut) for cut in cuts] == [TruncatedDipoleDipole] * len(cuts)
    assert 30.0 in [cut.cutoff for cut in cuts]
    assert TruncatedDipoleDipole().cutoff == 30.0
    nearer = TruncatedDipoleDipole(cutoff=2.0, gap=8e-6).approximations(1.0)
    assert [(one.cutoff, one.gap) for one in nearer] == [(2.0, 4e-6), (2.0, 5.6e-6)]
    assert [one.cutoff for one in TruncatedDipoleDipole().approximations(1.0)] == [16.0, 21.6]
    # Rounded to contact, without a gap, it would not be a valid law.
    assert TruncatedDipoleDipole(cutoff=2.004).approximations(1.0) == ()
    # Rounded up, the cut-off would be no shorter. Two that are rounded to one value are listed once.
    assert TruncatedDipoleDipole(cutoff=2.008).approximations(1.0) == ()
    small = TruncatedDipoleDipole(cutoff=2.008, gap=1e-9).approximations(1.0)
    assert [(one.cutoff, one.gap) for one in small] == [(2.0, 5e-10), (2.008, 7e-10)]
    assert [one.cutoff for one in TruncatedDipoleDipole(cutoff=2.014).approximations(1.0)] == [2.01]
    (_, several) = law.model_copy(update={"sweeps": 0}).approximations(1.0)
    assert several.sweeps == 100


def test_only_needed_fields_are_allocated():
    setup = scene([[0, 0, 0]], [[0, 0, 0]], (DipoleDipole(),))
    assert fields_beside_the_core(setup) == {"moment", "force"}


def test_invalid_values_are_refused():
    with pytest.raises(InputError) as fault:
        TruncatedDipoleDipole(cutoff=2)
    rule = "greater than 2, or 2 beside a gap"
    assert str(fault.value) == f"truncated_dipole_dipole.cutoff must be {rule}; received 2.0"
