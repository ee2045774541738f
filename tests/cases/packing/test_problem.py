"""The inverse problems: scenes of designs, objectives, better designs, and designs without a packing."""

import numpy as np
import pytest

from tisim import InputError, optimize, run
from tisim.cases.case import every
from tisim.cases.packing import problem as searching
from tisim.cases.packing.measures import fraction_of
from tisim.cases.packing.problem import FEWEST_LARGE, PackingDesign, details, problem, shape_of
from tisim.cases.packing.scene import rod
from tisim.shapes import SuperquadricShape

EQUAL = {"size_ratio": 1.0, "large_share": 0.5}
"""Genes of a mixture of two equal sizes."""


def packed(variant, *designs, starts=3):
    """Results of designs of the small search, shape (designs, starts)."""
    searched = problem("small", variant)
    results = run([searched.scene(one, seed) for one in designs for seed in range(starts)])
    assert all(result.status.ok for result in results)
    return [results[k : k + starts] for k in range(0, len(results), starts)]


def test_a_design_makes_its_packing():
    made = problem("small").scene({"aspect": 1.4, "size_ratio": 2.0, "large_share": 0.7}, 3)
    assert made.seed == 3
    radius = made.start()["radius"]
    large = radius > 1.5 * radius.min()
    assert radius.max() / radius.min() == pytest.approx(2.0)
    assert (radius[large] ** 3).sum() / (radius**3).sum() == pytest.approx(0.7, abs=0.02)
    assert large.sum() == FEWEST_LARGE
    (shape,) = made.effects[0].rods
    assert (shape.length, shape.diameter) == (pytest.approx(0.4), 1.0)
    flat = shape_of({"length": 1.5, "thickness": 0.6, "exponent": 3.0})
    assert flat == SuperquadricShape(semi_axes=(0.3, 0.5, 0.75), exponents=(3.0, 3.0, 3.0))
    assert len(problem("small", "superquadrics").scene({"length": 1.0, "thickness": 1.0, "exponent": 2.0}, 0)
               .start()["radius"]) == 40  # fmt: skip


def test_long_bodies_need_more_of_them():
    """A box with the expected density is at least twice as wide as the largest body is long."""
    for aspect, ratio, share in ((1.0, 1.0, 1.0), (5.0, 1.0, 1.0), (2.0, 2.0, 0.8), (1.0, 2.0, 0.3)):
        design = PackingDesign(rod(aspect), ratio, share, number=10, most=2000)
        number, volume = design.bodies(), rod(aspect).volume()
        large = number * (share / ratio**3) / (share / ratio**3 + 1 - share)
        side = np.cbrt(large * ratio**3 * volume / share / min(0.8, 4 / aspect))
        assert side >= 2 * aspect * ratio * (1 - 1e-12)
        assert share == 1 or large > FEWEST_LARGE - 1


def test_designs_of_too_many_bodies_are_refused():
    design = {"aspect": 3.0, "size_ratio": 2.0, "large_share": 0.5}
    with pytest.raises(InputError, match=r"bodies of the design must be at most 200, .* received 372"):
        problem("small").scene(design, 0)
    assert len(problem("default").scene(design, 0).start()["radius"]) == 372
    with pytest.raises(InputError, match="size must be one of small, default for the inverse problem"):
        problem("paper")


@pytest.mark.slow
def test_short_rods_are_denser_than_spheres_and_two_sizes_denser_than_one():
    """Spheres of one size, rods, and spheres of two sizes."""
    designs = [
        {"aspect": 1.0, **EQUAL},
        {"aspect": 1.4, **EQUAL},
        {"aspect": 1.0, "size_ratio": 2.0, "large_share": 0.7},
    ]
    (dense,) = problem("small").objectives
    spheres, rods, mixed = ([dense.of(one) for one in group] for group in packed("densest", *designs))
    assert dense.cost(rods) < dense.cost(spheres) - 0.04
    assert dense.cost(mixed) < dense.cost(spheres) - 0.01
    assert 0.6 < np.mean(spheres) < 0.64


@pytest.mark.slow
def test_surface_and_permeability_are_of_the_designed_size():
    spheres, wide, long = packed(
        "permeable",
        {"diameter": 1e-3, "aspect": 1.0, **EQUAL},
        {"diameter": 2e-3, "aspect": 1.0, **EQUAL},
        {"diameter": 1e-3, "aspect": 4.5, **EQUAL},
        starts=1,
    )
    surface, permeable = problem("small", "permeable").objectives
    (one,), (other,), (rods,) = spheres, wide, long
    phi = fraction_of(one)
    assert surface.of(one) == pytest.approx(6 * phi / 1e-3)
    assert permeable.of(one) == pytest.approx((1 - phi) ** 3 / (5 * surface.of(one) ** 2))
    assert surface.of(other) == pytest.approx(surface.of(one) / 2)
    assert permeable.of(other) == pytest.approx(4 * permeable.of(one))
    # Beds of the same surface: long rods are looser, and more permeable.
    merit = [permeable.of(result) * surface.of(result) ** 2 for result in (one, rods)]
    assert merit[1] > 1.2 * merit[0]
    assert details({}, one)["packing fraction"] == phi
    assert 4 < details({}, one)["contact number"] < 7


@pytest.mark.slow
def test_a_search_goes_on_without_a_design_that_outgrows_its_box(monkeypatch):
    monkeypatch.setattr(searching, "SLENDER", 0.01)
    searched = problem("small").fix(**EQUAL)
    ensemble = {"min_starts": 1, "select": 0, "confirm": 0}
    options = {"population": 8}
    outcome = optimize.run(
        searched, method="random", generations=0, options=options, ensemble=ensemble, max_evaluations=8
    )
    reasons = {one[0].reason for one in outcome.failures.values()}
    assert len(outcome.failures) + len(outcome.estimates) == 8
    assert any("bodies longer than half the periodic box" in reason for reason in reasons)
    assert outcome.hall[0]


def test_searches_have_the_population_of_the_case():
    for size in ("small", "default"):
        for variant in every()["packing"].variants:
            searched, settings = every()["packing"].inverse(size, variant)
            assert settings["options"] == {"population": 8, "first": 12}
            assert size in searched.name or size == "default"
