"""Designs that a search has found, run from held-out random starts (seeds).

    python tests/benchmarks/other_starts.py valve out/valve-front/best.csv [--starts 6]

The designs are the first --most lines of the table. Printed are each objective, and each further quantity
that the case reports for a design: its mean with the half width of the 95 % interval over the starts in which
it is finite, and the number of these starts; and the number of starts whose runs end without a failure.
"""

import argparse
import csv
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

import tisim
from tisim import Result
from tisim.analysis import Mean
from tisim.cases.case import every
from tisim.cases.common.runs import OTHER_STARTS
from tisim.optimize import Problem


def designs(problem: Problem, file: Path, most: int) -> list[dict[str, float]]:
    """Return the first designs of a search's table."""
    with file.open(newline="") as lines:
        rows = list(csv.DictReader(lines))[:most]
    return [{gene.name: float(row[gene.label]) for gene in problem.genome.genes} for row in rows]


def known(problem: Problem, design: Mapping[str, float], result: Result) -> dict[str, float]:
    """Return the quantities of one run: its objectives, and further ones that the case reports."""
    objectives = {one.label: one.of(result) for one in problem.objectives}
    return objectives | dict(problem.details(design, result) if problem.details else {})


def line(name: str, values: Sequence[float]) -> str:
    """Return a line on a quantity of several runs."""
    finite = [value for value in values if np.isfinite(value)]
    said = str(Mean.of(finite)) if len(set(finite)) > 1 else ", ".join(f"{value:.4g}" for value in finite[:1])
    return f"  {name}: {said or 'nothing'}; finite in {len(finite)} of {len(values)}"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("case")
    parser.add_argument("table", type=Path, help="best.csv of the search")
    parser.add_argument("--variant")
    parser.add_argument("--starts", type=int, default=6)
    parser.add_argument("--first", type=int, default=OTHER_STARTS)
    parser.add_argument("--most", type=int, default=5)
    options = parser.parse_args()
    tisim.init()
    problem, _search = every()[options.case].inverse("default", options.variant)
    for design in designs(problem, options.table, options.most):
        seeds = range(options.first, options.first + options.starts)
        results = tisim.run([problem.scene(design, seed) for seed in seeds])
        well = [known(problem, design, result) for result in results if result.status.ok]
        print(", ".join(f"{name} {value:.4g}" for name, value in design.items()), f"({len(well)} end well)")
        for name in well[0] if well else ():
            print(line(name, [one[name] for one in well]))


if __name__ == "__main__":
    main()
