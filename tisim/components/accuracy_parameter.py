"""What a part of a scene says about the settings that trade accuracy for time."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from tisim.components.component import Component


def three_digits(value: float) -> float:
    """Return what a study sets a setting to, rounded so that people can read it."""
    return float(f"{value:.3g}")


Part = TypeVar("Part", bound="Component")


class AccuracyParameter:
    """An accuracy parameter groups settings of a part that together ask for an error, each with its order.

    ``AccuracyParameter(error=1)``; ``AccuracyParameter(dt=2)``: the error goes as dt^2;
    ``AccuracyParameter(longest=2, tolerance=1)``: two settings turned together. A part lists its own in
    ``accuracy_parameters``, and ``tisim cost`` turns them.

    converges : whether the error that the part makes vanishes with it; not so where a setting that is not
        turned bounds it too.
    """

    def __init__(self, *, converges: bool = True, **orders: float) -> None:
        self.orders, self.converges = orders, converges

    def turned(self, part: Part, decades: float) -> Part:
        """Return the part with settings for an error that is so many decades larger; itself for 0.

        Settings are rounded to three digits. Raise InputError when the part cannot have them.
        """
        if decades == 0:
            return part
        values = {name: getattr(part, name) for name in type(part).model_fields}
        for name, order in self.orders.items():
            values[name] = three_digits(values[name] * 10 ** (decades / order))
        return type(part)(**values)
