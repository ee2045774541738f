"""Extreme cases of magnetic moments: zero field, saturation, contact, overlap, and near divergence."""

import numpy as np
import pytest

from tests.effects.contact.loads import WORLDS, close, loads
from tests.effects.magnetic.magnets import K_B, MU_0, Quadrupole, dipole_field, flux_density
from tests.effects.magnetic.test_cutoff import parts
from tests.effects.magnetic.test_dipole_dipole import SIDE, magnets
from tests.effects.magnetic.test_moment import langevin
from tests.hard.judging import holds
from tests.scenes import by_id, fixed, scene, simulate
from tisim import Material, Simulation
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.cases.hard.moments import magnetised, moments_near_divergence, soft_chain
from tisim.effects import (
    DipoleDipole,
    FixedMoment,
    Granular,
    Hooke,
    LangevinMoment,
    LinearSpring,
    Magnetophoresis,
    MutualInducedMoment,
    NearField,
    PermanentMoment,
    RestitutionDamping,
    TruncatedDipoleDipole,
)
from tisim.numerics.langevin import langevin_ratio
from tisim.sources import MagneticField
from tisim.steppers import ErrorControl, Trapezoid

ARGUMENTS = np.concatenate(
    [[1e-30, 1e-12, 1e6, 1e30], np.nextafter(1, [0, 1, 2]), 10 ** np.linspace(-4, 3, 400)]
)


@in_taichi_thread
@ti.kernel
def _ratios(x: ti.types.ndarray(), out: ti.types.ndarray()):
    for k in range(x.shape[0]):
        out[k] = langevin_ratio(x[k])


def ratios(real=np.float32):
    """L(x)/x for all arguments, and at 0."""
    x = np.concatenate([ARGUMENTS, [0.0]]).astype(real)
    out = np.zeros_like(x)
    _ratios(x, out)
    return out.astype(float).tolist()


@pytest.mark.parametrize("real", [np.float64, np.float32])
def test_langevins_function_is_right_to_rounding(real, request):
    """L(x)/x is compared to 60 digits for x from 1e-30 to 1e30 in both precisions; it is 1/3 at 0."""
    values = np.array(
        ratios(real)
        if real is np.float64
        else request.getfixturevalue("single")("hard.test_magnetism", "ratios")
    )
    assert values[-1] == real(1 / 3)
    x = ARGUMENTS.astype(real).astype(float)
    expected = np.array([langevin(x) / x if x > 1e-15 else 1 / 3 for x in x])
    assert np.abs(values[:-1] / expected - 1).max() < 4 * np.finfo(real).eps


@pytest.mark.slow
def test_no_field_no_moment_and_no_force(rng):
    """At B = 0 no direction is preferred and the moment is zero; next to it the moment is complete."""
    place = np.array([[0, 0, 0], [1e-12, 0, 0], [0, 0, 0], [1, 0, 0]])
    field = Quadrupole(constant=(0, 0, 0), scale=(2, 2, 1))
    start = {"saturation_moment": 5.0, "domain_moment": 1e-20}
    for law in (FixedMoment(), LangevinMoment(temperature=1e4)):
        fixed_size = isinstance(law, FixedMoment)
        quantities = {"saturation_moment": 5.0} if fixed_size else start

        def at(place, effects, quantities=quantities):
            return scene(place, 0 * place, effects, mass=1.0, quantities=quantities)

        anywhere = Quadrupole(constant=tuple(rng.normal(size=3)), scale=tuple(rng.normal(size=3)))
        effects = [(source, law, Magnetophoresis()) for source in (field, anywhere)]
        null, other = loads([at(place, effects[0]), at(rng.normal(size=(9, 3)), effects[1])])
        x = 1e-20 * 2 * place[:, 0] / (K_B * 1e4)
        along = [5.0, 5.0] if fixed_size else [5.0 * x[1] / 3, 5.0 * langevin(x[3])]
        np.testing.assert_allclose(null["moment"][[1, 3], 1], along, rtol=1e-14)
        np.testing.assert_array_equal(null["moment"][[0, 2]], 0.0)
        np.testing.assert_array_equal(null["force"][[0, 2]], 0.0)
        np.testing.assert_allclose(null["force"][[1, 3], 0], 2 * np.array(along), rtol=1e-14)
        b = flux_density((anywhere, MagneticField()), other["position"])
        strength = np.linalg.norm(b, axis=1)
        size = [1.0 if fixed_size else langevin(1e-20 * b / (K_B * 1e4)) for b in strength]
        close(other["moment"], (5.0 * np.array(size) / strength)[:, None] * b)


