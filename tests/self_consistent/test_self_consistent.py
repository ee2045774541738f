"""Self-consistent quantities in the field of a source: rules 6 and 7 of tisim/effects/base."""

import numpy as np
import pytest

from tests.scenes import scene, simulate
from tisim import Simulation
from tisim.backend.taichi import ti
from tisim.components.component import Vector
from tisim.effects import Force, PairForce, SelfConsistentQuantity, parameter
from tisim.sources import Source, sources
from tisim.state.fields import Field

DIPOLE = Field("dipole", "A m^2", 3, "sum")


class Ramp(Source):
    """H(r) = strength + slope x, uniform apart from a gradient along x."""

    quantity = "magnetic_field_strength"
    strength: Vector = parameter("A/m", "strength", (0.0, 0.0, 0.0))
    slope: Vector = parameter("A/m^2", "slope", (0.0, 0.0, 0.0))

    @ti.func
    def value(self, w, r, t):
        return self.strength(w) + self.slope(w) * r[0]

    @ti.func
    def gradient(self, w, r, t):
        return self.slope(w).outer_product(ti.Vector([1.0, 0.0, 0.0]))


class Polarisation(SelfConsistentQuantity):
    """m_i = chi R_i^3 (H0(r_i) + sum_j H_j(r_i)), H_j the field of dipole j."""

    fields = (DIPOLE, "radius")
    quantity = "dipole"
    chi: float = parameter("", "chi", gt=0)

    def connect(self, peers):
        return {"applied": sources(peers, "magnetic_field_strength")}

    @ti.func
    def influence(self, s, w, i, j, separation, distance, t):
        n, m = separation / distance, s.dipole[w, j]
        return (3.0 * m.dot(n) * n - m) / (4.0 * ti.math.pi * distance**3)

    @ti.func
    def response(self, s, w, i, total, t):
        field = total
        for source in ti.static(self.applied):
            field += source.value(w, s.position[w, i], t)
        return self.chi(w) * s.radius[w, i] ** 3 * field


class TowardsDipole(Force):
    """F = (m . grad) H of the applied field, per unit permeability."""

    fields = (DIPOLE,)

    def connect(self, peers):
        return {"applied": sources(peers, "magnetic_field_strength")}

    @ti.func
    def force(self, s, w, i, t):
        total = 0.0 * s.velocity[w, i]
        for source in ti.static(self.applied):
            total += source.gradient(w, s.position[w, i], t) @ s.dipole[w, i]
        return total


class DipoleForce(PairForce):
    """Force between point dipoles, per unit permeability."""

    fields = (DIPOLE,)

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        n, a, b = separation / distance, s.dipole[w, i], s.dipole[w, j]
        near = a.dot(n) * b + b.dot(n) * a + a.dot(b) * n - 5.0 * a.dot(n) * b.dot(n) * n
        return -3.0 / (4.0 * ti.math.pi * distance**4) * near


FIELD, SLOPE, CHI = np.array([0.3, -1.0, 2.0]), np.array([5.0, 0.0, 1.0]), 2.5


def cloud(seed, n=30, chi=CHI, spread=3.0, **more):
    rng = np.random.default_rng(seed)
    effects = (
        Ramp(strength=tuple(FIELD), slope=tuple(SLOPE)),
        Polarisation(chi=chi, **more),
        TowardsDipole(),
        DipoleForce(),
    )
    return scene(
        rng.uniform(0.0, spread, (n, 3)),
        rng.normal(size=(n, 3)),
        effects,
        radius=rng.uniform(0.1, 0.3, n),
        mass=1.0,
        dt=1e-3,
        steps=20,
    )


