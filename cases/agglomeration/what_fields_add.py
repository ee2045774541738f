"""Compare the kinds of genes in the search for the largest grains, at equal budget.

    python -m tisim.cases.agglomeration.what_fields_add [--size small] [--runs 400] [--searches 5]
        [--method NAME] [--starts N] [--fresh 64] [--out what_fields_add.png]
    python -m tisim.cases.agglomeration.what_fields_add --one-flow [--size small] [--fresh 256]

Each kind is searched several times with different seeds; genes that are left out have the values of no charge
and no field. The best design of each search is then run from held-out starts, which are the same for all
searches. The table shows the mean of these values over the searches, with its 95 % confidence interval, and
the mean of the values that the searches themselves report.

With ``--one-flow`` nothing is searched: the best flow of Z04, with the lowest hardness in the range, is run
with one kind of field after another, each from the same starts.
"""

import argparse
import dataclasses
import functools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.console import Console

import tisim
from tisim import Scene, optimize
from tisim.analysis import Mean
from tisim.cases.agglomeration import fields
from tisim.cases.agglomeration.problem import GENES, UNBREAKABLE, cost, problem
from tisim.cases.agglomeration.scene import BEST, SIZES, scene
from tisim.cases.case import size_named
from tisim.cases.common.runs import OTHER_STARTS, sound
from tisim.numerics.statistics import CONFIDENCE
from tisim.optimize import Gene, Genome, Problem
from tisim.plotting.style import empty, legend_above, plain

KINDS_OF_GENES: Mapping[str, tuple[Gene, ...]] = {
    "the flow alone": (),
    "and charges": fields.CHARGE_GENES,
    "and charges, electric field": (*fields.CHARGE_GENES, *fields.ELECTRIC_GENES),
    "and magnetic field": fields.MAGNETIC_GENES,
    "all": fields.FIELD_GENES,
}
"""The genes that each kind of search adds to the genes of Z04."""

OPPOSITE_CHARGES = {"surface_charge": 4e-3, "charge_ratio": -1.0}
FELT: Mapping[str, Mapping[str, float]] = {
    "nothing": {},
    "opposite charges": OPPOSITE_CHARGES,
    "charges of one sign": {**OPPOSITE_CHARGES, "charge_ratio": 1.0},
    "opposite charges, constant E": {**OPPOSITE_CHARGES, "electric_field": 1e7},
    "opposite charges, E of 100 Hz": {
        **OPPOSITE_CHARGES,
        "electric_amplitude": 1e7,
        "electric_frequency": 100.0,
    },
    "constant B": {"magnetic_field": 1.0},
    "B of 100 Hz": {"magnetic_amplitude": 1.0, "magnetic_frequency": 100.0},
}
"""The fields in the comparison of one flow, each at its upper limit."""


@dataclass(frozen=True)
class Found:
    """The best design of a search. claimed : Pi reported by the search. true : Pi over held-out starts."""

    design: Mapping[str, float]
    claimed: float
    true: float


def without_the_rest(design: Mapping[str, float], seed: int, grains: int) -> Scene:
    """Return the flow of a design from a start; charges and fields that the design does not name are zero."""
    return scene({**fields.NO_FIELDS, **design}, seed, grains)


def problem_of(kind: str, size: str) -> Problem:
    """Return the inverse problem with a kind of genes."""
    return dataclasses.replace(
        problem(size, "fields"),
        name=f"agglomeration-{size}-{kind}",
        genome=Genome((*GENES, UNBREAKABLE, *KINDS_OF_GENES[kind])),
        scene=functools.partial(without_the_rest, grains=size_named(size, SIZES).scene["grains"]),
    )


def search(kind: str, size: str, seed: int, fresh: int, settings: Mapping[str, Any]) -> Found:
    """Search once, and run the best design from held-out starts."""
    searched = problem_of(kind, size)
    best = optimize.run(searched, seed=seed, **settings).designs[0]
    starts = range(OTHER_STARTS, OTHER_STARTS + fresh)
    ends = sound(tisim.run([searched.scene(best.genes, start) for start in starts]))
    (claimed,) = best.values.values()
    return Found(best.genes, claimed, float(np.mean([cost(end) for end in ends])))


def searches(size: str, number: int, fresh: int, settings: Mapping[str, Any]) -> Iterator[tuple[str, Found]]:
    """Search with each kind of genes a number of times."""
    for seed in range(number):
        for kind in KINDS_OF_GENES:
            yield kind, search(kind, size, seed, fresh, settings)