def test_dipoles_at_contact_and_closer(rng):
    """For coincident dipoles the force is undefined, and the failure names it.

    At 1e-12 radii the usual law holds. Antiparallel dipoles in contact attract side by side and repel in
    line.
    """
    moment = rng.normal(size=3)
    place = np.array([[1.0, 1, 1], [1.0, 1, 1], [2, 2, 2]])
    law = magnets(rng, DipoleDipole(), n=3)

    def at(place, moments):
        start = law.particles.model_copy(
            update={
                "position": tuple(map(tuple, place)),
                "quantities": {"moment": [list(m) for m in moments]},
                "radius": (0.1,) * 3,
            }
        )
        return law.model_copy(update={"particles": start})

    (bad,) = simulate([at(place, [moment] * 3)], worlds=WORLDS, capacity=16)
    for word in ("at t = 0 s", "effects.dipole_dipole", "particle 0", "not finite"):
        assert word in bad.status.reason
    np.testing.assert_array_equal(bad.state["position"], place)
    far = [0.1, 0.1, 0.1]
    d = np.array([2.0**-44, 0, 0])
    (near,) = loads([at([d, [0, 0, 0], far], [[3.0, 0, 0], [2.0, 0, 0], [0, 0, 0]])])
    unit = 3 * MU_0 / (4 * np.pi)
    np.testing.assert_allclose(near["force"][0], [-2 * unit * 6.0 * 2.0**176, 0, 0], rtol=1e-12)
    assert (near["force"].sum(axis=0) == 0).all()
    for moments, expected in (
        ([[0, 1, 0], [0, -1, 0], [0, 0, 0]], unit / 0.2**4),
        ([[1, 0, 0], [-1, 0, 0], [0, 0, 0]], -2 * unit / 0.2**4),
    ):
        (state,) = loads([at([[0.5, 0.5, 0.5], [0.7, 0.5, 0.5], [0.5, 2, 2]], moments)])
        np.testing.assert_allclose(state["force"][0], [expected, 0, 0], rtol=1e-12, atol=1e-20)
    assert SIDE > 2


def solved_results(scenes, capacity=128):
    simulation = Simulation(scenes[0], worlds=len(scenes), capacity=capacity)
    simulation.load(scenes)
    results = simulation.results()
    simulation.close()
    return results


def solve(place, law=None):
    n, chi = len(place), 1e6 - 1
    gain = 4 * np.pi / MU_0 * chi / (3 + chi)
    part = np.ones((n, n)) if law is None else parts(law, place, np.ones(n))
    influence = part[..., None, None] * dipole_field(place)
    matrix = np.eye(3 * n) - gain * influence.transpose(0, 2, 1, 3).reshape(3 * n, 3 * n)
    return np.linalg.solve(matrix, np.tile([0, 0, gain], n)).reshape(n, 3)


@pytest.mark.slow
def test_mutual_induction_converges_or_fails_with_a_message():
    """Induction at mu_r = 1e6 gives the right moments, or a failure that states the growth factor of a sweep.

    Cases: the pairs and the chain of the hard case by plain sweeps; nearly coincident spheres; and dense
    lattices with eigenvalues below -1, which need relaxation or mixing to converge.
    """
    holds(moments_near_divergence, "none")
    lattice = 2.0 * np.argwhere(np.ones((5, 5, 5)))
    faces = np.argwhere(np.ones((6, 6, 6)))
    faces = np.sqrt(2) * faces[faces.sum(axis=1) % 2 == 0]

    def pair(d):
        return np.array([[0, 0, 0], [0, 0, d]])

    alike = [
        (lattice, 0.75, None),
        (faces, 0.75, None),
        (pair(1e-3), 1.0, 2e9),
        (pair(0.0), 1.0, np.nan),
    ]
    plain = [*alike, (lattice, 1.0, 1.0639), (faces, 1.0, 1.3313)]
    mixed = [*alike, (lattice, 1.0, None), (faces, 1.0, None)]
    results = []
    for cases, how in ((plain, "none"), (mixed, "anderson")):
        enough = {"sweeps": 2000, "tolerance": 1e-12, "acceleration": how}
        results += solved_results([magnetised(place, relaxation=part, **enough) for place, part, _ in cases])
    for (place, _, factor), result in zip([*plain, *mixed], results, strict=True):
        if factor is None:
            assert result.status.ok or result.status.reason == "running", result.status.reason
            close(result.state["moment"], solve(place), 1e-9)
            continue
        assert "effects.mutual_induced_moment, at particle" in result.status.reason
        np.testing.assert_array_equal(result.state["position"], place)
        if np.isfinite(factor):
            assert "does not converge: a sweep multiplies the change by" in result.status.reason
            # The eigenvalue is (1 - 1e-6) times this, because mu_r is finite.
            assert result.measures["sweep_factor"] == pytest.approx(factor, rel=1e-4)
        else:
            assert "not finite" in result.status.reason


