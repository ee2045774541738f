"""The inverse problem of spin_up: the steps of a design, the body whose axes count, and a run."""

import numpy as np
import pytest

from tests.cases.common.test_rubble_pile import state_of
from tests.cases.spin_up.test_fragments import BLOCK, ROW, broken
from tests.cases.spin_up.test_stages import spin_up
from tisim.cases.spin_up import problem as spun
from tisim.cases.spin_up.fragments import fragments
from tisim.cases.spin_up.problem import SPUN_GENES, final_elongation, rates_to


def test_a_pile_is_brought_to_its_spin_in_steps():
    np.testing.assert_allclose(rates_to(100e-6), [100e-6])
    np.testing.assert_allclose(rates_to(300e-6), [100e-6, 200e-6, 300e-6])
    np.testing.assert_allclose(rates_to(310e-6), [100e-6, 200e-6, 300e-6, 310e-6])
    low, high = (1e-6 * SPUN_GENES[1].low, 1e-6 * SPUN_GENES[1].high)
    assert len(rates_to(low)) == 1
    assert len(rates_to(high)) == 15


def test_the_most_elongated_body_at_the_end_counts(monkeypatch):
    """Earlier states and bodies of fewer grains do not."""
    asked = []

    def ends_as(state):
        def spun_up(wanted, **settings):
            asked.append((wanted, settings["rates"][-1]))
            return [spin_up(broken(ROW, ROW), state)]

        monkeypatch.setattr(spun, "spun_up", spun_up)
        return final_elongation({"magnetisation": 119.0, "spin": 800.0}, 7)

    row = max(one.elongation for one in fragments(broken(ROW)))
    assert ends_as(broken(BLOCK, ROW)) == pytest.approx(row)
    assert 1 < ends_as(broken(BLOCK, ROW[:7])) < 1.5 < row
    assert ends_as(state_of(ROW[:7])) == 1.0
    assert asked == [([(119.0, 7)], pytest.approx(8e-4))] * 3


@pytest.mark.slow
def test_a_strong_pile_is_longer_than_an_unmagnetised_one():
    """At 1000 urad/s, from two starts."""
    strong, plain = (
        [final_elongation({"magnetisation": m, "spin": 1000.0}, seed) for seed in range(2)]
        for m in (1190.0, 0.0)
    )
    assert min(strong) > 1.5 * max(plain)