def solved(state, chi=CHI):
    """Dipoles from one linear solve, and the forces on them, in NumPy."""
    r, n = state["position"], len(state["radius"])
    d = r[None] - r[:, None]
    distance = np.linalg.norm(d, axis=2) + np.eye(n)
    unit = d / distance[..., None]
    coupling = (3 * unit[..., None] * unit[..., None, :] - np.eye(3)) / (4 * np.pi * distance**3)[
        ..., None, None
    ]
    coupling[np.arange(n), np.arange(n)] = 0
    gain = chi * state["radius"] ** 3
    applied = FIELD + SLOPE * r[:, :1]
    matrix = np.eye(3 * n) - np.repeat(gain, 3)[:, None] * coupling.transpose(0, 2, 1, 3).reshape(
        3 * n, 3 * n
    )
    m = np.linalg.solve(matrix, (gain[:, None] * applied).ravel()).reshape(n, 3)
    a, b = (m * unit.transpose(1, 0, 2)).sum(axis=2).T, (m[None] * unit).sum(axis=2)
    pairs = a[..., None] * m[None] + b[..., None] * m[:, None]
    pairs += ((m @ m.T)[..., None] - 5 * (a * b)[..., None]) * unit
    force = (-3 / (4 * np.pi * distance**4)[..., None] * pairs * (1 - np.eye(n))[..., None]).sum(axis=1)
    return m, force + SLOPE * m[:, :1], matrix


@pytest.mark.parametrize("schedule", ["world", pytest.param("particle", marks=pytest.mark.slow)])
def test_induced_dipoles_equal_a_linear_solve(schedule):
    """Dipoles and forces at the start and after 20 steps, in two worlds that need different numbers of
    sweeps."""
    scenes = [cloud(1, tolerance=1e-13), cloud(2, chi=5.0, tolerance=1e-13)]
    simulation = Simulation(scenes[0], worlds=2, schedule=schedule)
    simulation.load(scenes)
    for steps in (0, 20):
        simulation.run(steps=steps)
        for result, chi in zip(simulation.results(), (CHI, 5.0), strict=True):
            dipole, force, _ = solved(result.state, chi)
            np.testing.assert_allclose(
                result.state["dipole"], dipole, rtol=0, atol=1e-11 * np.abs(dipole).max()
            )
            np.testing.assert_allclose(result.state["force"], force, rtol=0, atol=1e-10 * np.abs(force).max())
            # The coupling matters: without it the dipoles would differ.
            alone = (
                chi * result.state["radius"][:, None] ** 3 * (FIELD + SLOPE * result.state["position"][:, :1])
            )
            assert np.abs(dipole - alone).max() > 0.02 * np.abs(dipole).max()
    few, many = (result.work["mutual_sweeps"] for result in simulation.results())
    assert 21 < few < many
    simulation.close()


@pytest.mark.long
def test_divergence_is_a_clear_failure():
    """With too strong a coupling the sweeps diverge.

    The world stops, and the message names the effect and the growth factor. The factor equals the NumPy value
    and tends to the spectral radius.
    """
    setup = cloud(3, n=20, chi=60.0, spread=1.0, sweeps=20, acceleration="none")
    start = setup.particles.arrays(setup.domain, 0)
    coupling = np.eye(60) - solved(start, 60.0)[2]
    spread = np.abs(np.linalg.eigvals(coupling)).max()
    alone = 60.0 * start["radius"][:, None] ** 3 * (FIELD + SLOPE * start["position"][:, :1])
    m, changes = np.zeros(60), []
    for _ in range(19):
        m, last = alone.ravel() + coupling @ m, m
        changes.append(np.linalg.norm((m - last).reshape(20, 3), axis=1).max())
    simulation = Simulation(setup)
    simulation.load([setup])
    simulation.run()
    (result,) = simulation.results()
    simulation.close()
    assert not result.status.ok
    factor = result.measures["sweep_factor"]
    assert factor == pytest.approx(np.sqrt(changes[-1] / changes[-3]), rel=1e-9)
    assert 0.8 * spread < factor < 1.2 * spread
    for words in (
        f"does not converge: a sweep multiplies the change by {factor:.3g}",
        "by effects.polarisation, at particle",
    ):
        assert words in result.status.reason
    np.testing.assert_array_equal(result.state["position"], result.start["position"])


def mixed_sweeps(coupling, alone, tolerance):
    """The values after each sweep until no value changes by more than a tolerance, in NumPy."""
    x, last, values = np.zeros_like(alone), None, []
    while True:
        f = alone + coupling @ x
        r, values = f - x, [*values, f]
        size = np.linalg.norm(np.stack([r, f]).reshape(2, -1, 3), axis=2).max(axis=1)
        if size[0] <= tolerance * size[1]:
            return values
        change = r - last[1] if last else r
        theta = r @ change / (change @ change) if last else 0.0
        x, last = f - theta * (f - last[0] if last else 0.0), (f, r)


