"""What a valve must show: walls bear what drags grains, and what L21 says of jams, beside what is found."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from cases.case import Check
from cases.statistics import Claim, Mean, Shown
from cases.valve.measures import clusters, drag_pressure, held_pressure, unhindered_rate
from cases.valve.runs import ARRESTED, Flow, left
from cases.valve.sizes import GRADIENT, LENGTH
from cases.valve.studies import ValveRuns, by_throat

STARTS = 6
"""Each valve is run from so many starts, that of fine grains from half as many."""
BALANCE = 0.05
"""Walls bear the drag on an arrested flow to this part."""


def check(starts: int = STARTS) -> Iterator[Check | Claim | Shown]:
    """Yield each number as it is known."""
    narrow, wide, fine, without = by_throat(starts)
    yield from flowing([narrow, wide, fine])
    name = f"{without.name}: flow in the end over that before"
    yield Claim(name, left(without.flows), ARRESTED)
    yield from arrested(narrow)
    yield from going_on(wide, "L21: 40x does not jam")
    yield from going_on(fine, "L21: fine grains yield")


def flowing(valves: Sequence[ValveRuns]) -> Iterator[Claim]:
    """Yield that grains flow without a field."""
    for valve in valves:
        parts = [flow.open_rate / unhindered(flow) for flow in valve.flows]
        yield Claim(
            f"{valve.name}, before the field: flow over that of grains that go along",
            Mean.of(parts),
            0.5,
            1.1,
        )


def unhindered(flow: Flow) -> float:
    """Return the rate (kg/s) of the grains of a flow, were all to go with the oil."""
    return unhindered_rate(flow.result.scene, float(flow.result.state["mass"].sum()))


def arrested(valve: ValveRuns) -> Iterator[Check | Claim | Shown]:
    """Yield that a flow is arrested, how many arches there are, and that the walls bear the drag on it."""
    results = [flow.result for flow in valve.flows]
    yield Claim(f"{valve.name}: flow left in the field (L21: 20x, 30x jam)", left(valve.flows), most=ARRESTED)
    yield arches(valve)
    borne = np.mean([held_pressure(one) / drag_pressure(one) for one in results])
    yield Check("the same: force on the walls over drag", float(borne), 1.0, BALANCE)
    pressures = [drag_pressure(one) / (GRADIENT * LENGTH) for one in results]
    name = f"the same: drag over cross-section, over the {1e-3 * GRADIENT * LENGTH:.3g} kPa asked for"
    yield Claim(name, Mean.of(pressures), 0.8, 1.3)


def going_on(valve: ValveRuns, says: str) -> Iterator[Claim | Shown]:
    """Yield that a flow goes on in the field, and how many arches there are."""
    yield Claim(f"{valve.name}: flow left in the field ({says})", left(valve.flows), ARRESTED)
    yield arches(valve)


def arches(valve: ValveRuns) -> Shown:
    """Return how many starts end with grains in contact from wall to wall. It is shown of valves that flow,
    too: there such an arch is one that yields."""
    results = [flow.result for flow in valve.flows]
    bridged = sum(clusters(one.state, one.scene).bridged for one in results)
    name = f"{valve.name}: starts with grains in contact from wall to wall"
    return Shown(name, bridged, f"of {len(results)}")
