"""Random scenes: the mean over starts, its confidence interval, and the number of starts for an error."""

import numpy as np
import pytest

from tests.accuracy.scenes import DEVIATION, ENERGY, GRAIN, GRAINS, MEAN, drift, energy
from tests.scenes import head_on, simulate
from tisim import Box, InputError
from tisim.accuracy import Quantity, Study, run
from tisim.accuracy.cost_study import TRUSTED
from tisim.accuracy.quantity import (
    displacement,
    estimate,
    kinetic_energy,
    mean,
    reference_runs,
    truth_by_reference,
    usual,
)
from tisim.accuracy.sweep import methods
from tisim.cases.case import every
from tisim.cases.packing import scene as packing
from tisim.effects import Impact
from tisim.geometry import SphericalContainer

ENSEMBLES, STARTS = 60, 8


@pytest.fixture(scope="module")
def drifts():
    """Results of many random starts."""
    scenes = [drift(seed) for seed in range(ENSEMBLES * STARTS)]
    return simulate(scenes, worlds=len(scenes), capacity=GRAINS)


def test_the_interval_covers_the_true_mean_at_its_nominal_level(drifts):
    """Of 60 intervals at 95 %, fewer than 51 cover once in 2000 trials, and all 60 in 5 % of trials."""
    groups = [drifts[k : k + STARTS] for k in range(0, len(drifts), STARTS)]
    estimates = [estimate(ENERGY, group) for group in groups]
    covered = sum(abs(one.value[0] - energy()) <= one.uncertainty for one in estimates)
    assert 51 <= covered < ENSEMBLES
    # Student's t for 7 degrees of freedom is 2.365; v^2 = (m + d x)^2 has the variance below.
    variance = 4 * MEAN**2 * DEVIATION**2 / 3 + 4 * DEVIATION**4 / 45
    half = 2.365 * 0.5 * GRAIN * np.sqrt(GRAINS * variance / STARTS)
    assert np.mean([one.uncertainty for one in estimates]) == pytest.approx(half, rel=0.1)


def test_the_interval_of_several_components_bounds_their_distance(drifts):
    values = np.array([[r.state["velocity"][0, 0], r.state["velocity"][1, 0]] for r in drifts])
    both, one = mean(values), mean(values[:, :1])
    assert both.value.shape == (2,)
    assert both.uncertainty == pytest.approx(np.sqrt(2) * one.uncertainty, rel=0.1)


@pytest.mark.slow
def test_more_starts_buy_a_smaller_error(drifts):
    """The error bound falls as the square root of the number of starts, and covers the true error."""
    cost_study = Study(drift(), (ENERGY,), precisions=("f64",), repeats=1, starts=(8, len(drifts)), coarser=0)
    run(cost_study)
    few, many = cost_study.line("random starts")
    assert (few.starts, many.starts) == (8, len(drifts))
    for row in (few, many):
        error, uncertainty = row.errors[0]
        assert error < 2 * uncertainty
    gain = few.errors[0][1] / many.errors[0][1]
    assert gain == pytest.approx(np.sqrt(len(drifts) / 8), rel=0.35)
    assert cost_study.truths[0].estimate.value[0] == pytest.approx(energy())
    assert cost_study.cheapest(many.at_most()).starts == len(drifts)
    # All other settings are run from the largest number of starts, with the same seeds.
    assert [row.errors for row in cost_study.line("Verlet, FixedStep: dt")] == [many.errors]


def test_a_random_reference_is_no_better_than_its_starts(drifts):
    """The confidence interval of its mean counts, though the runs that check it agree to the last digit."""
    unknown = Quantity("kinetic energy", kinetic_energy, random=True)
    references = reference_runs(methods(drift(), 0.05, 1.0, (0.0,), (), 1), 0.0)
    truth = truth_by_reference(unknown, [drifts, drifts], references[:2])
    assert truth.estimate.uncertainty == estimate(unknown, drifts).uncertainty > 0
    # The interval does not hide a stepper whose error is the same in every start.
    half = drifts[: len(drifts) // 2]
    bias = (
        truth_by_reference(unknown, [drifts, half], references[:2]).estimate.uncertainty
        - truth.estimate.uncertainty
    )
    apart = estimate(unknown, half).value - truth.estimate.value
    assert bias == pytest.approx(np.linalg.norm(apart))
    assert bias > 0
    error, off = estimate(unknown, drifts[:STARTS]).error(truth.estimate, truth.size)
    assert error < TRUSTED * off


@pytest.mark.slow
def test_packings_are_compared_with_their_jamming_density():
    """Mechanical contraction of few attempts ends before spheres jam, at a third of the density below."""
    scene = packing.scene_for("small", 0).replace({"stepper.attempts": 20})
    cost_study = Study(
        scene, every()["packing"].quantities(scene), precisions=("f64",), repeats=1, starts=(8,), coarser=0
    )
    run(cost_study)
    assert cost_study.complete
    (own,) = cost_study.line(cost_study.rows[1].method)
    (jammed,) = cost_study.line("EnergyMinimisation: precision, tolerance")
    assert own.errors[0][0] > 0.4
    assert jammed.errors[0][0] < 0.05
    assert cost_study.cheapest(0.1).method.startswith(("EnergyMinimisation", "MonteCarloGrowth"))
    assert [truth.error < 0.05 for truth in cost_study.truths[:2]] == [True, True]


def test_default_quantities():
    impacts = (Impact(hardness=1e5),)
    assert [q.name for q in usual(drift())] == ["velocity"]
    assert usual(drift().model_copy(update={"effects": impacts}))[0].random
    free = drift().model_copy(update={"domain": type(drift()).model_fields["domain"].default})
    assert usual(free)[0].value is displacement
    packed = packing.scene_for("small", 0)
    (fraction,) = usual(packed)
    assert (fraction.name, fraction.random) == ("packing fraction", True)
    # Their places and orientations are given.
    assert not usual(packing.of_shape(packing.rod(1.5), "small", 0))[0].random
    walled = packing.of_shape(packing.rod(1.5), "small", 0, container=SphericalContainer(), start=0.05)
    with pytest.raises(InputError, match="quantities must be given, as walls bound the packing"):
        usual(walled)
    with pytest.raises(InputError, match="quantities must be given, as impacts"):
        usual(head_on(1.0, impacts, domain=Box(low=(-1.0,) * 3, high=(1.0,) * 3)))
