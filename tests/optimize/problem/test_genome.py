import numpy as np
import pytest

from tisim import InputError
from tisim.optimize.problem.genome import Gene, Genome, SearchBox

GENOME = Genome((Gene("v", "m/s", 20.0, 200.0), Gene("H0", "Pa", 1e5, 1e6, "log"), Gene("mu", "", 0.01, 0.1)))


def test_exact_ends():
    assert GENOME.decode([0, 0, 0]) == {"v": 20.0, "H0": 1e5, "mu": 0.01}
    assert GENOME.decode([1, 1, 1]) == {"v": 200.0, "H0": 1e6, "mu": 0.1}


def test_log_scale_is_uniform_in_the_exponent():
    assert GENOME.decode([0.5, 0.5, 0.5])["H0"] == pytest.approx(10**5.5, rel=1e-14)
    assert GENOME.decode([0.5, 0.5, 0.5])["v"] == pytest.approx(110.0, rel=1e-14)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Gene("", "m", 0, 1), "gene name must be"),
        (lambda: Gene("x", "m", 1, 1), "must be finite with low < high; received"),
        (lambda: Gene("x", "m", 0, float("nan")), "must be finite with low < high; received"),
        (lambda: Gene("x", "m", 0, 1, "log"), "on a log scale must be > 0; received 0"),
        (lambda: Gene("x", "m", 1, 2, "cubic"), "must be 'linear' or 'log'; received 'cubic'"),
        (lambda: Genome(()), "one gene or more"),
        (lambda: Genome((Gene("x", "", 0, 1), Gene("x", "", 0, 1))), "all different"),
        (lambda: GENOME.decode([0, 0, 1.01]), "within 0..1"),
        (lambda: GENOME.decode([0, 0, float("nan")]), "within 0..1"),
        (lambda: GENOME.decode([0, 0]), "of shape"),
        (lambda: SearchBox.full(2).recentre([0.5, 0.5], 0.0), "recentre factor must be"),
        (lambda: SearchBox.full(2).recentre([0.5, 1.5], 0.5), "best point must be"),
    ],
)
def test_bad_input_is_named(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_recentre_contains_best_stays_in_range_and_shrinks():
    rng = np.random.default_rng(2)
    for _ in range(200):
        box = SearchBox.full(3)
        for step in range(1, 12):
            best = np.where(rng.random(3) < 0.3, rng.integers(0, 2, 3), rng.random(3))
            factor = rng.uniform(0.2, 1.0)
            expected = box.width * factor
            box = box.recentre(best, factor)
            assert np.all(box.low >= 0), step
            assert np.all(box.high <= 1), step
            assert np.all(box.low <= best), step
            assert np.all(best <= box.high), step
            np.testing.assert_allclose(box.width, expected, atol=1e-15)
            sample = box.sample(rng)
            assert np.all((sample >= box.low) & (sample <= box.high))


def test_recentre_is_central_away_from_the_edges():
    box = SearchBox.full(2).recentre([0.5, 0.9], 0.5)
    np.testing.assert_allclose([box.low, box.high], [[0.25, 0.5], [0.75, 1.0]])
