"""Watching takes a share of a core from the run that is watched."""

import pytest

from tisim.watch.budget import CORE_SHARE, Budget


@pytest.fixture
def budget(clock):
    return Budget(clock=clock, processor=clock.processor)


def test_work_waits_until_it_is_a_share_of_the_time(budget, clock):
    assert budget.wait() == 0.0
    clock.used = 0.3
    assert budget.wait() == pytest.approx(0.3 / CORE_SHARE)
    clock.now = 20.0
    assert budget.wait() == pytest.approx(10.0)
    clock.now = 30.0
    assert budget.wait() == 0.0


def test_idle_time_is_not_saved_up(budget, clock):
    clock.now = 1e5
    assert budget.wait() == 0.0
    clock.used = 0.3
    assert budget.wait() == pytest.approx(30.0)


def test_short_answers_count_together(budget, clock):
    """2 ms every 2 s are 0.1 %, and do not delay work; 50 ms every 2 s do."""
    for _ in range(100):
        clock.now, clock.used = clock.now + 2.0, clock.used + 0.002
        assert budget.wait() == 0.0
    for _ in range(100):
        clock.now, clock.used = clock.now + 2.0, clock.used + 0.05
        budget.wait()
    assert budget.wait() == pytest.approx(100 * (5.0 - 2.0), rel=0.05)


def test_the_first_page_does_not_count(budget, clock):
    clock.used = 0.1
    with budget.exempt():
        clock.used += 100.0
    assert budget.wait() == pytest.approx(10.0)


def test_over_a_long_time_the_share_is_kept(budget, clock):
    """Work of 0.1 s whenever it is allowed, looked for every 2 s."""
    for _ in range(10_000):
        if not budget.wait():
            clock.used += 0.1
        clock.used += 0.0005
        clock.now += 2.0
    assert 0.8 * CORE_SHARE < clock.used / clock.now <= CORE_SHARE
