"""What is compared, what is claimed of it and how it is drawn, of flows that are made up."""

import numpy as np
import pytest

from cases.valve import checks, figures, studies
from cases.valve.measures import Clusters, oil_of, unhindered_rate
from cases.valve.runs import FLOW_LOOKS, Flow
from cases.valve.scene import FIELD
from cases.valve.sizes import FINE_DIAMETER, THROATS, D
from tests.cases.valve.states import at_rest


def made_up(scenes, progress):
    """Coarse grains in the narrow constriction are arrested in a field, all others slow down to a third."""
    done = []
    for k, one in enumerate(scenes):
        result = at_rest(one)
        result.state["velocity"] = np.tile(
            [0.0, 0.0, 0.1 * oil_of(one).speed], (len(result.state["mass"]), 1)
        )
        result.measures["valve_force_z"] = 1e-3
        times = np.linspace(0, one.duration, FLOW_LOOKS)
        field = one.effects[0]
        jams = len(result.state["mass"]) < 200 and field.constant[0] > 0
        end = 0.01 + 1e-4 * k if jams else 0.33 + 1e-3 * k
        free = 0.8 * unhindered_rate(one, float(result.state["mass"].sum()))
        rates = free * np.where(times <= field.begin, 1.0, end)
        done.append(Flow(result, times, rates))
    return done


@pytest.fixture(autouse=True)
def _without_runs(monkeypatch):
    monkeypatch.setattr(studies, "flows", made_up)


def test_each_valve_has_its_starts():
    valves = studies.by_throat(4)
    asked = [(one.throat, one.diameter, one.flux, len(one.flows)) for one in valves]
    narrow, wide = THROATS
    assert asked == [
        (narrow, D, FIELD, 4), (wide, D, FIELD, 4), (narrow, FINE_DIAMETER, FIELD, 2), (narrow, D, 0.0, 4),
    ]  # fmt: skip
    for one in valves:
        assert [flow.result.scene.seed for flow in one.flows] == list(range(len(one.flows)))
        assert all(flow.result.scene.effects[0].constant[0] == one.flux for flow in one.flows)
        for flow in one.flows:
            assert 2 * float(flow.result.state["radius"].mean()) == pytest.approx(one.diameter)
    assert [sum(flow.arrested for flow in one.flows) for one in valves] == [4, 0, 0, 0]
    assert valves[-1].name == "4 grains of 44 µm, no field"


def test_claims_are_of_the_valves_they_name(monkeypatch):
    found = {one.name: one for one in checks.check(4)}
    arrested = [one for name, one in found.items() if "20x, 30x jam" in name]
    assert [one.mean.value for one in arrested] == [pytest.approx(0.01 + 1.5e-4)]
    assert arrested[0].ok
    assert all(one.ok for name, one in found.items() if "40x" in name or "fine grains yield" in name)
    # The starts are random, in which no grains touch.
    shown = [one for name, one in found.items() if "from wall to wall" in name]
    assert [(one.value, one.beside, one.ok) for one in shown] == [(0, "of 4", None)] * 2 + [(0, "of 2", None)]
    # All but the first start of a valve end with an arch.
    monkeypatch.setattr(checks, "clusters", lambda state, made: Clusters(1.0, made.seed > 0))
    arches = [checks.arches(one).value for one in studies.by_throat(4)]
    assert arches == [3, 3, 1, 3]
    without = next(one for name, one in found.items() if "in the end over that before" in name)
    assert without.ok
    assert without.mean.value == pytest.approx(0.33, abs=0.03)
    # Were it arrested without a field, too, it would not be the field that does it.
    monkeypatch.setattr(
        checks, "by_throat", lambda starts: [*studies.by_throat(starts)[:3], studies.by_throat(starts)[0]]
    )
    assert not next(one for one in checks.check(4) if "in the end over that before" in one.name).ok


def test_figures_are_of_all_valves():
    throats, fields = studies.by_throat(2), studies.by_field(2)
    rows = figures.table([*throats, *fields]).splitlines()
    assert len(rows) == 1 + 2 * 3 + 1 + 2 * 4
    _, sweep = figures.flow_figure(throats, fields).axes
    assert [text.get_text() for text in sweep.get_legend().get_texts()] == [
        "4 grains of 44 µm", "6.5 grains of 44 µm"
    ]  # fmt: skip
    assert len(figures.cut_figure(throats[:3]).axes) == 4
