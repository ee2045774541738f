"""Figures of the case valve: flow rate by time, what is left of it by field, and grains in a cut."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure

from cases.valve.measures import clusters, drag_pressure, duct_of, held_pressure
from cases.valve.runs import ARRESTED, Flow, left
from cases.valve.sizes import THROATS, D
from cases.valve.studies import ValveRuns, by_field, by_throat
from tisim.engine.batches import Progress, progress_of_part
from tisim.errors import must
from tisim.plotting.style import empty, letters, plain

STARTS = 6
"""Each setting is run from so many starts."""
COLOURS = ("#4477aa", "#ccbb44", "#cc6677", "#228833")
"""Those of the valves, from narrow to wide, and of fine grains."""
GROUP_COLOURS = ("#4477aa", "#cc6677", "#dddddd")
"""Those of the grains of the largest cluster, of other clusters, and of grains that touch none (L21 Fig.
3.11)."""
MILLI, KILO = 1e-3, 1e3
"""A millisecond, s, and a kilopascal, Pa."""


def figures(size: str, progress: Progress) -> Mapping[str, Figure | str]:
    """flow.png, flow.csv: flow rate by time, by constriction and grain size, and what is left of it by field;
    cut.png: grains in the field, by cluster."""
    must(size == "default", "size", "default, which is run", size)
    throats = by_throat(STARTS, progress_of_part(progress, 0, 2))
    fields = by_field(STARTS, progress_of_part(progress, 1, 2))
    return {
        "flow.png": flow_figure(throats, fields),
        "flow.csv": table([*throats, *fields]),
        "cut.png": cut_figure(throats),
    }


def flow_figure(throats: Sequence[ValveRuns], fields: Sequence[ValveRuns]) -> Figure:
    """Draw flow rates by time, thin lines for starts, and what is left of them by field."""
    figure = empty(12.0, 4.0)
    rates, sweep = figure.subplots(1, 2)
    for study, colour in zip(throats, COLOURS, strict=True):
        flows = study.flows
        for flow in flows:
            rates.plot(flow.times / MILLI, flow.rates / flow.open_rate, color=colour, lw=0.5, alpha=0.6)
        mean = np.mean([flow.rates / flow.open_rate for flow in flows], axis=0)
        rates.plot(flows[0].times / MILLI, mean, color=colour, lw=1.8, label=study.name)
    rates.axvline(throats[0].flows[0].switched / MILLI, color="0.5", lw=0.8, ls=":")
    rates.set(xlabel="time (ms)", ylabel="mass flow rate over that without field", ylim=(-0.1, 1.6))
    rates.set_title("field on at the dotted line")
    for throat, colour in zip((THROATS[0], THROATS[-1]), (COLOURS[0], COLOURS[2]), strict=True):
        line = [one for one in (*fields, *throats) if (one.throat, one.diameter) == (throat, D)]
        line.sort(key=lambda one: one.flux)
        means = [left(one.flows) for one in line]
        sweep.errorbar([one.flux for one in line], [one.value for one in means], [one.half for one in means],
                       fmt="o-", ms=4, capsize=3, color=colour, label=line[0].name)  # fmt: skip
    sweep.axhline(ARRESTED, color="0.5", lw=0.8, ls=":")
    sweep.set(xlabel="flux density (T)", ylabel="part of the flow rate that is left", title="by field")
    for axis in (rates, sweep):
        axis.legend(frameon=False, fontsize=8)
        plain(axis)
    letters((rates, sweep))
    return figure


def cut_figure(studies: Sequence[ValveRuns]) -> Figure:
    """Draw the grains of the first start of each that the plane of axis and field cuts, by cluster."""
    figure = empty(3.0 * len(studies), 4.6, pad=0.1)
    axes = figure.subplots(1, len(studies))
    for axis, study in zip(axes, studies, strict=True):
        cut(axis, study.flows[0])
        axis.set_title(f"{study.name}: {'arrested' if study.flows[0].arrested else 'flows'}")
    letters(axes, 9)
    return figure


def cut(axis: Axes, flow: Flow) -> None:
    """Draw the grains of a flow that the plane of axis and field cuts, as large as they are there, and walls;
    the flow is downwards."""
    state, duct = flow.result.state, duct_of(flow.result.scene)
    label = clusters(state, flow.result.scene).label
    sizes = np.bincount(label)
    kind = np.where(label == sizes.argmax(), 0, np.where(sizes[label] > 1, 1, 2))
    place = state["position"]
    squares = state["radius"] ** 2 - place[:, 1] ** 2
    seen = squares > 0
    width = 2 * np.sqrt(squares[seen]) / MILLI
    circles = EllipseCollection(
        width, width, np.zeros(len(width)), units="xy", offsets=place[seen][:, [0, 2]] / MILLI,
        offset_transform=axis.transData, facecolors=[GROUP_COLOURS[k] for k in kind[seen]],
        edgecolors="white", linewidths=0.3,
    )  # fmt: skip
    axis.add_collection(circles)
    heights, radii = duct.profile()
    for side in (-1, 1):
        axis.plot(side * radii / MILLI, (heights - duct.length / 2) / MILLI, color="0.2", lw=1.5)
    axis.set(aspect="equal", xlabel="along the field (mm)")
    axis.set_ylim(duct.length / 2 / MILLI, -duct.length / 2 / MILLI)
    plain(axis)
    axis.grid(visible=False)


def table(studies: Sequence[ValveRuns]) -> str:
    """Return what each start of each valve has come to, as CSV."""
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(
        [
            "throat_m", "grain_diameter_m", "flux_density_T", "seed", "open_rate_kg_per_s", "part_left",
            "drag_pressure_Pa", "held_pressure_Pa", "largest_cluster", "bridged",
        ]
    )  # fmt: skip
    for study in studies:
        for flow in study.flows:
            found = clusters(flow.result.state, flow.result.scene)
            numbers = (flow.open_rate, flow.left, drag_pressure(flow.result), held_pressure(flow.result))
            writer.writerow(
                [f"{study.throat:.4g}", f"{study.diameter:.4g}", study.flux, flow.result.scene.seed]
                + [f"{one:.4g}" for one in (*numbers, found.largest)]
                + [int(found.bridged)]
            )
    return text.getvalue()
