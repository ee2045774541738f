"""The genes of a problem, the unit cube that the search works in, and the search box inside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tisim.errors import InputError, abbreviated, must
from tisim.optimize.problem.gene_values import Value
from tisim.optimize.problem.genes import Gene, Searched
from tisim.optimize.problem.given_genes import DependentGene, FixedGene

__all__ = ["Gene", "Genome", "SearchBox"]
AnyGene = Searched | FixedGene | DependentGene


@dataclass(frozen=True)
class Genome:
    """An ordered tuple of genes with different names (Z04 Eq. 7.3).

    The search works in the unit cube of the searched genes, in their order, ``len(genome)`` of them; a design
    has the values of all genes by name, in the order of the genome. InputError without a searched gene.
    """

    genes: tuple[AnyGene, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "genes", tuple(self.genes))
        for gene in self.genes:
            must(isinstance(gene, AnyGene), "gene", "a Gene, Choice, FixedGene or DependentGene", gene)
        names = [gene.name for gene in self.genes]
        must(len(self.searched) > 0, "genome", "one gene or more that is searched", self.genes)
        must(len(set(names)) == len(names), "gene names", "all different", names)

    def __len__(self) -> int:
        return len(self.searched)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all genes."""
        return tuple(gene.name for gene in self.genes)

    @cached_property
    def searched(self) -> tuple[Searched, ...]:
        """The genes that the search changes, one coordinate of the unit cube each."""
        return tuple(gene for gene in self.genes if isinstance(gene, Searched))

    @property
    def kinds(self) -> tuple[str, ...]:
        """The kind of each coordinate: "real", "integer", "ordered" or "category"."""
        return tuple(gene.kind for gene in self.searched)

    def decode(self, u: Sequence[float] | NDArray[np.float64]) -> dict[str, Any]:
        """Return the design in physical units of a point u, shape (searched genes,), of the unit cube.

        InputError outside it.
        """
        point = np.asarray(u, dtype=float)
        must(point.shape == (len(self),), "unit-cube point", f"of shape ({len(self)},)", point.shape)
        must(bool(np.all((point >= 0) & (point <= 1))), "unit-cube point", "within 0..1", point.tolist())
        return self.complete(
            {gene.name: gene.decode(float(x)) for gene, x in zip(self.searched, point, strict=True)}
        )

    def encode(self, design: Mapping[str, Any]) -> NDArray[np.float64]:
        """Return a point of the unit cube that decodes to a design, to the last bit if the design was itself
        decoded.

        Dependent genes are ignored. InputError for a gene that is missing, unknown or out of its range, and
        for a fixed gene with another value.
        """
        whole = self.complete(design)
        for gene in self.genes:
            if isinstance(gene, FixedGene) and gene.name in design:
                must(design[gene.name] == gene.value, f"gene {gene.name}", gene.described, design[gene.name])
        return np.array([gene.encode(whole[gene.name]) for gene in self.searched])

    def complete(self, design: Mapping[str, Any], what: str = "design") -> dict[str, Any]:
        """Return a design with its fixed and dependent values, in the order of the genome.

        InputError if a searched gene is missing or a gene is unknown; ``what`` names the design in the
        message.
        """
        searched = [gene.name for gene in self.searched]
        right = set(searched) <= set(design) <= set(self.names)
        must(right, what, f"of the genes {', '.join(searched)}", [*design])
        values = {gene.name: design[gene.name] for gene in self.searched}
        values |= {gene.name: gene.value for gene in self.genes if isinstance(gene, FixedGene)}
        for gene in self.genes:
            if isinstance(gene, DependentGene):
                values[gene.name] = gene.value(values)
        return {name: values[name] for name in self.names}

    def parse(self, row: Mapping[str, str]) -> dict[str, Any]:
        """Return the design in a row of a CSV file, texts by heading: gene names, or their labels as in
        best.csv.

        Other columns are ignored. InputError if a searched gene has no column.
        """
        design = {}
        for gene in self.searched:
            heading = gene.label if gene.label in row else gene.name
            must(heading in row, "columns", f"of all genes, {gene.label} among them", [*row])
            design[gene.name] = gene.parse(row[heading])
        return self.complete(design)

    def fix(self, **values: Value) -> Genome:
        """Return the genome with these genes fixed, each within its range. InputError for others."""
        genes = {gene.name: gene for gene in self.genes}
        for name, value in values.items():
            gene = genes.get(name)
            if isinstance(gene, Searched):
                genes[name] = FixedGene(name, gene.decode(gene.encode(value)), gene.unit)
                continue
            free = ", ".join(gene.name for gene in self.searched)
            raise InputError(f"gene to fix must be one of {free}; received {abbreviated(name)}")
        return Genome(tuple(genes.values()))

    def canonical(self, u: ArrayLike) -> NDArray[np.float64]:
        """Return the canonical one of all points that decode to the same design: the cell centres of integers
        and choices.

        u : shape (..., searched genes).
        """
        points = np.array(u, dtype=float)
        for k, gene in enumerate(self.searched):
            points[..., k] = gene.snap(points[..., k])
        return points

    def features(self, u: ArrayLike) -> NDArray[np.float64]:
        """Return the features of designs for a surrogate, shape (points, columns): equal for all points of
        one design.

        A number has its position in 0..1, an integer the centre of its cell; a choice has a column for each
        of its values, any two of them at distance 1. u : shape (points, searched genes).

        Source: E. C. Garrido-Merchan and D. Hernandez-Lobato, Neurocomputing 380 (2020) 20-35: a Gaussian
        process of points that are rounded before they enter its kernel.
        """
        points = np.atleast_2d(np.asarray(u, dtype=float))
        return np.hstack([gene.features(points[:, k]) for k, gene in enumerate(self.searched)])

    @property
    def feature_genes(self) -> NDArray[np.intp]:
        """The coordinate that each column of ``features`` belongs to. All columns of a choice share one
        length scale."""
        return np.repeat(np.arange(len(self)), [gene.width for gene in self.searched])


@dataclass(frozen=True, eq=False)
class SearchBox:
    """The part of the unit cube that new individuals are drawn from: arrays low and high, shape (genes,)."""

    low: NDArray[np.float64]
    high: NDArray[np.float64]

    @classmethod
    def full(cls, genes: int) -> SearchBox:
        """Return the whole unit cube for this number of genes."""
        return cls(np.zeros(genes), np.ones(genes))

    @property
    def width(self) -> NDArray[np.float64]:
        return self.high - self.low

    def sample(self, rng: np.random.Generator) -> NDArray[np.float64]:
        """Return a point drawn uniformly, shape (genes,)."""
        return np.clip(self.low + rng.random(len(self.low)) * self.width, self.low, self.high)

    def recentre(self, best: ArrayLike, factor: float) -> SearchBox:
        """Return the box shrunk by factor (0 < factor <= 1) around best, shifted to stay in the unit cube.

        The new box contains best but may extend beyond the old one, so an optimum that an earlier box
        excluded can still be found. InputError outside the unit cube.

        Source: Z04 section 8: every four generations the search domain was restricted and rescaled to be
        centred around the best parameter set.
        """
        centre = np.asarray(best, dtype=float)
        must(0 < factor <= 1, "recentre factor", "within 0 < factor <= 1", factor)
        must(bool(np.all((centre >= 0) & (centre <= 1))), "best point", "within 0..1", centre.tolist())
        width = self.width * factor
        low = np.clip(centre - width / 2, 0.0, 1.0 - width)
        return SearchBox(np.minimum(low, centre), np.maximum(np.minimum(low + width, 1.0), centre))
