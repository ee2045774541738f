"""Sizes of the case valve: valves for a laptop, the valves of a search, and valves with the numbers of
L21."""

from __future__ import annotations

from typing import Any

from tisim.cases.case import Size
from tisim.cases.mixtures import FINE_VALVE_GRAINS, VALVE_GRAINS, classes
from tisim.cases.mrf_shear.grains import equal
from tisim.cases.valve import published

D = published.LARGEST
"""Diameter of the coarse grains, m, equal to L21's largest."""
FINE_DIAMETER = D / 2
"""Diameter of the fine grains, m."""
COARSE, FINE_GRAINS = equal(D / 2, 1.0), equal(FINE_DIAMETER / 2, 1.0)
"""Grains of one size: the largest of L21, and half as large."""
THROATS = (4 * D, 6.5 * D)
"""Diameters of the constrictions, m."""
BORE, LENGTH = 8 * D, 8 * D
"""Diameter and length of the duct, m."""

L21_BORE, L21_LENGTH = 3.2e-3, 0.9e-3
"""Diameter of the duct of L21, m, and its length. L21 does not state the diameter; here it is an eighth of an
inch, which leaves 0.4 mm of wall in a valve that is 4 mm wide (its table 3.1). With this length, its oil
drags grains at rest with 90, 117 and 141 kPa in constrictions 20, 30 and 40 grains wide, close to its 100
kPa."""
GRADIENT = published.PRESSURE / L21_LENGTH
"""The drag on grains at rest per volume of the duct, Pa/m: L21's 100 kPa over that length."""

SEARCHED: dict[str, Any] = {"flowing": 0.0, "lasting": 4e-4}
"""Settings of the runs in a search: the field is on from the beginning."""
SEARCH_SETTINGS = {
    "generations": 6, "options": {"population": 8, "first": 12}, "ensemble": {"min_starts": 4, "confirm": 8},
}  # fmt: skip
"""With one start, some valves jam by chance, and a search would select those."""


def l21(ratio: int, **more: Any) -> dict[str, Any]:
    """Return the settings of L21's valve with a constriction ``ratio`` grains wide."""
    throat = published.CONSTRICTIONS[ratio]
    return {
        "throat": throat, "bore": L21_BORE, "straight": throat / 4, "slope": 0.25, "length": L21_LENGTH,
        "grains": classes(VALVE_GRAINS, "mass"), "speed": published.OIL_SPEED, "dt": published.STEP,
        "flux": published.FLUX, "flowing": published.UNMAGNETISED, "lasting": 4e-3, **more,
    }  # fmt: skip


SIZES = {
    "default": Size(
        "185 grains of 44 um, a constriction of 4 diameters in a duct of 8 by 8", {}, SEARCH_SETTINGS
    ),
    "l21_20": Size("L21's numbers: a constriction of 0.88 mm, 44,668 grains of its coarse mixture", l21(20)),
    "l21_30": Size("the same, 1.32 mm, 47,782 grains", l21(30)),
    "l21_40": Size("the same, 1.76 mm, 53,848 grains", l21(40)),
    "l21_fine": Size(
        "1.32 mm, 1,498,645 grains of L21's fine mixture, in a shorter duct with a shorter constriction",
        l21(
            30,
            grains=classes(FINE_VALVE_GRAINS, "mass"),
            dt=published.FINE_STEP,
            straight=0.1e-3,
            slope=0.1,
            length=0.4e-3,
        ),
    ),
}
