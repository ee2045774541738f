"""Reports of calibration and sensitivity: tables for the terminal, CSV files and figures."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from tisim.files.atomic import replace_file
from tisim.optimize.analysis import calibration as calibrating
from tisim.optimize.analysis import sensitivity as sensing
from tisim.optimize.analysis.calibration import Calibration
from tisim.optimize.analysis.sensitivity import LEAST_Q2, Between, Sensitivity
from tisim.optimize.outcome import Outcome
from tisim.optimize.report.report import columns_csv, picture, text

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Analysis:
    """The analyses of a search.

    calibration : None if the objective is not a Misfit.
    sensitivity : of each objective; empty if too few designs are known.
    """

    calibration: Calibration | None
    sensitivity: tuple[Sensitivity, ...]

    @classmethod
    def of(cls, outcome: Outcome) -> Analysis:
        """Return the analyses of a search that has found a design."""
        enough = len(outcome.estimates) >= sensing.least_designs(outcome.problem.genome)
        return cls(
            calibrating.calibration(outcome) if outcome.problem.measured else None,
            sensing.sensitivity(outcome) if enough else (),
        )

    def tables(self) -> list[RenderableType]:
        """Return the tables for the terminal."""
        known = [calibration_table(self.calibration)] if self.calibration else []
        return [*known, *(sensitivity_table(one) for one in self.sensitivity)]

    def write(self, folder: Path) -> list[Path]:
        """Write the available analyses as .csv, .png and .pdf; return the paths.

        A figure that cannot be drawn is skipped, with a message on standard error.
        """
        paths: list[Path] = []
        known, sensitive = self.calibration, self.sensitivity
        if known is not None:
            replace_file(folder / "calibration.csv", columns_csv(calibrating.columns(known)))
            paths.append(folder / "calibration.csv")
            if known.genes:
                paths += picture(folder / "calibration", _late("calibration_figure", known))
        if sensitive:
            replace_file(folder / "sensitivity.csv", columns_csv(sensing.columns(sensitive)))
            paths += [folder / "sensitivity.csv"]
            paths += picture(folder / "sensitivity", _late("sensitivity_figure", sensitive))
        return paths


def _late(name: str, of: Calibration | tuple[Sensitivity, ...]) -> Callable[[], Figure]:
    """Return a function that draws the figure; matplotlib is imported only when it is called."""

    def draw() -> Figure:
        from tisim.optimize.report import analysis_figures

        figure: Figure = getattr(analysis_figures, name)(of)
        return figure

    return draw


def calibration_table(found: Calibration) -> RenderableType:
    """Return the estimates and intervals of the genes as a table for the terminal."""
    title = Text(f"calibration: {calibrating.summary(found)}", "italic")
    parts: list[RenderableType] = ["", title]
    if found.genes:
        table = Table(box=None, padding=(0, 1, 0, 0), pad_edge=False)
        table.add_column("gene")
        for heading in ("estimate", "95 % from", "to", "of its range"):
            table.add_column(heading, justify="right", no_wrap=True)
        table.add_column("")
        for one in found.genes:
            label = f"{one.name} ({one.unit})" if one.unit else one.name
            estimate, low, high = calibrating.shown(one)
            table.add_row(Text(label), estimate, Text(low), Text(high), f"{100 * one.part:.0f} %",
                          one.words.partition(":")[0])  # fmt: skip
        parts.append(table)
    if any(one.open_low or one.open_high for one in found.genes):
        parts.append(Text("[...]: an end of the searched range; the interval may extend beyond it", "dim"))
    for name, values in found.choices.items():
        parts.append(Text(f"{name}: {', '.join(map(str, values))} (designs within the 95 % limit of a gene)"))
    return Group(*parts, *(Text(remark) for remark in found.remarks))


def sensitivity_table(found: Sensitivity) -> RenderableType:
    """Return the effects of the genes on an objective as a table for the terminal."""
    table = Table(box=None, padding=(0, 1, 0, 0), pad_edge=False)
    table.add_column("gene")
    for heading in ("-10 % of range", "+10 % of range", "alone", "in all"):
        table.add_column(heading, justify="right", no_wrap=True)
    for gene in found.genes:
        label = f"{gene.name} ({gene.unit})" if gene.unit else gene.name
        changes = (_signed(gene.changes[move]) for move in (-0.1, 0.1))
        table.add_row(Text(label), *changes, _index(gene.first), _index(gene.total))
    predicts = (
        f"predicts {found.q2.low:.2f} to {found.q2.high:.2f} of the variance of left-out designs, "
        "without their noise"
    )
    words = [
        f"-10 %, +10 %: change of {found.objective} when only this gene moves from the best design by that "
        "part of its range",
        f"alone, in all: parts of the variance of {found.objective} over all ranges due to the gene alone "
        "and together with others (first-order and total Sobol' indices)",
        f"±: half of the 95 % interval. From a Gaussian process through {found.designs} designs, which "
        f"{predicts}",
    ]
    if found.doubt:
        words.append(f"the best design {found.doubt}")
    if not found.trusted:
        words[1] = f"alone, in all: not given, because the Gaussian process predicts less than {LEAST_Q2:g}"
    title = Text(f"effect of each gene on {found.label}", "italic")
    return Group("", title, table, *(Text(line, "dim") for line in words))


def _signed(one: Between) -> str:
    if not math.isfinite(one.value):
        return "-"
    return f"{text(float(f'{one.value:.3g}'))} ± {text(float(f'{(one.high - one.low) / 2:.2g}'))}"


def _index(one: Between) -> str:
    return f"{one.value:.2f} ± {(one.high - one.low) / 2:.2f}" if math.isfinite(one.value) else "-"
