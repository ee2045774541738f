"""Sizes of the case avalanche: the number of grains, and the cell in grain diameters."""

from __future__ import annotations

from dataclasses import dataclass

from tisim.cases.case import Size


@dataclass(frozen=True)
class Cell:
    """A cell with grains beside a dividing wall; lengths are in grain diameters.

    number : of grains. column : distance from the end to the dividing wall. width : periodic. length : of the
    whole cell.
    height : of the drawn part.
    """

    number: int
    column: float
    width: float
    length: float
    height: float


DEFAULT = Cell(number=400, column=10.0, width=5.25, length=40.0, height=14.0)
"""The width is slightly more than twice the cut-off of the dipoles."""
SMALL = Cell(number=200, column=7.0, width=5.25, length=28.0, height=11.0)
"""Half the number of grains, in a column of the same ratio of width to height."""
LARGE_CELL = Cell(number=2500, column=25.0, width=5.25, length=90.0, height=30.0)
"""A column 18 diameters high, whose slope is longer than the chains of grains on it."""
L21_CELLS = {
    5e-3: Cell(number=500_000, column=150.0, width=80.0, length=300.0, height=400.0),
    1e-2: Cell(number=77_000, column=75.0, width=40.0, length=150.0, height=200.0),
    5e-2: Cell(number=70_000, column=75.0, width=40.0, length=150.0, height=200.0),
}
"""Cells of L21 by grain diameter, m: 1.5 m by 0.4 m by 2 m, and 7.5 m by 2 m by 10 m (L21 section 4.4.1.3).
L21 does not give the position of the dividing wall; here it is in the middle."""

SEARCH_SETTINGS = {
    "generations": 6, "ensemble": {"min_starts": 1, "select": 0, "confirm": 3},
}  # fmt: skip

SIZES = {
    "default": Size(
        f"{DEFAULT.number} grains in a narrow cell, softened", {"cell": DEFAULT}, SEARCH_SETTINGS
    ),
    "small": Size(f"{SMALL.number} grains, softened", {"cell": SMALL}),
    "large": Size(f"{LARGE_CELL.number} grains, 18 diameters high, softened", {"cell": LARGE_CELL}),
    **{
        name: Size(
            f"{L21_CELLS[diameter].number} grains of {text} with L21's stiffness",
            {"cell": L21_CELLS[diameter], "diameter": diameter, "stiffness": None},
        )
        for name, diameter, text in (
            ("l21", 5e-3, "5 mm"), ("l21_1cm", 1e-2, "1 cm"), ("l21_5cm", 5e-2, "5 cm"),
        )
    },
}  # fmt: skip
