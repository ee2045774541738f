"""Genes in a design that are not searched: fixed ones, and ones that depend on the others."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from tisim.errors import InputError, abbreviated, must
from tisim.optimize.problem.faults import FaultyProblem, error_told
from tisim.optimize.problem.gene_values import Named, Value, check_name, plain_value


@dataclass(frozen=True)
class FixedGene(Named):
    """A value that every design has: it is in tables and reports, and the search does not change it."""

    name: str
    value: Value
    unit: str = ""

    def __post_init__(self) -> None:
        check_name(self.name)
        object.__setattr__(self, "value", plain_value(self.value, f"fixed gene {self.name}"))

    @property
    def kind(self) -> str:
        """ "fixed"."""
        return "fixed"

    @property
    def described(self) -> str:
        """A text of all properties that define the gene; part of the identity of a search."""
        return f"{self.value!r} {self.unit}".rstrip() + ", fixed"


@dataclass(frozen=True)
class DependentGene(Named):
    """A value computed from the others of a design: it is in tables and reports, and not searched.

    of : function of the design, which contains all genes that are not dependent, and the dependent genes
        before this one. It must return a value for every design; use constraints to restrict the allowed
        values.
    """

    name: str
    unit: str
    of: Callable[[Mapping[str, Any]], Value]

    def __post_init__(self) -> None:
        check_name(self.name)
        must(
            callable(self.of),
            f"function 'of' of dependent gene {self.name}",
            "a function of the design",
            self.of,
        )

    @property
    def kind(self) -> str:
        """ "dependent"."""
        return "dependent"

    @property
    def described(self) -> str:
        """A text of its properties; its function is in the checksum of the problem's code."""
        return f"computed {self.unit}".rstrip()

    def value(self, design: Mapping[str, Any]) -> Value:
        """Return its value in a design. FaultyProblem if the function fails or returns no value."""
        rule = f"dependent gene {self.name} must return a finite number, a text or a flag"
        try:
            value = self.of(MappingProxyType(dict(design)))
        except Exception as error:
            raise FaultyProblem(f"{rule}; received {error_told(error)}") from error
        try:
            return plain_value(value, self.name)
        except InputError:
            raise FaultyProblem(f"{rule}; received {abbreviated(value)}") from None
