"""Watching takes a share of the processor time from the run that is watched."""

import pytest

from tisim.backend import runtime
from tisim.watch.budget import CORES_SHARE, CREDIT, Budget

SHARE = 0.01


@pytest.fixture
def budget(clock):
    return Budget(SHARE, clock=clock, processor=clock.processor)


def test_after_the_credit_work_waits_until_it_is_a_share_of_the_time(budget, clock):
    assert budget.wait() == 0.0
    clock.used = CREDIT
    assert budget.wait() == 0.0
    clock.used += 0.3
    assert budget.wait() == pytest.approx(0.3 / SHARE)
    clock.now = 0.2 / SHARE
    assert budget.wait() == pytest.approx(0.1 / SHARE)
    clock.now = 0.3001 / SHARE
    assert budget.wait() == 0.0


def test_the_share_is_of_all_cores(clock, monkeypatch):
    monkeypatch.setattr(runtime, "cores", lambda: 16)
    budget = Budget(clock=clock, processor=clock.processor)
    clock.used = CREDIT + 0.3
    assert budget.wait() == pytest.approx(0.3 / (16 * CORES_SHARE))


def test_of_idle_time_only_the_credit_is_saved_up(budget, clock):
    clock.used = CREDIT
    budget.wait()
    clock.now = 1e6
    assert budget.wait() == 0.0
    clock.used += CREDIT + 0.3
    assert budget.wait() == pytest.approx(0.3 / SHARE)


def test_short_answers_count_too(budget, clock):
    """50 ms every 2 s are 2.5 %."""
    for _ in range(100):
        clock.now, clock.used = clock.now + 2.0, clock.used + 0.05
        budget.wait()
    assert budget.wait() == pytest.approx((100 * 0.05 - CREDIT) / SHARE - 200.0, rel=0.02)


def test_the_first_page_does_not_count(budget, clock):
    clock.used = CREDIT + 0.1
    with budget.exempt():
        clock.used += 100.0
    assert budget.wait() == pytest.approx(0.1 / SHARE)


def test_over_a_long_time_the_share_is_kept(budget, clock):
    """Work of 0.1 s whenever it is allowed, looked for every 2 s."""
    for _ in range(10_000):
        if not budget.wait():
            clock.used += 0.1
        clock.used += 0.0005
        clock.now += 2.0
    assert 0.9 * SHARE < (clock.used - CREDIT) / clock.now <= 1.01 * SHARE
