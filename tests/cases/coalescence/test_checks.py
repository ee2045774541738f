"""The checks of the case coalescence."""

import pytest

from tisim.cases.coalescence.checks import check


@pytest.mark.slow
def test_all_checks_pass():
    wrong = [(item.name, *item.cells) for item in check() if item.ok is False]
    assert not wrong