@pytest.mark.slow
def test_mixed_sweeps_find_moments_only_if_they_exist(rng):
    """Overlapping spheres of unequal sizes, mu_r = 1e9.

    If an eigenvalue exceeds 1, mixed sweeps would converge to a spurious solution. The world stops in these
    cases and in no others.
    """
    scenes, solvable = [], []
    for _ in range(120):
        n = int(rng.integers(2, 30))
        place = rng.uniform(0, rng.uniform(1.2, 4.0) * n ** (1 / 3), (n, 3))
        radius = rng.uniform(0.1, 1.0, n) ** 2
        apart = np.linalg.norm(place[None] - place[:, None], axis=2) + np.diag(np.full(n, np.inf))
        radius *= (apart / (radius[:, None] + radius)).min() / rng.uniform(0.4, 1.0)
        gain = 4 * np.pi / MU_0 * radius**3
        root = np.repeat(np.sqrt(gain), 3)
        coupling = dipole_field(place).transpose(0, 2, 1, 3).reshape(3 * n, 3 * n)
        solvable.append(np.linalg.eigvalsh(root[:, None] * coupling * root).max())
        scenes.append(
            scene(
                place,
                0 * place,
                (
                    MagneticField(constant=(0, 0, 1)),
                    MutualInducedMoment(susceptibility=1e9, sweeps=2000, tolerance=1e-10),
                ),
                radius=radius,
                mass=1.0,
            )
        )
    results = solved_results(scenes, capacity=32)
    largest = np.array(solvable)
    assert (largest > 1.01).sum() > 20
    assert (largest < 0.99).sum() > 20
    for bound, result in zip(largest, results, strict=True):
        if bound < 0.99:
            assert result.status.reason == "running", result.status.reason
        elif bound > 1.01:
            assert "does not converge: a sweep multiplies the change by" in result.status.reason
            assert 1 < result.measures["sweep_factor"] < bound * (1 + 1e-6)


def energy(state, wall, b):
    """Energy (J): kinetic, of linear dipoles in the field b, and of the repulsion between the two."""
    gap = np.linalg.norm(state["position"][1] - state["position"][0])
    return 0.5 * (state["velocity"] ** 2).sum() - 0.5 * (state["moment"] @ b).sum() + wall(gap)


@pytest.mark.slow
def test_a_trial_state_without_convergence_is_repeated():
    """Two spheres in a field fly at each other and rebound.

    The first step is so long that it ends with overlapping spheres, for which the moments diverge. It is
    repeated with a shorter step. The energy is conserved and nothing fails.
    """
    b, power = (0.0, 0, 1e-2), 30
    push = NearField(alpha2=900.0 * (power - 1) * 2.05 ** (power - 1), beta2=power)
    stepper = Trapezoid(control=ErrorControl(error=1e-6, tolerance=1e-9, first=0.05, longest=0.05))
    solvable, never = (
        scene(
            [[0, 0, -2.0], [0, 0, 2.0]],
            [[0, 0, 30.0], [0, 0, -30.0]],
            (
                MagneticField(constant=b),
                MutualInducedMoment(susceptibility=1e6, tolerance=tolerance, sweeps=12, acceleration="none"),
                DipoleDipole(),
                push,
            ),
            radius=1.0,
            mass=1.0,
            stepper=stepper,
            duration=0.2,
        )
        for tolerance in (1e-6, 1e-13)
    )
    simulation = Simulation(solvable, worlds=2)
    simulation.load([solvable, solvable])
    start = simulation.results()[0]
    simulation.load([solvable, never])
    simulation.run()
    result, failed = simulation.results()
    simulation.close()
    stuck = "cannot be solved even at the shortest step, by effects.mutual_induced_moment, at particle"
    assert stuck in failed.status.reason
    assert result.status.ok, result.status.reason
    assert result.work["rejections"] > 0
    assert by_id(result)["velocity"][1, 2] > 20

    def wall(gap):
        return push.alpha2 / (power - 1) * gap ** (1 - power)

    assert energy(by_id(result), wall, b) == pytest.approx(energy(by_id(start), wall, b), rel=1e-4)