def table(found: Mapping[str, Sequence[Found]]) -> str:
    """Return the table of docs/agglomeration.md."""
    lines = [
        f"| genes | number | Pi, fresh starts, {CONFIDENCE:.0%} CI | as the search has it |",
        "|---|---|---|---|",
    ]
    for kind, ones in found.items():
        number = len(GENES) + 1 + len(KINDS_OF_GENES[kind])
        true, claimed = (Mean.of([getattr(one, name) for one in ones]) for name in ("true", "claimed"))
        lines.append(f"| {kind} | {number} | {true.value:.3f} ± {true.half:.3f} | {claimed.value:.3f} |")
    return "\n".join(lines)


def one_flow(grains: int, starts: int) -> str:
    """Return a table of the effect of fields on one flow: Pi, and its reduction relative to no field from the
    same starts."""
    soft = {**BEST, "hardness": 1e5}
    values = {
        name: np.array(
            [
                cost(end)
                for end in sound(
                    tisim.run([without_the_rest({**soft, **felt}, k, grains) for k in range(starts)])
                )
            ]
        )
        for name, felt in FELT.items()
    }
    lines = ["| grains feel | Pi | less than nothing felt by |", "|---|---|---|"]
    for name, ones in values.items():
        gain = Mean.of(values["nothing"] - ones)
        lines.append(f"| {name} | {Mean.of(ones)} | {'' if name == 'nothing' else gain} |")
    return "\n".join(lines)


def picture(found: Mapping[str, Sequence[Found]], title: str) -> Figure:
    """Return a figure of the best designs of the searches of each kind, and their means with intervals."""
    figure = empty(6.8, 0.5 * len(found) + 1.5)
    axis = figure.subplots()
    rows = range(len(found))
    for row, ones in zip(rows, found.values(), strict=True):
        (dots,) = axis.plot([one.true for one in ones], [row] * len(ones), "o", mfc="none", color="#4477aa")
        average = Mean.of([one.true for one in ones])
        bar = axis.errorbar(average.value, row, xerr=average.half, fmt="s", capsize=4, color="#cc6677")
        if row == 0:
            dots.set_label("a search")
            bar.set_label(f"mean, {CONFIDENCE:.0%} interval")
    axis.set_yticks(rows, list(found))
    axis.set_ylim(len(found) - 0.5, -0.5)
    axis.set_xlabel(f"Pi of the best design, from fresh starts\n{title}")
    legend_above(axis)
    plain(axis)
    return figure


def main() -> None:
    """Search, print the table and draw the picture."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--size", default="small", choices=SIZES)
    parser.add_argument("--runs", type=int, default=400, help="number of runs of a search")
    parser.add_argument("--searches", type=int, default=5, help="number of searches with each kind of genes")
    parser.add_argument("--method", help="name of the method; by default as in optimize.run")
    parser.add_argument("--starts", type=int, help="starts of each design; by default as in optimize.run")
    parser.add_argument("--fresh", type=int, default=64, help="held-out starts of the best designs")
    parser.add_argument("--one-flow", action="store_true", help="fields in one flow, without a search")
    parser.add_argument("--out", type=Path, help="file of the picture")
    options = parser.parse_args()
    if options.one_flow:
        print(one_flow(size_named(options.size, SIZES).scene["grains"], options.fresh))
        return
    settings: dict[str, Any] = {"max_evaluations": options.runs, "generations": options.runs}
    if options.method is not None:
        settings["method"] = options.method
    if options.starts is not None:
        settings["ensemble"] = dict.fromkeys(("min_starts", "max_starts", "block"), options.starts)

    console = Console()
    found: dict[str, list[Found]] = {kind: [] for kind in KINDS_OF_GENES}
    for kind, one in searches(options.size, options.searches, options.fresh, settings):
        found[kind].append(one)
        design = ", ".join(f"{name} {value:.3g}" for name, value in one.design.items())
        console.print(
            f"{kind}: Pi {one.true:.3f}, as the search has it {one.claimed:.3f}; {design}", highlight=False
        )
    print(table(found))
    if options.out is not None:
        title = f"{options.size} size, {options.searches} searches of {options.runs} runs each"
        picture(found, title).savefig(options.out, dpi=150)


if __name__ == "__main__":
    main()
