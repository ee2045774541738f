"""Spectra that cases compute from the frames of a run, as curves of a report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from tisim.errors import must
from tisim.report.tables import MOST_POINTS, digits


@dataclass(frozen=True)
class Spectrum:
    """Amplitudes against angular frequency, on a logarithmic axis.

    unit : of the amplitudes. omega : angular frequencies, 1/s, increasing, shape (n,). amplitudes : of the
        same shape; those below ``floor`` are not drawn.
    expected : frequencies (1/s) by name, such as resonances, which are drawn as lines.
    """

    title: str
    unit: str
    omega: np.ndarray
    amplitudes: np.ndarray
    floor: float = 0.0
    expected: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        must(len(self.omega) > 1, "omega", "two frequencies or more", len(self.omega))
        must(
            self.omega.shape == self.amplitudes.shape,
            "amplitudes",
            "one for each frequency",
            len(self.amplitudes),
        )

    def facts(self) -> dict[str, object]:
        """Return the curve as plain data. Of many points it has the highest of each few neighbours, so that
        peaks keep their height and place."""
        few = -(-len(self.omega) // MOST_POINTS)
        begins = np.arange(0, len(self.omega), few)
        highest = [begin + int(np.argmax(self.amplitudes[begin : begin + few])) for begin in begins.tolist()]
        shown = self.amplitudes[highest]
        curve = {"label": "", "values": digits(np.where(shown >= self.floor, shown, np.nan))}
        return {
            "title": self.title, "unit": self.unit, "logarithmic": True, "curves": [curve],
            "omega": digits(self.omega[highest]),
            "lines": [{"x": x, "label": name} for name, x in self.expected.items()],
        }  # fmt: skip
