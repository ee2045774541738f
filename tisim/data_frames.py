"""Columns as pandas data frames. pandas is optional: only these functions import it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from tisim.errors import InputError

if TYPE_CHECKING:
    from pandas import DataFrame


def data_frame(columns: Mapping[str, Any], units: Mapping[str, str]) -> DataFrame:
    """Return the columns as a data frame; ``attrs["units"]`` has the unit of each column that has one.

    InputError if pandas is not installed.
    """
    try:
        from pandas import DataFrame
    except ImportError as missing:
        how = 'python -m pip install "tisim[notebook]"'
        rule = f"installed for a data frame, as by {how}"
        raise InputError(f"pandas must be {rule}; received {missing}") from None
    frame = DataFrame(dict(columns))
    frame.attrs["units"] = {heading: units[heading] for heading in frame.columns if units.get(heading)}
    return frame


def vector_columns(
    arrays: Mapping[str, np.ndarray], units: Mapping[str, str]
) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Return arrays of shape (n,) or (n, k) as columns, and the unit of each column.

    A vector has a column for each component, such as ``velocity_x``; other numbers of components than three
    are counted from 0.
    """
    columns, unit_of = dict[str, np.ndarray](), dict[str, str]()
    for name, values in arrays.items():
        parts = {name: values}
        if values.ndim > 1:
            flat = values.reshape(len(values), -1)
            ends = "xyz" if flat.shape[1] == 3 else range(flat.shape[1])
            parts = {f"{name}_{end}": flat[:, k] for k, end in enumerate(ends)}
        columns |= parts
        unit_of |= dict.fromkeys(parts, units.get(name, ""))
    return columns, unit_of
