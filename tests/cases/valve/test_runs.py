"""Comparisons, claims and figures of valves, with synthetic flows."""

import numpy as np
import pytest

from tests.cases.valve.states import at_rest
from tisim.cases.valve import checks, figures, runs
from tisim.cases.valve.measures import oil_of, unhindered_rate
from tisim.cases.valve.runs import FLOW_SAMPLES, Flow
from tisim.cases.valve.scene import FIELD, FINE_DIAMETER, THROATS, D


def made_up(scenes, progress):
    """Flows in which a field arrests coarse grains in the narrow constriction and slows others to a third."""
    done = []
    for k, one in enumerate(scenes):
        result = at_rest(one)
        result.state["velocity"] = np.tile(
            [0.0, 0.0, 0.1 * oil_of(one).speed], (len(result.state["mass"]), 1)
        )
        result.measures["valve_force_z"] = 1e-3
        times = np.linspace(0, one.duration, FLOW_SAMPLES)
        field = one.effects[0]
        jams = len(result.state["mass"]) < 200 and field.constant[0] > 0
        end = 0.01 + 1e-4 * k if jams else 0.33 + 1e-3 * k
        free = 0.8 * unhindered_rate(one, float(result.state["mass"].sum()))
        rates = free * np.where(times <= field.begin, 1.0, end)
        done.append(Flow(result, times, rates))
    return done


@pytest.fixture(autouse=True)
def _without_runs(monkeypatch):
    monkeypatch.setattr(runs, "flows", made_up)


def test_each_valve_has_its_starts():
    valves = runs.by_throat(4)
    asked = [(one.throat, one.diameter, one.flux, len(one.flows)) for one in valves]
    narrow, wide = THROATS
    assert asked == [
        (narrow, D, FIELD, 8), (wide, D, FIELD, 4), (narrow, FINE_DIAMETER, FIELD, 2), (narrow, D, 0.0, 8),
    ]  # fmt: skip
    for one in valves:
        assert [flow.result.scene.seed for flow in one.flows] == list(range(len(one.flows)))
        assert all(flow.result.scene.effects[0].constant[0] == one.flux for flow in one.flows)
        for flow in one.flows:
            assert 2 * float(flow.result.state["radius"].mean()) == pytest.approx(one.diameter)
    assert [sum(flow.arrested for flow in one.flows) for one in valves] == [8, 0, 0, 0]
    assert valves[-1].name == "4 grains of 44 µm, no field"


@pytest.mark.slow
def test_claims_refer_to_the_named_valves(monkeypatch):
    found = {one.name: one for one in checks.check(4)}
    arrested = [one for name, one in found.items() if "20x, 30x jam" in name]
    assert [one.mean.value for one in arrested] == [pytest.approx(0.01 + 3.5e-4)]
    assert arrested[0].ok
    # The ratio to the flow without a field is taken for each start.
    parts = [(0.01 + 1e-4 * k) / (0.33 + 1e-3 * (k + 14)) for k in range(8)]
    (beside,) = [one for name, one in found.items() if "same starts without a field" in name]
    assert beside.value.value == pytest.approx(np.mean(parts))
    (wider,) = [one for name, one in found.items() if "minus flow left" in name]
    assert wider.mean.value == pytest.approx(0.33 + 9.5e-3 - (0.01 + 3.5e-4))
    assert wider.ok
    assert all(one.ok for name, one in found.items() if "40x" in name or "fine grains yield" in name)
    without = next(one for name, one in found.items() if "no field" in name and "at the end" in name)
    assert without.value.value == pytest.approx(0.33 + 1e-3 * 17.5)
    # Two equal valves do not support the claim.
    monkeypatch.setattr(checks, "by_throat", lambda starts: [runs.by_throat(starts)[k] for k in (0, 0, 2, 3)])
    assert not next(one for one in checks.check(4) if "minus flow left" in one.name).ok


def test_the_start_farthest_from_balance_is_judged(monkeypatch):
    """The errors of starts might cancel in their mean."""
    held = iter((1.0, 1.04, 0.94, *[1.0] * 5))
    monkeypatch.setattr(checks, "held_pressure", lambda result: next(held))
    monkeypatch.setattr(checks, "drag_pressure", lambda result: 1.0)
    found = next(one for one in checks.check(4) if "force on the walls" in one.name)
    assert found.measured == 0.94
    assert not found.ok


@pytest.mark.slow
def test_figures_show_all_valves():
    throats, fields = runs.by_throat(2), runs.by_field(2)
    rows = figures.table([*throats, *fields]).splitlines()
    assert len(rows) == 1 + 2 * 4 + 2 + 1 + 2 * 4
    _, sweep = figures.flow_figure(throats, fields).axes
    assert [text.get_text() for text in sweep.get_legend().get_texts()] == [
        "4 grains of 44 µm", "6.5 grains of 44 µm"
    ]  # fmt: skip
    assert len(figures.cut_figure(throats[:3]).axes) == 4
