"""Figures of the case granular_bench: tests of single contacts, heaps and silos, and a shear cell."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.figure import Figure

from tisim.cases.case import size_named
from tisim.cases.granular_bench.beds import bed_figure, beds, table
from tisim.cases.granular_bench.contact_figure import contact_figure
from tisim.cases.granular_bench.scene import BED, SIZES
from tisim.cases.granular_bench.shear_cell import sheared_beds
from tisim.cases.granular_bench.shear_figure import FRACTIONS, shear_figure, shear_table
from tisim.engine.batches import Progress
from tisim.errors import must


def figures(size: str, progress: Progress) -> Mapping[str, Figure | str]:
    """contact_tests.png: the tests of single contacts; beds.png, beds.csv: heaps and silos; shear_cell.png,
    shear_cell.csv: mu(I)."""
    must(size != BED, "size", "one of a draw-down test", size)
    found = beds(progress, dict(size_named(size, SIZES).scene))
    sheared = sheared_beds(FRACTIONS)
    return {
        "contact_tests.png": contact_figure(),
        "beds.png": bed_figure(found),
        "beds.csv": table(found),
        "shear_cell.png": shear_figure(sheared),
        "shear_cell.csv": shear_table(sheared),
    }
