"""Figures of the case valve: flow rate over time, its remaining part by field, and a cut through the
grains."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from tisim.cases.common.csv_tables import csv_text
from tisim.cases.valve.measures import clusters, drag_pressure, held_pressure, oil_of
from tisim.cases.valve.runs import ARRESTED, Flow, ValveRuns, by_field, by_throat, left
from tisim.cases.valve.scene import THROATS, D
from tisim.engine.batches import Progress, progress_of_part
from tisim.errors import must
from tisim.plotting.cloud import directions, panel
from tisim.plotting.look import Look
from tisim.plotting.scenery import scenery, window
from tisim.plotting.style import TIME, empty, letters, plain
from tisim.rendering.camera import ALONG_Y, ClipPlane

STARTS = 6
"""Number of starts of each setting. The narrow valve in the strongest field and without one has twice this
number, and the one with fine grains has half of it."""
COLOURS = ("#4477aa", "#cc6677", "#228833", "#aaaaaa")
"""Colours of the narrow and of the wide constriction, of fine grains, and of runs without a field."""
SPEEDS = Normalize(0.0, 0.6)
"""Scale of the colours: speed as a fraction of the speed of the oil in the duct."""
CUT = Look(camera=ALONG_Y, clip=(ClipPlane((0.0, -1.0, 0.0), 0.0),))
"""The look of grains that are cut in the plane of axis and field."""
MILLI = 1e-3
"""A millisecond, s, and a millimetre, m."""


def figures(size: str, progress: Progress) -> Mapping[str, Figure | str]:
    """flow.png, flow.csv: flow rate over time, by constriction and grain size, and its remaining part by
    field; cut.png: grains in the field, by speed."""
    must(size == "default", "size", "default, which is run", size)
    throats = by_throat(STARTS, progress_of_part(progress, 0, 2))
    fields = by_field(STARTS, progress_of_part(progress, 1, 2))
    return {
        "flow.png": flow_figure(throats, fields),
        "flow.csv": table([*throats, *fields]),
        "cut.png": cut_figure([one for one in throats if one.flux > 0]),
    }


def flow_figure(throats: Sequence[ValveRuns], fields: Sequence[ValveRuns]) -> Figure:
    """Draw flow rates over time, with thin lines for single starts, and their remaining part by field."""
    figure = empty(12.0, 4.0)
    rates, sweep = figure.subplots(1, 2)
    for valve, colour in zip(throats, COLOURS, strict=True):
        flows = valve.flows
        for flow in flows:
            rates.plot(flow.times / MILLI, flow.rates / flow.open_rate, color=colour, lw=0.5, alpha=0.6)
        mean = np.mean([flow.rates / flow.open_rate for flow in flows], axis=0)
        rates.plot(flows[0].times / MILLI, mean, color=colour, lw=1.8, label=valve.name)
    rates.axvline(throats[0].flows[0].switched / MILLI, color="0.5", lw=0.8, ls=":")
    rates.set(xlabel="time (ms)", ylabel="mass flow rate over that without field", ylim=(-0.1, 1.6))
    rates.set_title("field on at the dotted line")
    for throat, colour in zip(THROATS, COLOURS[:2], strict=True):
        line = [one for one in (*fields, *throats) if (one.throat, one.diameter) == (throat, D)]
        line.sort(key=lambda one: one.flux)
        means = [left(one.flows) for one in line]
        sweep.errorbar([one.flux for one in line], [one.value for one in means], [one.half for one in means],
                       fmt="o-", ms=4, capsize=3, color=colour, label=line[-1].name)  # fmt: skip
    sweep.axhline(ARRESTED, color="0.5", lw=0.8, ls=":")
    sweep.set(xlabel="flux density (T)", ylabel="part of the flow rate that is left", title="by field")
    for axis in (rates, sweep):
        axis.legend(frameon=False, fontsize=8)
        plain(axis)
    letters((rates, sweep))
    return figure


def cut_figure(valves: Sequence[ValveRuns]) -> Figure:
    """Draw the grains behind the plane of axis and field at the end, by speed, for the first start of each
    valve."""
    figure = empty(3.3 * len(valves) + 0.8, 3.8, pad=0.1)
    axes = figure.subplots(1, len(valves))
    for axis, valve in zip(axes, valves, strict=True):
        cut(axis, valve.flows[0])
        axis.set_title(f"{valve.name}: {'arrested' if valve.flows[0].arrested else 'flows'}")
    letters(axes, 9)
    label = "speed / speed of the oil in the duct"
    figure.colorbar(ScalarMappable(SPEEDS, TIME), ax=axes, label=label, extend="both")
    return figure


def cut(axis: Axes, flow: Flow) -> None:
    """Draw the walls and the final grains, cut in the plane of axis and field."""
    state, scene = flow.result.state, flow.result.scene
    around = scenery(scene, [state], flow.result.time, flow.result.measures)
    part = window([state], look=CUT)
    colours = TIME(SPEEDS(state["velocity"][:, 2] / oil_of(scene).speed))[:, :3]
    panel(axis, state, part, replace(around, edges=()), colours, look=CUT)
    directions(axis, part, np.zeros(3), camera=CUT.camera)


def table(valves: Sequence[ValveRuns]) -> str:
    """Return the results of each start of each valve as CSV."""
    rows: list[list[object]] = [
        [
            "throat_m", "grain_diameter_m", "flux_density_T", "seed", "open_rate_kg_per_s", "part_left",
            "drag_pressure_Pa", "held_pressure_Pa", "largest_cluster", "bridged",
        ]
    ]  # fmt: skip
    for valve in valves:
        for flow in valve.flows:
            found = clusters(flow.result.state, flow.result.scene)
            numbers = (flow.open_rate, flow.left, drag_pressure(flow.result), held_pressure(flow.result))
            rows.append(
                [f"{valve.throat:.4g}", f"{valve.diameter:.4g}", valve.flux, flow.result.scene.seed]
                + [f"{one:.4g}" for one in (*numbers, found.largest)]
                + [int(found.bridged)]
            )
    return csv_text(rows)
