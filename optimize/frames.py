"""Columns as pandas data frames; pandas is optional."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from tisim import InputError

if TYPE_CHECKING:
    from pandas import DataFrame


def data_frame(columns: Mapping[str, Any], units: Mapping[str, str]) -> DataFrame:
    """Return the columns as a data frame; ``attrs["units"]`` has the unit of each column that has one.

    InputError if pandas is not installed.
    """
    try:
        from pandas import DataFrame
    except ImportError as missing:
        raise InputError(f"pandas must be installed for a data frame; received {missing}") from None
    frame = DataFrame(dict(columns))
    frame.attrs["units"] = {heading: units[heading] for heading in frame.columns if units.get(heading)}
    return frame
