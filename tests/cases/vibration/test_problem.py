"""The inverse problem of vibration: its fitness, and a search that finds the resonance."""

import numpy as np
import pytest

import tisim
from tisim import InputError
from tisim.cases.vibration.problem import (
    DRIVE,
    VARIANTS,
    closed_form,
    details,
    displacement,
    nearest,
    problem,
    scene,
)
from tisim.cases.vibration.scene import CHARGE, MASS, SEARCH_SETTINGS
from tisim.optimize.evaluation.evaluator import BatchEvaluator
from tisim.optimize.search import search
from tisim.optimize.settings import Settings
from tisim.optimize.storage.cache import Cache

DESIGNS = {
    "far": {"flux": 1.0, "stiffness": 1.0},
    "fast resonance": {"flux": 0.785, "stiffness": 11.8},
    "no field to speak of": {"flux": 0.2, "stiffness": 480.0},
    "stiff": {"flux": 2.0, "stiffness": 630.0},
}


@pytest.fixture(scope="module")
def evaluator():
    """One evaluator, so that both searches share its compiled simulations."""
    batch = BatchEvaluator()
    yield batch
    batch.close()


@pytest.mark.long
def test_fitness_is_the_closed_form():
    results = tisim.run([scene(design, duration=0.2) for design in DESIGNS.values()])
    peaks = [problem().objective(result) for result in results]
    exact = [-1e3 * closed_form(design) for design in DESIGNS.values()]
    np.testing.assert_allclose(peaks, exact, rtol=2e-3)
    opposite = [problem(variant="avoid").objective(result) for result in results]
    np.testing.assert_array_equal(opposite, -np.array(peaks))
    table = details(DESIGNS["far"], results[0])
    assert table["nearest resonance over drive"] == pytest.approx(1.0 / 0.8, rel=2e-3)
    assert table["largest displacement, m"] == displacement(results[0])


def test_resonance_nearest_to_the_drive():
    """k/m = Omega^2 -+ w Omega, the fast and the slow resonance."""
    for flux, sign in ((0.3, -1), (0.1, 1)):
        w = CHARGE * flux / MASS
        stiffness = MASS * (DRIVE**2 + sign * w * DRIVE)
        assert nearest({"flux": flux, "stiffness": stiffness}) == pytest.approx(DRIVE, rel=1e-12)


def test_nothing_is_random_and_other_variants_are_refused():
    inverse = problem()
    assert inverse.scene(DESIGNS["far"], 1).digest() == inverse.scene(DESIGNS["far"], 2).digest()
    with pytest.raises(InputError, match="variant must be one of resonate, avoid; received 'sing'"):
        problem(variant="sing")


@pytest.mark.slow
@pytest.mark.parametrize("variant", VARIANTS)
def test_search_improves_and_lands_on_the_resonance_or_far_from_it(variant, evaluator, tmp_path):
    settings = {**SEARCH_SETTINGS, "generations": 6}
    with Cache(tmp_path / "search.h5") as cache:
        outcome = search(problem(variant=variant), evaluator, cache, Settings(**settings))
    best = outcome.logbook.select("best")
    design = outcome.problem.genome.decode(outcome.best)
    assert best[-1] < best[0]
    if variant == "resonate":
        assert nearest(design) / DRIVE == pytest.approx(1.0, abs=0.01)
        # At resonance for 0.2 s, the result is within a tenth of the best of a fine grid, 12.37 mm.
        assert best[-1] < -11.1
    else:
        assert not 0.5 < nearest(design) / DRIVE < 2.0
        # The smallest amplitude on a fine grid is 0.131 mm.
        assert best[-1] < 0.15
