"""A valve that opens again: measures of made-up flows, the phases of scenes, runs that continue, and flow
that resumes in a small valve."""

import numpy as np
import pytest

from tests.cases.valve.states import at_rest
from tisim import InputError
from tisim.cases.valve.opens import (
    NOMINAL,
    SMOOTH,
    Count,
    Opening,
    Raised,
    Reopening,
    picture,
    raised,
    report,
    three_phases,
)
from tisim.cases.valve.runs import ARRESTED, Flow
from tisim.cases.valve.scene import continued, scene

UM = 1e-6
TINY = {"throat": 176 * UM, "bore": 308 * UM, "length": 400 * UM, "pressure": 40e3, "flux": 0.5}
TIMES = np.arange(1, 101) * 8 * UM
"""100 samples of 0.8 ms: 0.1 ms without a field, 0.4 ms with it, 0.3 ms without."""


def opening(during, after, arrested_at=100 * UM, delay=20 * UM):
    """A start with the flow 2 before the field, 2 ``during`` from a time (s) after its begin, and 2 ``after``
    from a delay (s) after its end."""
    slow, open_again = 100 * UM + arrested_at, 500 * UM + delay
    rates = np.select([open_again < TIMES, slow < TIMES], [2 * after, 2 * during], 2.0)
    return Opening(Flow(None, TIMES, rates))


def test_the_phases_of_a_flow():
    one = opening(0.02, 0.5)
    assert (one.before, one.during, one.after) == pytest.approx((2.0, 0.04, 1.0))
    assert one.arrested
    assert one.flows_again
    assert one.opening_time == pytest.approx(20 * UM, abs=8 * UM)
    # The running mean is late by half of its samples.
    assert one.arrest_time == pytest.approx(100 * UM, abs=(SMOOTH // 2 + 1) * 8 * UM)
    assert one.arrest_time > 100 * UM
    later = opening(0.02, 0.5, arrested_at=180 * UM)
    assert later.arrest_time - one.arrest_time == pytest.approx(80 * UM)


def test_flows_that_are_not_arrested_or_do_not_resume_have_no_times():
    going, shut = opening(1.1 * ARRESTED, 0.5), opening(0.0, 0.9 * ARRESTED)
    assert not going.arrested
    assert np.isnan(going.arrest_time)
    assert not shut.flows_again
    assert np.isnan(shut.opening_time)


def test_an_arrest_time_ignores_the_flow_after_the_field():
    """The flow resumes in the first sample after the field."""
    assert opening(0.0, 1.0, delay=0.0).arrest_time == opening(0.0, 0.0, delay=0.0).arrest_time


def test_the_interval_of_a_count():
    """All of 12: the lower end of the exact interval is 0.025^(1/12)."""
    assert Count.of([True] * 12).interval == pytest.approx((0.025 ** (1 / 12), 1.0))
    assert str(Count.of([True] * 12)) == "12 of 12 (0.74 to 1.00)"
    assert Count.of([False, True]).found == 1
    with pytest.raises(InputError, match="at least one; received 0"):
        Count.of([])


def test_a_raised_pressure_is_held_relative_to_its_open_flow():
    flow = Flow(None, TIMES, np.full(100, 0.3))
    assert Raised(2.0, 4.0, flow).left == pytest.approx(0.3 / 8)
    assert Raised(2.0, 4.0, flow).held
    assert not Raised(2.0, 1.0, flow).held


def test_the_field_of_a_scene_ends_only_if_the_valve_opens_again():
    phases = {"flowing": 1e-4, "lasting": 4e-4}
    opens, stays = scene(**phases, reopened=3e-4), scene(**phases)
    assert (opens.effects[0].begin, opens.effects[0].end) == pytest.approx((1e-4, 5e-4))
    assert opens.duration == pytest.approx(8e-4)
    assert stays.effects[0].end > 1e20
    assert opens.structure() == stays.structure()


def made_up(scenes, progress=lambda part: None):
    """Flows with a hundredth of the first flow in the field, a third after it, and all of it without one."""
    done = []
    for one in scenes:
        field, times = one.effects[0], np.linspace(0, one.duration, 101)[1:]
        result = at_rest(one)
        result.state["id"] = np.arange(len(result.state["mass"]))
        rates = np.ones(100)
        if field.constant[0] > 0:
            rates[times > field.begin] = 0.01 + 1e-3 * one.seed
            rates[times > field.end] = 0.33
        done.append(Flow(result, times, rates))
    return done


def test_three_phases_have_two_controls_from_the_same_starts(monkeypatch):
    monkeypatch.setattr("tisim.cases.valve.opens.flows", made_up)
    found = three_phases(3)
    assert isinstance(found, Reopening)
    for group in found.groups.values():
        assert [one.flow.result.scene.seed for one in group] == [0, 1, 2]
        assert all(one.flow.result.scene.duration == pytest.approx(8e-4) for one in group)
    ends = [[round(one.after / one.before, 3) for one in group] for group in found.groups.values()]
    assert ends == [[0.33] * 3, [0.01, 0.011, 0.012], [1.0] * 3]
    jams = raised(found.closed, (1.0, 4.0))
    assert [one[0].factor for one in jams] == [1.0, 4.0]
    for factor, group in zip((1.0, 4.0), jams, strict=True):
        for one, jam in zip(group, found.closed, strict=True):
            made = one.flow.result.scene
            np.testing.assert_array_equal(made.particles.position, jam.flow.result.state["position"])
            speed = scene(pressure=factor * NOMINAL).effects[5].speed
            assert made.effects[5].speed == pytest.approx(speed)
    text = report(found, [found.closed, found.closed], jams)
    assert "field stays on: 0.0110 ± 0.0025, 0.0110 ± 0.0025; arrested 3 of 3" in text
    assert "4 times, 156 kPa: held 3 of 3" in text
    assert "of those arrested, flow again: 3 of 3 (0.29 to 1.00)" in text
    rates, ends = picture(found).axes
    assert [text.get_text() for text in ends.get_xticklabels()] == ["on, then off", "stays on", "no field"]
    assert len(rates.lines) == 3 + 3


def test_a_run_continues_with_its_springs_and_moments_in_the_order_of_ids():
    state = at_rest(scene(**TINY)).state
    n = len(state["mass"])
    past = np.arange(2.0 * n).reshape(n, 2)
    state |= {"id": np.arange(n)[::-1], "granular_past": past, "force": np.ones(n)}
    particles = continued(state)
    np.testing.assert_array_equal(particles.position, state["position"][::-1])
    np.testing.assert_array_equal(particles.quantities["granular_past"], state["granular_past"][::-1])
    assert set(particles.quantities) == {"granular_past"}


@pytest.mark.slow
def test_flow_resumes_when_the_field_ends_and_only_then():
    found = three_phases(3, flowing=6e-5, lasting=2.4e-4, reopened=1.2e-4, **TINY)
    for opened, closed, without in zip(found.opened, found.closed, found.without, strict=True):
        assert opened.arrested
        assert closed.after < ARRESTED * closed.before
        assert opened.flows_again
        assert opened.after > 5 * closed.after
        assert opened.opening_time < 6e-5
        assert not without.arrested
    assert sum(one.after for one in found.opened) > 0.3 * sum(one.after for one in found.without)