@pytest.mark.long
def test_mixed_sweeps_follow_anderson():
    """The number of sweeps equals NumPy for the same tolerance; under strong coupling it is a third of plain
    ones."""
    setups = [cloud(seed, n=20, chi=chi, spread=1.5, tolerance=1e-10) for seed, chi in ((1, 1.0), (2, 2.0))]
    simulation = Simulation(setups[0], worlds=2)
    simulation.load(setups)
    for setup, result in zip(setups, simulation.results(), strict=True):
        dipole, _, matrix = solved(result.state, setup.effects[1].chi)
        values = mixed_sweeps(np.eye(60) - matrix, matrix @ dipole.ravel(), 1e-10)
        assert result.work["mutual_sweeps"] == len(values)
        np.testing.assert_allclose(result.state["dipole"], dipole, rtol=0, atol=1e-9 * np.abs(dipole).max())
    simulation.close()
    spread = np.abs(np.linalg.eigvals(np.eye(60) - matrix)).max()
    assert spread < 1
    assert len(values) < np.log(1e-10) / np.log(spread) / 3


@pytest.mark.slow
def test_one_sweep_in_each_step():
    """``sweeps=0``: one sweep in each step, started from the last values.

    At the start the sweeps continue to convergence, unless that is disabled too.
    """
    setups = [cloud(1, sweeps=0, largest_change=change) for change in (1e-2, 2.0)]
    simulation = Simulation(setups[0], worlds=2)
    simulation.load(setups)
    first = [result.work["mutual_sweeps"] for result in simulation.results()]
    assert first[0] > 4
    assert first[1] == 1
    simulation.run()
    after = simulation.results()
    # The convergence factor is unknown if there were never three sweeps in a step.
    factor, unknown = (result.measures["sweep_factor"] for result in after)
    assert unknown == 0
    for result, sweeps in zip(after, first, strict=True):
        assert result.status.ok
        assert result.work["mutual_sweeps"] == sweeps + 20
        exact = solved(result.state)[0]
        error = np.abs(result.state["dipole"] - exact).max() / np.abs(exact).max()
        assert 1e-8 < error < 1e-2
        # The error estimated from the reported quantities is right within a factor of 2.
        said = result.measures["sweep_change"] * factor / (1 - factor)
        assert 0.5 < error / said < 2
    simulation.close()


class Potential(SelfConsistentQuantity):
    """phi_i = 1 + strength sum_j phi_j / d_ij, a scalar."""

    fields = (Field("potential", "V", 1, "keep"),)
    quantity = "potential"
    strength: float = parameter("m", "strength", gt=0)

    @ti.func
    def influence(self, s, w, i, j, separation, distance, t):
        return self.strength(w) * s.potential[w, j] / distance

    @ti.func
    def response(self, s, w, i, total, t):
        return 1.0 + total


@pytest.mark.parametrize("schedule", ["world", pytest.param("particle", marks=pytest.mark.slow)])
def test_a_scalar_converges_without_any_force(schedule):
    """Two particles at a distance d have phi = 1/(1 - strength/d); no effect needs forces, so there are
    none."""
    effects = (Potential(strength=0.1, tolerance=1e-14),)
    setup = scene([[0.0, 0, 0], [1.0, 0, 0]], [[0.0, 0, 0], [0.5, 0, 0]], effects, dt=0.1, steps=10)
    (result,) = simulate([setup], schedule=schedule)
    assert result.status.ok
    assert "force" not in result.state
    np.testing.assert_allclose(result.state["potential"], 1 / (1 - 0.1 / 1.5), rtol=1e-13)


class Forgetful(Polarisation):
    """Does not declare the quantity that it needs."""

    fields = ("radius",)


def test_a_quantity_that_is_not_needed_is_refused():
    setup = scene([[0, 0, 0]], [[0, 0, 0]], (Forgetful(chi=1.0),))
    with pytest.raises(TypeError, match=r"Forgetful\.fields must name its quantity, 'dipole'"):
        Simulation(setup)
