"""The ellipsoid of a blast in closed form, and the inverse problem with an ellipsoid as its target."""

import numpy as np
import pytest

from tisim import InputError, Result, Status
from tisim.cases.blast import CASE
from tisim.cases.blast import scene as blast
from tisim.cases.blast.problem import DURATION, TARGET_FLUX, details, field, misfit, problem, start
from tisim.cases.blast.shape import ball, contacts, ellipsoid, extents, moments, principal_half_axes
from tisim.optimize.evaluation.evaluator import BatchEvaluator
from tisim.optimize.search import search
from tisim.optimize.settings import Settings
from tisim.optimize.storage.cache import Cache


def shell(rng, number=200_000):
    """Positions and unit directions of particles that fill a ball of 1 m evenly."""
    n = rng.standard_normal((number, 3))
    n /= np.linalg.norm(n, axis=1)[:, None]
    return n * np.cbrt(rng.random((number, 1))), n


def flown(r, n, flux, t):
    """Positions of those particles at t without drag, by Rodrigues' rotation of the part across the field."""
    w, v = blast.SPECIFIC_CHARGE * np.linalg.norm(flux), blast.SPEED * n
    b = flux / np.linalg.norm(flux)
    along = (v @ b)[:, None] * b
    across = v - along
    return r + along * t + across * np.sin(w * t) / w + np.cross(across, b) * (1 - np.cos(w * t)) / w


@pytest.mark.parametrize("t", [0.1, 0.3, 0.7])
def test_ellipsoid_agrees_with_circling_particles(rng, t):
    r, n = shell(rng)
    state = {"position": flown(r, n, TARGET_FLUX, t), "mass": np.ones(len(r))}
    exact = ellipsoid(TARGET_FLUX, t, 1.0)
    assert misfit(moments(state), exact) < 5e-3
    axes, directions = principal_half_axes(exact), np.linalg.eigh(exact)[1]
    assert axes[0] > 1.005 * axes[1]
    assert abs(directions[:, -1] @ TARGET_FLUX) / np.linalg.norm(TARGET_FLUX) == pytest.approx(1.0, abs=1e-12)
    along, across = extents(blast.SPECIFIC_CHARGE * np.linalg.norm(TARGET_FLUX), t, 1.0)
    np.testing.assert_allclose(axes, np.sqrt(5 * np.array([along, across, across])), rtol=1e-12)


@pytest.mark.parametrize("size", ["small", "default"])
def test_the_target_ellipsoid_has_the_initial_size_of_starts_with_its_number(size):
    """It agrees with the mean of starts not used to fit it, whose spread is 0.1 % for 500 particles."""
    number = CASE.size(size).scene.get("number", blast.NUMBER)
    scenes = [blast.scene(number=number, seed=100 + k) for k in range(8)]
    sizes = [ball(moments(one.particles.arrays(one.domain, one.seed))) for one in scenes]
    assert np.mean(sizes) == pytest.approx(start(number), rel=4e-3)
    target = ellipsoid(TARGET_FLUX, DURATION, start(number))
    half_axes = ", ".join(f"{a:.3f}" for a in principal_half_axes(target))
    assert f"half axes of {half_axes} m" in problem(size).title


def test_moments_weigh_by_mass_and_contacts_count_pairs():
    state = {
        "position": np.array([[0.0, 0, 0], [1.0, 0, 0], [1.0, 0.3, 0]]),
        "mass": np.array([2.0, 1.0, 1.0]), "radius": np.full(3, 0.16),
    }  # fmt: skip
    np.testing.assert_allclose(moments(state)[0, 0], 0.25)
    np.testing.assert_allclose(moments(state)[0, 1], (2 * 0.5 * 0.075 - 0.5 * 0.075 + 0.5 * 0.225) / 4)
    assert contacts(state) == 1


def test_details_list_the_target_and_the_result(rng):
    r, n = shell(rng, 2000)
    state = {"position": flown(r, n, TARGET_FLUX, DURATION), "mass": np.ones(2000)}
    result = Result(None, state, state, DURATION, {}, Status(True, ""), 0.0)
    for sign in (1.0, -1.0):
        turned = dict(zip(("flux_x", "flux_y", "flux_z"), sign * TARGET_FLUX, strict=True))
        details_ = details(turned, result, ellipsoid(TARGET_FLUX, DURATION, 1.0))
        assert details_["field to the long axis wanted, degrees"] == pytest.approx(0.0, abs=1e-5)
    assert details_["strength of the field, T"] == pytest.approx(0.7)
    for k in (1, 2, 3):
        assert details_[f"half axis {k} reached, m"] == pytest.approx(
            details_[f"half axis {k} wanted, m"], rel=0.05
        )


def test_no_other_variant_than_the_ellipsoid():
    with pytest.raises(InputError, match="variant must be one of ellipsoid; received 'torus'"):
        CASE.problem("default", "torus")


@pytest.mark.slow
def test_search_recovers_the_field_up_to_sign(tmp_path):
    """With 500 particles and 10 generations the field is within 5 % of 0.7 T and 4 degrees of its axis."""
    evaluator = BatchEvaluator()
    with Cache(tmp_path / "search.h5") as cache:
        outcome = search(
            problem("small"), evaluator, cache, Settings(**{**blast.SEARCH_SETTINGS, "generations": 10})
        )
    evaluator.close()
    best = outcome.logbook.select("best")
    assert best[-1] < best[0] / 2
    flux = field(outcome.problem.genome.decode(outcome.best))
    strength = np.linalg.norm(flux)
    assert strength == pytest.approx(np.linalg.norm(TARGET_FLUX), rel=0.05)
    cosine = abs(flux @ TARGET_FLUX) / strength / np.linalg.norm(TARGET_FLUX)
    assert np.degrees(np.arccos(cosine)) < 4.0
