"""How far the turns of a benchmark lie apart, in words."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np


def spread(values: Iterable[float]) -> str:
    """Median, and least and greatest."""
    values = list(values)
    return f"{np.median(values):.3g} ({min(values):.3g} .. {max(values):.3g})"
