"""Saturating magnetisation by Froehlich and Kennelly, alone and mutual, against 60 digits."""

from decimal import Decimal, getcontext

import numpy as np
import pytest
from scipy.optimize import root

from tests.effects.contact.loads import WORLDS, close, loads
from tests.effects.magnetic.magnets import MU_0, Quadrupole, dipole_field, flux_density, gradient
from tests.effects.magnetic.test_moment import made_of
from tests.scenes import scene
from tisim import InputError
from tisim.effects import (
    CARBONYL_IRON,
    MAGNETITE,
    DipoleDipole,
    FroehlichMoment,
    InducedMoment,
    Magnetophoresis,
    MutualFroehlichMoment,
)
from tisim.sources import MagneticField

NUMBERS = {"susceptibility": 999.0, "saturation": 1.671e6}


def magnetisation(chi, saturation, flux):
    """M of a sphere (A/m): the smaller root of M (M_s + chi H) = chi H M_s with H = B/mu_0 - M/3, by the
    textbook formula, with 60 digits."""
    getcontext().prec = 60
    chi, m_s, h = Decimal(float(chi)), Decimal(float(saturation)), Decimal(float(flux)) / Decimal(MU_0)
    a, b, c = chi / 3, m_s + chi * h + chi * m_s / 3, chi * h * m_s
    return float((b - (b * b - 4 * a * c).sqrt()) / (2 * a))


CHI = (1e-3, 0.5, 3.0, 50.0, 1e3, 1e6, 1e12, 1e-9)


def test_saturating_moments_and_their_forces(rng):
    scenes = [made_of(rng, FroehlichMoment(susceptibility=chi, saturation=1e6)) for chi in CHI]
    for one, state in zip(scenes, loads(scenes), strict=True):
        b, law = flux_density(one.effects, state["position"]), one.effects[2]
        strength, volume = np.linalg.norm(b, axis=1), 4 / 3 * np.pi * state["radius"] ** 3
        size = [magnetisation(law.susceptibility, law.saturation, one) for one in strength]
        close(state["moment"], (volume * size / strength)[:, None] * b)
        pull = np.einsum("iab,ib->ia", gradient(one.effects, state["position"]), state["moment"])
        close(state["force"], pull)


def at(fields, law):
    """A sphere of 1 m^3 in each of some fields (T)."""
    radius = (3 / (4 * np.pi)) ** (1 / 3)
    direction = np.array([2.0, -3.0, 6.0]) / 7
    return [
        scene(
            [[0, 0, 0]],
            [[0, 0, 0]],
            (Quadrupole(constant=b * direction, scale=(0, 0, 0)), MagneticField(), law, Magnetophoresis()),
            radius=radius,
            mass=1.0,
        )
        for b in fields
    ]


def test_weak_fields_are_linear_and_strong_ones_saturate():
    """chi H / M_s from 1e-12 to 1e6 and beyond; chi of 1e3, and almost infinite."""
    for chi in (999.0, 1e9):
        law = FroehlichMoment(susceptibility=chi, saturation=NUMBERS["saturation"])
        gain, unit = 3 * chi / (3 + chi), MU_0 * NUMBERS["saturation"]
        fields = unit * np.array([1e-12, 1e-6, 0.3, 0.34, 1.0, 1e3, 1e6, 1e30])
        sizes = [np.linalg.norm(state["moment"]) for state in loads(at(fields, law))]
        np.testing.assert_allclose(sizes, [magnetisation(chi, law.saturation, b) for b in fields], rtol=1e-12)
        assert sizes[0] == pytest.approx(gain * fields[0] / MU_0, rel=1e-11)
        h = fields[5] / MU_0 - law.saturation / 3
        assert law.saturation - sizes[5] == pytest.approx(law.saturation**2 / (chi * h), rel=1e-2, abs=1e-9)
        assert sizes[-1] == pytest.approx(law.saturation, rel=1e-15)


def mutual(rng, b, law):
    """Six spheres that nearly touch."""
    place = 2.2 * np.mgrid[:3, :2, :1].reshape(3, -1).T + 0.1 * rng.normal(size=(6, 3))
    field = (Quadrupole(constant=(0, 0, 0), scale=(0, 0, 0)), MagneticField(constant=tuple(b)))
    effects = (*field, law, Magnetophoresis(), DipoleDipole())
    return scene(place, 0 * place, effects, radius=1.0, mass=1.0)


@pytest.mark.long
def test_saturating_moments_are_finite_if_linear_ones_diverge():
    """Two spheres in a weak field overlap until 2 a = 2 exceeds 1, so linear moments diverge: here each
    saturates the other."""
    law = MutualFroehlichMoment(**NUMBERS, tolerance=1e-14, sweeps=1000)
    setup = mutual(np.random.default_rng(0), (0, 0, 1e-6), law)
    start = setup.particles.model_copy(
        update={"position": np.array([[0, 0, 0], [0, 0, 1.0]]), "velocity": np.zeros((2, 3))}
        | {"radius": np.ones(2), "mass": np.ones(2)}
    )
    (state,) = loads([setup.model_copy(update={"particles": start})])
    m = state["moment"][:, 2]
    inside = 1e-6 + 2e-7 * m[::-1]
    np.testing.assert_allclose(m, [4 / 3 * np.pi * magnetisation(*NUMBERS.values(), b) for b in inside])
    assert m.min() > 0.9 * 4 / 3 * np.pi * NUMBERS["saturation"]


def test_mutual_moments_follow_the_local_field(rng):
    """Against a root found by SciPy; from weak fields, in which moments are linear, to saturation."""
    fields = np.geomspace(1e-3, 50.0, WORLDS)
    law = MutualFroehlichMoment(**NUMBERS, tolerance=1e-14, sweeps=1000)
    scenes = [mutual(rng, b * np.array([0.6, 0.0, 0.8]), law) for b in fields]
    parts = []
    for one, state in zip(scenes, loads(scenes), strict=True):
        b, field = flux_density(one.effects, state["position"]), dipole_field(state["position"])
        full = 4 / 3 * np.pi * NUMBERS["saturation"]

        def excess(x, b=b, field=field, full=full):
            m = full * x.reshape(-1, 3)
            inside = b + np.einsum("ijab,jb->ia", field, m)
            strength = np.linalg.norm(inside, axis=1)
            size = [magnetisation(*NUMBERS.values(), one) for one in strength]
            return (m - 4 / 3 * np.pi * (size / strength)[:, None] * inside).ravel() / full

        found = root(excess, state["moment"].ravel() / full * 0.9, tol=1e-13)
        close(state["moment"], full * found.x.reshape(-1, 3), 1e-9)
        parts.append(np.linalg.norm(state["moment"], axis=1).max() / full)
    assert parts[0] < 0.01
    assert parts[-1] > 0.95


def test_the_named_materials_make_moments():
    """Iron as in Ginder, Davis and Elie: mu_0 M_s = 2.1 T, mu_r = 1000; magnetite with 480 kA/m."""
    law = FroehlichMoment(**CARBONYL_IRON.parameters())
    assert law.susceptibility == 999.0
    assert MU_0 * law.saturation == pytest.approx(2.1, rel=1e-9)
    assert MAGNETITE.saturation == 4.8e5
    assert InducedMoment(susceptibility=CARBONYL_IRON.susceptibility).susceptibility == 999.0
    with pytest.raises(InputError, match="susceptibility of magnetite must be given"):
        MAGNETITE.parameters()
    assert MAGNETITE.parameters(susceptibility=20.0) == {"susceptibility": 20.0, "saturation": 4.8e5}
