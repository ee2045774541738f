"""Figures of the case granular_bench: the tests of single contacts and of heaps and silos."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.figure import Figure

from cases.case import size_named
from cases.granular_bench.beds import bed_figure, beds, table
from cases.granular_bench.contact_figure import contact_figure
from cases.granular_bench.scene import SIZES
from tisim.engine.batches import Progress


def figures(size: str, progress: Progress) -> Mapping[str, Figure | str]:
    """contact_tests.png: the tests of single contacts; beds.png, beds.csv: heaps and silos."""
    settings = dict(size_named(size, SIZES).scene)
    found = beds(progress, settings)
    return {"contact_tests.png": contact_figure(), "beds.png": bed_figure(found), "beds.csv": table(found)}
