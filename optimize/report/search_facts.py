"""The designs and the course of a search as plain data, from which the scripts of its page draw the plots."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from tisim.optimize.report.search_data import Row, RunOfDesign, SearchData, number_or_none
from tisim.optimize.tables import FEASIBLE, FRESH_STARTS, HIGH, LOW, error_of
from tisim.plotting.colours import WIDE_RANGE


def designs_facts(data: SearchData, kept: Sequence[int]) -> dict[str, Any]:
    """Return some designs as plain data by column."""

    def of(column: Sequence[Any]) -> list[Any]:
        return [column[k] for k in kept]

    def values(row: Row) -> dict[str, Any]:
        name = row["name"]
        known = data.values.get(name, [math.nan] * len(data))
        ends = {"errors": error_of(name), "fresh": f"{name}{FRESH_STARTS}"}
        ends |= {"low": f"{name} {LOW}{FRESH_STARTS}", "high": f"{name} {HIGH}{FRESH_STARTS}"}
        columns = {
            key: [number_or_none(value) for value in of(data.values[head])] if head in data.values else None
            for key, head in ends.items()
        }
        columns["errors"] = columns["errors"] or [None for _ in kept]
        shown = [*known, *(value for head in [*ends.values()][1:] for value in data.values.get(head, ()))]
        return {
            "name": name, "unit": row.get("unit", ""), "largest": row.get("direction") == "largest",
            "logarithmic": _spread(shown), "values": list(map(number_or_none, of(known))), **columns,
        }  # fmt: skip

    fresh, quantities = data.facts.get(f"starts{FRESH_STARTS}", ()), run_quantities(data)
    return {
        "genes": [_gene(row, of(data.design_genes[row["name"]])) for row in data.genes if len(data)],
        "objectives": [values(row) for row in data.objectives],
        "constraints": [values(row) for row in data.constraints if row["name"] in data.values],
        "gen": of(data.facts.get("gen", ())), "rank": of(data.facts.get("rank", ())),
        "best": of(data.facts.get("best", ())), "starts": of(data.facts.get("starts", ())),
        "freshStarts": of(fresh), "feasible": of(data.facts.get(FEASIBLE, ())),
        "failed": of(data.facts.get("failed", ())),
        "runs": [[_run(run, quantities) for run in data.runs[k]] for k in kept],
    }  # fmt: skip


def _gene(row: Row, values: Sequence[Any]) -> dict[str, Any]:
    choices = None
    if "choices" in row:
        choices = json.loads(row["choices"])
    elif any(isinstance(value, str | bool) for value in values):
        choices = list(dict.fromkeys(values))
    searched = "low" in row or "choices" in row
    return {
        "name": row["name"], "unit": row.get("unit", ""), "low": row.get("low"), "high": row.get("high"),
        "logarithmic": row.get("scale") == "log", "choices": choices,
        "varied": searched or len(set(values)) > 1, "values": list(values),
    }  # fmt: skip


def _run(run: RunOfDesign, names: Sequence[str]) -> dict[str, Any]:
    return {
        "start": run.start, "fresh": run.held_out, "seed": run.seed, "reason": run.reason,
        "values": [number_or_none(run.values.get(name, math.nan)) for name in names],
        "wall": number_or_none(run.wall_s, 3),
    }  # fmt: skip


def run_quantities(data: SearchData) -> list[str]:
    """Return the names of the values of runs, in order."""
    return list(dict.fromkeys(name for of_it in data.runs for run in of_it[:1] for name in run.values))


def _spread(values: Sequence[float]) -> bool:
    """Return whether a logarithmic axis suits values."""
    known = [value for value in values if math.isfinite(value)]
    return bool(known) and min(known) > 0 and max(known) > WIDE_RANGE * min(known)


def convergence(data: SearchData) -> Iterable[dict[str, Any]]:
    """Yield the panels of the best values by generation; for one objective also the mean of the population
    with its standard deviation, and the derived values."""
    log = data.logbook
    if not log.get("gen"):
        return
    marks = list(_held_out_best(data))
    if len(data.objectives) > 1:
        headings = [one for one in log if one.startswith("best ")]
        for row, heading in zip(data.objectives, headings, strict=False):
            yield _panel(f"best {row['name']}", row.get("unit", ""), [_curve("", log[heading])])
        return
    (objective,) = data.objectives
    ends = [(m - s, m + s) for m, s in zip(log["mean"], log["std"], strict=True)]
    mean = _curve("mean", log["mean"])
    mean["low"], mean["high"] = ([number_or_none(end) for end in side] for side in zip(*ends, strict=True))
    title = f"{objective['name']}: best, and mean and standard deviation of the population"
    yield _panel(title, objective.get("unit", ""), [_curve("best", log["best"]), mean], marks)


def progress(data: SearchData) -> Iterable[dict[str, Any]]:
    """Yield the panels of all other numbers of a generation that change."""
    titles = {
        "starts": "new runs", "designs": "new designs", "failed": "failed designs",
        "box": "mean width of the search box", "front": "designs in the front",
    }  # fmt: skip
    for heading, values in data.logbook.items():
        known = heading in ("gen", "mean", "std", "recentred") or heading.split(" ")[0] == "best"
        if known or not all(isinstance(value, int | float) for value in values):
            continue
        if len({value for value in values if math.isfinite(value)}) > 1:
            yield _panel(titles.get(heading, heading), "", [_curve("", values)])


def _curve(label: str, values: Sequence[float]) -> dict[str, Any]:
    return {"label": label, "values": [number_or_none(value) for value in values]}


def _panel(title: str, unit: str, curves: Sequence[Mapping[str, Any]], marks: Any = ()) -> dict[str, Any]:
    sides = [one.get(name, ()) for one in curves for name in ("values", "low", "high")]
    sides += [[mark["value"], mark["low"], mark["high"]] for mark in marks]
    every = [value for side in sides for value in side if value is not None]
    return {
        "title": title, "unit": unit, "logarithmic": _spread(every), "curves": curves, "marks": list(marks)
    }  # fmt: skip


def _held_out_best(data: SearchData) -> Iterable[dict[str, Any]]:
    """Yield the value of each objective of the best design from held-out starts, with its interval."""
    best = next((k for k, one in enumerate(data.facts.get("best", ())) if one), None)
    if best is None or len(data.objectives) > 1:
        return
    for row in data.objectives:
        name = row["name"]
        heads = (f"{name}{FRESH_STARTS}", f"{name} {LOW}{FRESH_STARTS}", f"{name} {HIGH}{FRESH_STARTS}")
        value, low, high = (
            number_or_none(data.values[head][best]) if head in data.values else None for head in heads
        )
        if value is not None:
            label = "best from fresh starts, 95 % interval"
            last = data.logbook["gen"][-1]
            yield {"x": last + 0.5, "value": value, "low": low, "high": high, "label": label}
