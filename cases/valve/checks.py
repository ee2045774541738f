"""Checks of a valve: the walls balance the drag on grains, and L21's findings on jams are compared with the
results."""

from collections.abc import Iterator, Sequence

import numpy as np

from tisim.analysis import Mean
from tisim.cases.case import Check, Claim, Shown
from tisim.cases.valve.measures import drag_pressure, held_pressure, unhindered_rate
from tisim.cases.valve.runs import ARRESTED, Flow, ValveRuns, by_throat, left, left_of
from tisim.cases.valve.scene import GRADIENT, LENGTH

STARTS = 6
"""Number of starts of each valve. The narrow one has twice this number, with and without a field, and the one
with fine grains has half of it."""
BALANCE = 0.05
"""Largest relative difference between the force on the walls and the drag on an arrested flow."""


def check(starts: int = STARTS) -> Iterator[Check | Claim | Shown]:
    """Yield each number when it is known."""
    narrow, wide, fine, without = by_throat(starts)
    yield from flowing([narrow, wide, fine])
    yield Shown(f"{without.name}: flow at the end over flow before", left(without.flows))
    yield from arrested(narrow, without)
    yield going_on(wide, "L21: 40x does not jam")
    more = left(wide.flows).minus(left(narrow.flows))
    yield Claim(f"{wide.name}: flow left, minus flow left with {narrow.name}", more, 0.0)
    yield going_on(fine, "L21: fine grains yield")


def flowing(valves: Sequence[ValveRuns]) -> Iterator[Claim]:
    """Yield that grains flow without a field."""
    for valve in valves:
        parts = [flow.open_rate / unhindered(flow) for flow in valve.flows]
        yield Claim(
            f"{valve.name}, before the field: flow over flow of grains that move with the oil",
            Mean.of(parts),
            0.5,
            1.1,
        )


def unhindered(flow: Flow) -> float:
    """Return the rate (kg/s) of a flow if all grains moved with the oil."""
    return unhindered_rate(flow.result.scene, float(flow.result.state["mass"].sum()))


def arrested(valve: ValveRuns, without: ValveRuns) -> Iterator[Check | Claim | Shown]:
    """Yield that a flow is arrested, its remaining part compared with runs without a field, and the balance
    of wall force and drag."""
    results = [flow.result for flow in valve.flows]
    yield Claim(f"{valve.name}: flow left in the field (L21: 20x, 30x jam)", left(valve.flows), most=ARRESTED)
    name = "the same over the flow of the same starts without a field, at the same time"
    yield Shown(name, left_of(valve.flows, without.flows))
    borne = np.array([held_pressure(one) / drag_pressure(one) for one in results])
    farthest = float(borne[np.abs(borne - 1).argmax()])
    yield Check("arrested flow: force on the walls over drag, start farthest from 1", farthest, 1.0, BALANCE)
    pressures = [drag_pressure(one) / (GRADIENT * LENGTH) for one in results]
    name = f"arrested flow: drag over cross-section, over the nominal {1e-3 * GRADIENT * LENGTH:.3g} kPa"
    yield Claim(name, Mean.of(pressures), 0.8, 1.3)


def going_on(valve: ValveRuns, says: str) -> Claim:
    """Return the claim that a flow continues in the field."""
    return Claim(f"{valve.name}: flow left in the field ({says})", left(valve.flows), ARRESTED)
