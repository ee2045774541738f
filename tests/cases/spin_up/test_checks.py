"""The checks of the case spin_up."""

import pytest

from tisim.cases.spin_up.checks import check


@pytest.mark.slow
def test_all_checks_pass():
    wrong = [(item.name, *item.cells) for item in check() if item.ok is False]
    assert not wrong