@pytest.mark.slow
def test_dense_lattices_with_a_cutoff_converge():
    """At mu_r = 1e6 and contact, mixed sweeps converge where plain ones do not.

    This holds with and without relaxation and with a cut-off. The moments equal a linear solve with the same
    pairs.
    """
    faces = np.argwhere(np.ones((6, 6, 6)))
    faces = np.sqrt(2) * faces[faces.sum(axis=1) % 2 == 0]
    for cut in ({"cutoff": 3.0}, {"cutoff": 2.0, "gap": 1.7}, {"cutoff": 6.0, "shifted": True}):
        expected = solve(faces, magnetised(faces, **cut).effects[1])
        enough = {"sweeps": 2000, "tolerance": 1e-12, **cut}
        made = [magnetised(faces, relaxation=relaxation, **enough) for relaxation in (0.6, 1.0)]
        for result in solved_results(made):
            assert result.status.reason == "running", result.status.reason
            close(by_id(result)["moment"], expected, 1e-9)


CONTACT = Granular(normal=Hooke(), damping=RestitutionDamping(), tangential=LinearSpring())
STEEL = {"steel": Material(stiffness=1e5, restitution=0.1, friction=0.5)}


def chain(*effects, materials=None, **more):
    """Five grains in a row along z, just in contact."""
    place = np.array([[0, 0, 2.0 * k] for k in range(5)])
    return scene(
        place,
        0 * place,
        (CONTACT, *effects),
        radius=1.0,
        mass=1.0,
        stepper=fixed(1e-4),
        duration=4.0,
        materials=materials or STEEL,
        **more,
    )


CHAINS = {
    "permanent": lambda: chain(PermanentMoment(), DipoleDipole(), quantities={"moment": [[0, 0, 1e4]] * 5}),
    "mutual": lambda: chain(
        MagneticField(constant=(0, 0, 1e-3)),
        MutualInducedMoment(susceptibility=1e3, cutoff=6.0),
        TruncatedDipoleDipole(cutoff=6.0),
    ),
    "mutual, one sweep a step": soft_chain,
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CHAINS)
def test_a_chain_at_rest_holds(name):
    """Each contact spring bears the magnetic force between the moments on its two sides."""
    setup = CHAINS[name]()
    (result,) = simulate([setup], capacity=32)
    assert result.status.ok, result.status.reason
    state, law = by_id(result), setup.effects[-1]
    r, m = state["position"], state["moment"]
    pull = np.zeros((5, 5))
    for i, j in np.argwhere(~np.eye(5, dtype=bool)):
        d = r[j, 2] - r[i, 2]
        x = abs(d) / (getattr(law, "cutoff", np.inf) or np.inf)
        part, slope = (
            (1 - 4 * x**3 + 3 * x**4, 12 * x**3 * (x - 1)) if getattr(law, "shifted", False) else (1.0, 0.0)
        )
        # U = -2 c m m / d^3 for a pair in line; F along n is f times -6 c m m / d^4, minus d f' U / d.
        size = 2e-7 * m[i, 2] * m[j, 2] / d**4
        pull[i, j] = np.sign(d) * (3 * part - slope) * size if x <= 1 else 0.0
    assert np.abs(state["force"]).max() < 1e-5 * np.abs(pull).max()
    for k in range(4):
        spring = 1e5 * (2.0 - (r[k + 1, 2] - r[k, 2]))
        assert spring == pytest.approx(pull[: k + 1, k + 1 :].sum(), rel=1e-4)
    np.testing.assert_allclose(r[:, :2], 0.0, atol=1e-12)
    np.testing.assert_allclose(m[:, :2], 0.0, atol=1e-9 * np.abs(m).max())
